"""Where rays meet triangles: all rays from the origin, or a grid of parallel ones. Exact, and without a library."""

from collections.abc import Iterator

import numpy as np

from ._topology import cross, norms

_MOST_CELLS = 2**17  # rays of some triangles that are looked at together
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
    directions = np.stack([np.sin(rows) * np.cos(columns), np.sin(rows) * np.sin(columns), np.cos(rows)])
    sides = _sides(triangles)
    volume = (triangles[:, 0] * sides[0].T).sum(axis=1)
    farthest = np.zeros(rows.shape)
    for triangle, row, column in _in_cones(triangles, len(polar), len(azimuth)):
        column %= len(azimuth)
        _, whole, met = _barycentric(sides, triangle, directions[:, row, column])
        np.maximum.at(farthest, (row[met], column[met]), volume[triangle[met]] / whole[met])
    return farthest


def depths(triangles: np.ndarray, half: float, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and highest z on lines parallel to it, through the pixels of `[-half, half]^2`.

    Args:
        triangles: `(f, 3, 3)`, corners in rows.

    Returns:
        two images `(pixels, pixels)`, x in rows and y in columns, `inf` and `-inf` where a line meets nothing.
    """
    on_image = (triangles[:, :, :2] + half) * pixels / (2 * half) - 0.5
    sides = _sides(np.concatenate([on_image, np.ones_like(on_image[..., :1])], axis=2))
    heights = np.ascontiguousarray(triangles[:, :, 2].T)
    low, high = np.full((pixels, pixels), np.inf), np.full((pixels, pixels), -np.inf)
    for triangle, row, column in _in_boxes(on_image, pixels):
        shares, _, met = _barycentric(sides, triangle, np.stack([row, column, np.ones(len(row))]))
        height = (shares[:, met] * heights[:, triangle[met]]).sum(axis=0)
        np.minimum.at(low, (row[met], column[met]), height)
        np.maximum.at(high, (row[met], column[met]), height)
    return low, high


def _sides(triangles: np.ndarray) -> np.ndarray:
    """Normals `(3, 3, f)` of the planes through the origin and the side opposite to each corner; corners first."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.stack([np.ascontiguousarray(cross(*side).T) for side in ((b, c), (c, a), (a, b))])


def _barycentric(
    sides: np.ndarray, triangle: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the whole line of each ray meets its triangle's plane: coordinates `(3, p)` that sum up to 1.

    Also their common denominator `(p,)`, and whether that is inside of the triangle. Rays parallel to the plane get
    NaN, and are outside.

    Args:
        triangle: `(p,)`, the number of each ray's triangle.
        directions: `(3, p)`.
    """
    volumes = np.stack([sum(normal[i][triangle] * directions[i] for i in range(3)) for normal in sides])
    whole = volumes[0] + volumes[1] + volumes[2]
    whole = np.where(whole == 0, np.nan, whole)
    shares = volumes / whole
    return shares, whole, (shares[0] >= -_SLACK) & (shares[1] >= -_SLACK) & (shares[2] >= -_SLACK)


def _in_cones(triangles: np.ndarray, rows: int, columns: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Triangles, and rows and columns of rays that may meet them: between the angles of a cone about each triangle.

    Rows and columns of rays are those of `reach`; columns are counted on beyond the last one.
    """
    tiny = np.finfo(float).tiny
    outwards = [corner / np.maximum(norms(corner), tiny)[:, None] for corner in np.moveaxis(triangles, 1, 0)]
    middle = outwards[0] + outwards[1] + outwards[2]
    middle /= np.maximum(norms(middle), tiny)[:, None]
    cosine = np.minimum.reduce([np.einsum("fi,fi->f", corner, middle) for corner in outwards])
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


def _in_boxes(triangles: np.ndarray, pixels: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Triangles of `(f, 3, 2)`, and rows and columns of pixels that may be inside: those in the box about each."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    first = np.clip(np.ceil(low - _SLACK), 0, pixels).astype(int)
    last = np.clip(np.floor(high + _SLACK), -1, pixels - 1).astype(int)
    return _cells(first, last)


def _cells(first: np.ndarray, last: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The cells of the rectangles from `first` to `last`, `(f, 2)`: the rectangle, row and column of each, `(c,)`.

    In blocks of some rectangles, so that memory stays bounded where large triangles hide behind each other.
    """
    size = np.maximum(last - first + 1, 0)
    before = np.concatenate([[0], np.cumsum(size[:, 0] * size[:, 1])])
    start = 0
    while start < len(size):
        stop = max(start + 1, int(np.searchsorted(before, before[start] + _MOST_CELLS, side="right")) - 1)
        box = np.repeat(np.arange(start, stop), np.diff(before[start : stop + 1]))
        row, column = np.divmod(np.arange(len(box)) + before[start] - before[box], size[box, 1])
        yield box, first[box, 0] + row, first[box, 1] + column
        start = stop
