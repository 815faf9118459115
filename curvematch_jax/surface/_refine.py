"""More vertices on a surface that stays exactly as it is: long edges are halved until none is longer than asked."""

import numpy as np

from ._flips import flat_pieces, flip_edges
from ._topology import Edges, edges, face_areas, neighbour_pairs, norms

INNER = 1.5  # edges inside of flat pieces may be so much longer: the diagonals of narrow strips stay
# The corners of the faces that replace a face, by its halved edges; 3, 4, 5 are the middles of its edges 01, 12, 20.
_ONE = np.array([[0, 3, 2], [3, 1, 2]])
_TWO = {"01": np.array([[3, 1, 4], [0, 3, 4], [0, 4, 2]]), "10": np.array([[3, 1, 4], [0, 3, 2], [3, 4, 2]])}
_THREE = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


def even_edge(vertices: np.ndarray, faces: np.ndarray, count: int) -> float:
    """Of the edges of `count` vertices that are spread evenly over a closed surface of this area."""
    return float(np.sqrt(face_areas(vertices, faces).sum() / count * 2 / np.sqrt(3)))


def edge_lengths(vertices: np.ndarray, table: Edges) -> np.ndarray:
    """The length of each edge, once."""
    return norms(vertices[table.ends[:, 0]] - vertices[table.ends[:, 1]])


def refine(vertices: np.ndarray, faces: np.ndarray, longest: float, most: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Halve edges until none is longer than `longest`, or inside of flat pieces 1.5 times that; None if that is a lot.

    From twice the longest edge down, edges between flat pieces are halved first, and diagonals inside of the pieces are
    exchanged where that makes better triangles: the long sides of a rod, or a cap cut into a fan, need no more vertices
    than their borders do. Old vertices keep their numbers.

    Args:
        most: how many vertices there may be.
    """
    faces, piece = flip_edges(vertices, faces, flat_pieces(vertices, faces))
    table, length, between = _measured(vertices, faces, piece)
    steps = max(int(np.ceil(np.log2(length.max() / longest))), 0)
    for wanted in longest * 2.0 ** np.arange(steps, -1, -1):
        while (long := _long(length, between, wanted)).any():
            if len(vertices) + long.sum() > most:
                return None
            vertices, faces, parent = halve(vertices, faces, table, long)
            faces, piece = flip_edges(vertices, faces, piece[parent])
            table, length, between = _measured(vertices, faces, piece)
    return vertices, faces


def _measured(vertices: np.ndarray, faces: np.ndarray, piece: np.ndarray) -> tuple[Edges, np.ndarray, np.ndarray]:
    """The edges, their lengths, and whether the faces of each are not of one flat piece."""
    table = edges(faces)
    return table, edge_lengths(vertices, table), _between_pieces(faces, piece, table)


def _long(length: np.ndarray, between: np.ndarray, wanted: float) -> np.ndarray:
    """Which edges are to be halved: those between pieces, and where none of them is left, those inside."""
    long = between & (length > wanted)
    return long if long.any() else length > INNER * wanted


def halve(
    vertices: np.ndarray, faces: np.ndarray, table: Edges, chosen: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Put a new vertex into the middle of each chosen edge, `(e,)` bool, and cut the faces on it.

    Returns:
        vertices, the old ones first; faces; and for each face the old one that it is a piece of.
    """
    middle = np.full(len(chosen), -1)
    middle[chosen] = len(vertices) + np.arange(chosen.sum())
    vertices = np.concatenate([vertices, vertices[table.ends[chosen]].mean(axis=1)])
    faces, parent = _split(vertices, faces, middle[table.of_halfedge].reshape(3, -1).T)
    return vertices, faces, parent


def _between_pieces(faces: np.ndarray, piece: np.ndarray, table: Edges) -> np.ndarray:
    """For each edge whether its faces are not of one flat piece."""
    halfedges, pairs = neighbour_pairs(faces, table)
    inner = (piece[pairs[:, 0]] == piece[pairs[:, 1]]) & (piece[pairs[:, 0]] >= 0)
    border = np.ones(len(table.ends), dtype=bool)
    border[table.of_halfedge[halfedges[inner, 0]]] = False
    return border


def _split(vertices: np.ndarray, faces: np.ndarray, middles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """New faces, and for each the old one that it is a piece of.

    A face whose two longer edges are halved is cut along the shorter diagonal of what is left.

    Args:
        middles: `(f, 3)`, the vertex in the middle of the edge from each corner to the next, -1 where it stays whole.
    """
    halved = middles >= 0
    count = halved.sum(axis=1)
    # Turned so that the first edges are the halved ones.
    first = np.where(
        count == 1, np.argmax(halved, axis=1), np.where(count == 2, (np.argmin(halved, axis=1) + 1) % 3, 0)
    )
    turn = (first[:, None] + np.arange(3)) % 3
    six = np.concatenate([np.take_along_axis(faces, turn, axis=1), np.take_along_axis(middles, turn, axis=1)], axis=1)
    two = six[count == 2]
    across = np.linalg.norm(vertices[two[:, 0]] - vertices[two[:, 4]], axis=1)
    other = np.linalg.norm(vertices[two[:, 3]] - vertices[two[:, 2]], axis=1)
    pieces = [
        faces[count == 0],
        six[count == 1][:, _ONE],
        two[across <= other][:, _TWO["01"]],
        two[across > other][:, _TWO["10"]],
        six[count == 3][:, _THREE],
    ]
    rows = [np.flatnonzero(count == k) for k in range(4)]
    parents = [rows[0], rows[1], rows[2][across <= other], rows[2][across > other], rows[3]]
    parents = [np.repeat(row, times) for row, times in zip(parents, (1, 2, 3, 3, 4), strict=True)]
    return np.concatenate([piece.reshape(-1, 3) for piece in pieces]), np.concatenate(parents)
