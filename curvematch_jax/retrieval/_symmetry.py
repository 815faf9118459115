"""Intrinsic symmetry: the parts of one object that a symmetry of its surface exchanges.

A symmetry of a surface is an isometry of it with itself (M. Ovsjanikov, J. Sun, L. Guibas, "Global intrinsic
symmetries of shapes", Computer Graphics Forum 27(5), 2008). Of all points only the feature points are asked here: it
permutes them, keeps their distances from each other, and exchanges parts with level curves alike.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..surface import Parts
from ._distances import part_distances
from ._matching import Matching
from ._stack import stack

# `limit` goes with the scale of these distances, so that they are not the default of rankings: with near-isometry
# weighing 12, as there, recall on SHREC'07 falls from .78 to .45 at the same limit.
SELF = Matching(length_weight=0.25, level_set_weight=0.25, isometry_weight=6.0, isometry_limit=0.12, decay=0.0)
# Radians for one diameter by which distances between feature points change.
_DISTORTION_WEIGHT = 10.0
# In `limit`s, the cost of a part that stays in its place, and of one without an image. An exchange that costs less than
# the first is a gain: at the default limit, distances to the other parts may change by 0.2 diameters where two parts
# are the same, and by 0.07 where they are only just alike.
_STAY = 1.5
_UNMATCHED = 1.8
# In `limit`s, how much higher than the least energy others may be. Both reflections of a table are as good; to
# exchange a front leg and a hind leg is not as good as to exchange left and right.
_MARGIN = 0.2
# Pairs of parts that a search begins with, those nearest to each other: all pairs of 20 parts.
_SEEDS = 190
# Assignments after a seed; hardly any changes after the third.
_ROUNDS = 4


class Symmetry(NamedTuple):
    """An involution of P parts."""

    image: np.ndarray  # (P,) of each part; a part's own index when it stays in its place
    matched: np.ndarray  # (P,) bool, False for a part that nothing is known about: its counterpart may be missing
    energy: float


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """What symmetries of an object with P parts are judged by.

    Attributes:
        distances: (P, P) of the parts, symmetric, in radians, inf where they are too unlike; `stay` on the diagonal.
        feature_distances: (P, P) distances of the feature points, symmetric, in diameters.
        stay: the cost of a part that stays in its place, and so the energy of the identity.
        unmatched: the cost of a part without an image, and the most that any costs.
        margin: how much higher than the least energy that of a symmetry may be.
    """

    distances: np.ndarray
    feature_distances: np.ndarray
    stay: float
    unmatched: float
    margin: float

    def costs(self, image: np.ndarray, matched: np.ndarray) -> np.ndarray:
        """(P, P) cost of sending part k to part l while the matched parts go to their images."""
        change = np.abs(self.feature_distances[:, None, :] - self.feature_distances[:, image][None]) @ matched
        costs = self.distances + _DISTORTION_WEIGHT * change / max(int(matched.sum()) - 1, 1)
        np.fill_diagonal(costs, np.minimum(np.diag(costs), self.unmatched))
        return (costs + costs.T) / 2

    def settled(self, image: np.ndarray) -> Symmetry:
        """The symmetry without the parts that fit worst: they leave one by one, each with its image."""
        matched = np.ones(len(image), bool)
        change = np.abs(self.feature_distances - self.feature_distances[np.ix_(image, image)])
        alike = self.distances[np.arange(len(image)), image]
        while True:
            costs = alike + _DISTORTION_WEIGHT * (change @ matched) / max(int(matched.sum()) - 1, 1)
            costs = np.where(matched, np.maximum(costs, costs[image]), 0.0)
            worst = int(np.argmax(costs))
            if costs[worst] <= self.unmatched:
                return Symmetry(image, matched, float(np.where(matched, costs, self.unmatched).mean()))
            matched[[worst, image[worst]]] = False


def symmetric_parts(parts: Parts, matching: Matching = SELF, limit: float = 1.3) -> tuple[tuple[int, ...], ...]:
    """Groups of the parts that an intrinsic symmetry exchanges, such as left and right legs.

    A symmetry is an involution s of the P parts. With `d(i, j)` the distance of two parts (equation D), or of one and
    the mirror image of the other when that is less, `d(i, i) = 1.5 limit`, and `b` the distances between feature
    points (`Parts.feature_distances`), its energy is

        E(s) = 1/P sum_i min(d(i, s(i)) + 10 mean_j abs(b(i, j) - b(s(i), s(j))), 1.8 limit)

    with the mean over the other parts j that have an image: those for which the minimum is its first term. So a part
    whose counterpart was not found costs little, and changes nothing for the others. The identity has the energy
    `1.5 limit`. Every pair of parts with `d <= limit` is exchanged in turn, and the others are assigned, again and
    again, at the least cost. Of the symmetries found, those count that have images for more than half of the parts,
    are below the identity, and at most `0.2 limit` above the lowest. The groups are the orbits of all that count.

    Limits: rotations that are not made of reflections or half turns (a whirl of three arms) are not found. Between
    two parts alone there is one distance, which says nothing: likeness decides. Legs of a chair that are alike in all
    distances are one group, whatever a person would say. Several feature points on one limb go to one group when
    their exchange is as good as the symmetry.

    Args:
        parts: P parts of one object, P >= 0.
        matching: how parts are compared; sizes should count. By default nearly as in rankings, with less weight on
            near-isometry.
        limit: radians; parts that are farther apart are never exchanged. It goes with the scale of the distances.

    Returns:
        every part's index in exactly one group; ascending, and groups in the order of their first part.

    Raises:
        ValueError: when `limit` is not a positive number.
    """
    if not 0 < limit < math.inf:
        raise ValueError(f"limit must be a positive number, found {limit!r}")
    count = len(parts.areas)
    if count < 2:
        return tuple((k,) for k in range(count))
    distances = self_distances(parts, matching)
    distances[distances > limit] = np.inf
    np.fill_diagonal(distances, _STAY * limit)
    stay, unmatched, margin = (share * limit for share in (_STAY, _UNMATCHED, _MARGIN))
    problem = Problem(distances, parts.feature_distances.astype(np.float64), stay, unmatched, margin)
    return _orbits(count, _search(problem))


def self_distances(parts: Parts, matching: Matching) -> np.ndarray:
    """Distances (P, P) of an object's parts, each compared with the others and with their mirror images."""
    count = len(parts.areas)
    rows, columns = np.triu_indices(count, 1)
    pairs = np.concatenate([np.stack([rows, columns], axis=1), np.stack([rows, columns + count], axis=1)])
    both = stack([parts, mirrored(parts)], matching.unit)
    plain, reflected = part_distances(both, both, pairs, matching, matching.aligner).reshape(2, -1)
    distances = np.zeros((count, count))
    distances[rows, columns] = distances[columns, rows] = np.minimum(plain, reflected)
    return distances


def mirrored(parts: Parts) -> Parts:
    """The parts of the mirror image, as far as they are compared: it does not matter in which plane.

    A reflection alone would leave the curves clockwise around their feature points.
    """
    curves = parts.curves[..., ::-1].copy()
    curves[..., 0, :] *= -1
    return dataclasses.replace(parts, curves=curves)


def _search(problem: Problem) -> list[Symmetry]:
    """The symmetries that count."""
    rows, columns = np.triu_indices(len(problem.feature_distances), 1)
    distances = problem.distances[rows, columns]
    nearest = np.argsort(distances, kind="stable")[: min(_SEEDS, int(np.isfinite(distances).sum()))]
    found = [_grown(problem, int(rows[k]), int(columns[k])) for k in nearest]
    # Two parts that are the same are a symmetry of themselves, wherever they are: most of the others have to agree.
    found = [s for s in found if 2 * s.matched.sum() > len(s.matched) and s.energy < problem.stay]
    most = min((s.energy for s in found), default=0.0) + problem.margin
    return [s for s in found if s.energy <= most]


def _grown(problem: Problem, i: int, j: int) -> Symmetry:
    """The best symmetry met that exchanges parts i and j: all others are assigned, first by what i and j tell."""
    image = np.arange(len(problem.feature_distances))
    image[[i, j]] = j, i
    matched = np.zeros(len(image), bool)
    matched[[i, j]] = True
    met: list[Symmetry] = []
    for _ in range(_ROUNDS):
        image = _assigned(problem.costs(image, matched), i, j)
        if met and np.array_equal(image, met[-1].image):
            break
        met.append(problem.settled(image))
        matched = met[-1].matched
    return min(met, key=lambda symmetry: symmetry.energy)


def _assigned(costs: np.ndarray, i: int, j: int) -> np.ndarray:
    """The involution of least cost that exchanges i and j; where the assignment is none, parts stay in place."""
    every = np.arange(len(costs))
    rest = np.delete(every, [i, j])
    image = every.copy()
    image[[i, j]] = j, i
    image[rest] = rest[linear_sum_assignment(costs[np.ix_(rest, rest)])[1]]
    return np.where(image[image] == every, image, every)


def _orbits(count: int, found: list[Symmetry]) -> tuple[tuple[int, ...], ...]:
    """What the symmetries together carry each part to."""
    rows = np.concatenate([np.flatnonzero(s.matched) for s in found]) if found else np.arange(0)
    columns = np.concatenate([s.image[s.matched] for s in found]) if found else np.arange(0)
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    return tuple(tuple(np.flatnonzero(label == k).tolist()) for k in dict.fromkeys(label.tolist()))
