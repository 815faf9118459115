"""Better triangles on flat pieces of a surface, which stays exactly as it is."""

import numpy as np

from ._topology import cross, edges, face_areas, label_components, neighbour_pairs, norms

_ROUNDS = 60
_COPLANAR = 1e-6  # radians between the normals of two faces of one flat piece
_NO_AREA = 1e-9  # area over squared longest edge: such a face is flat with each of its neighbours
_BASE = 2**31  # more than there are vertices
_TOLERANCE = 1e-9  # of the sine of the two angles opposite to an edge


def flat_pieces(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """For each face of an oriented surface the number of its flat piece, or -1 for a face that has no area."""
    normal, empty = _normals(vertices, faces)
    _, pairs = neighbour_pairs(faces, edges(faces))
    one, other = normal[pairs[:, 0]], normal[pairs[:, 1]]
    level = (norms(cross(one, other)) < _COPLANAR) & (_dot(one, other) > 0)
    level &= ~empty[pairs].any(axis=1)
    _, piece = label_components(len(faces), pairs[level])
    return np.where(empty, -1, piece)


def _normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = (vertices[corner] for corner in faces.T)
    normal = cross(b - a, c - a)
    size = norms(normal)
    longest = np.maximum.reduce([_dot(side, side) for side in (b - a, c - b, a - c)])
    return normal / np.maximum(size, 1e-300)[:, None], size <= 2 * _NO_AREA * longest


def flip_edges(vertices: np.ndarray, faces: np.ndarray, piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exchange diagonals until flat pieces are Delaunay triangulations between their own borders.

    Args:
        piece: `(f,)` of `flat_pieces`: faces are changed inside a piece, and those without area with any neighbour.

    Returns:
        the faces and their pieces.
    """
    alone = (np.bincount(piece + 1) == 1)[piece + 1] & (piece >= 0)
    touched = np.zeros(len(vertices), dtype=bool)
    touched[faces[piece < 0].ravel()] = True
    active = np.flatnonzero(~alone | touched[faces].any(axis=1))
    if not len(active):
        return faces, piece
    faces, piece = faces.copy(), piece.copy()
    here, number = faces[active], piece[active]
    rest = _keys(*edges(np.delete(faces, active, axis=0)).ends.T) if len(active) < len(faces) else active[:0]
    for _ in range(_ROUNDS):
        if not _flip_once(vertices, here, number, rest):
            break
    faces[active], piece[active] = here, number
    return faces, piece


def _keys(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """A number for each pair of vertices, ascending for the ends of a table of edges."""
    return np.minimum(one, other) * _BASE + np.maximum(one, other)


def _among(values: np.ndarray, ascending: np.ndarray) -> np.ndarray:
    """Which values are among others that are sorted."""
    return np.searchsorted(ascending, values, side="left") < np.searchsorted(ascending, values, side="right")


def _flip_once(vertices: np.ndarray, faces: np.ndarray, piece: np.ndarray, rest: np.ndarray) -> bool:
    """Flip edges that have no face in common, worst first, in place; False when there are none to flip."""
    table = edges(faces)
    halfedges, pairs = neighbour_pairs(faces, table)
    corner, face = np.divmod(halfedges, len(faces))
    a, b = faces[face[:, 0], corner[:, 0]], faces[face[:, 0], (corner[:, 0] + 1) % 3]
    c, d = (faces[face[:, k], (corner[:, k] + 2) % 3] for k in range(2))
    group = piece[pairs]
    free = (group[:, 0] == group[:, 1]) | (group[:, 0] < 0) | (group[:, 1] < 0)
    sine = np.ones(len(free))
    sine[free] = _sine_of_opposite_angles(vertices, a[free], b[free], c[free], d[free])
    wanted = np.flatnonzero((sine < -_TOLERANCE) & (c != d))
    key = _keys(c, d)
    wanted = wanted[~_among(key[wanted], _keys(*table.ends.T)) & ~_among(key[wanted], rest)]
    if not len(wanted):
        return False
    chosen = wanted[_apart(sine[wanted], pairs[wanted], len(faces))]
    _, first = np.unique(key[chosen], return_index=True)
    chosen = chosen[first]
    one, other = pairs[chosen].T
    faces[one] = np.stack([a[chosen], d[chosen], c[chosen]], axis=1)
    faces[other] = np.stack([d[chosen], b[chosen], c[chosen]], axis=1)
    piece[one] = piece[other] = group[chosen].max(axis=1)
    empty = face_areas(vertices, faces[np.r_[one, other]]) == 0
    piece[np.r_[one, other][empty]] = -1
    return True


def _sine_of_opposite_angles(
    vertices: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray
) -> np.ndarray:
    """Sine of the sum of the angles at c and d: negative where the edge from a to b is not Delaunay."""
    u, v, w, z = (vertices[one] - vertices[other] for one, other in ((a, c), (b, c), (a, d), (b, d)))
    total = _dot(u, v) * norms(cross(w, z)) + norms(cross(u, v)) * _dot(w, z)
    return total / np.maximum(norms(u) * norms(v) * norms(w) * norms(z), 1e-300)


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    (a, b, c), (x, y, z) = one.T, other.T
    return a * x + b * y + c * z


def _apart(score: np.ndarray, pairs: np.ndarray, count: int) -> np.ndarray:
    """Of pairs of faces those of the lowest score at both of their faces."""
    rank = np.empty(len(score), dtype=np.int64)
    rank[np.argsort(score, kind="stable")] = np.arange(len(score))
    best = np.full(count, len(score))
    np.minimum.at(best, pairs[:, 0], rank)
    np.minimum.at(best, pairs[:, 1], rank)
    return np.flatnonzero((best[pairs] == rank[:, None]).all(axis=1))
