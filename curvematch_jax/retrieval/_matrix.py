"""Every object of a collection against every other."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._progress import Progress, reporter
from ..surface import Parts
from ._blocks import block_distances, block_pairs, block_ranges, compared, fused_row
from ._files import locked
from ._matching import BEST, Matching
from ._matrix_store import MatrixStore, describe, open_matrix
from ._parts_file import require_same_settings

if TYPE_CHECKING:
    from distributed import Client

# `(key, function(*arguments))` of every `(key, arguments)`, in any order.
Run = Callable[[Callable[..., Any], Iterator[tuple[Any, tuple]]], Iterator[tuple[Any, Any]]]


def dissimilarity_matrix(
    parts: Sequence[Parts],
    matching: Matching = BEST,
    progress: Progress = False,
    store: str | os.PathLike[str] | None = None,
    client: Client | None = None,
) -> np.ndarray:
    """Dissimilarities of all pairs of objects.

    Row i is what `rank(parts[i], the others)` gives, 0 on the diagonal. Part distances are symmetric, so every pair
    of parts is compared once and serves two rows. Memory is bounded: pairs are compared in blocks, of which only the
    distances of parts to objects are kept, 4 bytes each, or with `store` nothing.

    Arguments:
        parts: M objects, extracted with the same settings.
        matching: how parts are compared and joined.
        progress: `True` for a bar on stderr, or a function of `(done, total)` part pairs.
        store: where blocks are kept as they are done, see `build_matrix`.
        client: of a `dask.distributed` cluster that the blocks are computed on.

    Returns:
        (M, M); rows are queries, smaller is more similar, not symmetric. An object without parts is farther from
        every query than all others, and as a query knows none from another.

    Raises:
        ValueError: when there are no objects, or settings of the extraction differ, naming the setting; when `store`
            holds something else.
    """
    if store is not None:
        found, order = _filled(parts, store, matching, progress, client)
        return found.dissimilarity[np.ix_(order, order)]
    if not len(parts):
        raise ValueError("the collection is empty: at least one object is needed")
    require_same_settings(parts)
    return fused_rows(parts, part_to_object(parts, matching, progress, client), matching)


def build_matrix(
    parts: Sequence[Parts],
    store: str | os.PathLike[str],
    matching: Matching = BEST,
    progress: Progress = False,
    client: Client | None = None,
) -> None:
    """`dissimilarity_matrix` into a zarr group, without ever holding it: `load_matrix` reads it.

    Each block of 32 by 32 objects lands whole or not at all. A second call with the same arguments goes on with the
    blocks that are missing, and what it ends with is equal to the bit. Objects that are new are added behind those that
    are there, and only their rows and columns are computed.

    Arguments:
        parts: as `dissimilarity_matrix`; a lazy sequence, such as `StoredParts`, keeps memory flat.

    Raises:
        ValueError: when the store was made with other settings or objects, naming the first difference; when it is
            in use, or cannot be written to.
    """
    _filled(parts, store, matching, progress, client)


def part_to_object(
    parts: Sequence[Parts], matching: Matching, progress: Progress = False, client: Client | None = None
) -> np.ndarray:
    """Distance of every part to every object, (P, M); NaN to its own."""
    counts = np.array([len(p.areas) for p in parts])
    starts = np.cumsum([0, *counts])
    distances = np.full((starts[-1], len(counts)), np.nan, np.float32)  # What is not computed has to show.
    pairs = block_pairs(len(parts))
    tasks = _tasks(parts, pairs, lambda one, other: compared(*block_ranges(one, other, len(parts))), matching)
    advance = _progress(progress, counts, pairs, pairs)
    for key, block in _run(client)(block_distances, tasks):
        one, other = block_ranges(key[0], key[1], len(parts))
        _fill(distances, starts, one, other, block.forward)
        _fill(distances, starts, other, one, block.backward)
        advance(key)
    return distances


def fused_rows(parts: Sequence[Parts], distances: np.ndarray, matching: Matching) -> np.ndarray:
    """The matrix (M, M) from the distances (P, M) of every part to every object."""
    counts = np.array([len(p.areas) for p in parts])
    rows = np.split(distances, np.cumsum(counts)[:-1])
    return np.stack([fused_row(rows[i], parts[i].areas, i, counts > 0, matching) for i in range(len(parts))])


def _filled(
    parts: Sequence[Parts],
    path: str | os.PathLike[str],
    matching: Matching,
    progress: Progress,
    client: Client | None,
) -> tuple[MatrixStore, list[int]]:
    """The store with everything in it, and where in it each of the objects is."""
    objects = describe(parts)
    with locked(Path(path)):
        store, order = open_matrix(path, objects, matching)
        inverse = np.argsort(order).tolist()  # Which of the objects given each of the store's is.
        missing = store.missing()
        advance = _progress(progress, store.counts, block_pairs(len(parts)), missing)
        tasks = _tasks(_Reordered(parts, inverse), missing, store.wanted, matching)
        for key, block in _run(client)(block_distances, tasks):
            store.put(key[0], key[1], block)
            advance(key)
        store.finish([objects[k].areas for k in inverse], matching, progress)
    return store, order


class _Reordered(Sequence[Parts]):
    """The same objects in another order, read no sooner than they are needed."""

    def __init__(self, parts: Sequence[Parts], order: Sequence[int]) -> None:
        self._parts, self._order = parts, order

    def __len__(self) -> int:
        return len(self._order)

    def __getitem__(self, i: int) -> Parts:  # type: ignore[override]
        return self._parts[self._order[i]]


def _tasks(
    parts: Sequence[Parts],
    pairs: Sequence[tuple[int, int]],
    wanted: Callable[[int, int], np.ndarray],
    matching: Matching,
) -> Iterator[tuple[tuple[int, int], tuple]]:
    """The arguments of `block_distances` for each pair of blocks; of a row of blocks the first is read once."""
    held, first = -1, []
    for one, other in pairs:
        rows, columns = block_ranges(one, other, len(parts))
        if one != held:
            held, first = one, [parts[i] for i in rows]
        second = first if one == other else [parts[j] for j in columns]
        yield (one, other), (first, second, wanted(one, other), matching)


def _run(client: Client | None) -> Run:
    if client is None:
        return _here
    from ._cluster import on_cluster

    return partial(on_cluster, client)


def _here(function: Callable[..., Any], tasks: Iterator[tuple[Any, tuple]]) -> Iterator[tuple[Any, Any]]:
    for key, arguments in tasks:
        yield key, function(*arguments)


def _progress(
    progress: Progress, counts: np.ndarray, pairs: Sequence[tuple[int, int]], missing: Sequence[tuple[int, int]]
) -> Callable[[tuple[int, int]], None]:
    """What to call when a pair of blocks is done. Pairs of parts are counted, as time goes with them."""
    report, costs = reporter(progress, "matrix", "pairs"), {pair: _cost(counts, pair) for pair in pairs}
    total = sum(costs.values())
    done = total - sum(costs[pair] for pair in missing)
    report(done, total)

    def advance(pair: tuple[int, int]) -> None:
        nonlocal done
        done += costs[pair]
        report(done, total)

    return advance


def _cost(counts: np.ndarray, pair: tuple[int, int]) -> int:
    one, other = block_ranges(*pair, len(counts))
    return int(counts[one.start : one.stop] @ compared(one, other) @ counts[other.start : other.stop])


def _fill(distances: np.ndarray, starts: np.ndarray, rows: range, columns: range, values: np.ndarray) -> None:
    """Put distances of the parts of the objects `rows` to the objects `columns` where they were computed."""
    place = distances[starts[rows.start] : starts[rows.stop], columns.start : columns.stop]
    np.copyto(place, values, where=np.isfinite(values))
