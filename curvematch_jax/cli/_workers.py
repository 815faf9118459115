"""One function over many tasks in worker processes, where a task that fails or kills its worker costs itself alone."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

# Forking a process in which JAX has started its threads can deadlock.
_CONTEXT = multiprocessing.get_context("spawn")


@dataclass(frozen=True)
class Outcome:
    """What became of a task: a result, or the reason why there is none."""

    task: int
    result: Any = None
    failure: str | None = None


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_processes(function: Callable[[Any], Any], tasks: Sequence[Any], jobs: int) -> Iterator[Outcome]:
    """`function(task)` of every task, in the order in which they end.

    Arguments:
        function: importable by name, as its name is what the workers are given.
        tasks: anything that can be pickled.
        jobs: how many workers, at least 1.
    """
    waiting = deque(enumerate(tasks))
    busy: dict[Connection, tuple[SpawnProcess, int]] = {}
    try:
        for _ in range(min(jobs, len(waiting))):
            _give(*_start(function), waiting, busy)
        while busy:
            for connection in wait(list(busy)):
                assert isinstance(connection, Connection)
                process, task = busy.pop(connection)
                try:
                    yield Outcome(task, *connection.recv())
                except (EOFError, ConnectionResetError):
                    process.join()
                    yield Outcome(task, failure=_death(process.exitcode))
                    process, connection = _start(function) if waiting else (process, connection)
                _give(process, connection, waiting, busy)
    finally:
        for process, _ in busy.values():
            process.terminate()


def _start(function: Callable[[Any], Any]) -> tuple[SpawnProcess, Connection]:
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_work, args=(function, theirs), daemon=True)
    process.start()
    # Ours has to be the only open end, or the death of the worker would not end the connection.
    theirs.close()
    return process, ours


def _give(process: SpawnProcess, connection: Connection, waiting: deque, busy: dict) -> None:
    """The next task to this worker; without one, closing its connection ends it."""
    if not waiting:
        connection.close()
        return
    task, argument = waiting.popleft()
    busy[connection] = (process, task)
    with suppress(BrokenPipeError, ConnectionResetError):  # The worker has died: reading from it will say so.
        connection.send(argument)


def _work(function: Callable[[Any], Any], connection: Connection) -> None:
    """What a worker does: answer every task with `(result, failure)` until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # An interrupt is the parent's to handle.
    while True:
        try:
            argument = connection.recv()
        except EOFError:
            return
        try:
            answer = (function(argument), None)
        except Exception as error:
            answer = (None, one_line(error))
        connection.send(answer)


def one_line(error: BaseException) -> str:
    """An exception in one line: its message, after its type unless it is one of those we raise ourselves."""
    message = " ".join(str(error).split()) or type(error).__name__
    ours = isinstance(error, ValueError | ImportError | FileNotFoundError)
    return message if ours else f"{type(error).__name__}: {message}"


def _death(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        return f"its worker process was killed by {signal.Signals(-exitcode).name}"
    return f"its worker process ended with status {exitcode}"
