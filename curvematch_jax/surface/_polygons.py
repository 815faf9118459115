"""Polygons to triangles: fans of convex ones, ears of the others."""

import numpy as np

# Of the area: corners that turn the wrong way by less are rounding.
_STRAIGHT = 1e-9


def triangulated(points: np.ndarray, polygons: list[list[int]]) -> np.ndarray:
    """Triangles `(f, 3)` that cover the polygons, in their order; those of fewer than three corners are skipped.

    A convex polygon becomes a fan around its first corner. Any other is cut inside itself, as it is seen along its
    normal (the earcut algorithm), unless it names vertices that do not exist, has no area or crosses itself: then a fan
    is as good as anything.

    Args:
        points: `(v, 3)`.
        polygons: vertex numbers of each polygon's corners in order.
    """
    size = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    count = np.maximum(size - 2, 0)
    first = np.cumsum(count) - count
    triangles = np.zeros((int(count.sum()), 3), dtype=np.int64)
    for corners in np.unique(size[size >= 3]).tolist():
        rows = np.flatnonzero(size == corners)
        given = np.array([polygons[row] for row in rows], dtype=np.int64)
        fans = np.stack([np.stack([given[:, 0], given[:, k], given[:, k + 1]], axis=1) for k in range(1, corners - 1)])
        triangles[first[rows] + np.arange(corners - 2)[:, None]] = fans
        for row in _concave(points, given) if corners > 3 else ():
            start = first[rows[row]]
            triangles[start : start + corners - 2] = _cut(points, given[row], triangles[start : start + corners - 2])
    return triangles


def _concave(points: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Which of the polygons `(k, n)` have a corner that turns the wrong way round."""
    inside = np.flatnonzero(((polygons >= 0) & (polygons < len(points))).all(axis=1))
    with np.errstate(all="ignore"):
        corners = points[polygons[inside]] - points[polygons[inside, :1]]
        ahead = np.roll(corners, -1, axis=1)
        normal = np.cross(corners, ahead).sum(axis=1)
        area = np.linalg.norm(normal, axis=1)
        turns = np.cross(ahead - corners, np.roll(corners, -2, axis=1) - ahead)
        wrong = (turns * normal[:, None]).sum(axis=2) < -_STRAIGHT * area[:, None] ** 2
    return inside[wrong.any(axis=1) & np.isfinite(area) & (area > 0)]


def _cut(points: np.ndarray, polygon: np.ndarray, fan: np.ndarray) -> np.ndarray:
    from mapbox_earcut import triangulate_float64

    corners = points[polygon] - points[polygon[0]]
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    across = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(across, normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    v /= np.linalg.norm(v)
    flat = corners @ np.stack([u, v], axis=1)
    # Corners on straight sides come later: rounding makes needles of them.
    bend = np.abs(_cross(np.roll(flat, 1, axis=0) - flat, np.roll(flat, -1, axis=0) - flat))
    kept = np.flatnonzero(bend > _STRAIGHT * np.linalg.norm(normal))
    ears = triangulate_float64(np.ascontiguousarray(flat[kept]), np.array([len(kept)], dtype=np.uint32))
    found = kept[np.asarray(ears, dtype=np.int64)].reshape(-1, 3)
    a, b, c = (flat[found[:, k]] for k in range(3))
    turned = _cross(b - a, c - a).sum() < 0
    triangles = _with_all(found[:, ::-1] if turned else found, len(polygon))
    return fan if len(triangles) != len(fan) else polygon[triangles]


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def _with_all(triangles: np.ndarray, count: int) -> np.ndarray:
    """Triangles of the corners of a polygon, with those corners put in that were left out on straight sides."""
    there = np.isin(np.arange(count), triangles)
    found = triangles.tolist()
    for corner in np.flatnonzero(~there).tolist():
        before, after = (corner - 1) % count, (corner + 1) % count
        while not there[before]:
            before = (before - 1) % count
        while not there[after]:
            after = (after + 1) % count
        for k, (a, b, c) in enumerate(found):
            apex = {(a, b): c, (b, c): a, (c, a): b}.get((before, after))
            if apex is not None:
                found[k : k + 1] = [[before, corner, apex], [corner, after, apex]]
                there[corner] = True
                break
    return np.array(found, dtype=np.int64).reshape(-1, 3)
