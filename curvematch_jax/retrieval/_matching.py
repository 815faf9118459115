"""Distances between parts, and from parts to objects.

Equations D and 5 of H. Tabia, M. Daoudi, J.-P. Vandeborre, O. Colot, "A new 3D-matching method of non-rigid and
partially similar models using curve analysis", IEEE PAMI 33(4), 2011, with what the paper leaves open decided here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from ..elastic import Aligner, pair_distances
from ..surface import Parts
from ._store import require_same_settings

Fusion = Literal["belief", "weighted", "mean"]
Significance = Literal["equal", "area"]

# No two aligned unit-length curves are farther apart: the best rotation never leaves a negative inner product.
MAX_CURVE_DISTANCE = math.pi / 2
# Parts a side that are compared at once: enough to fill the engine's batches, few enough to forget.
_BLOCK = 160
# Sizes that differ by more than this factor are as different as can be.
_MAX_LOG_RATIO = math.log(8.0)


@dataclass(frozen=True)
class Matching:
    """How parts are compared and what they say about objects is joined.

    Two parts differ, level by level, by the elastic distance of their curves (radians) and by `length_weight` times
    the difference of the logarithms of the curves' lengths. The levels are averaged with weights `k^-decay`, k = 1
    next to the feature point, up to a part's first gap; a level that only one of the two parts has counts as
    `missing`, one that neither has does not count. `area_weight` times the difference of the logarithms of the
    parts' areas is added.

    Attributes:
        aligner: the alignment of two curves.
        candidates: how many parts of each object the aligner is tried on for each part: those nearest by start point
            and rotation alone. 0 tries it on all.
        length_weight: radians for a factor e between the lengths of two curves.
        area_weight: radians for a factor e between the areas of two parts.
        decay: how fast the weight of a level falls with its distance from the feature point.
        missing: radians for a level curve that only one of two parts has.
        fusion: how the parts of a query are joined. `"belief"`: by the transferable belief model. `"weighted"`: by
            the sum of masses that the belief model comes to in large collections. `"mean"`: by the mean of their
            distances to the object.
        significance: what a part's word is worth in the belief model: that of all parts is worth the same
            (`"equal"`), or less the less of the query's surface it covers (`"area"`, as published).
        scale: part-to-object distances D1 become `1 - exp(-D1 / scale)` before they are masses; without a scale,
            the share of the greatest distance there is.
    """

    aligner: Aligner = field(default_factory=Aligner.fast)
    candidates: int = 1
    length_weight: float = 0.25
    area_weight: float = 0.15
    decay: float = 0.75
    missing: float = 1.0
    fusion: Fusion = "belief"
    significance: Significance = "equal"
    scale: float | None = 0.15

    def __post_init__(self) -> None:
        for name, known in (("fusion", get_args(Fusion)), ("significance", get_args(Significance))):
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, and was {getattr(self, name)!r}")
        if not isinstance(self.candidates, int) or self.candidates < 0:
            raise ValueError(f"candidates must be a whole number, 0 or more, and was {self.candidates!r}")
        for name in ("length_weight", "area_weight", "decay", "missing"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be 0 or more, and was {getattr(self, name)!r}")
        if self.scale is not None and not 0 < self.scale < math.inf:
            raise ValueError(f"scale must be more than 0, or None, and was {self.scale!r}")

    @classmethod
    def paper(cls) -> Matching:
        """The published method: shapes of curves alone, all levels alike, all part pairs, belief from areas."""
        return cls(candidates=0, length_weight=0.0, area_weight=0.0, decay=0.0, significance="area", scale=None)

    @property
    def max_distance(self) -> float:
        """The greatest distance of two parts there is: that of parts with nothing in common."""
        sizes = self.length_weight + self.area_weight
        return max(MAX_CURVE_DISTANCE, self.missing) + sizes * _MAX_LOG_RATIO

    def normalised(self, distances: np.ndarray) -> np.ndarray:
        """Part-to-object distances brought into [0, 1] by a constant, never by the collection."""
        share = distances / self.max_distance if self.scale is None else -np.expm1(-distances / self.scale)
        return np.clip(share, 0.0, 1.0)


BEST = Matching()
"""The default settings."""


@dataclass(frozen=True, eq=False)
class Stack:
    """The parts of M objects in one, P in all, object by object.

    Attributes:
        curves: (C, 3, n) the curves that count.
        rows: (P, L) where in `curves` a part's level is, -1 where it is masked or beyond a gap.
        log_lengths: (P, L) 0 where there is no row.
        log_areas: (P,)
        starts: (M + 1,) object j has the parts `starts[j]` to `starts[j + 1]`.
    """

    curves: np.ndarray
    rows: np.ndarray
    log_lengths: np.ndarray
    log_areas: np.ndarray
    starts: np.ndarray

    @property
    def objects(self) -> int:
        return len(self.starts) - 1

    @property
    def lacking(self) -> np.ndarray:
        """(M,) bool, True for an object without parts."""
        return np.diff(self.starts) == 0

    def __getitem__(self, objects: slice) -> Stack:
        """The stack of a run of objects."""
        starts = self.starts[objects.start : objects.stop + 1]
        parts = slice(int(starts[0]), int(starts[-1]))
        before = int((self.rows[: parts.start] >= 0).sum())
        rows = self.rows[parts]
        count = int((rows >= 0).sum())
        return Stack(
            curves=self.curves[before : before + count],
            rows=np.where(rows >= 0, rows - before, -1),
            log_lengths=self.log_lengths[parts],
            log_areas=self.log_areas[parts],
            starts=starts - parts.start,
        )


def stack(collection: Sequence[Parts]) -> Stack:
    """Put the parts of a collection into one.

    Raises:
        ValueError: when the collection is empty, or was extracted with different settings.
    """
    if not collection:
        raise ValueError("the collection is empty: at least one object is needed")
    require_same_settings(collection)
    mask = unbroken(np.concatenate([parts.mask for parts in collection]))
    rows = np.full(mask.shape, -1)
    rows[mask] = np.arange(mask.sum())
    lengths = np.concatenate([parts.lengths for parts in collection]).astype(np.float64)
    areas = np.concatenate([parts.areas for parts in collection]).astype(np.float64)
    return Stack(
        curves=np.concatenate([parts.curves for parts in collection])[mask],
        rows=rows,
        log_lengths=np.log(np.where(mask, lengths, 1.0)),
        log_areas=np.log(areas),
        starts=np.cumsum([0, *(len(parts.areas) for parts in collection)]),
    )


def unbroken(mask: np.ndarray) -> np.ndarray:
    """The first run of levels of each part, (P, L) bool.

    Beyond a gap the front has split and met again: all fingers of a hand go on as the same arm there, which says
    nothing about a finger. On both development collections parts are told apart better without those levels.
    """
    ended = np.logical_or.accumulate(mask, axis=1) & ~mask
    return mask & ~np.logical_or.accumulate(ended, axis=1)


def nearest(first: Stack, second: Stack, apart: np.ndarray, matching: Matching) -> tuple[np.ndarray, np.ndarray]:
    """Distances of parts to objects, both ways (equation 5): `min over parts of the object`.

    Arguments:
        first, second: M1 objects with P1 parts, and M2 objects with P2 parts.
        apart: (M1, M2) bool, the pairs of objects to compare.

    Returns:
        (P1, M2) distances of the parts of the first to the objects of the second, and (P2, M1) the other way
        round; `matching.max_distance` to objects without parts, and inf for pairs not to compare.
    """
    wanted = np.repeat(np.repeat(apart, np.diff(first.starts), axis=0), np.diff(second.starts), axis=1)
    pairs = np.argwhere(wanted)
    distances = np.full(wanted.shape, np.inf)
    if matching.candidates:
        distances[wanted] = part_distances(first, second, pairs, matching, Aligner.rigid())
        short = shortlist(distances, second.starts, matching.candidates)
        short |= shortlist(distances.T, first.starts, matching.candidates).T
        pairs = np.argwhere(short & wanted)
    distances[tuple(pairs.T)] = part_distances(first, second, pairs, matching, matching.aligner)
    forward = _least(distances, second.starts, matching.max_distance)
    backward = _least(distances.T, first.starts, matching.max_distance)
    return forward, backward


def part_distances(first: Stack, second: Stack, pairs: np.ndarray, matching: Matching, aligner: Aligner) -> np.ndarray:
    """Distances (K,) of the pairs (K, 2) of a part of the first and one of the second (equation D).

    The levels are averaged as `Matching` says. Parts without a level in common are `matching.max_distance` apart.
    """
    left, right = first.rows[pairs[:, 0]], second.rows[pairs[:, 1]]
    both = (left >= 0) & (right >= 0)
    either = (left >= 0) | (right >= 0)
    values = np.where(either, matching.missing, 0.0)
    curve_pairs = np.stack([left[both], right[both]], axis=1)
    shapes = pair_distances(first.curves, second.curves, curve_pairs, aligner) if len(curve_pairs) else 0.0
    sizes = _log_ratio(first.log_lengths[pairs[:, 0]], second.log_lengths[pairs[:, 1]])
    values[both] = shapes + matching.length_weight * sizes[both]
    weights = np.arange(1, left.shape[1] + 1) ** -matching.decay
    mean = (values * weights).sum(axis=1) / np.maximum((either * weights).sum(axis=1), weights[-1])
    areas = matching.area_weight * _log_ratio(first.log_areas[pairs[:, 0]], second.log_areas[pairs[:, 1]])
    return np.where(both.any(axis=1), mean + areas, matching.max_distance)


def shortlist(distances: np.ndarray, starts: np.ndarray, candidates: int) -> np.ndarray:
    """For each row (P1, P2), the nearest columns of each object: the objects' columns begin at `starts`."""
    short = np.zeros(distances.shape, bool)
    for start, end in _segments(starts):
        count = min(candidates, end - start)
        best = np.argpartition(distances[:, start:end], count - 1, axis=1)[:, :count]
        np.put_along_axis(short[:, start:end], best, True, axis=1)
    return short


def object_blocks(starts: np.ndarray, parts: int = _BLOCK) -> list[slice]:
    """Runs of objects with at most `parts` parts each; an object with more is a run by itself."""
    blocks, begin = [], 0
    for end in range(1, len(starts)):
        if end + 1 == len(starts) or starts[end + 1] - starts[begin] > parts:
            blocks.append(slice(begin, end))
            begin = end
    return blocks


def _least(distances: np.ndarray, starts: np.ndarray, empty: float) -> np.ndarray:
    """The least of each object's columns, (P1, M2); `empty` for an object without columns."""
    least = np.full((len(distances), len(starts) - 1), empty)
    filled = np.diff(starts) > 0
    if filled.any():
        least[:, filled] = np.minimum.reduceat(distances, starts[:-1][filled], axis=1)
    return least


def _segments(starts: np.ndarray) -> Iterator[tuple[int, int]]:
    """Where the columns of each object that has some begin and end."""
    return ((int(a), int(b)) for a, b in pairwise(starts) if b > a)


def _log_ratio(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.minimum(np.abs(one - other), _MAX_LOG_RATIO)
