"""How far a surface is from another: what `clean` did to the shape that was given."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from ._topology import compact, face_areas, signed_volume

_SAMPLES, _DENSE = 2000, 20_000  # points whose distance to the other surface is looked for, and points on that one
_NEAREST = 8  # points of the other surface whose faces are looked at
# Steps of an even sequence in the unit square (Roberts: the reciprocals of the plastic number and of its square).
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


class Shape(NamedTuple):
    """What is compared of a surface, in its own units."""

    area: float
    volume: float | None  # None for an open surface
    extents: tuple[float, float, float]  # of its box along the axes


def shape_of(vertices: np.ndarray, faces: np.ndarray, closed: bool) -> Shape:
    """The shape of a surface in one or more oriented pieces."""
    x, y, z = np.ptp(compact(vertices, faces)[0], axis=0).tolist()
    area = float(face_areas(vertices, faces).sum())
    return Shape(area, abs(signed_volume(vertices, faces)) if closed else None, (x, y, z))


def hausdorff(before: tuple[np.ndarray, np.ndarray], after: tuple[np.ndarray, np.ndarray]) -> float:
    """The largest distance from a point of one surface to the other, found on some thousands of points of each."""
    return max(_farthest(before, after), _farthest(after, before))


def _farthest(source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray]) -> float:
    from trimesh.triangles import closest_point

    points = np.concatenate([_samples(*source, _SAMPLES)[0], source[0][:: max(len(source[0]) // _SAMPLES, 1)]])
    dense, owner = _samples(*target, _DENSE)
    corners = target[0][target[1]]
    tree = KDTree(np.concatenate([dense, corners.mean(axis=1)]))
    _, near = tree.query(points, k=_NEAREST)
    near = np.concatenate([owner, np.arange(len(corners))])[near]
    repeated = np.repeat(points, _NEAREST, axis=0)
    with np.errstate(all="ignore"):  # faces without area
        found = np.linalg.norm(closest_point(corners[near.ravel()], repeated) - repeated, axis=1)
    ends = np.linalg.norm(corners[near.ravel(), 0] - repeated, axis=1)
    return float(np.where(np.isfinite(found), found, ends).reshape(near.shape).min(axis=1).max())


def _samples(vertices: np.ndarray, faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly over a surface, always the same, and the face of each."""
    reached = np.cumsum(face_areas(vertices, faces))
    number = np.arange(count)
    face = np.searchsorted(reached, (number + 0.5) / count * reached[-1]).clip(max=len(faces) - 1)
    share = (number[:, None] * _STEPS) % 1
    share = np.where(share.sum(axis=1, keepdims=True) > 1, 1 - share, share)
    a, b, c = (vertices[faces[face, k]] for k in range(3))
    return a + share[:, :1] * (b - a) + share[:, 1:] * (c - a), face
