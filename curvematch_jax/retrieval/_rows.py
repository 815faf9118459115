"""Rows of the dissimilarity matrix, from the distances of parts to objects."""

from __future__ import annotations

import functools as ft
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

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
    cells = _Cells(read, objects, grid, matching)
    return _mutual(cells, members) if matching.mutual else ft.partial(_one_way, cells)


@dataclass(frozen=True, eq=False)
class _Cells:
    """Distances of parts to objects, and what they belong to."""

    read: Read
    objects: Objects
    grid: Grid
    matching: Matching

    def of(self, rows: range, columns: range) -> np.ndarray:
        """Distances (P, M2) of the P parts of a run of objects to another run."""
        cells = self.read(rows, columns)
        return cells[np.arange(cells.shape[1]) < self.objects.counts[rows, None]]

    def areas(self, rows: range) -> tuple[np.ndarray, np.ndarray]:
        """Of the P parts of a run of objects, (P,), and where among them each object's begin, (B + 1,)."""
        starts = np.concatenate([[0], np.cumsum(self.objects.counts)])[rows.start : rows.stop + 1]
        return self.objects.areas[starts[0] : starts[-1]], starts - starts[0]

    def forward(self, rows: range) -> np.ndarray:
        """Mean distances (S, B, M) of a run of objects to all, of every source."""
        parts = np.concatenate([self.means(rows, each) for each in self.grid.ranges], axis=1)
        some = {name: table[rows] for name, table in self.objects.descriptors.items()}
        return np.stack([parts, *witness_distances(some, self.objects.descriptors, self.matching)])

    def means(self, rows: range, columns: range) -> np.ndarray:
        """Mean distances (B, M2) of the parts of a run of objects to another run."""
        found = object_distances(self.of(rows, columns), *self.areas(rows), self.matching)
        found[:, self.objects.counts[columns] == 0] = np.nan
        return found


def _one_way(cells: _Cells, rows: range) -> np.ndarray:
    """Row i is what object i's parts say of the others."""
    known = np.concatenate([cells.of(rows, each) for each in cells.grid.ranges], axis=1).astype(np.float64)
    areas, starts = cells.areas(rows)
    present = cells.objects.counts > 0
    found = np.zeros((len(rows), len(present)))
    for row, i, (start, end) in zip(found, rows, pairwise(starts.tolist()), strict=True):
        others = np.arange(len(present)) != i
        if others.any():
            fused = fuse(known[start:end, others], areas[start:end], present[others], cells.matching)
            row[others] = fused.dissimilarity
    return found


def _mutual(cells: _Cells, members: Sequence[int]) -> Callable[[range], np.ndarray]:
    """Entry i, j is what both objects say of each other, in the eyes of a cohort."""
    keys, counts, ranges = cells.objects.fingerprints, cells.objects.counts, cells.grid.ranges
    picked = np.asarray(members)
    to_members = np.concatenate([cells.forward(rows)[:, :, picked] for rows in ranges], axis=1)
    to_members = np.where(own(keys, [keys[k] for k in members]), np.nan, to_members)
    cohort = Cohort.of(picked, to_members[:, picked], cells.matching)
    moments = cohort.moments(to_members)

    def rows_of(rows: range) -> np.ndarray:
        forward, back = cells.forward(rows), np.concatenate([cells.means(each, rows) for each in ranges])
        backward = np.stack([back, *(values.T for values in forward[1:])])
        there = cohort.evidence(forward, moments[:, rows]).sum(axis=0)
        here = cohort.evidence(backward, moments).sum(axis=0).T
        found = mutual(cohort, there + here, (counts[rows, None] > 0) & (counts > 0))
        found[np.arange(len(rows)), rows] = 0.0
        return found

    return rows_of
