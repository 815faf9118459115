"""One function over many tasks: in this process, or on an existing `dask.distributed` cluster."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from distributed import Client, Future

Tasks = Iterator[tuple[Any, tuple]]
# `(key, function(*arguments))` of every `(key, arguments)`, in any order; few of them on the way at a time.
Executor = Callable[[Callable[..., Any], Tasks], Iterator[tuple[Any, Any]]]

# Tasks that wait at each worker, so that none is idle while its next one is on the way.
_AHEAD = 2
# Seconds that a scheduler has to answer.
_PATIENCE = 20


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
        return Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(f"{address}: no dask scheduler answers there ({type(error).__name__})") from error


def executor(client: Client | None) -> Executor:
    """What runs tasks: the cluster of a client, or this process."""
    return here if client is None else partial(on_cluster, client)


def here(function: Callable[..., Any], tasks: Tasks) -> Iterator[tuple[Any, Any]]:
    """One after the other."""
    for key, arguments in tasks:
        yield key, function(*arguments)


def on_cluster(client: Client, function: Callable[..., Any], tasks: Tasks) -> Iterator[tuple[Any, Any]]:
    """`(key, function(*arguments))` of every `(key, arguments)`, in the order in which they end.

    Only a few tasks a worker are on the way at a time, so that memory stays bounded here and at the scheduler. The
    scheduler holds the arguments until a task has ended, and gives the tasks of a lost worker to another.

    Raises:
        RuntimeError: when a task has gone down with several workers; whatever `function` raises.
    """
    from distributed import KilledWorker, wait

    running: dict[Future, Any] = {}
    waiting = iter(tasks)
    try:
        while True:
            room = _AHEAD * max(len(client.scheduler_info(n_workers=-1)["workers"]), 1) - len(running)
            for key, arguments in islice(waiting, max(room, 0)):
                running[_submit(client, function, arguments)] = key
            if not running:
                return
            with client.as_current():
                ended: Any = wait(list(running), return_when="FIRST_COMPLETED")
            for future in ended.done:
                key = running.pop(future)
                try:
                    yield key, future.result()
                except KilledWorker as error:
                    raise RuntimeError(
                        f"several workers died while computing block {key}: give them more memory"
                    ) from error
    finally:
        client.cancel(list(running))


def _submit(client: Client, function: Callable[..., Any], arguments: tuple) -> Future:
    with warnings.catch_warnings():
        # That a graph is large. Arguments that are sent ahead instead are lost with the worker that holds them.
        warnings.simplefilter("ignore", UserWarning)
        return client.submit(function, *arguments, pure=False)
