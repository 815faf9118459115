"""A graph on the vertices of a surface: edges, and straight lines over faces, with shortest ways close to geodesics."""

from typing import Any

import numpy as np
import scipy.sparse as sp

from ._mesh import Mesh
from ._topology import edges, neighbour_pairs

# Windows narrower than this are not looked through: ways between lines that are so much apart are 1 % too long at most.
_NARROWEST = 0.2  # radians
_DEPTH = 256  # edges that a straight line crosses at most


def shortcut_graph(mesh: Mesh) -> sp.csr_matrix:
    """Lengths of the edges of a mesh, and of the straight lines from a vertex to those a few faces away.

    Around a vertex the faces are unfolded into the plane, edge by edge, and each further vertex that is seen through
    the edges in between is joined to it by a straight line (as in Mitchell, Mount, Papadimitriou: The discrete geodesic
    problem, SIAM J. Comput. 16(4), 1987, with windows that end after a few faces). Ways in this graph are ways on the
    surface, so they are never shorter than geodesics; since there are some thirty directions at a vertex instead of
    six, they are only little longer.

    Args:
        mesh: an oriented manifold, with or without boundary.
    """
    table = edges(mesh.faces)
    length = np.linalg.norm(mesh.vertices[table.ends[:, 0]] - mesh.vertices[table.ends[:, 1]], axis=1)
    found = [(table.ends[:, 0], table.ends[:, 1], length)]
    found += _lines(mesh.faces, length[table.of_halfedge], _opposite(mesh.faces))
    start, end, along = (np.concatenate(column) for column in zip(*found, strict=True))
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((along, high, low))
    low, high, along = low[order], high[order], along[order]
    first = np.flatnonzero(np.r_[True, (low[1:] != low[:-1]) | (high[1:] != high[:-1])])
    count = len(mesh.vertices)
    half = sp.coo_matrix((along[first], (low[first], high[first])), shape=(count, count)).tocsr()
    return half + half.T


def _opposite(faces: np.ndarray) -> np.ndarray:
    """For each half-edge the one on the other side of its edge, -1 where there is none."""
    halfedges, _ = neighbour_pairs(faces, edges(faces))
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
    a = length + 0j
    b = _apex(a, 0j, length[after], length[after[after]])
    # The source, where the line began (one that comes back there is no shortest way), the window, its ends and view.
    state: tuple[Any, ...] = (tail, after, after, a, b, a, b)
    found = []
    for _ in range(_DEPTH):
        keep = (opposite[state[2]] >= 0) & _wide(*state[5:])
        source, begun, window, a, b, low, high = (x[keep] for x in state)
        if not len(source):
            break
        across = opposite[window]
        first, second = after[across], after[after[across]]  # from A to the new vertex, and from it to B
        w = _apex(a, b, length[first], length[second])
        right, left = _cross(low, w) > 0, _cross(w, high) > 0
        seen = right & left
        found.append((source[seen], tail[second[seen]], np.abs(w[seen])))
        # Through the edge from A to the new vertex goes what is seen to the right of that vertex, and so on.
        right &= first != opposite[begun]
        left &= second != opposite[begun]
        ways = (
            (source, begun, first, a, w, low, np.where(seen, w, high)),
            (source, begun, second, w, b, np.where(seen, w, low), high),
        )
        state = tuple(np.concatenate([x[right], y[left]]) for x, y in zip(*ways, strict=True))
    return found


def _wide(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Whether the angle from `low` to `high` is more than the narrowest that is looked into."""
    turn = np.conj(low) * high
    return np.imag(turn) > np.tan(_NARROWEST) * np.maximum(np.real(turn), 0)


def _apex(a: np.ndarray, b: np.ndarray | complex, from_a: np.ndarray, from_b: np.ndarray) -> np.ndarray:
    """The point at these distances from A and B, to the right of the line from A to B."""
    edge = np.maximum(np.abs(b - a), np.finfo(float).tiny)
    x = (edge**2 + (from_a - from_b) * (from_a + from_b)) / (2 * edge)
    y = np.sqrt(np.maximum((from_a - x) * (from_a + x), 0))
    return a + (x - 1j * y) * ((b - a) / edge)


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.imag(np.conj(one) * other)
