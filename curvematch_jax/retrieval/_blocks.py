"""The all-pairs work in blocks: pure functions that a loop, a store and a cluster call alike."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from ..surface import Parts
from ._distances import nearest
from ._matching import Matching
from ._ranking import fuse
from ._stack import stack

# Objects a side that are compared at once: enough to fill the engine's batches, few enough to lose.
BLOCK = 32


class Block(NamedTuple):
    """Distances between two runs of M1 and M2 objects with P1 and P2 parts; NaN for objects not compared."""

    forward: np.ndarray  # (P1, M2) float32, of the parts of the first to the objects of the second
    backward: np.ndarray  # (P2, M1) float32, the other way round


def block_pairs(objects: int) -> list[tuple[int, int]]:
    """All pairs of blocks of so many objects, row by row; block k has the objects from `k BLOCK`."""
    return list(combinations_with_replacement(range(-(-objects // BLOCK)), 2))


def all_blocks(objects: int) -> list[range]:
    """The objects of each block."""
    return [_block(k, objects) for k in range(-(-objects // BLOCK))]


def block_ranges(one: int, other: int, objects: int) -> tuple[range, range]:
    """The objects of two blocks."""
    return _block(one, objects), _block(other, objects)


def compared(one: range, other: range) -> np.ndarray:
    """Which objects of two blocks are compared with each other, bool: each two of the collection once."""
    return np.asarray(one)[:, None] < np.asarray(other)


def block_distances(first: Sequence[Parts], second: Sequence[Parts], wanted: np.ndarray, matching: Matching) -> Block:
    """Distances of parts to objects of two blocks, both ways (equation 5).

    Arguments:
        wanted: (M1, M2) bool, the objects to compare.
    """
    forward, backward = nearest(stack(first, matching.unit), stack(second, matching.unit), wanted, matching)
    return Block(_float(forward.distance), _float(backward.distance))


def fused_row(
    distances: np.ndarray, areas: np.ndarray, own: int, present: np.ndarray, matching: Matching
) -> np.ndarray:
    """Row `own` of the matrix, (M,), from the distances (P, M) of an object's parts to all objects.

    Arguments:
        areas: (P,) of the object.
        present: (M,) bool, False for an object without parts.
    """
    row, others = np.zeros(len(present)), np.arange(len(present)) != own
    if others.any():
        row[others] = fuse(distances[:, others].astype(np.float64), areas, present[others], matching).dissimilarity
    return row


def _block(k: int, objects: int) -> range:
    return range(k * BLOCK, min((k + 1) * BLOCK, objects))


def _float(distances: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(distances), distances, np.nan).astype(np.float32)
