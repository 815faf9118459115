"""Blocks on an existing `dask.distributed` cluster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from distributed import Client, Future

# Tasks that wait at each worker, so that none is idle while its next one is on the way.
_AHEAD = 2
_ATTEMPTS = 5


def connect(address: str) -> Client:
    """A client of the scheduler at an address such as `tcp://host:8786`.

    Raises:
        ImportError: `distributed` is not installed; the message has the line that installs it.
        ValueError: nobody answers there.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError('clusters need distributed: pip install "curvematch_jax[cluster]"') from error
    try:
        return Client(address, timeout="20s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(f"{address}: no dask scheduler answers there ({type(error).__name__})") from error


def on_cluster(
    client: Client, function: Callable[..., Any], tasks: Iterator[tuple[Any, tuple]]
) -> Iterator[tuple[Any, Any]]:
    """`(key, function(*arguments))` of every `(key, arguments)`, in the order in which they end.

    Only a few tasks a worker are on the way at a time, so that memory here stays bounded. Arguments go to the workers
    directly. A task is given out again when the worker that held it, or its arguments, is lost.

    Raises:
        RuntimeError: when a task has been lost too often; whatever `function` raises.
    """
    from distributed import wait

    running: dict[Future, tuple[Any, tuple]] = {}
    lost: Counter = Counter()
    waiting = iter(tasks)
    try:
        while True:
            room = _AHEAD * max(len(client.scheduler_info(n_workers=-1)["workers"]), 1) - len(running)
            for _, (key, arguments) in zip(range(room), waiting, strict=False):
                running[_submit(client, function, arguments)] = key, arguments
            if not running:
                return
            ended: Any = wait(list(running), return_when="FIRST_COMPLETED")
            for future in ended.done:
                key, arguments = running.pop(future)
                if future.status == "finished":
                    yield key, future.result()
                    continue
                lost[key] += 1
                if lost[key] >= _ATTEMPTS or not _worker_was_lost(future):
                    future.result()
                    raise RuntimeError(f"block {key} was lost {lost[key]} times with the workers that had it")
                running[_submit(client, function, arguments)] = key, arguments
    finally:
        client.cancel(list(running))


def _submit(client: Client, function: Callable[..., Any], arguments: tuple) -> Future:
    placed: Any = client.scatter(list(arguments), hash=False)
    return client.submit(function, *placed, pure=False)


def _worker_was_lost(future: Future) -> bool:
    from distributed import KilledWorker

    if future.status in ("cancelled", "lost"):
        return True
    return isinstance(future.exception(), KilledWorker)
