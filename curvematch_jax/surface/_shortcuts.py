"""A graph on the vertices of a surface: edges, and straight lines over faces, with shortest ways close to geodesics."""

import numpy as np
import scipy.sparse as sp

from ._mesh import Mesh
from ._refine import edge_lengths
from ._topology import Edges, neighbour_pairs

# Windows are looked through while the tangent of their angle is more than this share of height over length of the face
# behind, within these limits: on even triangles ways along lines that far apart are 1 % too long at most, and among
# needles, where the next vertex may be far to the side, they have to lie closer.
_SHARE, _NARROWEST, _WIDEST = 0.8, 0.1, 0.2
_SHORTEST = 1e-12  # of the other two edges of a face: shorter ones are unfolded as if they were so long
_DEPTH = 256  # edges that a straight line crosses at most


def shortcut_graph(mesh: Mesh) -> sp.csr_matrix:
    """Lengths of the edges of a mesh, and of the straight lines from a vertex to those a few faces away.

    Around a vertex the faces are unfolded into the plane, edge by edge, and each further vertex that is seen through
    the edges in between is joined to it by a straight line (as in Mitchell, Mount, Papadimitriou: The discrete geodesic
    problem, SIAM J. Comput. 16(4), 1987, with windows that end after a few faces). Ways in this graph are ways on the
    surface, so they are never shorter than geodesics; since there are some sixty directions at a vertex instead of six,
    they are only little longer.

    Args:
        mesh: an oriented manifold, with or without boundary.
    """
    table = mesh.edges
    length = edge_lengths(mesh.vertices, table)
    found = [(table.ends[:, 0], table.ends[:, 1], length)]
    found += _lines(mesh.faces, length[table.of_halfedge], _opposite(mesh.faces, table))
    start, end, along = (np.concatenate(column) for column in zip(*found, strict=True))
    count = len(mesh.vertices)
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key)
    key = key[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    low, high = np.divmod(key[first], count)
    shortest = np.minimum.reduceat(along[order], first)
    half = sp.coo_matrix((shortest, (low, high)), shape=(count, count)).tocsr()
    return half + half.T


def _opposite(faces: np.ndarray, table: Edges) -> np.ndarray:
    """For each half-edge the one on the other side of its edge, -1 where there is none."""
    halfedges, _ = neighbour_pairs(faces, table)
    other = np.full(3 * len(faces), -1)
    other[halfedges[:, 0]], other[halfedges[:, 1]] = halfedges[:, 1], halfedges[:, 0]
    return other


def _lines(faces: np.ndarray, length: np.ndarray, opposite: np.ndarray) -> list[tuple[np.ndarray, ...]]:
    """Ends and lengths of the lines that cross 1, 2, ... edges.

    A window is the edge from A to B, in the complex plane where its source vertex is 0 and to the left of it, with the
    directions `low` and `high` between which the source sees something through it.
    """
    size = len(faces)
    corner, face = np.divmod(np.arange(3 * size), size)
    after = (corner + 1) % 3 * size + face  # the half-edge that follows in the same face
    tail = faces.T.ravel()
    a, b, shape = _unfolded(length, length[after], length[after[after]])
    narrowest = _narrowest(shape, opposite)
    # Where the line began (one that comes back there is no shortest way), the window, its ends and view.
    view = _tangent(_cross(a, b), a, b)
    seeing = view > narrowest[after]
    state = tuple(x[seeing] for x in (after, after, a, b, a, b, view))
    source = tail[after[after]]  # of a line that began at a half-edge
    found = []
    for _ in range(_DEPTH):
        begun, window, a, b, low, high, view = state
        if not len(begun):
            break
        across = opposite[window]
        first = after[across]  # from A to the new vertex
        second = after[first]  # from it to B
        w = b + shape[across] * (a - b)
        # Through the edge from A to the new vertex goes what is seen to the right of that vertex, and so on.
        to_right, to_left = _cross(low, w), _cross(w, high)
        right, left = to_right > 0, to_left > 0
        seen = np.flatnonzero(right & left)
        at = w[seen]
        found.append((source[begun[seen]], tail[second[seen]], np.abs(at)))
        # A vertex in view leaves two narrower ones; others leave it as wide as it was.
        lowest, highest, view_right, view_left = low.copy(), high.copy(), view.copy(), view.copy()
        lowest[seen] = highest[seen] = at
        view_right[seen] = _tangent(to_right[seen], low[seen], at)
        view_left[seen] = _tangent(to_left[seen], at, high[seen])
        back = opposite[begun]
        right = np.flatnonzero(right & (view_right > narrowest[first]) & (first != back))
        left = np.flatnonzero(left & (view_left > narrowest[second]) & (second != back))
        ways = (
            (begun, first, a, w, low, highest, view_right),
            (begun, second, w, b, lowest, high, view_left),
        )
        state = tuple(np.concatenate([x[right], y[left]]) for x, y in zip(*ways, strict=True))
    return found


def _narrowest(shape: np.ndarray, opposite: np.ndarray) -> np.ndarray:
    """Tangents of the narrowest angles that each half-edge is looked through at: infinite where no face is behind it.

    Args:
        shape: `(h,)`, of the face of each half-edge the third corner in the plane in which the half-edge is 1 long.
    """
    longest = np.maximum(np.maximum(np.abs(shape), np.abs(shape - 1)), 1)
    behind = np.clip(_SHARE * np.imag(shape) / longest**2, _NARROWEST, _WIDEST)[opposite]
    return np.where(opposite < 0, np.inf, behind)


def _tangent(crossed: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Of the angle from `low` to `high`, whose cross product is given; infinite from a right angle on."""
    along = np.real(low) * np.real(high) + np.imag(low) * np.imag(high)
    return np.where(along > 0, crossed / np.where(along > 0, along, 1), np.where(crossed > 0, np.inf, 0))


def _unfolded(
    edge: np.ndarray, from_head: np.ndarray, from_tail: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles in the complex plane, one edge of each from 0 along the real axis and the third corner to its left.

    Args:
        edge, from_head, from_tail: `(h,)`, lengths of the edge and of what joins its head and its tail to the corner.

    Returns:
        the head of the edge, the corner, and the corner in the plane in which the edge is 1 long; `(h,)`.
    """
    edge = np.maximum(edge, _SHORTEST * (from_head + from_tail) + np.finfo(float).tiny)
    x = (edge**2 + (from_tail - from_head) * (from_tail + from_head)) / (2 * edge)
    x = np.clip(x, -from_tail, from_tail)
    corner = x + 1j * np.sqrt((from_tail - x) * (from_tail + x))
    return edge + 0j, corner, corner / edge


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.real(one) * np.imag(other) - np.imag(one) * np.real(other)
