"""Feature points: where two distance fields, grown from the ends of the surface's diameter, both have an extremum."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ._fields import Distances
from ._mesh import Mesh
from ._topology import label_components

_STARTS = 3
# On rods and tins sweeps come to rest in the middles of the caps, which are not the vertices farthest apart.
_REACHES = (0.12, 0.08, 0.04)  # steps to the side, in diameters
_RING = 0.15  # of a step, inwards and outwards
_DIRECTIONS = 3


class Features(NamedTuple):
    """Feature points of a surface and its diameter."""

    vertices: np.ndarray  # (P,) in the order in which they were accepted
    diameter: float  # in the unit of the distances
    ends: tuple[int, int]  # v1, v2
    fallback: bool  # no point satisfied the definition, so the ends of the diameter stand in
    added: int  # how many of the vertices, the last ones, were added to make up the number that was asked for


def diameter_pair(mesh: Mesh, distances: Distances) -> tuple[int, int, float]:
    """The two vertices farthest apart, and their distance.

    A sweep goes to the vertex farthest from where it stands, until that distance stops growing. The first
    starts from the vertex farthest from the centroid, each of the others from the vertex that is farthest
    from all the vertices at which earlier sweeps stood. Then one end is moved a step to the side, if that helps. Ties
    go to the lower index.
    """
    start = int(np.argmax(np.linalg.norm(mesh.vertices - mesh.vertices.mean(axis=0), axis=1)))
    best = (start, start, 0.0)
    nearest = np.full(len(mesh.vertices), np.inf)
    for _ in range(_STARTS):
        found, visited = _sweep(distances, start)
        best = max(best, found, key=lambda pair: pair[2])
        for vertex in visited:
            nearest = np.minimum(nearest, distances(vertex))
        start = int(np.argmax(nearest))
    for reach in _REACHES:
        best = max([best, *_beside(distances, best, reach)], key=lambda pair: pair[2])
    return best


def _beside(distances: Distances, pair: tuple[int, int, float], reach: float) -> Iterator[tuple[int, int, float]]:
    """Pairs whose one end is a step to the side of the first end of a pair, in three directions."""
    start, _, diameter = pair
    apart = np.abs(distances(start) - reach * diameter)
    ring = np.flatnonzero(apart <= max(apart.min(), _RING * reach * diameter))
    place = int(ring[np.argmin(apart[ring])])
    nearest = np.full(len(apart), np.inf)
    for _ in range(_DIRECTIONS):
        field = distances(place)
        there = int(np.argmax(field))
        yield place, there, float(field[there])
        nearest = np.minimum(nearest, field)
        place = int(ring[np.argmax(nearest[ring])])


def _sweep(distances: Distances, start: int) -> tuple[tuple[int, int, float], list[int]]:
    visited = [start]
    best = (start, start, 0.0)
    while True:
        here = visited[-1]
        field = distances(here)
        there = int(np.argmax(field))
        if field[there] <= best[2]:
            return best, visited
        best = (here, there, float(field[there]))
        visited.append(there)


def local_extrema(ends: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Vertices where `field` `(v,)` is strictly higher, or strictly lower, than on the whole one-ring, ascending.

    Connected vertices of equal value count as one place: a plateau that is higher (lower) than everything
    around it gives its lowest-numbered vertex.

    Args:
        ends: `(e, 2)`, those of the mesh's edges.
    """
    count = len(field)
    level = field[ends[:, 0]] == field[ends[:, 1]]
    number, plateau = label_components(count, ends[level])
    up = plateau[ends[~level]]
    higher = field[ends[~level]]
    swap = higher[:, 0] > higher[:, 1]
    low, high = np.where(swap, up[:, 1], up[:, 0]), np.where(swap, up[:, 0], up[:, 1])
    has_above, has_below = np.zeros(number, dtype=bool), np.zeros(number, dtype=bool)
    has_above[low] = True
    has_below[high] = True
    _, first = np.unique(plateau, return_index=True)
    return np.sort(first[has_above ^ has_below])


def feature_points(mesh: Mesh, distances: Distances, epsilon: float, min_parts: int = 1) -> Features:
    """Feature points of a closed, connected mesh (Tabia et al., IEEE PAMI 33(4), 2011, section 3).

    `f1` and `f2` are the distances from the ends `v1`, `v2` of the diameter, `F1` and `F2` their local extrema. A
    vertex is a feature point when a vertex of `F1` and a vertex of `F2` lie within `epsilon` of it and no other
    feature point does. What the definition leaves open is fixed as follows.

    Of the vertices that qualify, the candidates are those half-way between a vertex of `F1` and the nearest vertex of
    `F2`. They are accepted farthest first: the first is the candidate with the largest mean distance to the others,
    each next one the candidate farthest from those accepted, until none is more than `epsilon` away from
    them. Ties go to the lower vertex index. When no vertex qualifies the ends of the diameter are the feature points,
    and `fallback` is set. While there are fewer than `min_parts`, the vertex farthest from all of them is added: cups,
    rings and mechanical parts have few tips or none, and one or two points say little about them.

    Args:
        distances: the distance fields of `mesh`, geodesic or spectral.
        epsilon: in diameters.
        min_parts: how many points there are at least.
    """
    v1, v2, diameter = diameter_pair(mesh, distances)
    first = local_extrema(mesh.edges.ends, distances(v1))
    second = local_extrema(mesh.edges.ends, distances(v2))
    reach = epsilon * diameter
    candidates = _candidates(distances, first, second, reach)
    if len(candidates):
        between = np.stack([distances(v)[candidates] for v in candidates.tolist()])
        found = candidates[_farthest_first(between, reach)].tolist()
    else:
        found = [v1, v2]
    vertices = _made_up(distances, found, min_parts)
    return Features(np.array(vertices), diameter, (v1, v2), not len(candidates), len(vertices) - len(found))


def _candidates(distances: Distances, first: np.ndarray, second: np.ndarray, reach: float) -> np.ndarray:
    found = set()
    for start in first.tolist():
        field = distances(start)
        partner = int(second[np.argmin(field[second])])
        if field[partner] <= 2 * reach:
            farther = np.maximum(field, distances(partner))
            middle = int(np.argmin(farther))
            if farther[middle] <= reach:
                found.add(middle)
    return np.array(sorted(found), dtype=np.int64)


def _farthest_first(between: np.ndarray, reach: float) -> list[int]:
    accepted = [int(np.argmax(between.mean(axis=1)))]
    nearest = between[accepted[0]].copy()
    while nearest.max() > reach:
        accepted.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, between[accepted[-1]])
    return accepted


def _made_up(distances: Distances, vertices: list[int], count: int) -> list[int]:
    """The vertices, and while they are fewer than `count` the one farthest from them all."""
    vertices = list(vertices)
    while len(vertices) < count:
        nearest = np.minimum.reduce([distances(v) for v in vertices])
        vertices.append(int(np.argmax(nearest)))
    return vertices
