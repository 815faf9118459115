"""One function over many tasks: in this process, or on a `dask.distributed` cluster."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from distributed import Client, Future


class Outcome(NamedTuple):
    """What became of a task: a result, or the reason why there is none."""

    task: int
    """Its index."""
    result: Any = None
    failure: str | None = None


# The outcome of a function for every task, in the order in which they end; few tasks are taken before they begin.
Executor = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Outcome]]

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


def here(function: Callable[[Any], Any], tasks: Iterable[Any]) -> Iterator[Outcome]:
    """One after the other; what `function` raises is raised."""
    for index, task in enumerate(tasks):
        yield Outcome(index, function(task))


def on_cluster(client: Client, function: Callable[[Any], Any], tasks: Iterable[Any]) -> Iterator[Outcome]:
    """On the workers of an existing cluster.

    Only a few tasks a worker are on the way at a time, so that memory stays bounded here and at the scheduler. The
    scheduler holds a task until it has ended, and gives the tasks of a lost worker to another; one that has gone down
    with several workers has failed.
    """
    from distributed import KilledWorker, wait

    running: dict[Future, int] = {}
    waiting = iter(enumerate(tasks))
    try:
        while True:
            room = _AHEAD * max(len(client.scheduler_info(n_workers=-1)["workers"]), 1) - len(running)
            for index, task in islice(waiting, max(room, 0)):
                running[_submit(client, function, task)] = index
            if not running:
                return
            with client.as_current():
                ended: Any = wait(list(running), return_when="FIRST_COMPLETED")
            for future in ended.done:
                index, error = running.pop(future), future.exception()
                if error is None:
                    yield Outcome(index, future.result())
                elif isinstance(error, KilledWorker):
                    yield Outcome(index, failure="several workers died while computing it: give them more memory")
                else:
                    yield Outcome(index, failure=f"{type(error).__name__}: {error}")
    finally:
        client.cancel(list(running))


def _submit(client: Client, function: Callable[[Any], Any], task: Any) -> Future:
    with warnings.catch_warnings():
        # That a graph is large. Arguments that are sent ahead instead are lost with the worker that holds them.
        warnings.simplefilter("ignore", UserWarning)
        return client.submit(function, task, pure=False)
