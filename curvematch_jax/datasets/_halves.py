"""Halves of models, cut off by a plane, and two of them joined in one closed surface."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._optional import require
from ..surface import Extraction, Mesh, MeshError, clean
from ..surface._features import feature_points
from ..surface._fields import distances_on
from ..surface._topology import face_areas

# Where a model may be cut: with these shares of its area on one side.
_SHARES = (0.36, 0.43, 0.5, 0.57, 0.64)
_LEAST_SHARE = 0.3  # of the area, in the one piece that is kept of a side
_LEAST_TIPS = 0.3  # of the model's tips, on a half
_MOST_SCALE = 1.4  # how much a half may grow or shrink against the other to fit: twice the area
_LEAST_CONTACT = 0.5  # of the smaller cut, that lies on the other
_TURNS = tuple(math.pi / 2 * k for k in range(4))

# In square roots of a model's area.
_BELOW = 1e-4  # from the cut to where its outline is taken
_ON_SURFACE = 1e-3
# In square roots of the smaller cut's area.
_DEPTH = 0.05
# In mean edges of the halves.
_SLIVER, _LONG = 0.01, 3.0


@dataclass(frozen=True, eq=False)
class Half:
    """A piece of a model of area 1, cut off by a plane.

    Attributes:
        solid: in z <= 0; the cut lies in z = 0, its centre is the origin and its longer side along x.
        cut: the outline of the cut, one loop.
        tips: how many of the model's feature points are on the piece.
        axis: along which principal axis of the model it was cut, 0 the longest.
    """

    solid: Any
    cut: Any
    tips: int
    axis: int


def halves(mesh: Mesh) -> list[Half]:
    """The halves of a cleaned mesh that keep enough of it, at most two an axis; the longest axis comes first.

    Planes stand across the principal axes. Of those that leave one closed loop, the one with the smallest is taken
    for each side of each axis: at the waist.

    Raises:
        ImportError: without manifold3d (the extra `prep`).
    """
    points, areas = _normalised(mesh)
    features = feature_points(mesh, distances_on(mesh, Extraction().field), Extraction().epsilon)
    whole = _solid(points, mesh.faces)
    tips = points[features.vertices]
    centres = points[mesh.faces].mean(axis=1)
    found = []
    for axis, along in enumerate(_principal_axes(centres, areas)):
        for direction in (along, -along):
            heights = _quantiles(centres @ direction, areas)
            cuts = (_half(whole, tips, direction, height, axis) for height in heights)
            fair = [half for half in cuts if half is not None]
            if fair:
                found.append(min(fair, key=lambda half: half.cut.area()))
    return found


def join(lower: Half, upper: Half) -> Mesh | None:
    """Both halves in one closed connected surface, cut on cut, or None when they do not fit.

    The second is scaled so that the cuts are of one area, by a factor of 1.4 at most, and turned by the quarter
    turn that brings most of the cuts together.
    """
    motion = _fit(lower.cut, upper.cut)
    if motion is None:
        return None
    facing = upper.solid.transform(motion)
    union = lower.solid + facing
    # Limbs of both that touch elsewhere would close a loop.
    if len(union.decompose()) != 1 or union.genus() != lower.solid.genus() + facing.genus():
        return None
    try:
        return clean(_evened(union))[0]
    except MeshError:
        return None


def _fit(lower: Any, upper: Any) -> np.ndarray | None:
    """The motion (3, 4) that brings the second half upon the first, given their cuts; None when too little meets."""
    scale = min(max(math.sqrt(lower.area() / upper.area()), 1 / _MOST_SCALE), _MOST_SCALE)
    frames = [scale * _facing(turn) for turn in _TURNS]
    contacts = [(lower ^ upper.transform(np.column_stack([frame[:2, :2], [0, 0]]))).area() for frame in frames]
    smaller = min(lower.area(), scale**2 * upper.area())
    if max(contacts) < _LEAST_CONTACT * smaller:
        return None
    return np.column_stack([frames[int(np.argmax(contacts))], [0, 0, -_DEPTH * math.sqrt(smaller)]])


def _normalised(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of a mesh of area 1, and the areas of its faces."""
    areas = face_areas(mesh.vertices, mesh.faces)
    middle = areas @ mesh.vertices[mesh.faces].mean(axis=1) / areas.sum()
    return (mesh.vertices - middle) / math.sqrt(areas.sum()), areas / areas.sum()


def _solid(points: np.ndarray, faces: np.ndarray) -> Any:
    manifold3d = require("manifold3d", "prep", "making composites")
    return manifold3d.Manifold(manifold3d.Mesh64(points, faces.astype(np.uint64)))


def _principal_axes(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The principal axes (d, d) of weighted points, a row each, the longest first; the greatest component positive."""
    centred = points - weights @ points / weights.sum()
    axes = np.linalg.eigh((centred * weights[:, None]).T @ centred)[1].T[::-1]
    greatest = np.take_along_axis(axes, np.abs(axes).argmax(axis=1)[:, None], axis=1)
    return axes * np.sign(greatest)


def _quantiles(heights: np.ndarray, areas: np.ndarray) -> np.ndarray:
    order = np.argsort(heights, kind="stable")
    return np.interp(_SHARES, np.cumsum(areas[order]), heights[order])


def _half(whole: Any, tips: np.ndarray, direction: np.ndarray, height: float, axis: int) -> Half | None:
    """The largest piece below a plane, if it is large, ends in one loop at the plane, and has its share of tips."""
    upright = np.column_stack([_upright(direction), [0, 0, -height]])
    below = whole.transform(upright).trim_by_plane((0, 0, -1), 0).decompose()
    if not below:
        return None
    piece = max(below, key=lambda part: part.surface_area())
    cut = piece.slice(-_BELOW)
    if cut.num_contour() != 1 or piece.surface_area() - cut.area() < _LEAST_SHARE:
        return None
    on_plane = _centred(cut.to_polygons()[0])
    to_surface = KDTree(piece.to_mesh64().vert_properties[:, :3]).query(_moved(upright, tips))[0]
    kept = int((to_surface < _ON_SURFACE).sum())
    if kept < _LEAST_TIPS * len(tips):
        return None
    in_space = np.insert(np.insert(on_plane, 2, 0, axis=1), 2, [0, 0, 1, 0], axis=0)
    return Half(piece.transform(in_space), cut.transform(on_plane), kept, axis)


def _upright(direction: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) that turns a unit vector upwards."""
    across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(direction, across), direction])


def _centred(polygon: np.ndarray) -> np.ndarray:
    """The motion (2, 3) that brings the centre of a polygon's outline to the origin, its longer side along x."""
    following = np.roll(polygon, -1, axis=0)
    middles, lengths = (polygon + following) / 2, np.linalg.norm(following - polygon, axis=1)
    axes = _principal_axes(middles, lengths)
    axes[1] *= np.linalg.det(axes)
    return np.column_stack([axes, -axes @ (lengths @ middles / lengths.sum())])


def _facing(turn: float) -> np.ndarray:
    """The rotation (3, 3) that turns a half upside down, and then about the upright."""
    cos, sin = math.cos(turn), math.sin(turn)
    return np.array([[cos, sin, 0], [sin, -cos, 0], [0, 0, -1]])


def _moved(motion: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ motion[:, :-1].T + motion[:, -1]


def _evened(union: Any) -> Mesh:
    """The union without slivers where the surfaces met, and the flat ledges of larger cuts in smaller triangles."""
    edge = math.sqrt(union.surface_area() / union.num_tri() * 4 / math.sqrt(3))
    even = union.simplify(_SLIVER * edge).refine_to_length(_LONG * edge).to_mesh64()
    return Mesh(even.vert_properties[:, :3], even.tri_verts.astype(np.int64))
