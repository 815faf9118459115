"""The distances of all parts to all objects, filled block by block, and the matrix that is made of them: in memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._progress import Progress, reporter
from ._blocks import Block, Grid, compared
from ._cohort import chosen
from ._matching import Matching
from ._objects import Objects
from ._rows import row_maker


class MatrixTable:
    """All pairs of M objects.

    Attributes:
        grid: the objects in blocks.
        counts: (M,) parts of each object.
    """

    def __init__(self, objects: Objects, block: int) -> None:
        count = len(objects.names)
        self.grid, self.counts = Grid(count, block), objects.counts
        # What is not computed has to show.
        self._distances: Any = np.full((count, max(int(self.counts.max()), 1), count), np.nan, np.float32)
        self._dissimilarity: Any = np.full((count, count), np.nan)
        self._members: Sequence[int] = chosen(objects.fingerprints).tolist()

    @property
    def dissimilarity(self) -> np.ndarray:
        """(M, M), when all is there."""
        return np.asarray(self._dissimilarity)

    def missing(self) -> list[tuple[int, int]]:
        """The pairs of blocks that have to be computed, in part or whole."""
        return self.grid.pairs

    def wanted(self, one: int, other: int) -> np.ndarray:
        """Which objects of two blocks have still to be compared, bool."""
        return compared(*self.ranges(one, other))

    def ranges(self, one: int, other: int) -> tuple[range, range]:
        """The objects of two blocks."""
        return self.grid.ranges[one], self.grid.ranges[other]

    def put(self, one: int, other: int, block: Block) -> None:
        """Keep what was computed of a pair of blocks."""
        rows, columns = self.ranges(one, other)
        forward, backward = self._padded(rows, block.forward), self._padded(columns, block.backward)
        if one == other:
            forward = np.where(np.isnan(forward), backward, forward)
            forward[np.arange(len(rows)), :, np.arange(len(rows))] = 0.0
            self._write(rows, rows, forward)
        else:
            self._write(rows, columns, forward)
            self._write(columns, rows, backward)

    def finish(self, objects: Objects, matching: Matching, progress: Progress = False) -> None:
        """Make the matrix of the distances, a block of rows at a time."""
        report = reporter(progress, "rows", "objects")
        rows_of = row_maker(self._cells, objects, self.grid, self._members, matching)
        for rows in self.grid.ranges:
            self._write_rows(rows, rows_of(rows))
            report(rows.stop, self.grid.objects)

    def _cells(self, rows: range, columns: range) -> np.ndarray:
        """Distances (B, C, M2)."""
        return np.asarray(self._distances[rows.start : rows.stop, :, columns.start : columns.stop])

    def _write(self, rows: range, columns: range, cells: np.ndarray) -> None:
        self._distances[rows.start : rows.stop, :, columns.start : columns.stop] = cells

    def _write_rows(self, rows: range, values: np.ndarray) -> None:
        self._dissimilarity[rows.start : rows.stop] = values

    def _padded(self, rows: range, distances: np.ndarray) -> np.ndarray:
        """Distances (P1, M2) of the parts of a block's objects as (B, C, M2)."""
        cells = np.zeros((len(rows), self._distances.shape[1], distances.shape[1]), np.float32)
        counts = self.counts[rows.start : rows.stop]
        cells[np.arange(cells.shape[1]) < counts[:, None]] = distances
        return cells
