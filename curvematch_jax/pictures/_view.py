"""Surfaces as a viewer sees them: one view, one light, painted from far to near."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..surface import Mesh

# The view of everything: z up, seen from the front left and a little from above; the light comes with the viewer.
_AZIMUTH, _ELEVATION = np.radians(50.0), np.radians(18.0)
_LIGHT = np.array([-0.35, 0.5, 0.79])
# Grid cells across a tile: about two pixels each in a sheet.
_CELLS = 120


class Frame(NamedTuple):
    """What fills the tile: after `seen`, what the frame was made for lies in [-1, 1] along each axis of the picture."""

    middle: np.ndarray
    half: float

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) along the viewer's axes: right, up, towards the viewer."""
        return (points @ _view().T - self.middle) / self.half


class Painted(NamedTuple):
    """What a surface shows of itself, in the order in which it is painted."""

    corners: np.ndarray  # (t, 3, 3) of the triangles that face the viewer, along the viewer's axes, farthest first
    shades: np.ndarray  # (t,)


def frame_of(points: np.ndarray) -> Frame:
    """The frame that is filled by points (p, 3)."""
    seen = points @ _view().T
    low, high = seen.min(axis=0), seen.max(axis=0)
    return Frame((low + high) / 2, max(float((high - low)[:2].max()) / 2, np.finfo(float).tiny))


def paint(mesh: Mesh, frame: Frame | None = None, cells: int = _CELLS) -> Painted:
    """The faces of a mesh that face the viewer.

    Args:
        frame: by default the mesh fills it.
        cells: vertices that share one of this many cells across the frame are merged.
    """
    frame = frame_of(mesh.vertices) if frame is None else frame
    points, faces = _thinned(frame.seen(mesh.vertices), mesh.faces, cells)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    smooth = np.zeros_like(points)
    for k in range(3):
        np.add.at(smooth, faces[:, k], normals)
    facing = np.flatnonzero(normals[:, 2] > 0)
    order = facing[np.argsort(corners[facing, :, 2].mean(axis=1), kind="stable")]
    return Painted(corners[order], shades(smooth[faces[order]].sum(axis=1)))


def shades(normals: np.ndarray) -> np.ndarray:
    """How light surfaces are (t,) whose outward normals, of any length, are (t, 3) along the viewer's axes."""
    length = np.linalg.norm(normals, axis=1)
    return 0.38 + 0.67 * np.clip(normals @ _LIGHT / np.where(length > 0, length, 1), 0, 1)


def _view() -> np.ndarray:
    """Rotation (3, 3) to the viewer's axes: right, up, towards the viewer."""
    cos_a, sin_a, cos_e, sin_e = np.cos(_AZIMUTH), np.sin(_AZIMUTH), np.cos(_ELEVATION), np.sin(_ELEVATION)
    right = [-sin_a, cos_a, 0]
    up = [-sin_e * cos_a, -sin_e * sin_a, cos_e]
    towards = [cos_e * cos_a, cos_e * sin_a, sin_e]
    return np.array([right, up, towards])


def _thinned(points: np.ndarray, faces: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of [-1, 1] along each axis of the picture, those of one grid cell merged.

    At the size of a thumbnail nothing is lost, and a scan of a million faces draws as fast as any other mesh.
    """
    _, first, cell = np.unique(np.round(points * (cells / 2)), axis=0, return_index=True, return_inverse=True)
    merged = cell.reshape(-1)[faces]
    a, b, c = merged.T
    return points[first], merged[(a != b) & (b != c) & (c != a)]
