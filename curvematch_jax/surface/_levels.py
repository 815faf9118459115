"""Level curves of a function on a surface: closed, ordered, consistently oriented, and followed from level to level."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from ._mesh import Mesh
from ._topology import Edges, label_components


class _Crossings(NamedTuple):
    """The points where edges meet levels, by edge and then by level."""

    edge: np.ndarray  # (c,)
    level: np.ndarray  # (c,)
    first: np.ndarray  # (e,) of each edge, less its lowest level: the point on edge e and level k is `first[e] + k`
    inner: np.ndarray  # (c,) the end of the edge where the function is <= the level's value
    outer: np.ndarray  # (c,) the other end
    points: np.ndarray  # (c, 3)


class LevelSets:
    """The level sets of one function, given at the vertices and linear on faces, for ascending values, all at once.

    A value that is met exactly at a vertex counts as just below the curve there (simulation of simplicity), so
    curves never break or branch at vertices. Curves run counter-clockwise around the region of lower values, seen
    against the outward normal: with faces oriented outwards, the lower side is on the left.

    Args:
        mesh: an oriented manifold, with or without boundary.
        function: `(v,)`.
        values: `(L,)`, ascending.

    Attributes:
        level: `(k,)` of each curve the index of its value.
        lengths: `(k,)` of each curve.
        closed: `(k,)` bool, False for a curve that begins and ends on the boundary of the surface.
        level_set_lengths: `(L,)` length of all curves of each value together.
    """

    def __init__(self, mesh: Mesh, function: np.ndarray, values: np.ndarray):
        self._table = mesh.edges
        # Between which values a vertex is: it is inside of level k when its band is no more than k.
        self._band = np.searchsorted(values, function, side="left")
        self._crossings = _crossings(mesh, function, values, self._band, self._table)
        self._following = _following(mesh.faces, self._band, self._crossings, self._table)
        count = len(self._following)
        here = np.flatnonzero(self._following >= 0)
        number, self._curve = label_components(count, np.stack([here, self._following[here]], axis=1))
        steps = np.zeros(count)
        points = self._crossings.points
        steps[here] = np.linalg.norm(points[self._following[here]] - points[here], axis=1)
        self.lengths = np.bincount(self._curve, weights=steps, minlength=number)
        self.closed = np.ones(number, dtype=bool)
        self.closed[self._curve[self._following < 0]] = False
        self.level = np.zeros(number, dtype=np.int64)
        self.level[self._curve] = self._crossings.level
        self.level_set_lengths = np.bincount(self.level, weights=self.lengths, minlength=len(values))

    def polyline(self, curve: int) -> np.ndarray:
        """Points `(p, 3)` of one closed curve in order, without repeating the first."""
        start, following = self._starts[curve], self._steps
        order = [start]
        while (after := following[order[-1]]) != start:
            order.append(after)
        return self._crossings.points[order]

    @cached_property
    def _starts(self) -> list[int]:
        return np.unique(self._curve, return_index=True)[1].tolist()

    @cached_property
    def _steps(self) -> list[int]:
        return self._following.tolist()  # numbers of a list are ten times as quick to get as those of an array

    def follow(self, source: int, dominance: float) -> list[int | None]:
        """The curve around vertex `source`, where the function is lowest, followed through the levels.

        From one level to the next a curve continues as the curves that bound the same piece of the band in between.
        If there are several, the longest continues alone, provided that it has at least the share `dominance` of
        their length in all. If not, this level has no curve; all of them are followed on, and when one dominates later
        (between fingers the level set splits, and is one again at the wrist) the part goes on with it. It ends where
        the surface ends, and where a curve is open because it runs into a boundary.

        Returns:
            One curve for each value, `None` where the part has none.
        """
        levels = len(self.level_set_lengths)
        found: list[int | None] = [None] * levels
        below, above, at_source = self._pieces(source)
        curves: list[list[int]] = [[] for _ in range(levels)]
        for curve, level in enumerate(self.level.tolist()):
            curves[level].append(curve)
        lengths, closed = self.lengths.tolist(), self.closed.tolist()
        reached = {at_source} if self._band[source] == 0 else set()
        for level in range(levels):
            current = [curve for curve in curves[level] if below[curve] in reached]
            if not current or not all(closed[curve] for curve in current):
                break
            longest = max(current, key=lengths.__getitem__)
            if lengths[longest] >= dominance * sum(lengths[curve] for curve in current) > 0:
                current = [longest]
                found[level] = longest
            reached = {above[curve] for curve in current}
        return found

    def _pieces(self, source: int) -> tuple[list[int], list[int], int]:
        """Of each curve the connected pieces of the bands below and above it; and the piece that a vertex is in.

        Nodes: the vertices, the curves as upper ends of pieces, the curves as lower ends. Inside one face a band is
        convex, so vertices of one band joined by an edge, a crossed edge's end in the band, and edges that cross both
        levels of a band tell all.
        """
        count, curves = len(self._band), len(self.level)
        upper, lower = count + self._curve, count + curves + self._curve
        crossings, ends = self._crossings, self._table.ends
        from_below = self._band[crossings.inner] == crossings.level
        from_above = self._band[crossings.outer] == crossings.level + 1
        through = np.flatnonzero(crossings.edge[1:] == crossings.edge[:-1])
        links = [
            ends[self._band[ends[:, 0]] == self._band[ends[:, 1]]],
            np.stack([crossings.inner, upper], axis=1)[from_below],
            np.stack([crossings.outer, lower], axis=1)[from_above],
            np.stack([lower[through], upper[through + 1]], axis=1),
        ]
        _, piece = label_components(count + 2 * curves, np.concatenate(links))
        return piece[count : count + curves].tolist(), piece[count + curves :].tolist(), int(piece[source])


def _crossings(mesh: Mesh, function: np.ndarray, values: np.ndarray, band: np.ndarray, table: Edges) -> _Crossings:
    a, b = table.ends.T
    swap = band[a] > band[b]
    inner, outer = np.where(swap, b, a), np.where(swap, a, b)
    lowest = band[inner]
    count = band[outer] - lowest
    first = np.cumsum(count) - count - lowest
    edge = np.repeat(np.arange(len(count)), count)
    level = np.arange(len(edge)) - first[edge]
    inner, outer = inner[edge], outer[edge]
    share = (values[level] - function[inner]) / (function[outer] - function[inner])
    points = mesh.vertices[inner] + share[:, None] * (mesh.vertices[outer] - mesh.vertices[inner])
    return _Crossings(edge, level, first, inner, outer, points)


def _following(faces: np.ndarray, band: np.ndarray, crossings: _Crossings, table: Edges) -> np.ndarray:
    """The next point along each curve, -1 where it leaves the surface.

    In each crossed face one half-edge goes out of the lower region and one comes back: a step of the curve.
    """
    a, b, c = bands = band[faces.T]
    lowest = np.minimum(np.minimum(a, b), c)
    count = np.maximum(np.maximum(a, b), c) - lowest
    face = np.repeat(np.arange(len(faces)), count)
    level = np.arange(len(face)) - (np.cumsum(count) - count - lowest)[face]
    a, b, c = bands[:, face] <= level  # whether the corners are inside
    leaves, returns = np.where(a & ~b, 0, np.where(b & ~c, 1, 2)), np.where(b & ~a, 0, np.where(c & ~b, 1, 2))
    first = crossings.first[table.of_halfedge]
    following = np.full(len(crossings.edge), -1)
    following[first[leaves * len(faces) + face] + level] = first[returns * len(faces) + face] + level
    return following
