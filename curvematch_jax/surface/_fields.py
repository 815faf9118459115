"""Distance along the surface from one vertex to all others."""

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ._mesh import Mesh
from ._shortcuts import shortcut_graph
from ._smooth import smoothing_step
from ._spectral import SpectralDistances, SpectralField

Field = Literal["geodesic", SpectralField]

# Distances `(v,)` of all vertices of one mesh from a vertex, 0 there and positive elsewhere. Every field has a unit of
# its own, in proportion to the mesh's, so that only shares of its own diameter mean something.
Distances = Callable[[int], np.ndarray]

# About the geodesic diameter of a creature with limbs, in square roots of the area.
_DIAMETER = 1.5

# How far fields are smoothed, in square roots of the area: what is left of the graph's directions would be taken for
# feature points. A length that does not depend on the mesh makes fields, and so feature points, depend less on it.
_SMOOTHING = 0.03

# Smoothing makes no distance shorter by more than the first share, nor longer by more than the second: it is too long
# already, if anything. Where half of all distances would change by more than the third share, the triangles are no good
# for smoothing: none may grow, and none shrink by more than the fourth.
_SHORTER, _LONGER, _SOUND, _DOUBTFUL = 0.025, 0.015, 0.016, 0.015


def check_field(field: str) -> None:
    """Raise `ValueError` unless `field` names a method."""
    if field not in get_args(Field):
        raise ValueError(f"field must be one of {', '.join(get_args(Field))}, found {field!r}")


def distances_on(mesh: Mesh, field: Field) -> Distances:
    """The distance fields of one mesh. Spectral ones need a closed connected mesh, as `clean` makes it."""
    return Geodesics(mesh) if field == "geodesic" else SpectralDistances(mesh, field)


def curve_unit(mesh: Mesh, field: Field, diameter: float) -> float:
    """What curves are measured in, in mesh units: the diameter of the field where that is a length on the surface.

    A spectral field's is not; with it curves are measured in `1.5 sqrt(area)`. That is about the geodesic
    diameter of a creature with limbs, but a short cut between two of them leaves it as it is.
    """
    if field == "geodesic":
        return diameter
    return _DIAMETER * float(np.sqrt(mesh.area))


class Geodesics:
    """Geodesic distances on one mesh, whatever its triangles; what can be shared between sources is prepared once.

    They are the shortest ways in a graph of edges and straight lines over faces (`shortcut_graph`), which are no
    shorter than geodesics and seldom longer by 1 %, made smooth by a short step of heat flow. On sound triangles that
    changes most of them by a few thousandths, and makes none shorter by more than 2.5 % or longer by more than 1.5 %:
    where it would, next to the source, at tips or among needles, the bound is the distance. The farthest vertex keeps
    its distance as it was.

    Args:
        mesh: any oriented mesh; vertices that cannot be reached from a source are infinitely far from it.
    """

    def __init__(self, mesh: Mesh):
        self._count = len(mesh.vertices)
        self._graph = shortcut_graph(mesh)
        self._smoothed = smoothing_step(mesh, _SMOOTHING)
        self._known: dict[int, np.ndarray] = {}

    def __call__(self, source: int) -> np.ndarray:
        """Distances `(v,)` from vertex `source`, in mesh units: 0 at the source, `inf` where it cannot be reached."""
        if not 0 <= source < self._count:
            raise IndexError(f"source vertex {source} is not between 0 and {self._count - 1}")
        if source not in self._known:
            distance = dijkstra(self._graph, indices=source)
            reached = np.isfinite(distance)
            shortest = distance[reached]
            smoothed = self._smoothed(np.where(reached, distance, 0.0))[reached]
            distance[reached] = _bounded(smoothed, shortest)
            distance.setflags(write=False)
            self._known[source] = distance
        return self._known[source]


def _bounded(smoothed: np.ndarray, shortest: np.ndarray) -> np.ndarray:
    """Smoothed distances, brought to within some share of what they were."""
    smoothed = np.where(np.isfinite(smoothed), smoothed, shortest)
    sound = 2 * np.count_nonzero(np.abs(smoothed - shortest) <= _SOUND * shortest) >= len(shortest)
    down, up = (_SHORTER, _LONGER) if sound else (_DOUBTFUL, 0.0)
    distance = np.clip(smoothed, (1 - down) * shortest, (1 + up) * shortest)
    farthest = np.argmax(shortest)
    distance[farthest] = shortest[farthest]
    return distance
