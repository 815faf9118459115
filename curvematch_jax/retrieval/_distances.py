"""Distances between parts, and from parts to objects.

Equations D and 5 of H. Tabia, M. Daoudi, J.-P. Vandeborre, O. Colot, "A new 3D-matching method of non-rigid and
partially similar models using curve analysis", IEEE PAMI 33(4), 2011.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..elastic import Aligner, Rigid, pair_distances
from ._matching import ISOMETRY_DECAY, MAX_ISOMETRY_RATIO, MAX_LOG_RATIO, Matching
from ._stack import Stack

Index = np.ndarray | tuple[slice | None, ...]

# Pairs of parts whose levels are held at once while their sizes are compared.
_SIZES_AT_ONCE = 1 << 15


class Nearest(NamedTuple):
    """Part-to-object distances (equation 5)."""

    distance: np.ndarray  # (P1, M2), the maximal distance to objects without parts, inf for pairs not to compare
    part: np.ndarray  # (P1, M2) the part of the object that is nearest, from 0; -1 where there is none


def nearest(first: Stack, second: Stack, apart: np.ndarray, matching: Matching) -> tuple[Nearest, Nearest]:
    """Distances of parts to objects, both ways (equation 5): `min over parts of the object`.

    Args:
        first, second: M1 objects with P1 parts, and M2 objects with P2 parts.
        apart: (M1, M2) bool, the pairs of objects to compare.

    Returns:
        of the parts of the first to the objects of the second, and the other way round.
    """
    wanted, rough = _rough(first, second, apart, matching)
    forward = backward = wanted
    if rough is not None:
        forward = wanted & shortlist(rough, second.starts, matching.candidates)
        backward = wanted & shortlist(rough.T, first.starts, matching.candidates).T
    distances = _distances(first, second, forward | backward, matching)
    return (
        _least(np.where(forward, distances, np.inf), second.starts, matching.max_distance),
        _least(np.where(backward, distances, np.inf).T, first.starts, matching.max_distance),
    )


def nearest_in(first: Stack, second: Stack, apart: np.ndarray, matching: Matching) -> Nearest:
    """Distances of the parts of the first to the objects of the second, as `nearest` has them."""
    wanted, rough = _rough(first, second, apart, matching)
    forward = wanted if rough is None else wanted & shortlist(rough, second.starts, matching.candidates)
    return _least(_distances(first, second, forward, matching), second.starts, matching.max_distance)


def _rough(first: Stack, second: Stack, apart: np.ndarray, matching: Matching) -> tuple[np.ndarray, np.ndarray | None]:
    """Which parts are of objects to compare, (P1, P2) bool, and what candidates among them are chosen by, if any."""
    wanted = np.repeat(np.repeat(apart, np.diff(first.starts), axis=0), np.diff(second.starts), axis=1)
    if not matching.candidates:
        return wanted, None
    rough = np.full(wanted.shape, np.inf)
    rough[wanted] = rough_distances(first, second, np.argwhere(wanted), matching)
    return wanted, rough


def _distances(first: Stack, second: Stack, compared: np.ndarray, matching: Matching) -> np.ndarray:
    """Distances (P1, P2) of the parts to compare, inf for all others."""
    distances = np.full(compared.shape, np.inf)
    distances[compared] = part_distances(first, second, np.argwhere(compared), matching, matching.aligner)
    return distances


def part_distances(
    first: Stack, second: Stack, pairs: np.ndarray, matching: Matching, aligner: Aligner | None
) -> np.ndarray:
    """Distances (K,) of the pairs (K, 2) of a part of the first and one of the second (equation D).

    The levels are averaged as `Matching` says. Parts without a level in common are `matching.max_distance` apart.
    Without an aligner all shapes are taken to be the same, and sizes alone tell parts apart.
    """
    chunks = np.array_split(pairs, max(1, -(-len(pairs) // _SIZES_AT_ONCE)))
    return np.concatenate([_part_distances(first, second, chunk, matching, aligner) for chunk in chunks])


def shortlist(distances: np.ndarray, starts: np.ndarray, candidates: int) -> np.ndarray:
    """For each row (P1, P2), the nearest columns of each object: the objects' columns begin at `starts`."""
    short = np.zeros(distances.shape, bool)
    for start, end in pairwise(starts.tolist()):
        if end > start:
            count = min(candidates, end - start)
            best = np.argpartition(distances[:, start:end], count - 1, axis=1)[:, :count]
            np.put_along_axis(short[:, start:end], best, True, axis=1)
    return short


def rough_distances(first: Stack, second: Stack, pairs: np.ndarray, matching: Matching) -> np.ndarray:
    """What candidates are chosen by: sizes, which cost next to nothing, or else shapes without reparametrisation."""
    rigid = Rigid.estimate() if matching.aligner.warps else matching.aligner
    return part_distances(first, second, pairs, matching, None if matching.sized else rigid)


def _part_distances(
    first: Stack, second: Stack, pairs: np.ndarray, matching: Matching, aligner: Aligner | None
) -> np.ndarray:
    one, other = pairs.T
    levels = compared(first, one, second, other, matching)
    if aligner is not None and levels.both.any():
        curve_pairs = np.stack([first.rows[one][levels.both], second.rows[other][levels.both]], axis=1)
        levels.values[levels.both] += _curve_distances(first, second, curve_pairs, aligner)
    return levels.joined(matching)


def _curve_distances(first: Stack, second: Stack, pairs: np.ndarray, aligner: Aligner) -> np.ndarray:
    """Distances (K,) of pairs of curves; only those that occur are handed over."""
    (rows1, at1), (rows2, at2) = (np.unique(rows, return_inverse=True) for rows in pairs.T)
    return pair_distances(first.curves[rows1], second.curves[rows2], np.stack([at1, at2], axis=1), aligner)


class Levels(NamedTuple):
    """Pairs of parts, level by level: in any shape, (*K, L)."""

    values: np.ndarray  # (*K, L) radians: what lengths and missing levels say, to which shapes are added
    both: np.ndarray  # (*K, L) bool, levels that both parts have
    either: np.ndarray  # (*K, L) bool
    apart: np.ndarray | float  # (*K,) radians: what level sets and near-isometry say

    def joined(self, matching: Matching) -> np.ndarray:
        """Distances (*K,) of the parts (equation D)."""
        distances = _mean(self.values, self.either, _weights(self.values, matching.decay)) + self.apart
        return np.where(self.both.any(axis=-1), distances, matching.max_distance)


def compared(first: Stack, one: Index, second: Stack, other: Index, matching: Matching) -> Levels:
    """Everything but the shapes of the curves: of the parts `one` and `other`, indices whose results broadcast."""
    left, right = first.rows[one] >= 0, second.rows[other] >= 0
    both, either = left & right, left | right
    lengths = first.log_lengths[one] - second.log_lengths[other]
    ratios = np.minimum(np.abs(lengths), MAX_LOG_RATIO)
    values = np.where(both, matching.length_weight * ratios, np.float32(matching.missing) * either)
    apart: np.ndarray | float = 0.0
    if matching.level_set_weight:
        level_sets = np.abs(first.log_level_sets[one] - second.log_level_sets[other])
        weights = _weights(level_sets, matching.decay)
        apart = apart + matching.level_set_weight * _mean(np.minimum(level_sets, MAX_LOG_RATIO), None, weights)
    if matching.isometry_weight:
        units = first.log_units[one] - second.log_units[other]
        unequal = np.minimum(np.abs(lengths - units[..., None]), MAX_ISOMETRY_RATIO)
        unequal = np.where(both, unequal, np.float32(MAX_ISOMETRY_RATIO) * either)
        unequal = _mean(unequal, either, _weights(unequal, ISOMETRY_DECAY))
        apart = apart + matching.isometry_weight * np.minimum(unequal, matching.isometry_limit)
    return Levels(values, both, either, apart)


def _weights(levels: np.ndarray, decay: float) -> np.ndarray:
    """Weights (L,) of the levels on the last axis, from the one next to the feature point."""
    return np.arange(1.0, levels.shape[-1] + 1) ** -decay


def _mean(values: np.ndarray, counted: np.ndarray | None, weights: np.ndarray) -> np.ndarray:
    """Mean over the levels (*K, L) that count, (*K,); 0 where none does."""
    # Not by `@`, where the last bits of a row depend on how many rows there are.
    weights = weights.astype(values.dtype)
    total = np.einsum("...l,l->...", values, weights)
    if counted is None:
        return total / weights.sum()
    return total / np.maximum(np.einsum("...l,l->...", counted, weights), weights[-1])


def _least(distances: np.ndarray, starts: np.ndarray, empty: float) -> Nearest:
    """The least of each object's columns; `empty` for an object without columns."""
    shape = (len(distances), len(starts) - 1)
    least, part = np.full(shape, empty), np.full(shape, -1)
    for j, (start, end) in enumerate(pairwise(starts.tolist())):
        if end > start and len(distances):
            part[:, j] = np.argmin(distances[:, start:end], axis=1)
            least[:, j] = distances[np.arange(len(distances)), start + part[:, j]]
    return Nearest(least, np.where(np.isfinite(least), part, -1))
