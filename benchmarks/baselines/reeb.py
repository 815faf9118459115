"""Slices of a surface along a function, and how they hang together: a Reeb graph of finite resolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._topology import edges, face_areas, label_components, neighbour_pairs


@dataclass(frozen=True, eq=False)
class Regions:
    """Connected pieces of a surface, as the nodes of a directed graph.

    Attributes:
        area: `(n,)` shares of the surface, which sum up to 1.
        spread: `(n, 2)` the least and the greatest value of the function on each.
        upwards: `(n, n)` bool: whether the column's region continues the row's to where the function is greater.
    """

    area: np.ndarray
    spread: np.ndarray
    upwards: np.ndarray

    @property
    def joined(self) -> np.ndarray:
        """`(n, n)` bool, symmetric: which regions touch."""
        return self.upwards | self.upwards.T

    def united(self, labels: np.ndarray) -> Regions:
        """Regions of the same label `(n,)` made one. What was above and below it may be one thing then."""
        label = np.unique(labels, return_inverse=True)[1]
        return _regions(label, self.area, self.spread, np.argwhere(self.upwards))


def slices(mesh: Mesh, values: np.ndarray, count: int) -> Regions:
    """The components of `count` slices of equal height of a function `(v,)` that is linear on the faces.

    Faces are cut where slices end, so a slice that is thinner than the triangles stays connected all the same.
    """
    heights = (values - values.min()) / np.ptp(values) * count
    on_faces = heights[mesh.faces]
    face, level = _spanned(on_faces, count)
    first = np.searchsorted(face, np.arange(len(mesh.faces)))  # the pieces of a face follow each other, upwards
    across = _touching(mesh, heights, count)
    region = label_components(len(face), first[across[0]] + across[1] - level[first[across[0]]])[1]
    above = np.where(level == count - 1, np.inf, level + 1)  # faces that lie flat at the very top are below it
    shares = _share_below(on_faces[face], above) - _share_below(on_faces[face], level)
    area = face_areas(mesh.vertices, mesh.faces)
    bounds = np.clip([level, level + 1], on_faces.min(axis=1)[face], on_faces.max(axis=1)[face])
    spread = values.min() + bounds.T / count * np.ptp(values)
    lower = np.flatnonzero(face[1:] == face[:-1])
    return _regions(region, shares * area[face] / area.sum(), spread, np.stack([lower, lower + 1], axis=1))


def _regions(label: np.ndarray, area: np.ndarray, spread: np.ndarray, upwards: np.ndarray) -> Regions:
    """Pieces put together by their labels `(p,)`; `upwards` are pairs `(q, 2)`, the second continuing the first."""
    number = label.max() + 1
    low, high = np.full(number, np.inf), np.full(number, -np.inf)
    np.minimum.at(low, label, spread[:, 0])
    np.maximum.at(high, label, spread[:, 1])
    matrix = np.zeros((number, number), dtype=bool)
    matrix[tuple(label[upwards].T)] = True
    return Regions(np.bincount(label, area), np.stack([low, high], axis=1), matrix & ~np.eye(number, dtype=bool))


def _spanned(heights: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The slices that each row of heights reaches into, as pairs of a row and a slice, row by row and upwards."""
    low, high = (np.clip(end(axis=1).astype(int), 0, count - 1) for end in (heights.min, heights.max))
    rows = np.repeat(np.arange(len(heights)), high - low + 1)
    return rows, np.arange(len(rows)) - np.searchsorted(rows, rows) + low[rows]


def _touching(mesh: Mesh, heights: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces `(p, 2)` and the slice `(p, 1)` in which they share a piece of an edge."""
    halfedges, faces = neighbour_pairs(mesh.faces, edges(mesh.faces))
    corner, face = np.divmod(halfedges[:, 0], len(mesh.faces))
    ends = np.stack([mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]], axis=1)
    edge, level = _spanned(heights[ends], count)
    return faces[edge], level[:, None]


def _share_below(corners: np.ndarray, height: np.ndarray) -> np.ndarray:
    """The share of each triangle's area below a height `(p,)`, from the heights of its corners `(p, 3)`."""
    low, middle, high = np.sort(corners, axis=1).T
    tiny = np.finfo(float).tiny
    rising = (np.clip(height, low, middle) - low) ** 2 / np.maximum((high - low) * (middle - low), tiny)
    falling = 1 - (high - np.clip(height, middle, high)) ** 2 / np.maximum((high - low) * (high - middle), tiny)
    return np.where(height <= low, 0, np.where(height < middle, rising, falling))
