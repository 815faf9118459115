"""Where rays meet triangles: all rays from the origin, or a grid of parallel ones. Exact, and without a library."""

import numpy as np

from ._topology import cross

_SLACK = 1e-9  # rays along an edge meet both of its triangles, and never slip between them
_GAP = 1e-7  # radians: an arc cosine next to 1 is good to the root of the last digit


def reach(triangles: np.ndarray, polar: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """The farthest intersection of rays from the origin with triangles, `(p, a)`; 0 where there is none.

    Args:
        triangles: `(f, 3, 3)`, corners in rows.
        polar: `(p,)` angles of the rays with the z axis, `(k + 1/2) pi / p`.
        azimuth: `(a,)` angles around it, `2 pi k / a`.
    """
    rows, columns = np.meshgrid(polar, azimuth, indexing="ij")
    directions = np.stack([np.sin(rows) * np.cos(columns), np.sin(rows) * np.sin(columns), np.cos(rows)], axis=-1)
    triangle, cell = _in_cones(triangles, len(polar), len(azimuth))
    cell[:, 1] %= len(azimuth)
    sides = _sides(triangles)
    shares, whole = _barycentric(sides[triangle], directions[tuple(cell.T)])
    met = (shares >= -_SLACK).all(axis=1)
    volume = (triangles[:, 0] * sides[:, 0]).sum(axis=1)
    farthest = np.zeros(rows.shape)
    np.maximum.at(farthest, tuple(cell[met].T), volume[triangle[met]] / whole[met])
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


def _in_cones(triangles: np.ndarray, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles and rays `(p, 2)` that may meet: those in the angles between which a cone about each triangle is.

    Rows and columns of rays are those of `reach`; columns are counted on beyond the last one.
    """
    tiny = np.finfo(float).tiny
    outwards = triangles / np.maximum(np.linalg.norm(triangles, axis=2, keepdims=True), tiny)
    middle = outwards.sum(axis=1)
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), tiny)
    cosine = np.einsum("fki,fi->fk", outwards, middle).min(axis=1)
    # A cone below half a space is convex: it holds the triangle with its corners. Otherwise all rays are looked at.
    width = np.where(cosine > 0, np.arccos(np.clip(cosine, 0, 1)), np.pi) + _GAP
    polar, azimuth = np.arccos(np.clip(middle[:, 2], -1, 1)), np.arctan2(middle[:, 1], middle[:, 0])
    first = np.clip(np.ceil((polar - width) * rows / np.pi - 0.5), 0, rows).astype(int)
    last = np.clip(np.floor((polar + width) * rows / np.pi - 0.5), -1, rows - 1).astype(int)
    around = (width >= polar) | (width >= np.pi - polar)  # a cone about a pole
    half = np.arcsin(np.where(around, 0, np.sin(width) / np.maximum(np.sin(polar), tiny)).clip(0, 1)) + _GAP
    start = np.where(around, 0, np.ceil((azimuth - half) * columns / (2 * np.pi))).astype(int)
    end = np.where(around, columns - 1, np.floor((azimuth + half) * columns / (2 * np.pi))).astype(int)
    return _cells(np.stack([first, start], axis=1), np.stack([last, end], axis=1))


def _in_boxes(triangles: np.ndarray, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles `(f, 3, 2)` and pixels `(p, 2)` that may meet: those in the box about each triangle."""
    first = np.clip(np.ceil(triangles.min(axis=1) - _SLACK), 0, pixels).astype(int)
    last = np.clip(np.floor(triangles.max(axis=1) + _SLACK), -1, pixels - 1).astype(int)
    return _cells(first, last)


def _cells(first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All cells `(c, 2)` of the rectangles from `first` to `last`, `(f, 2)`, and the rectangle of each, `(c,)`."""
    size = np.maximum(last - first + 1, 0)
    count = size.prod(axis=1)
    box = np.repeat(np.arange(len(first)), count)
    place = np.arange(len(box)) - np.repeat(np.cumsum(count) - count, count)
    return box, first[box] + np.stack(np.divmod(place, size[box, 1]), axis=1)
