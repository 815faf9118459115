"""Distance along the surface from one vertex to all others."""

from collections.abc import Callable
from typing import Any, Literal, get_args

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from ._mesh import Mesh, MeshError
from ._spectral import SpectralDistances, SpectralField
from ._topology import edges, face_areas

GeodesicField = Literal["heat", "fast_marching"]
Field = Literal[GeodesicField, SpectralField]

# Distances `(v,)` of all vertices of one mesh from a vertex, 0 there and positive elsewhere. Every field has a unit of
# its own, in proportion to the mesh's, so that only shares of its own diameter mean something.
Distances = Callable[[int], np.ndarray]

# About the geodesic diameter of a creature with limbs, in square roots of the area.
_DIAMETER = 1.5

# The heat method's time is the square of this length, given in square roots of the area, or of the mean edge if that is
# longer. A length that does not depend on the mesh makes fields, and so feature points, depend less on it.
_SMOOTHING = 0.03

# Bounds of a sound field against the shortest way along edges, which is never shorter than the geodesic distance.
_SHORTEST, _LONGEST = 0.5, 1.1


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
    Computing geodesic paths on manifolds, PNAS 95, 1998). Heat falls off exponentially and underflows far away on
    very long meshes; a field that leaves the bounds set by the shortest ways along edges is computed again by
    fast marching.

    Args:
        mesh: any mesh; vertices that cannot be reached from a source are infinitely far from it.
        field: the method.
    """

    def __init__(self, mesh: Mesh, field: GeodesicField = "heat"):
        self._mesh = mesh
        self._graph = _edge_graph(mesh)
        self._unit = float(self._graph.data.mean())
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
        along_edges = dijkstra(self._graph, indices=source)
        distance = np.full(len(along_edges), np.inf)
        place = int(np.searchsorted(self._used, source))
        if place < len(self._used) and self._used[place] == source:
            distance[self._used] = self._solve_used(place, along_edges[self._used])
        distance[~np.isfinite(along_edges)] = np.inf
        distance[source] = 0.0
        return distance

    def _solve_used(self, source: int, along_edges: np.ndarray) -> np.ndarray:
        if self._heat is not None:
            distance = self._heat.compute_distance(source) * self._unit
            distance = np.maximum(distance - distance[source], 0)
            if _plausible(distance, along_edges, self._unit):
                return distance
        return self._marching.compute_distance([[(source, [])]]).ravel() * self._unit


def _solvers(vertices: np.ndarray, faces: np.ndarray, field: GeodesicField, name: str) -> tuple[Any, Any]:
    """The solver by fast marching, and the one by heat if that is the method."""
    import potpourri3d

    time = max(1.0, _SMOOTHING**2 * float(face_areas(vertices, faces).sum()))  # in squared mean edges
    try:
        marching = potpourri3d.MeshFastMarchingDistanceSolver(vertices, faces)
        heat = potpourri3d.MeshHeatMethodDistanceSolver(vertices, faces, t_coef=time) if field == "heat" else None
    except RuntimeError as error:
        reason = " ".join(str(error).split())[:120]
        raise MeshError(f"{name}: its triangles are too thin for distances along the surface ({reason})") from None
    return marching, heat


def _edge_graph(mesh: Mesh) -> sp.csr_matrix:
    ends = edges(mesh.faces).ends
    lengths = np.linalg.norm(mesh.vertices[ends[:, 0]] - mesh.vertices[ends[:, 1]], axis=1)
    count = len(mesh.vertices)
    half = sp.coo_matrix((lengths, (ends[:, 0], ends[:, 1])), shape=(count, count)).tocsr()
    return half + half.T


def _plausible(distance: np.ndarray, along_edges: np.ndarray, unit: float) -> bool:
    judged = np.isfinite(along_edges) & (along_edges > 5 * unit)  # close to the source a few edges round the ratio
    if not np.isfinite(distance[np.isfinite(along_edges)]).all():
        return False
    ratio = distance[judged] / along_edges[judged]
    return not len(ratio) or bool(ratio.min() >= _SHORTEST and ratio.max() <= _LONGEST)
