"""From capsules to a closed surface: one smooth implicit function, its zero level, evened triangles."""

import itertools as it
from collections.abc import Callable

import numpy as np

from .._optional import require
from ._skeleton import Capsules

# Vertices of a level set on a body-centred grid: area / (_DENSITY * edge**2), measured on a sphere.
_DENSITY = 0.378
# A grid as coarse as this multiple of the smallest half thickness still joins what is joined.
_COARSEST = 1.4
_EVENING_STEPS = 4


def surface(capsules: Capsules, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """The blended union of the capsules as a closed oriented manifold, (v, 3) float64 and (f, 3) int64.

    `vertices` is approximate, and exceeded where thin limbs need it.
    """
    edge = edge_for(capsules, vertices)
    points, faces = level_set(capsules, edge)
    return _evened(capsules, points, faces, step=edge), faces


def edge_for(capsules: Capsules, vertices: int) -> float:
    """The edge of the grid on which the surface has about so many vertices, and holds together."""
    return min(float(np.sqrt(_area(capsules) / (_DENSITY * vertices))), _COARSEST * capsules.thinnest)


def signed_distance(capsules: Capsules, points: np.ndarray, margin: float) -> np.ndarray:
    """Approximate distance of points (p, 3) to the blended union, negative inside; no more than `margin`.

    Capsules join one after the other by the polynomial smooth minimum (Quilez, "smooth minimum"), each with a
    fillet in proportion to its thickness: so a finger does not web with its neighbour.
    """
    value = np.full(len(points), np.inf)
    for start, tip, radii, normal, flat, fillet in zip(
        capsules.starts, capsules.tips, capsules.radii, capsules.normals, capsules.flats, capsules.fillets, strict=True
    ):
        reach = radii.max() + fillet + margin
        low, high = np.minimum(start, tip) - reach, np.maximum(start, tip) + reach
        near = np.flatnonzero(np.all((points >= low) & (points <= high), axis=1))
        new = _capsule(points[near], start, tip, radii, normal, flat)
        value[near] = _smooth_minimum(value[near], new, fillet)
    return np.minimum(value, margin)


def _capsule(
    points: np.ndarray, start: np.ndarray, tip: np.ndarray, radii: np.ndarray, normal: np.ndarray, flat: float
) -> np.ndarray:
    along = tip - start
    from_start = points - start
    share = np.clip(from_start @ along / (along @ along), 0.0, 1.0)
    off_axis = from_start - share[:, None] * along
    if flat != 1.0:
        off_axis = off_axis + (1 / flat - 1) * (off_axis @ normal)[:, None] * normal
    return np.linalg.norm(off_axis, axis=1) - (radii[0] + share * (radii[1] - radii[0]))


def _smooth_minimum(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    overlap = np.maximum(width - np.abs(a - b), 0.0)
    return np.minimum(a, b) - overlap**2 / (4 * width)


def _area(capsules: Capsules) -> float:
    lengths = np.linalg.norm(capsules.tips - capsules.starts, axis=1)
    thickness = capsules.radii.mean(axis=1) * (1 + capsules.flats) / 2
    # Joints, fillets and buried ends take a fifth.
    return float(0.8 * np.sum(2 * np.pi * thickness * (lengths + thickness)))


def level_set(capsules: Capsules, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """manifold3d's level set of the whole grid at once, with the triangles as they come.

    It asks a Python function for one grid point at a time, in a fixed order. So the first pass only notes the
    points, numpy evaluates them all, and the second pass replays the values.
    """
    march: Callable = require("manifold3d", "prep", "generating a creature").Manifold.level_set
    reach = capsules.radii.max(axis=1, keepdims=True) + 2 * edge
    low = np.minimum(capsules.starts, capsules.tips) - reach
    high = np.maximum(capsules.starts, capsules.tips) + reach
    bounds = [*low.min(axis=0), *high.max(axis=0)]
    asked: list[tuple[float, ...]] = []
    # `append` returns None, so every point is noted and counted as outside.
    march(lambda *point: asked.append(point) or -1.0, bounds, edge)
    grid = np.fromiter(it.chain.from_iterable(asked), float, 3 * len(asked)).reshape(-1, 3)
    # manifold3d counts the inside as positive.
    values = iter((-signed_distance(capsules, grid, margin=2 * edge)).tolist())
    mesh = march(lambda *_: next(values), bounds, edge).to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)


def _evened(capsules: Capsules, points: np.ndarray, faces: np.ndarray, step: float) -> np.ndarray:
    """Vertices spread evenly over the surface: each goes towards its neighbours' mean and back to level zero."""
    from scipy.sparse import coo_array

    corner, following = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    # Every edge is met once in each direction, since the surface is closed and oriented.
    ones = np.ones(len(corner))
    neighbours = coo_array((ones, (corner, following)), shape=(len(points), len(points))).tocsr()
    degree = neighbours.sum(axis=1)[:, None]
    for _ in range(_EVENING_STEPS):
        points = points + 0.5 * (neighbours @ points / degree - points)
        points = _projected(capsules, points, step)
    return points


def _projected(capsules: Capsules, points: np.ndarray, step: float) -> np.ndarray:
    """One Newton step towards level zero, no longer than half of `step`."""
    h = 1e-3 * step
    stencil = np.concatenate([points, *(points + h * axis for axis in np.eye(3))])
    value, *shifted = signed_distance(capsules, stencil, margin=np.inf).reshape(4, -1)
    gradient = (np.stack(shifted, axis=1) - value[:, None]) / h
    length = np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 0.1)
    move = np.clip(-value[:, None] / length, -0.5 * step, 0.5 * step)
    return points + move * gradient / length
