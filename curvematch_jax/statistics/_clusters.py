"""k-means in shape space: medoids from the matrix of distances, then Karcher means of the groups."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from .._progress import Progress
from ..elastic import Aligner, distance_matrix
from ._check import as_distances, as_unmirrored, as_whole
from ._mean import Mean, means
from ._sample import as_sample, in_order

_ROUNDS = 20


class Clusters(NamedTuple):
    """Attributes: labels `(k,)`, the centres `(c, d, n)`, distances of each curve to its centre `(k,)`, the mean of
    their squares, and whether labels had stopped changing."""

    labels: np.ndarray
    centres: np.ndarray
    distances: np.ndarray
    inertia: float
    converged: bool


def shape_kmeans(
    curves: ArrayLike | Sequence,
    clusters: int,
    aligner: Aligner | None = None,
    matrix: np.ndarray | None = None,
    progress: Progress = False,
) -> Clusters:
    """Groups of closed curves `(k, d, n)`, each around a Karcher mean.

    k-medoids first, on the matrix of distances: greedy starts, then exchanges while they help (Kaufman and Rousseeuw
    1990). Then means of the groups, and curves to the nearest mean, while labels change. Deterministic; labels are in
    the order of the groups' first members.

    Args:
        clusters: how many.
        aligner: `Aligner.fast()` unless given; `Aligner.accurate()` takes three times as long for all pairs.
        matrix: `distance_matrix(curves)`, where it is known already.
        progress: False, True for a bar on stderr, or a function of (done, total).

    Raises:
        ValueError: as `karcher_mean`, for a matrix that does not fit, and for fewer curves than clusters.
    """
    given = as_sample(curves)
    if as_whole("clusters", clusters, 1) > len(given):
        raise ValueError(f"clusters = {clusters}: {len(given)} curves have 1 to {len(given)}.")
    aligner = as_unmirrored(aligner, Aligner.fast)
    if matrix is None:
        matrix = distance_matrix(given, aligner=aligner, progress=progress)
    matrix = as_distances("matrix", matrix)
    if len(matrix) != len(given):
        raise ValueError(
            f"matrix has shape {matrix.shape}: {len(given)} curves have one of that many rows and columns."
        )
    labels = _labels(matrix, medoids(matrix, clusters, in_order(given)))
    return _moved(given, labels, aligner)


def medoids(matrix: np.ndarray, count: int, order: np.ndarray) -> np.ndarray:
    """The `count` shapes whose squared distances to all are least in sum, as far as single exchanges find them."""
    squares = matrix[np.ix_(order, order)] ** 2
    found = [int(np.argmin(squares.sum(axis=0)))]
    while len(found) < count:
        nearest = squares[:, found].min(axis=1)
        gain = np.minimum(squares, nearest[:, None]).sum(axis=0)
        gain[found] = np.inf
        found.append(int(np.argmin(gain)))
    while True:
        best, exchange = squares[:, found].min(axis=1).sum(), None
        for place in range(count):
            rest = squares[:, found[:place] + found[place + 1 :]].min(axis=1, initial=np.inf)
            sums = np.minimum(squares, rest[:, None]).sum(axis=0)
            if sums.min() < best * (1 - 1e-9):
                best, exchange = sums.min(), (place, int(np.argmin(sums)))
        if exchange is None:
            return order[found]
        found[exchange[0]] = exchange[1]


def _labels(matrix: np.ndarray, centres: np.ndarray) -> np.ndarray:
    nearest = np.argmin(matrix[:, centres], axis=1)
    nearest[centres] = np.arange(len(centres))
    return nearest


def _moved(curves: np.ndarray, labels: np.ndarray, aligner: Aligner) -> Clusters:
    for _ in range(_ROUNDS):
        centres = _means(curves, labels, aligner).curve
        apart = distance_matrix(curves, centres, aligner)
        nearest = np.argmin(apart, axis=1)
        if len(np.unique(nearest)) < len(centres) or np.array_equal(nearest, labels):
            break
        labels = nearest
    converged = np.array_equal(nearest, labels)
    _, first = np.unique(labels, return_index=True)
    order = np.argsort(first)
    own = apart[np.arange(len(labels)), labels]
    return Clusters(np.argsort(order)[labels], centres[order], own, float(np.mean(own.astype(float) ** 2)), converged)


def _means(curves: np.ndarray, labels: np.ndarray, aligner: Aligner) -> Mean:
    weights = 1 / np.bincount(labels)[labels]
    return means(curves, labels, weights, 2, aligner)
