"""Distance along the surface from one vertex to all others."""

from collections.abc import Callable
from typing import Any, Literal, get_args

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ._mesh import Mesh, MeshError
from ._refine import edge_lengths
from ._shortcuts import shortcut_graph
from ._spectral import SpectralDistances, SpectralField
from ._topology import face_areas

GeodesicField = Literal["heat", "fast_marching"]
Field = Literal[GeodesicField, SpectralField]

# Distances `(v,)` of all vertices of one mesh from a vertex, 0 there and positive elsewhere. Every field has a unit of
# its own, in proportion to the mesh's, so that only shares of its own diameter mean something.
Distances = Callable[[int], np.ndarray]

# About the geodesic diameter of a creature with limbs, in square roots of the area.
_DIAMETER = 1.5

# The heat method's time is the square of this length, given in square roots of the area, or of the mean edge if that is
# longer. A length that does not depend on the mesh makes fields, and so feature points, depend less on it.
_SMOOTHING = 0.015

# Shortest ways in the graph of shortcuts are longer than geodesics by less than this share; fields are kept in between.
_EXCESS = 0.03

# A field that had to be brought into its bounds at more than this share of the vertices is not used at all.
_CORRECTED = 0.6


def check_field(field: str) -> None:
    """Raise `ValueError` unless `field` names a method."""
    if field not in get_args(Field):
        raise ValueError(f"field must be one of {', '.join(get_args(Field))}, found {field!r}")


def distances_on(mesh: Mesh, field: Field) -> Distances:
    """The distance fields of one mesh. Spectral ones need a closed connected mesh, as `clean` makes it."""
    if field == "heat" or field == "fast_marching":
        return Geodesics(mesh, field)
    return SpectralDistances(mesh, field)


def curve_unit(mesh: Mesh, field: Field, diameter: float) -> float:
    """What curves are measured in, in mesh units: the diameter of the field where that is a length on the surface.

    A spectral field's is not; with it curves are measured in `1.5 sqrt(area)`. That is about the geodesic
    diameter of a creature with limbs, but a short cut between two of them leaves it as it is.
    """
    if field in get_args(GeodesicField):
        return diameter
    return _DIAMETER * float(np.sqrt(face_areas(mesh.vertices, mesh.faces).sum()))


class Geodesics:
    """Geodesic distances on one mesh; what can be shared between sources is prepared once.

    `"heat"` solves two sparse systems (Crane, Weischedel, Wardetzky: Geodesics in heat, ACM Trans. Graph. 32(5),
    2013, with intrinsic Delaunay flips and mollification); `"fast_marching"` propagates a front (Kimmel, Sethian:
    Computing geodesic paths on manifolds, PNAS 95, 1998). Both are smooth, and both can be wrong by a tenth: heat
    underflows far away on long meshes, and rounds off what is near; fronts go wrong in obtuse triangles. So they are
    held between bounds: the shortest ways in a graph of edges and straight lines over a few faces, which are never
    shorter than geodesics, and 0.97 times those. Where most vertices are out of bounds, the method is out of its depth,
    and those shortest ways are the distances.

    Args:
        mesh: any mesh; vertices that cannot be reached from a source are infinitely far from it.
        field: the method.
    """

    def __init__(self, mesh: Mesh, field: GeodesicField = "heat"):
        self._mesh = mesh
        self._graph = shortcut_graph(mesh)
        self._unit = float(edge_lengths(mesh.vertices, mesh.faces).mean())
        self._used, faces = np.unique(mesh.faces, return_inverse=True)  # the solvers refuse vertices without faces
        scaled = (mesh.vertices[self._used] - mesh.vertices[self._used].mean(axis=0)) / self._unit
        faces = faces.reshape(mesh.faces.shape)
        self._marching, self._heat = _solvers(scaled, faces, field, mesh.name or "mesh")
        self._known: dict[int, np.ndarray] = {}

    def __call__(self, source: int) -> np.ndarray:
        """Distances `(v,)` from vertex `source`, in mesh units: 0 at the source, `inf` where it cannot be reached."""
        if not 0 <= source < len(self._mesh.vertices):
            raise IndexError(f"source vertex {source} is not between 0 and {len(self._mesh.vertices) - 1}")
        if source not in self._known:
            distance = self._solve(source)
            distance.setflags(write=False)
            self._known[source] = distance
        return self._known[source]

    def _solve(self, source: int) -> np.ndarray:
        longest = dijkstra(self._graph, indices=source)
        distance = longest.copy()
        place = int(np.searchsorted(self._used, source))
        if place < len(self._used) and self._used[place] == source:
            distance[self._used] = _held(self._smooth(place), longest[self._used])
        distance[source] = 0.0
        return distance

    def _smooth(self, source: int) -> np.ndarray:
        """The field of the method, from a vertex among those that have faces."""
        if self._heat is None:
            return self._marching.compute_distance([[(source, [])]]).ravel() * self._unit
        distance = self._heat.compute_distance(source) * self._unit
        return distance - distance[source]


def _held(distance: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """A field brought between `1 - _EXCESS` times the given distances and those, or those where that is most of it."""
    within = np.clip(distance, (1 - _EXCESS) * longest, longest)
    corrected = ~(within == distance) & np.isfinite(longest)
    sound = np.isfinite(within[np.isfinite(longest)]).all() and corrected.mean() <= _CORRECTED
    return np.where(np.isfinite(longest), within, np.inf) if sound else longest


def _solvers(vertices: np.ndarray, faces: np.ndarray, field: GeodesicField, name: str) -> tuple[Any, Any]:
    """The solver by fast marching or the one by heat, and None for the other."""
    import potpourri3d

    time = max(1.0, _SMOOTHING**2 * float(face_areas(vertices, faces).sum()))  # in squared mean edges
    try:
        if field == "heat":
            return None, potpourri3d.MeshHeatMethodDistanceSolver(vertices, faces, t_coef=time)
        return potpourri3d.MeshFastMarchingDistanceSolver(vertices, faces), None
    except RuntimeError as error:
        reason = " ".join(str(error).split())[:120]
        raise MeshError(f"{name}: its triangles are too thin for distances along the surface ({reason})") from None
