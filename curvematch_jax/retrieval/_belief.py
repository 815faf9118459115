"""The transferable belief model: what several parts together say about which object is meant.

The frame of discernment is the M objects. Each part's mass is on single objects and on the whole frame, so the
combination has a closed form and never needs the 2^M subsets (H. Tabia, M. Daoudi, J.-P. Vandeborre, O. Colot, "A new
3D-matching method of non-rigid and partially similar models using curve analysis", IEEE PAMI 33(4), 2011,
equations 2 to 4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp


@dataclass(frozen=True, eq=False)
class Belief:
    """What is believed after the combination, over M objects.

    Attributes:
        log_probability: (M,) logarithm of the pignistic probability; it tells apart objects whose probabilities are
            too small or too alike for a float.
        conflict: mass on the empty set, in [0, 1]: how far the parts contradict each other.
        ignorance: mass on the whole frame, in [0, 1]: what no part has said anything about.
    """

    log_probability: np.ndarray
    conflict: float
    ignorance: float

    @property
    def probability(self) -> np.ndarray:
        """(M,) pignistic probability (equation 3), which sums to 1."""
        return np.exp(self.log_probability)


def masses(distance: np.ndarray, significance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass of each part on each object and on the whole frame (equation 4).

    `m_i({O_j}) = mu_i (1 - D_ij) / sum_l (1 - D_il)` and `m_i(frame) = 1 - mu_i`. A part as far as can be from every
    object says nothing: all its mass is on the frame.

    Args:
        distance: (N, M) distance of each of N parts to each object, in [0, 1].
        significance: (N,) in [0, 1].

    Returns:
        `(singletons, frame)`, (N, M) and (N,); every part's masses sum to 1.

    Raises:
        `ValueError` when a value is outside [0, 1] or NaN, or the shapes do not fit.
    """
    distance, significance = np.asarray(distance, np.float64), np.asarray(significance, np.float64)
    if distance.ndim != 2 or significance.shape != distance.shape[:1]:
        raise ValueError(f"distance (parts, objects) and significance (parts,) do not fit: {distance.shape}, "
                         f"{significance.shape}")  # fmt: skip
    for name, values in (("distance", distance), ("significance", significance)):
        if not ((values >= 0) & (values <= 1)).all():
            raise ValueError(f"{name} must lie in [0, 1]")
    support = 1.0 - distance
    total = support.sum(axis=1, keepdims=True)
    shares = np.divide(support, total, out=np.zeros_like(support), where=total > 0)
    singletons = significance[:, None] * shares
    return singletons, np.where(total[:, 0] > 0, 1.0 - significance, 1.0)


def odds_masses(exponents: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass of each part on each object and on the whole frame, from evidence that no other object enters.

    `m_i({O_j}) = expm1(x_ij) m_i(frame)`, and `m_i(frame)` is what makes the masses sum to 1. Combined,
    `log1p(a_ij / o_i) = x_ij`: the evidence for an object is the sum over the parts of `x_ij`, so that the order of
    two objects does not depend on which others there are. Under equation 4 it does.

    Args:
        exponents: (N, M), 0 or more; 0 where a part has nothing in common with an object.

    Returns:
        `(singletons, frame)`, (N, M) and (N,); every part's masses sum to 1.

    Raises:
        `ValueError` when an exponent is negative or NaN.
    """
    if not (exponents >= 0).all():
        raise ValueError("exponents must be 0 or more")
    log_odds = _log_expm1(exponents)
    log_frame = -np.logaddexp(0.0, logsumexp(log_odds, axis=1)) if exponents.shape[1] else np.zeros(len(exponents))
    return np.exp(log_odds + log_frame[:, None]), np.exp(log_frame)


def combine(singletons: np.ndarray, frame: np.ndarray) -> Belief:
    """Conjunctive combination without normalisation, and the pignistic probability (equations 2 and 3).

    With `a_ij` the mass of part i on object j, `o_i > 0` its mass on the frame, `s_j = sum_i log1p(a_ij / o_i)` and
    `C = prod_i o_i`: `m({j}) = C expm1(s_j)`, `m(frame) = C`, the rest is conflict, and
    `BetP_j = (expm1(s_j) + 1/M) / (1 + sum_l expm1(s_l))`.
    When some `o_i` is 0, nothing is left on the frame, `m({j}) = prod_i (a_ij + o_i)`, and BetP is proportional to it.
    Everything is computed in logarithms, where neither many parts nor sure ones overflow.
    Parts that contradict each other completely leave no belief at all: conflict 1, and equal probabilities.

    Args:
        singletons: (N, M) masses on the objects, N >= 0, M >= 1.
        frame: (N,) masses on the whole frame.

    Returns:
        `Belief`.
    """
    objects = singletons.shape[1]
    if (frame > 0).all():
        with np.errstate(over="ignore", divide="ignore"):
            odds = singletons / frame[:, None]
            by_logarithms = np.log(singletons) - np.log(frame)[:, None]
        evidence = np.where(np.isfinite(odds), np.log1p(odds), by_logarithms).sum(axis=0)
        log_singletons = _log_expm1(evidence)
        log_total = float(np.logaddexp(0.0, logsumexp(log_singletons)))
        log_frame = float(np.log(frame).sum())
        log_probability = np.logaddexp(log_singletons, -np.log(objects)) - log_total
        return Belief(log_probability, _one_minus_exp(log_frame + log_total), float(np.exp(log_frame)))
    with np.errstate(divide="ignore"):
        log_singletons = np.log(singletons + frame[:, None]).sum(axis=0)
    log_total = float(logsumexp(log_singletons))
    if log_total == -np.inf:
        return Belief(np.full(objects, -np.log(objects)), 1.0, 0.0)
    return Belief(log_singletons - log_total, _one_minus_exp(log_total), 0.0)


def weighted_evidence(singletons: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Sum of `a_ij / o_i` over the parts, (M,): what the combination comes to while every mass is small.

    A part without mass on the frame counts as one with as little as a float can tell from 0.
    """
    return (singletons / np.maximum(frame, np.finfo(np.float64).eps)[:, None]).sum(axis=0)


def _log_expm1(x: np.ndarray) -> np.ndarray:
    """`log(expm1(x))` for x >= 0, without overflow; -inf at 0."""
    with np.errstate(divide="ignore"):
        return x + np.log(-np.expm1(-x))


def _one_minus_exp(log_x: float) -> float:
    """`1 - exp(log_x)`, clipped to [0, 1] against rounding."""
    return float(np.clip(-np.expm1(log_x), 0.0, 1.0)) + 0.0  # Not -0.
