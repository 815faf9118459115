"""Surfaces and level curves, small enough for a page: decimated, and quantised to 16 bits."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial import KDTree

from ..pictures._strokes import strokes
from ..surface import Mesh, Parts
from ..surface._prep import decimate
from ._packed import packed

# Every third level curve is drawn on a mesh, and every fourth of its samples; without a mesh every curve.
_LEVEL_STEP, _SAMPLE_STEP = 3, 4
_STEPS = 65535


def packed_surface(parts: Parts | None, mesh: Mesh | None, vertices: int) -> dict[str, object]:
    """What a page needs to draw an object.

    Positions are whole numbers from 0 to 65,535 along each axis of the cube that holds the object.

    Args:
        parts: of which level curves are drawn, each where its feature point is the nearest.
        mesh: the surface, in the units of `parts`.
        vertices: larger surfaces are decimated to about so many.

    Raises:
        ImportError: for a surface that needs decimation, without the extra `prep`.
    """
    points, faces = _decimated(mesh, vertices)
    pieces, owners, features = _curves(parts, _LEVEL_STEP if mesh is not None else 1)
    everything = np.concatenate([points, pieces.reshape(-1, 3), features])
    low = everything.min(axis=0) if len(everything) else np.zeros(3)
    extent = np.ptp(everything, axis=0) if len(everything) else np.ones(3)
    side = float(extent.max()) or 1.0
    offset = (1 - extent / side) / 2  # The object in the middle of its cube.

    def quantised(positions: np.ndarray) -> str:
        unit = (positions - low) / side + offset
        return packed(np.clip(unit * _STEPS, 0, _STEPS).round(), "u2")

    return {
        "vertices": quantised(points),
        "faces": packed(faces, "u2"),
        "part": packed(_nearest_part(points, pieces, owners), "u1"),
        "curves": quantised(pieces),
        "curvePart": packed(np.minimum(owners, 254), "u1"),
        "points": quantised(features),
    }


def _decimated(mesh: Mesh | None, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    if mesh is None:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    points, faces = mesh.vertices, mesh.faces
    if len(points) > vertices:
        points, faces = decimate(points, faces, vertices)
    used, faces = np.unique(faces, return_inverse=True)
    points, faces = points[used], faces.reshape(-1, 3)
    # Decimation may stop early, at holes and seams; indices have 16 bits.
    kept = (faces <= _STEPS).all(axis=1)
    return points[: _STEPS + 1], faces[kept]


def _curves(parts: Parts | None, level_step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of pieces of level curves (s, 2, 3), the part of each (s,), and the feature points (P, 3)."""
    if parts is None or not len(parts.areas):
        return np.zeros((0, 2, 3)), np.zeros(0, int), np.zeros((0, 3))
    drawn = np.arange(parts.mask.shape[1]) % level_step == 0
    thinned = dataclasses.replace(parts, curves=parts.curves[..., ::_SAMPLE_STEP], mask=parts.mask & drawn)
    found = strokes(thinned)
    own = found.beyond <= 0
    return found.outer[own], found.part[own], parts.points.astype(float)


def _nearest_part(points: np.ndarray, pieces: np.ndarray, owners: np.ndarray) -> np.ndarray:
    """The part (n,) whose curve is the nearest to each point; 255 where there are none."""
    if not len(points) or not len(pieces):
        return np.full(len(points), 255)
    _, nearest = KDTree(pieces[:, 0]).query(points)
    return np.minimum(owners[nearest], 254)
