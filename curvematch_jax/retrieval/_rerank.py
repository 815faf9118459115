"""Re-ranking: what is near to the neighbours of two objects says more than the two alone."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.sparse import csr_array

from ._collection import Collection
from ._matrix_file import refuse_saved
from ._ranking import Ranking, mutual_among

# Objects of a ranking that are put in another order.
RERANKED = 50
# Share of what the neighbours say, beside what the affinities themselves say.
_NEIGHBOURS = 0.8
_STEPS = 32  # 0.8^32 < 1e-3


def rerank(dissimilarity: np.ndarray, k: int = 8) -> np.ndarray:
    """Dissimilarities after diffusion on the graph of mutual nearest neighbours.

    With `d` the symmetric part of the matrix and `s_i` the distance of object i to its k-th neighbour,
    `A_ij = exp(-d_ij / sqrt(s_i s_j))` (L. Zelnik-Manor, P. Perona, "Self-tuning spectral clustering", NIPS 2004). P
    has the affinities of each object to itself and to its mutual neighbours, those among its k nearest that have it
    among theirs, as shares of their sum. B is the fixed point of

        B = .8 P B P^T + .2 A,    1 - B is the result

    (regularised diffusion: S. Bai et al., PAMI 2019, with A in place of the identity). It is transductive: an object
    that joins or leaves changes the others' dissimilarities, and what it brings depends on the classes being larger
    than about k. Report its figures apart.

    Args:
        dissimilarity: (M, M), as `dissimilarity_matrix` makes it.
        k: neighbours of an object; of smaller collections all.

    Returns:
        (M, M), symmetric, in [0, 1], 0 on the diagonal.

    Raises:
        ValueError: when the matrix is not square and finite, or `k` is not 1 or more.
    """
    refuse_saved("dissimilarity", dissimilarity)
    matrix = np.asarray(dissimilarity, np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not np.isfinite(matrix).all():
        raise ValueError(f"re-ranking needs a square matrix of finite values, found shape {matrix.shape}")
    if not isinstance(k, int) or k < 1:
        raise ValueError(f"k must be a whole number, 1 or more, found {k!r}")
    if len(matrix) < 2:
        return np.zeros_like(matrix)
    affinity, mutual = _affinities(matrix, min(k, len(matrix) - 1))
    step = csr_array(np.where(mutual, affinity, 0))
    step = csr_array(step / step.sum(axis=1)[:, None])
    found = affinity
    for _ in range(_STEPS):
        found = _NEIGHBOURS * (step @ (step @ found).T) + (1 - _NEIGHBOURS) * affinity
    found = 1.0 - (found + found.T) / 2
    np.fill_diagonal(found, 0.0)
    return np.clip(found, 0.0, 1.0)


def _affinities(matrix: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
    """A, and which objects are each other's neighbours, or the same; both (M, M)."""
    apart = (matrix + matrix.T) / 2
    apart -= apart.min()
    np.fill_diagonal(apart, -1.0)  # An object is its own nearest, before any twin.
    nearest = np.argsort(apart, axis=1, kind="stable")[:, : k + 1]
    np.fill_diagonal(apart, 0.0)
    reach = np.maximum(np.take_along_axis(apart, nearest[:, -1:], axis=1), np.finfo(np.float64).tiny)
    near = np.zeros(matrix.shape, bool)
    np.put_along_axis(near, nearest, True, axis=1)
    with np.errstate(over="ignore"):  # of twins, whose reach is 0, from all others
        return np.exp(-apart / (np.sqrt(reach) * np.sqrt(reach.T))), near & near.T


def reranked(collection: Collection, ranking: Ranking, k: int = 8) -> Ranking:
    """A ranking whose first 50 objects are in the order of `rerank` among themselves and the query.

    Everything but the order stays as it was.

    Args:
        collection: that was ranked, with a cohort.
        ranking: the first 50 of its order are exact: `rank(query, collection, top=50)`, or more.

    Raises:
        ValueError: when the collection has no cohort: one-way dissimilarities of different objects do not compare.
    """
    if collection.cohort is None:
        raise ValueError('re-ranking needs symmetric dissimilarities: a matching with fusion = "cohort"')
    first = np.sort(ranking.order[:RERANKED])
    matrix = np.zeros((len(first) + 1, len(first) + 1))
    matrix[1:, 1:] = mutual_among(collection, first)
    matrix[0, 1:] = matrix[1:, 0] = ranking.dissimilarity[first]
    order = first[np.argsort(rerank(matrix, k)[0, 1:], kind="stable")]
    return dataclasses.replace(ranking, order=np.concatenate([order, ranking.order[RERANKED:]]))
