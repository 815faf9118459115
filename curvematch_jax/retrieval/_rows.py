"""Rows of the dissimilarity matrix, from the distances of parts to objects."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ._blocks import Grid
from ._cohort import Cohort, object_distances, witness_distances
from ._matching import Matching
from ._objects import Objects, own
from ._ranking import fuse, mutual

# Distances (B, C, M2) of up to C parts of each of a run of B objects to another run of objects.
Read = Callable[[range, range], np.ndarray]


def row_maker(
    read: Read, objects: Objects, grid: Grid, members: Sequence[int], matching: Matching
) -> Callable[[range], np.ndarray]:
    """What makes rows (B, M) of a run of B objects.

    Args:
        read: the distances, 0 of an object's parts to itself.
        members: of the cohort.
    """
    if matching.mutual:
        return _Mutual(read, objects, grid, members, matching).rows
    return _OneWay(read, objects, grid, matching).rows


class _OneWay:
    """Row i is what object i's parts say of the others."""

    def __init__(self, read: Read, objects: Objects, grid: Grid, matching: Matching) -> None:
        self._read, self._objects, self._grid, self._matching = read, objects, grid, matching
        self._counts = objects.counts

    def rows(self, rows: range) -> np.ndarray:
        most = max(int(self._counts[rows.start : rows.stop].max()), 1)
        # Copies, as a view of a few parts would hold the memory of all that there is room for.
        cells = np.concatenate([self._read(rows, each)[:, :most].copy() for each in self._grid.ranges], axis=2)
        return np.stack([self._row(cells[k, : self._counts[i]], i) for k, i in enumerate(rows)])

    def _row(self, distances: np.ndarray, i: int) -> np.ndarray:
        present = self._counts > 0
        row, others = np.zeros(len(present)), np.arange(len(present)) != i
        if others.any():
            areas, known = self._objects.areas[i], distances[:, others].astype(np.float64)
            row[others] = fuse(known, areas, present[others], self._matching).dissimilarity
        return row


class _Mutual:
    """Entry i, j is what both objects say of each other, in the eyes of a cohort."""

    def __init__(self, read: Read, objects: Objects, grid: Grid, members: Sequence[int], matching: Matching) -> None:
        self._read, self._objects, self._grid, self._matching = read, objects, grid, matching
        self._counts, self._descriptors = objects.counts, objects.descriptors
        picked = np.asarray(members)
        to_members = np.concatenate([self._forward(rows)[:, :, picked] for rows in grid.ranges], axis=1)
        twins = own(objects.fingerprints, [objects.fingerprints[k] for k in members])
        to_members = np.where(twins, np.nan, to_members)
        self._cohort = Cohort.of(picked, to_members[:, picked], matching)
        self._moments = self._cohort.moments(to_members)

    def rows(self, rows: range) -> np.ndarray:
        forward, run = self._forward(rows), slice(rows.start, rows.stop)
        back = np.concatenate([self._means(each, rows) for each in self._grid.ranges])
        backward = np.stack([back, *(values.T for values in forward[1:])])
        there = self._cohort.evidence(forward, self._moments[:, run]).sum(axis=0)
        here = self._cohort.evidence(backward, self._moments).sum(axis=0).T
        present = (self._counts[run, None] > 0) & (self._counts > 0)
        found = mutual(self._cohort, there + here, present)
        found[np.arange(len(rows)), rows] = 0.0
        return found

    def _forward(self, rows: range) -> np.ndarray:
        """Distances (S, B, M) of a run of objects to all, of every source."""
        parts = np.concatenate([self._means(rows, each) for each in self._grid.ranges], axis=1)
        some = {name: table[rows.start : rows.stop] for name, table in self._descriptors.items()}
        return np.stack([parts, *witness_distances(some, self._descriptors, self._matching)])

    def _means(self, rows: range, columns: range) -> np.ndarray:
        """Mean distances (B, M2) of the parts of a run of objects to another run."""
        counts = self._counts[rows.start : rows.stop]
        cells, areas = self._read(rows, columns), self._objects.areas[rows.start : rows.stop]
        parts = np.concatenate([cells[k, :count] for k, count in enumerate(counts.tolist())])
        found = object_distances(parts, np.concatenate(areas), np.cumsum([0, *counts.tolist()]), self._matching)
        found[:, self._counts[columns.start : columns.stop] == 0] = np.nan
        return found
