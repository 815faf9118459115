"""One function over many tasks in worker processes: a task that kills its worker does not affect the others."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import pickle
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf, isfinite
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from ..retrieval import Outcome

# Seconds that the extraction of one mesh may take.
TIME_LIMIT = 300.0

# Forking a process in which JAX has started its threads can deadlock.
_CONTEXT = multiprocessing.get_context("spawn")
# What a worker says when it begins with a task: loading the package is not the task's time.
_BEGUN = "begun"
# The least memory for a task, however many workers share the machine's.
_LEAST_MEMORY = 2 << 30


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass
class _Worker:
    """A process, our end of its pipe, and the task it has until `deadline`."""

    process: SpawnProcess
    connection: Connection
    task: int = -1
    deadline: float = inf


def in_processes(
    function: Callable[[Any], Any], tasks: Sequence[Any], jobs: int, seconds: float = inf
) -> Iterator[Outcome]:
    """`function(task)` of every task, in the order in which they end: an executor, as those of matrices are.

    On Linux a worker has its share of the memory, so that a task for which that is too little fails before the system
    runs out of memory; and workers die with the process that has started them.

    Args:
        function: importable by name, as its name is what the workers are given.
        tasks: anything that can be pickled.
        jobs: how many workers, at least 1.
        seconds: how long a task may take; then its worker is killed.
    """
    waiting = deque(enumerate(tasks))
    count = min(jobs, len(waiting))
    memory = max(_memory() // max(count, 1), _LEAST_MEMORY)
    busy: dict[Connection, _Worker] = {}
    try:
        for _ in range(count):
            _give(_start(function, memory), waiting, busy)
        while busy:
            for worker, outcome in _ended(busy, seconds):
                del busy[worker.connection]
                yield outcome
                if waiting and worker.process.exitcode is not None:
                    worker = _start(function, memory)
                _give(worker, waiting, busy)
    finally:
        for worker in busy.values():
            _kill(worker)


def _start(function: Callable[[Any], Any], memory: int) -> _Worker:
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_work, args=(function, theirs, memory), daemon=True)
    process.start()
    # Ours has to be the only open end, or the death of the worker would not end the connection.
    theirs.close()
    return _Worker(process, ours)


def _give(worker: _Worker, waiting: deque, busy: dict[Connection, _Worker]) -> None:
    """The next task to this worker; without one, closing its connection ends it."""
    if not waiting:
        worker.connection.close()
        return
    worker.task, argument = waiting.popleft()
    worker.deadline = inf
    busy[worker.connection] = worker
    with suppress(BrokenPipeError, ConnectionResetError):  # The worker has died: reading from it will say so.
        worker.connection.send(argument)


def _ended(busy: dict[Connection, _Worker], seconds: float) -> Iterator[tuple[_Worker, Outcome]]:
    """Wait for a word from a worker or for the next deadline: the tasks that have ended, one way or another."""
    left = min(worker.deadline for worker in busy.values()) - time.monotonic()
    heard = wait(list(busy), max(left, 0) if isfinite(left) else None)
    late = [w for w in busy.values() if w.connection not in heard and w.deadline <= time.monotonic()]
    for worker in [busy[connection] for connection in heard if isinstance(connection, Connection)]:
        try:
            answer = worker.connection.recv()
        except (EOFError, OSError):  # OSError: it died in the middle of an answer.
            worker.process.join()
            yield worker, Outcome(worker.task, failure=_death(worker.process.exitcode))
            continue
        if answer == _BEGUN:
            worker.deadline = time.monotonic() + seconds
        else:
            yield worker, Outcome(worker.task, *answer)
    for worker in late:
        _kill(worker)
        yield worker, Outcome(worker.task, failure=f"took longer than {seconds:g} s")


def _kill(worker: _Worker) -> None:
    worker.process.kill()
    worker.process.join()


def _work(function: Callable[[Any], Any], connection: Connection, memory: int) -> None:
    """What a worker does: answer every task with `(result, failure)` until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # An interrupt is the parent's to handle.
    if sys.platform == "linux":
        _die_with_parent()
        _limit_memory(memory)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):  # There are no more, or nobody to answer to.
        while True:
            argument = connection.recv()
            connection.send(_BEGUN)
            connection.send_bytes(_answer(function, argument, memory))


def _answer(function: Callable[[Any], Any], argument: Any, memory: int) -> bytes:
    try:
        return pickle.dumps((function(argument), None))
    except MemoryError:
        failure = f"needs more memory than the {memory / 2**30:.1f} GiB that are its worker process's share"
    except Exception as error:
        failure = one_line(error)
    return pickle.dumps((None, failure))


def _memory() -> int:
    """Bytes of memory: the machine's, or fewer if this process is confined to fewer; 0 when unknown."""
    if sys.platform != "linux":
        return 0
    sizes = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    for control in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):  # ValueError: `max`, which is no limit.
            sizes.append(int(Path(control).read_text()))
    return min(sizes)


def _limit_memory(memory: int) -> None:
    """Let this process allocate so many bytes more than it has. Mapped files and reserved addresses don't count."""
    import resource

    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    soft = int(status["VmData"].split()[0]) * 1024 + memory
    resource.setrlimit(resource.RLIMIT_DATA, (soft if hard == resource.RLIM_INFINITY else min(soft, hard), hard))


def _die_with_parent() -> None:
    """Have the system kill this process when its parent is gone, even one that is deep in native code."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # 1: PR_SET_PDEATHSIG
    parent = multiprocessing.parent_process()
    if parent is None or os.getppid() != parent.pid:
        raise SystemExit  # It was gone before.


def one_line(error: BaseException) -> str:
    """An exception in one line: its message, after its type unless it is one of those we raise ourselves."""
    message = " ".join(str(error).split()) or type(error).__name__
    ours = isinstance(error, ValueError | ImportError | FileNotFoundError)
    return message if ours else f"{type(error).__name__}: {message}"


def _death(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        return f"its worker process was killed by {signal.Signals(-exitcode).name}"
    return f"its worker process ended with status {exitcode}"
