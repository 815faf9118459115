"""Topological short cuts: a thin bridge where a limb comes close to something else."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from curvematch_jax._optional import require
from curvematch_jax.surface import Mesh, MeshError
from curvematch_jax.surface._features import feature_points
from curvematch_jax.surface._fields import Geodesics
from curvematch_jax.surface._topology import face_areas

# Where a bridge ends, in geodesic diameters from a feature point: off the tip, which is still there then.
_FROM_TIP = (0.08, 0.12)
# How far away the other end is at least, on the surface.
_FAR = 0.35


def with_short_cut(mesh: Mesh, width: float) -> tuple[Mesh, float]:
    """Join a limb to what it nearly touches by a straight round bridge, `width` thick in square roots of the area.

    Each feature point's surroundings come nearest to the rest of the surface somewhere. Of these places the one
    where a bridge makes the way shortest, for what it is on the surface, gets one. A bridge that meets anything on its
    way is not taken.

    Args:
        mesh: a closed connected surface.

    Returns:
        the boolean union, and how many times shorter the bridge is than the way on the surface.

    Raises:
        MeshError: there is no such place.
    """
    size = float(np.sqrt(face_areas(mesh.vertices, mesh.faces).sum()))
    edge = float(np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1).mean())
    body = _solid(mesh)
    for gain, start, end in sorted(_candidates(mesh), reverse=True):
        joined = body + _capsule(mesh.vertices[[start, end]], width * size / 2, edge)
        if joined.genus() == body.genus() + 1 and len(joined.decompose()) == 1:
            made = joined.to_mesh64()
            faces = np.array(made.tri_verts, dtype=np.int64)
            return Mesh(np.array(made.vert_properties[:, :3]), faces, mesh.name), gain
    raise MeshError(f"{mesh.name}: no place for a bridge")


def _candidates(mesh: Mesh) -> Iterator[tuple[float, int, int]]:
    """For each feature point where the surface near it comes nearest to what is far, and what a bridge would save."""
    geodesics = Geodesics(mesh)
    features = feature_points(mesh, geodesics, 0.05)
    low, high, far = (share * features.diameter for share in (*_FROM_TIP, _FAR))
    for tip in features.vertices.tolist():
        near = np.flatnonzero((geodesics(tip) >= low) & (geodesics(tip) <= high))
        away = np.flatnonzero(geodesics(tip) >= far)
        apart, place = map(np.asarray, KDTree(mesh.vertices[away]).query(mesh.vertices[near]))
        nearest = np.argmin(apart)
        start, end = int(near[nearest]), int(away[place[nearest]])
        yield float(geodesics(start)[end] / apart[nearest]), start, end


def _solid(mesh: Mesh):
    manifold3d = require("manifold3d", "prep", "joining two solids")
    return manifold3d.Manifold(manifold3d.Mesh64(np.array(mesh.vertices), mesh.faces.astype(np.uint64)))


def _capsule(ends: np.ndarray, radius: float, edge: float):
    """The convex hull of two balls, with triangles about as large as the surface's."""
    manifold3d = require("manifold3d", "prep", "joining two solids")
    ball = manifold3d.Manifold.sphere(radius, 8)
    return manifold3d.Manifold.batch_hull([ball.translate(end) for end in ends]).refine_to_length(edge)
