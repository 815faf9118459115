"""The all-pairs work in blocks of objects: what there is to do, and the function that does it anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from ..surface import Parts
from ._distances import nearest
from ._matching import Matching
from ._stack import stack

# Objects a side that are compared at once: enough to fill the engine's batches, few enough to lose.
BLOCK = 32


class Task(NamedTuple):
    """Two blocks of M1 and M2 objects that are to be compared."""

    first: Sequence[Parts]
    second: Sequence[Parts]
    wanted: np.ndarray  # (M1, M2) bool, the objects to compare
    matching: Matching


class Block(NamedTuple):
    """Distances between two runs of M1 and M2 objects with P1 and P2 parts; NaN for objects not compared."""

    forward: np.ndarray  # (P1, M2) float32, of the parts of the first to the objects of the second
    backward: np.ndarray  # (P2, M1) float32, the other way round


class Grid(NamedTuple):
    """So many objects in blocks of so many a side."""

    objects: int
    block: int

    @property
    def ranges(self) -> list[range]:
        """The objects of each block."""
        return [self.range(k) for k in range(-(-self.objects // self.block))]

    def range(self, k: int) -> range:
        """The objects of a block."""
        return range(k * self.block, min((k + 1) * self.block, self.objects))

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """All pairs of blocks, row by row."""
        return list(combinations_with_replacement(range(-(-self.objects // self.block)), 2))


def compared(one: range, other: range) -> np.ndarray:
    """Which objects of two blocks are compared with each other, bool: each two of the collection once."""
    return np.asarray(one)[:, None] < np.asarray(other)


def block_distances(task: Task) -> Block:
    """Distances of parts to objects of two blocks, both ways (equation 5)."""
    first, second, wanted, matching = task
    found = nearest(stack(first, matching.unit), stack(second, matching.unit), wanted, matching)
    return Block(*(np.where(np.isfinite(each.distance), each.distance, np.nan).astype(np.float32) for each in found))
