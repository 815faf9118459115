"""Every object of a collection against every other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np

from .._progress import Progress, reporter
from ..surface import Parts
from ._distances import nearest
from ._matching import BEST, Matching
from ._ranking import fuse
from ._stack import Stack, object_blocks, stack


def dissimilarity_matrix(parts: Sequence[Parts], matching: Matching = BEST, progress: Progress = False) -> np.ndarray:
    """Dissimilarities of all pairs of objects.

    Row i is what `rank(parts[i], the others)` gives, 0 on the diagonal. Part distances are symmetric, so every pair
    of parts is compared once and serves two rows. Memory is bounded: pairs are compared in blocks, of which only the
    distances of parts to objects are kept, 4 bytes each.

    Arguments:
        parts: M objects, extracted with the same settings.
        matching: how parts are compared and joined.
        progress: `True` for a bar on stderr, or a function of `(done, total)` part pairs.

    Returns:
        (M, M); rows are queries, smaller is more similar, not symmetric. An object without parts is farther from
        every query than all others, and as a query knows none from another.

    Raises:
        ValueError: when there are no objects, or settings of the extraction differ, naming the setting.
    """
    whole = stack(parts, matching.unit)
    return fused_rows(parts, whole, part_to_object(whole, matching, progress), matching)


def fused_rows(parts: Sequence[Parts], whole: Stack, distances: np.ndarray, matching: Matching) -> np.ndarray:
    """The matrix (M, M) from the distances (P, M) of every part to every object."""
    matrix = np.zeros((whole.objects, whole.objects))
    for i in range(whole.objects):
        others = np.arange(whole.objects) != i
        if others.any():
            rows = distances[whole.starts[i] : whole.starts[i + 1], others].astype(np.float64)
            matrix[i, others] = fuse(rows, parts[i].areas, ~whole.lacking[others], matching).dissimilarity
    return matrix


def part_to_object(whole: Stack, matching: Matching, progress: Progress = False) -> np.ndarray:
    """Distance of every part to every object, (P, M)."""
    distances = np.zeros((len(whole.rows), whole.objects), np.float32)
    blocks = object_blocks(whole.starts)
    report, done, total = reporter(progress, "matrix", "pairs"), 0, _part_pairs(whole)
    report(done, total)
    for one, other in combinations_with_replacement(blocks, 2):
        first, second = whole[one], whole[other]
        apart = np.arange(one.start, one.stop)[:, None] < np.arange(other.start, other.stop)
        forward, backward = nearest(first, second, apart, matching)
        _fill(distances, whole, one, other, forward.distance)
        _fill(distances, whole, other, one, backward.distance)
        done += int((apart * np.outer(np.diff(first.starts), np.diff(second.starts))).sum())
        report(done, total)
    return distances


def _fill(distances: np.ndarray, whole: Stack, rows: slice, columns: slice, values: np.ndarray) -> None:
    """Put distances of the parts of the objects `rows` to the objects `columns` where they were computed."""
    parts = slice(int(whole.starts[rows.start]), int(whole.starts[rows.stop]))
    np.copyto(distances[parts, columns], values, where=np.isfinite(values), casting="same_kind")


def _part_pairs(whole: Stack) -> int:
    """The pairs of parts of different objects."""
    counts = np.diff(whole.starts)
    return int(counts.sum() ** 2 - (counts**2).sum()) // 2
