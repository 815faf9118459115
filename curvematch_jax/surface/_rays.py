"""Where rays meet triangles: all rays from the origin, or a grid of parallel ones. Exact, and without a library."""

import numpy as np
from scipy.spatial import KDTree

from ._topology import cross

_SLACK = 1e-9  # rays along an edge meet both of its triangles, and never slip between them


def reach(triangles: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """The farthest intersection of rays from the origin with triangles; 0 where there is none.

    Args:
        triangles: `(f, 3, 3)`, corners in rows.
        directions: `(r, 3)`, of unit length.
    """
    triangle, ray = _in_cones(triangles, directions)
    sides = _sides(triangles)
    shares, whole = _barycentric(sides[triangle], directions[ray])
    met = (shares >= -_SLACK).all(axis=1)
    volume = (triangles[:, 0] * sides[:, 0]).sum(axis=1)
    farthest = np.zeros(len(directions))
    np.maximum.at(farthest, ray[met], volume[triangle[met]] / whole[met])
    return farthest


def depths(triangles: np.ndarray, half: float, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and highest z on lines parallel to it, through the pixels of `[-half, half]^2`.

    Args:
        triangles: `(f, 3, 3)`, corners in rows.

    Returns:
        two images `(pixels, pixels)`, x in rows and y in columns, `inf` and `-inf` where a line meets nothing.
    """
    on_image = (triangles[:, :, :2] + half) * pixels / (2 * half) - 0.5
    triangle, pixel = _in_boxes(on_image, pixels)
    flat = np.insert(on_image, 2, 1.0, axis=2)
    shares, _ = _barycentric(_sides(flat)[triangle], np.insert(pixel.astype(float), 2, 1.0, axis=1))
    met = (shares >= -_SLACK).all(axis=1)
    height = np.einsum("ij,ij->i", shares[met], triangles[triangle[met], :, 2])
    low, high = np.full((pixels, pixels), np.inf), np.full((pixels, pixels), -np.inf)
    np.minimum.at(low, tuple(pixel[met].T), height)
    np.maximum.at(high, tuple(pixel[met].T), height)
    return low, high


def _sides(triangles: np.ndarray) -> np.ndarray:
    """Normals `(f, 3, 3)` of the planes through the origin and the side opposite to each corner."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=1)


def _barycentric(sides: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the whole line of each ray meets its triangle's plane: coordinates `(p, 3)` that sum up to 1.

    Also their common denominator `(p,)`. Rays parallel to the plane get NaN, which compares as outside.

    Args:
        sides: `(p, 3, 3)`, of the triangle of each ray.
    """
    volumes = (sides @ directions[:, :, None])[:, :, 0]
    whole = volumes.sum(axis=1)
    whole = np.where(whole == 0, np.nan, whole)
    return volumes / whole[:, None], whole


def _in_cones(triangles: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles and rays that may meet, as index pairs: the rays in a cone about each triangle."""
    tiny = np.finfo(float).tiny
    outwards = triangles / np.maximum(np.linalg.norm(triangles, axis=2, keepdims=True), tiny)
    middle = outwards.sum(axis=1)
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), tiny)
    cosine = np.einsum("fki,fi->fk", outwards, middle).min(axis=1)
    # A cone below half a space is convex: it holds the triangle with its corners. Otherwise all rays are looked at.
    chord = np.where(cosine > 0, np.sqrt(np.maximum(2 - 2 * cosine, 0)), 2) + _SLACK
    rays = KDTree(directions).query_ball_point(middle, chord)
    return np.repeat(np.arange(len(rays)), [len(found) for found in rays]), np.concatenate(rays).astype(int)


def _in_boxes(triangles: np.ndarray, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles `(f, 3, 2)` and pixels `(p, 2)` that may meet: those in the box about each triangle."""
    first = np.clip(np.ceil(triangles.min(axis=1) - _SLACK), 0, pixels).astype(int)
    last = np.clip(np.floor(triangles.max(axis=1) + _SLACK), -1, pixels - 1).astype(int)
    size = np.maximum(last - first + 1, 0)
    count = size.prod(axis=1)
    triangle = np.repeat(np.arange(len(triangles)), count)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    return triangle, first[triangle] + np.stack(np.divmod(place, size[triangle, 1]), axis=1)
