"""Level curves of a function on a surface: closed, ordered, consistently oriented, and followed from level to level."""

from typing import NamedTuple

import numpy as np

from ._mesh import Mesh
from ._topology import Edges, edges, label_components


class Loops(NamedTuple):
    """The level set of one value. Its points lie on the mesh's edges, one on every crossed edge."""

    edges: np.ndarray  # (c,) the crossed edges, ascending
    points: np.ndarray  # (c, 3)
    inner: np.ndarray  # (c,) the end of each crossed edge where the function is <= the value
    outer: np.ndarray  # (c,) the other end
    following: np.ndarray  # (c,) index of the next point along the curve, -1 where the curve leaves the surface
    labels: np.ndarray  # (c,) which curve the point is on
    lengths: np.ndarray  # (k,) length of each curve
    closed: np.ndarray  # (k,) bool, False for a curve that begins and ends on the boundary of the surface

    def polyline(self, label: int) -> np.ndarray:
        """Points `(p, 3)` of one closed curve in order, without repeating the first."""
        order = [int(np.flatnonzero(self.labels == label)[0])]
        while (after := int(self.following[order[-1]])) != order[0]:
            order.append(after)
        return self.points[order]


class LevelSets:
    """Level sets of one function, given at the vertices and linear on faces.

    A value that is met exactly at a vertex counts as just below the curve there (simulation of simplicity), so
    curves never break or branch at vertices. Curves run counter-clockwise around the region of lower values, seen
    against the outward normal: with faces oriented outwards, the lower side is on the left.

    Args:
        mesh: an oriented manifold, with or without boundary.
        function: `(v,)`.
        table: `edges(mesh.faces)`, to share it between functions.
    """

    def __init__(self, mesh: Mesh, function: np.ndarray, table: Edges | None = None):
        self._mesh = mesh
        self.function = function
        self.table = edges(mesh.faces) if table is None else table

    def __call__(self, value: float) -> Loops:
        """All curves of the level set of `value`."""
        ends, function = self.table.ends, self.function
        below = function <= value
        crossed = np.flatnonzero(below[ends[:, 0]] != below[ends[:, 1]])
        pair = ends[crossed]
        swap = below[pair[:, 1]]
        inner, outer = np.where(swap, pair[:, 1], pair[:, 0]), np.where(swap, pair[:, 0], pair[:, 1])
        share = (value - function[inner]) / (function[outer] - function[inner])
        start, step = self._mesh.vertices[inner], self._mesh.vertices[outer] - self._mesh.vertices[inner]
        points = start + share[:, None] * step
        following = self._following(below, crossed)
        return Loops(crossed, points, inner, outer, following, *_curves(points, following))

    def _following(self, below: np.ndarray, crossed: np.ndarray) -> np.ndarray:
        """In each crossed face one half-edge goes out of the lower region and one comes back: a step of the curve."""
        faces, table = self._mesh.faces, self.table
        inside = below[faces]
        mixed = np.flatnonzero(inside.any(axis=1) & ~inside.all(axis=1))
        inside = inside[mixed]
        ahead = inside[:, [1, 2, 0]]
        leaves = np.argmax(inside & ~ahead, axis=1)
        returns = np.argmax(~inside & ahead, axis=1)
        edge_of = table.of_halfedge.reshape(3, len(faces))
        place = np.full(len(table.ends), -1)
        place[crossed] = np.arange(len(crossed))
        following = np.full(len(crossed), -1)
        following[place[edge_of[leaves, mixed]]] = place[edge_of[returns, mixed]]
        return following


def front_lengths(mesh: Mesh, function: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Length of the whole level set, all its curves together, at each of the values `(L,)`.

    In a face the level sets are parallel segments whose length grows linearly from the lowest corner to the middle
    one and falls to the highest.
    """
    order = np.argsort(function[mesh.faces], axis=1)
    corners = mesh.vertices[np.take_along_axis(mesh.faces, order, axis=1)]
    low, middle, high = np.take_along_axis(function[mesh.faces], order, axis=1).T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(high > low, (middle - low) / (high - low), 0.0)  # a level face is crossed nowhere
        rising, falling = (values - low) / (middle - low), (high - values) / (high - middle)
    across = corners[:, 0] + along * (corners[:, 2] - corners[:, 0]) - corners[:, 1]
    share = np.where(values <= middle, rising, falling)
    crossed = (values >= low) & (values < high) & np.isfinite(share)
    return np.linalg.norm(across, axis=1) @ np.where(crossed, share, 0.0)


def _curves(points: np.ndarray, following: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    here = np.flatnonzero(following >= 0)
    number, labels = label_components(len(points), np.stack([here, following[here]], axis=1))
    steps = np.zeros(len(points))
    steps[here] = np.linalg.norm(points[following[here]] - points[here], axis=1)
    closed = np.ones(number, dtype=bool)
    closed[labels[following < 0]] = False
    return labels, np.bincount(labels, weights=steps, minlength=number), closed


def follow(levels: LevelSets, source: int, values: np.ndarray, dominance: float) -> list[np.ndarray | None]:
    """The curve around vertex `source`, where the function is lowest, followed through ascending `values`.

    From one level to the next a curve continues as the curves that bound the same piece of the band in between.
    If there are several, the longest continues alone, provided that it has at least the share `dominance` of
    their length in all. If not, this level has no curve; all of them are followed on, and when one dominates later
    (between fingers the front splits, and is one again at the wrist) the part goes on with it. It ends where the
    surface ends, and where a curve is open because it runs into a boundary.

    Returns:
        One polyline `(p, 3)` for each value, `None` where the part has no curve.
    """
    curves: list[np.ndarray | None] = [None] * len(values)
    lower: tuple[float, Loops, np.ndarray] | None = None
    for k, value in enumerate(values):
        loops = levels(value)
        current = _continuations(levels, source, lower, value, loops)
        if not len(current) or not loops.closed[current].all():
            break
        longest = current[np.argmax(loops.lengths[current])]
        if loops.lengths[longest] >= dominance * loops.lengths[current].sum() > 0:
            current = np.array([longest])
            curves[k] = loops.polyline(int(longest))
        lower = (value, loops, current)
    return curves


def _continuations(
    levels: LevelSets, source: int, lower: tuple[float, Loops, np.ndarray] | None, value: float, upper: Loops
) -> np.ndarray:
    """Curves of `upper` that bound the pieces of the band below it which the lower curves bound (or `source` is in).

    Nodes: the vertices, the upper curves, the lower curves. Inside one face the band is convex, so vertices of the
    band joined by an edge, a crossed edge's end in the band, and edges that cross both levels tell all.
    """
    count = len(levels.function)
    band = levels.function <= value
    base = count + len(upper.lengths)
    links = [np.stack([upper.inner, count + upper.labels], axis=1)]
    start = np.array([source])
    if lower is not None:
        floor, loops, followed = lower
        band &= levels.function > floor
        links[0] = links[0][band[upper.inner]]
        entering = band[loops.outer]
        links.append(np.stack([loops.outer[entering], base + loops.labels[entering]], axis=1))
        _, above, below = np.intersect1d(upper.edges, loops.edges, assume_unique=True, return_indices=True)
        links.append(np.stack([count + upper.labels[above], base + loops.labels[below]], axis=1))
        start = base + followed
        base += len(loops.lengths)
    ends = levels.table.ends
    links.append(ends[band[ends[:, 0]] & band[ends[:, 1]]])
    _, piece = label_components(base, np.concatenate(links))
    return np.flatnonzero(np.isin(piece[count : count + len(upper.lengths)], piece[start]))
