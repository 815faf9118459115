"""A query in a collection: what the parts can be apart at least, and what they are, where it matters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..elastic import least_distance
from ._cohort import object_distances
from ._collection import Collection
from ._distances import Nearest, compared, part_distances, rough_distances
from ._matching import Matching
from ._stack import object_blocks

# Parts of the collection that are compared with a query at once: what is compared stays in the processor's cache.
_BLOCK = 1024
# Bounds stay below distances however both are rounded.
_SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class Search:
    """Distances of a query's P parts to the Q parts of M objects, as far as they are known.

    Attributes:
        query, collection, matching: what is compared, and how.
        distance: (P, Q) distances, or bounds of them from below.
        known: (P, Q) bool, whether `distance` is the distance itself.
        forward: (P, Q) bool, whether the object's part is a candidate of the query's part.
        backward: (P, Q) bool, the other way round; nothing where nobody asks.
    """

    query: Collection
    collection: Collection
    matching: Matching
    distance: np.ndarray
    known: np.ndarray
    forward: np.ndarray
    backward: np.ndarray

    @classmethod
    def begin(cls, query: Collection, collection: Collection, matching: Matching) -> Search:
        """Candidates and bounds; nothing is known yet."""
        blocks = object_blocks(collection.stack.starts, parts=_BLOCK)
        found = [_candidates(query, collection, block, matching) for block in blocks]
        distance, forward, backward = (np.concatenate(pieces, axis=1) for pieces in zip(*found, strict=True))
        return cls(query, collection, matching, distance, ~(forward | backward), forward, backward)

    @property
    def exact(self) -> np.ndarray:
        """(M,) bool, whether all that the query and the object say of each other is known."""
        there = (self._least(self.known) <= self._least(None)).all(axis=0)
        here = (self._nearest_to_query(self.known) <= self._nearest_to_query(None))[None]
        return there & (_by_object(here.astype(np.float64), self.collection.stack.starts, np.minimum, 1.0)[0] > 0)

    @property
    def nearest(self) -> Nearest:
        """The nearest candidates of the query's parts in each object, and their distances or bounds."""
        starts, least = self.collection.stack.starts, self._least(None)
        hit = self.forward & (self.distance == np.repeat(least, np.diff(starts), axis=1))
        place = np.where(hit, np.arange(self.distance.shape[1], dtype=np.float64), np.inf)
        first = _by_object(place, starts, np.minimum, np.inf)
        part = np.where(np.isfinite(first), first - starts[:-1], -1).astype(np.int64)
        return Nearest(np.where(np.isinf(least), self.matching.max_distance, least), part)

    @property
    def back(self) -> np.ndarray:
        """(M,) mean distance of an object's parts to the query; NaN for an object without."""
        nearest = self._nearest_to_query(None)[:, None]
        return object_distances(nearest, self.collection.areas, self.collection.stack.starts, self.matching)[:, 0]

    def settle(self, objects: np.ndarray) -> None:
        """Compute, in each of the objects, the candidates that may be nearest: the least ones not known yet."""
        stack = self.collection.stack
        sizes = np.diff(stack.starts)[objects]
        columns = np.repeat(stack.starts[:-1][objects] - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
        starts = np.concatenate([[0], np.cumsum(sizes)])
        distance = self.distance[:, columns]
        ahead = np.where(self.forward[:, columns], distance, np.inf)
        least = np.repeat(_by_object(ahead, starts, np.minimum, np.inf), sizes, axis=1)
        behind = np.where(self.backward[:, columns], distance, np.inf)
        asked = (ahead == least) & np.isfinite(ahead)
        asked |= (behind == behind.min(axis=0, initial=np.inf)) & np.isfinite(behind)
        i, at = np.nonzero(asked & ~self.known[:, columns])
        pairs = np.stack([i, columns[at]], axis=1)
        self.distance[i, columns[at]] = part_distances(
            self.query.stack, stack, pairs, self.matching, self.matching.aligner
        )
        self.known[i, columns[at]] = True

    def _least(self, among: np.ndarray | None) -> np.ndarray:
        """(P, M) the least distance of the query's parts to their candidates in each object."""
        counted = self.forward if among is None else self.forward & among
        values = np.where(counted, self.distance, np.inf)
        return _by_object(values, self.collection.stack.starts, np.minimum, np.inf)

    def _nearest_to_query(self, among: np.ndarray | None) -> np.ndarray:
        """(Q,) the least distance of an object's part to its candidates in the query."""
        counted = self.backward if among is None else self.backward & among
        return np.where(counted, self.distance, np.inf).min(axis=0, initial=np.inf)


def _by_object(values: np.ndarray, starts: np.ndarray, join: np.ufunc, empty: float) -> np.ndarray:
    """Values (P, Q) joined over the parts of each object, (P, M); `empty` for an object without parts."""
    found = np.full((len(values), len(starts) - 1), empty)
    some = np.diff(starts) > 0
    if some.any() and len(values):
        found[:, some] = join.reduceat(values, starts[:-1][some], axis=1)
    return found


def _candidates(
    query: Collection, collection: Collection, block: slice, matching: Matching
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bounds (P, Q) of the distances to the parts of a run of objects, and which are candidates in both directions."""
    starts = collection.stack.starts[block.start : block.stop + 1]
    rough, bound = _bounds(query, collection, slice(int(starts[0]), int(starts[-1])), matching)
    every = np.ones(rough.shape, bool)
    if not matching.candidates or not rough.size:
        return bound, every, every if matching.mutual else ~every
    sizes, count = np.diff(starts), matching.candidates
    place = np.arange(max(count, int(sizes.max())))
    column = np.where(place < sizes[:, None], starts[:-1, None] - starts[0] + place, rough.shape[1])
    extended = np.pad(rough, ((0, 0), (0, 1)), constant_values=np.inf)
    best = np.argpartition(extended[:, column], count - 1, axis=2)[..., :count]
    forward = np.zeros(extended.shape, bool)
    forward[np.arange(len(rough))[:, None, None], column[np.arange(len(sizes))[:, None], best]] = True
    backward = np.zeros(rough.shape, bool)
    if matching.mutual:
        few = min(count, len(rough))
        np.put_along_axis(backward, np.argpartition(rough, few - 1, axis=0)[:few], True, axis=0)
    return bound, forward[:, :-1], backward


def _bounds(
    query: Collection, collection: Collection, parts: slice, matching: Matching
) -> tuple[np.ndarray, np.ndarray]:
    """What candidates are chosen by, and lower bounds of the distances: (P1, P2) of the query's parts to a run."""
    levels = compared(query.stack, (slice(None), None), collection.stack, (None, parts), matching)
    rough = levels.joined(matching)
    if not matching.sized and matching.candidates:
        one, other = np.indices(rough.shape).reshape(2, -1)
        pairs = np.stack([one, other + parts.start], axis=1)
        rough = rough_distances(query.stack, collection.stack, pairs, matching).reshape(rough.shape)
    if query.signatures is None or collection.signatures is None:
        return rough, levels.joined(matching) - _SLACK
    products = np.einsum("ils,jls->ijl", query.signatures, collection.signatures[parts], optimize=True)
    levels.values[levels.both] += least_distance(products[levels.both])
    return rough, levels.joined(matching) - _SLACK
