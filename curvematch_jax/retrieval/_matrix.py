"""Every object of a collection against every other."""

from __future__ import annotations

import functools as ft
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .._files import locked
from .._progress import Progress, reporter
from ..surface import Parts
from ._blocks import BLOCK, Task, block_distances, compared
from ._executors import Executor, here, on_cluster
from ._matching import DEFAULT, Matching
from ._matrix_store import MatrixStore, open_matrix
from ._objects import Objects

if TYPE_CHECKING:
    from distributed import Client


def dissimilarity_matrix(
    parts: Sequence[Parts],
    matching: Matching = DEFAULT,
    progress: Progress = False,
    store: str | os.PathLike[str] | None = None,
    client: Client | None = None,
    block: int = BLOCK,
) -> np.ndarray:
    """Dissimilarities of all pairs of objects.

    By default entry i, j combines both directions, relative to a cohort of the collection (see
    `_cohort.py`): symmetric, in [0, 1], and comparable anywhere in the matrix, as `metric="precomputed"` in
    scikit-learn wants it. With the other fusions, as in `Matching.partial()` and `Matching.paper()`, row i is what
    `rank(parts[i], the others)` gives: dissimilarities of one row compare, and those of two rows do not.

    Part distances are symmetric, so every pair of parts is compared once and serves both. Pairs are compared in
    blocks, of which only the distances of parts to objects are kept, 4 bytes each, or with `store` nothing.

    Args:
        parts: M objects, extracted with the same settings.
        matching: how parts are compared and joined.
        progress: `True` for a bar on stderr, or a function of `(done, total)` part pairs.
        store: where blocks are kept as they are done, see `build_matrix`.
        client: of a `dask.distributed` cluster that the blocks are computed on.
        block: objects a side of a block.

    Returns:
        (M, M), 0 on the diagonal; rows are queries, smaller is more similar. An object without parts is farther from
        every query than all others, and as a query knows none from another.

    Raises:
        ValueError: when there are no objects, or settings of the extraction differ, naming the setting; when `store`
            holds something else.
    """
    found, order = _filled(parts, store, matching, progress, client, block)
    return found.dissimilarity[np.ix_(order, order)]


def build_matrix(
    parts: Sequence[Parts],
    store: str | os.PathLike[str],
    matching: Matching = DEFAULT,
    progress: Progress = False,
    client: Client | None = None,
    block: int = BLOCK,
) -> None:
    """`dissimilarity_matrix` into a zarr group, without ever holding it: `load_matrix` reads it.

    Each block of objects by objects lands whole or not at all. A second call with the same arguments goes on with the
    blocks that are missing, and what it ends with is equal to the bit. Objects that are new are added behind those that
    are there, and only their distances are computed. The cohort stays as it was once it has 32 members, so that new
    objects change no dissimilarity of the others.

    Args:
        parts: as `dissimilarity_matrix`; a lazy sequence, such as `StoredParts`, keeps memory flat.
        block: of one store always the same.

    Raises:
        ValueError: when the store was made with other settings or objects, naming the first difference; when it is
            in use, or cannot be written to.
    """
    _filled(parts, store, matching, progress, client, block)


def _filled(
    parts: Sequence[Parts],
    path: str | os.PathLike[str] | None,
    matching: Matching,
    progress: Progress,
    client: Client | None,
    block: int,
) -> tuple[MatrixStore, list[int]]:
    """The store with everything in it, in memory or at a path, and where in it each of the objects is."""
    if not isinstance(block, int) or block < 1:
        raise ValueError(f"block must be a whole number, 1 or more, found {block!r}")
    place = None if path is None else Path(path)
    objects = Objects.of(parts, matching)
    with nullcontext() if place is None else locked(place):
        store, order = open_matrix(place, objects, matching, block)
        inverse = np.argsort(order).tolist()  # Which of the objects given each of the store's is.
        missing, costs = store.missing(), {pair: _cost(store, pair) for pair in store.grid.pairs}
        total = sum(costs.values())
        done = total - sum(costs[pair] for pair in missing)
        report = reporter(progress, "matrix", "pairs")
        report(done, total)
        tasks = _tasks(lambda i: parts[inverse[i]], store, missing, matching)
        run: Executor = here if client is None else ft.partial(on_cluster, client)
        for index, found, failure in run(block_distances, tasks):
            if failure is not None:
                raise RuntimeError(f"block {missing[index]} could not be compared: {failure}")
            store.put(*missing[index], found)
            done += costs[missing[index]]
            report(done, total)
        store.finish(objects.taken(inverse), matching, progress)
    return store, order


def _tasks(
    load: Callable[[int], Parts], store: MatrixStore, pairs: Sequence[tuple[int, int]], matching: Matching
) -> Iterator[Task]:
    """What there is to do for each pair of blocks; of a row of blocks the first is read once."""
    held, first = -1, []
    for one, other in pairs:
        rows, columns = store.grid.range(one), store.grid.range(other)
        if one != held:
            held, first = one, [load(i) for i in rows]
        second = first if one == other else [load(j) for j in columns]
        yield Task(first, second, store.wanted(one, other), matching)


def _cost(store: MatrixStore, pair: tuple[int, int]) -> int:
    """Pairs of parts in a pair of blocks: time goes with them."""
    one, other = (store.grid.range(k) for k in pair)
    return int(store.counts[one] @ compared(one, other) @ store.counts[other])
