"""Medoids: the members of groups that are nearest to all others of their group."""

import numpy as np

from ..elastic import Aligner, Rigid, pair_distances, tabulate

_COMPARED = 128  # members with which each is compared: of more, evenly spaced ones
_ESTIMATE: Aligner = Rigid.estimate()


def rough_medoids(curves: np.ndarray, group: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """A member of each group near its middle, `(G,)` numbers of curves: a start, by start point and rotation alone."""
    tables = tabulate(curves, _ESTIMATE)
    return np.array([_medoid(tables, np.flatnonzero(group == g), weights) for g in range(int(group.max()) + 1)])


def _medoid(tables, members: np.ndarray, weights: np.ndarray) -> int:
    compared = members[np.linspace(0, len(members) - 1, min(len(members), _COMPARED)).astype(int)]
    pairs = np.stack(np.meshgrid(members, compared, indexing="ij"), axis=-1).reshape(-1, 2)
    squares = pair_distances(tables, tables, pairs, _ESTIMATE).reshape(len(members), -1).astype(float) ** 2
    sums = np.where(weights[members] > 0, squares @ weights[compared], np.inf)
    return int(members[np.argmin(sums)])
