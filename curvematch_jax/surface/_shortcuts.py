"""A graph on the vertices of a surface: edges, and straight lines over faces, with shortest ways close to geodesics."""

import numpy as np
import scipy.sparse as sp

from ._mesh import Mesh
from ._topology import edges, neighbour_pairs

_DEPTH = 4  # edges that a straight line crosses at most


def shortcut_graph(mesh: Mesh, depth: int = _DEPTH) -> sp.csr_matrix:
    """Lengths of the edges of a mesh, and of the straight lines from a vertex to those a few faces away.

    Around a vertex the faces are unfolded into the plane, edge by edge, and each further vertex that is seen through
    the edges in between is joined to it by a straight line (as in Mitchell, Mount, Papadimitriou: The discrete geodesic
    problem, SIAM J. Comput. 16(4), 1987, with windows that end after a few faces). Ways in this graph are ways on the
    surface, so they are never shorter than geodesics; since there are some thirty directions at a vertex instead of
    six, they are only little longer.

    Args:
        mesh: an oriented manifold, with or without boundary.
        depth: how many edges a line crosses at most; 0 leaves the edges alone.
    """
    table = edges(mesh.faces)
    length = np.linalg.norm(mesh.vertices[table.ends[:, 0]] - mesh.vertices[table.ends[:, 1]], axis=1)
    found = [(table.ends[:, 0], table.ends[:, 1], length)]
    found += _lines(mesh.faces, length[table.of_halfedge], _opposite(mesh.faces), depth)
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


def _lines(
    faces: np.ndarray, length: np.ndarray, opposite: np.ndarray, depth: int
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Ends and lengths of the lines that cross 1, 2, ... edges.

    A window is the edge from A to B, in the plane where its source vertex is the origin and to the left of it, with the
    directions `low` and `high` between which the source sees something through it.
    """
    size = len(faces)
    corner, face = np.divmod(np.arange(3 * size), size)
    after = (corner + 1) % 3 * size + face  # the half-edge that follows in the same face
    tail = faces.T.ravel()
    source = tail
    window = after
    a, b = _corner(length, after[after], np.arange(3 * size), window)
    low, high = a, b
    found = []
    for _ in range(depth):
        inner = opposite[window] >= 0
        source, window, a, b, low, high = (x[inner] for x in (source, window, a, b, low, high))
        across = opposite[window]
        first, second = after[across], after[after[across]]  # from A to the new vertex, and from it to B
        w = _unfolded(a, b, length[first], length[second])
        right, left = _cross(low, w) > 0, _cross(w, high) > 0
        seen = right & left
        found.append((source[seen], tail[second[seen]], np.linalg.norm(w[seen], axis=1)))
        # Through the edge from A to the new vertex goes what is seen to the right of that vertex, and so on.
        source = np.concatenate([source[right], source[left]])
        window = np.concatenate([first[right], second[left]])
        between = seen[:, None]
        a, b, low, high = (
            np.concatenate(pair)
            for pair in (
                (a[right], w[left]),
                (w[right], b[left]),
                (low[right], np.where(between, w, low)[left]),
                (np.where(between, w, high)[right], high[left]),
            )
        )
    return found


def _corner(length: np.ndarray, before: np.ndarray, own: np.ndarray, far: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of the other two corners of a face whose first corner is the origin."""
    one, other, opposite = length[own], length[before], length[far]
    one = np.maximum(one, np.finfo(float).tiny)
    x = (one**2 + other**2 - opposite**2) / (2 * one)
    y = np.sqrt(np.maximum(other**2 - x**2, 0))
    return np.stack([one, np.zeros_like(one)], axis=1), np.stack([x, y], axis=1)


def _unfolded(a: np.ndarray, b: np.ndarray, from_a: np.ndarray, from_b: np.ndarray) -> np.ndarray:
    """The vertex at these distances from A and B, to the right of the line from A to B."""
    along = b - a
    edge = np.maximum(np.linalg.norm(along, axis=1), np.finfo(float).tiny)
    along = along / edge[:, None]
    x = (edge**2 + from_a**2 - from_b**2) / (2 * edge)
    y = np.sqrt(np.maximum(from_a**2 - x**2, 0))
    return a + x[:, None] * along + y[:, None] * np.stack([along[:, 1], -along[:, 0]], axis=1)


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
