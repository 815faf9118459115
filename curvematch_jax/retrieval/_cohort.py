"""Distances made comparable: the chance of an unrelated object to be as near, in both directions.

Parts of one object are far from everything, those of another near to all: distances from different objects do not
compare. So each object i has the mean and the deviation of the logarithm of its distances to a fixed cohort of
objects, and in each source of belief s (the parts; the witnesses) the distance from i to j is a chance

    p_s(i -> j) = Phi((log(D_s(i, j) + floor_s) - mean_s(i)) / deviation_s(i)),

with Phi the normal distribution: that of an unrelated object to be as near (normalisation by a cohort in both
directions is the S-norm of speaker verification: S. Shum, N. Dehak, R. Dehak, J. Glass, "Unsupervised speaker
adaptation based on the cosine similarity for text-independent speaker verification", Odyssey 2010). What a source says
for j is `-log p`, which is 0 or more: no source speaks against. The sources' words add up as the evidence of the
transferable belief model does (see `odds_masses`), weighted and in both directions,

    E(i, j) = sum_s w_s (-log p_s(i -> j) - log p_s(j -> i)) / 2,

and the dissimilarity is the weighted geometric mean of the chances, `exp(-E / sum_s w_s)`: symmetric, in [0, 1].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import log_ndtr

from ._matching import EQUAL_SIGNIFICANCE, Matching
from ._objects import Descriptors

# Objects of a cohort, at most and at least; between them so many that this many pairs of objects are compared for it.
_MOST, LEAST = 256, 32
_PAIRS = 1 << 16
# In mean distances between members of the cohort: nearer is as near as can be, so that logarithms stay bounded.
_FLOOR = 0.01
# Distances to the cohort that the mean and the deviation of the whole cohort count for: few are known of small ones.
_PRIOR = 2.0
_LEAST_DEVIATION = 0.05
# Of the share of a witness's variance that the parts confirm over what they do not.
_TRUST = 1 / 3


@dataclass(frozen=True, eq=False)
class Cohort:
    """The objects that distances are compared with, for S sources: the parts, then the witnesses.

    Attributes:
        members: (C,) indices into the collection, ascending.
        floor: (S,) what is added to distances before their logarithm.
        mean, deviation: (S,) of the logarithms of all distances between members.
        weight: (S,) of each source's evidence; that of the parts is 1.
    """

    members: np.ndarray
    floor: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, members: np.ndarray, distances: np.ndarray, matching: Matching) -> Cohort:
        """From the distances (S, C, C) between its members, NaN where nothing is known, and of each to itself."""
        floor = np.maximum(_FLOOR * np.array([_mean(values, 1.0) for values in distances]), 1e-9)
        logs = np.log(distances + floor[:, None, None])
        mean = np.array([_mean(values, 0.0) for values in logs])
        spread = np.array([_mean((values - m) ** 2, 1.0) for values, m in zip(logs, mean, strict=True)])
        deviation = np.maximum(np.sqrt(spread), _LEAST_DEVIATION)
        cohort = cls(members, floor, mean, deviation, np.ones(len(distances)))
        scores = cohort.scores(distances, cohort.moments(distances))
        scores = (scores + scores.transpose(0, 2, 1)) / 2
        pairs = np.triu_indices(len(members), 1)
        weights = [
            _confirmed(scores[0][pairs], own[pairs]) if witness.weight is None else witness.weight
            for witness, own in zip(matching.witnesses, scores[1:], strict=True)
        ]
        return cls(members, floor, mean, deviation, np.array([1.0, *weights]))

    def moments(self, distances: np.ndarray) -> np.ndarray:
        """Mean and deviation, (S, K, 2), of K objects from their distances (S, K, C) to the members; NaN to itself."""
        logs = np.log(distances + self.floor[:, None, None])
        known = ~np.isnan(logs)
        count = known.sum(axis=2) + _PRIOR
        mean = (np.where(known, logs, 0.0).sum(axis=2) + _PRIOR * self.mean[:, None]) / count
        squares = np.where(known, (logs - mean[..., None]) ** 2, 0.0).sum(axis=2)
        deviation = np.sqrt((squares + _PRIOR * self.deviation[:, None] ** 2) / count)
        return np.stack([mean, np.maximum(deviation, _LEAST_DEVIATION)], axis=2)

    def scores(self, distances: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """Logarithms of the distances (S, K, M) of K objects in the deviations of their moments (S, K, 2)."""
        logs = np.log(distances + self.floor[:, None, None])
        return (logs - moments[..., :1]) / moments[..., 1:]

    def evidence(self, distances: np.ndarray, moments: np.ndarray) -> np.ndarray:
        """`-w log p / 2`, (S, K, M): what each source says in one direction; 0 where nothing is known."""
        scores = self.scores(distances, moments)
        said = -log_ndtr(np.where(np.isnan(scores), np.inf, scores)) + 0.0
        return self.weight[:, None, None] / 2 * said

    def dissimilarity(self, evidence: np.ndarray) -> np.ndarray:
        """`exp(-E / sum w)`, from the evidence of all sources and both directions together."""
        return np.exp(-evidence / self.weight.sum())


def chosen(fingerprints: Sequence[str]) -> np.ndarray:
    """Which objects are the cohort of a collection, (C,), ascending.

    Those of the lowest fingerprints: the same ones in any order of the objects, and as good as drawn by lot.
    """
    count = len(fingerprints)
    size = min(count, _MOST, max(LEAST, _PAIRS // max(count, 1)))
    return np.sort(np.argsort(np.array(fingerprints), kind="stable")[:size])


def witness_distances(first: Descriptors, second: Descriptors, matching: Matching) -> list[np.ndarray]:
    """Sums of absolute differences (M1, M2) of each witness; NaN where one of the two was not described.

    Raises:
        ValueError: when the descriptors of the two have different lengths.
    """
    found = []
    for witness in matching.witnesses:
        one, other = first[witness.name], second[witness.name]
        if 0 in (one.shape[1], other.shape[1]):
            found.append(np.full((len(one), len(other)), np.nan))
        elif one.shape[1] != other.shape[1]:
            numbers = f"{one.shape[1]} and of {other.shape[1]}"
            raise ValueError(f"the {witness.name} of objects have {numbers} numbers: extract them again")
        else:
            found.append(cdist(one, other, "cityblock"))
    return found


def object_distances(distances: np.ndarray, areas: np.ndarray, starts: np.ndarray, matching: Matching) -> np.ndarray:
    """Mean distances (K, M) of K objects to M, from those of their parts (P, M); NaN for an object without parts.

    Args:
        areas: (P,) shares of their object's surface.
        starts: (K + 1,) object k has the parts `starts[k]` to `starts[k + 1]`.
    """
    found = np.full((len(starts) - 1, distances.shape[1]), np.nan)
    some = np.diff(starts) > 0
    if some.any():
        weights = significance(areas, matching)
        begins = starts[:-1][some]
        total = np.add.reduceat(weights[:, None] * distances.astype(np.float64), begins, axis=0)
        found[some] = total / np.add.reduceat(weights, begins)[:, None]
    return found


def significance(areas: np.ndarray, matching: Matching) -> np.ndarray:
    """mu, what the word of each of P parts is worth; by area it is `exp(-p^2)`, p the share that a part lacks."""
    if matching.significance == "area":
        return np.exp(-((1.0 - np.clip(areas.astype(np.float64), 0.0, 1.0)) ** 2))
    return np.full(len(areas), EQUAL_SIGNIFICANCE)


def _mean(values: np.ndarray, otherwise: float) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else otherwise


def _confirmed(parts: np.ndarray, witness: np.ndarray) -> float:
    """The weight of a witness whose scores (N,) are set beside those of the parts, see `Witness`."""
    known = ~(np.isnan(parts) | np.isnan(witness))
    one, other = parts[known], witness[known]
    if len(one) < 3 or not one.std() or not other.std():
        return 0.0
    correlation = max(float(np.corrcoef(one, other)[0, 1]), 0.0)
    unexplained = (1 - correlation**2) * (len(one) - 1) / (len(one) - 2)  # Few pairs agree by chance.
    return float(min(max(_TRUST * (1 / max(unexplained, 1e-9) - 1), 0.0), 1.0))
