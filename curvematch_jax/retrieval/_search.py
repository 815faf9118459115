"""Exact top-k search with lower bounds."""

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
_SLACK = 1e-5


@dataclass(frozen=True, eq=False)
class Search:
    """Distances of a query's P parts to the Q parts of M objects, as far as they are known.

    Attributes:
        query, collection, matching: what is compared, and how.
        distance: (P, Q) distances, or bounds of them from below.
        known: (P, Q) bool, whether `distance` is the distance itself, or nobody asks for it.
        forward: (P, Q) bool, whether the object's part is a candidate of the query's part.
        backward: (P, Q) bool, the other way round; nothing where nobody asks.
        ahead: (P, M) the least distance of the query's parts to their candidates in each object; inf for none.
        behind: (Q,) the least distance of an object's part to its candidates in the query; inf for none.
        exact: (M,) bool, whether all that the query and the object say of each other is known.
    """

    query: Collection
    collection: Collection
    matching: Matching
    distance: np.ndarray
    known: np.ndarray
    forward: np.ndarray
    backward: np.ndarray
    ahead: np.ndarray
    behind: np.ndarray
    exact: np.ndarray

    @classmethod
    def begin(cls, query: Collection, collection: Collection, matching: Matching) -> Search:
        """Candidates and bounds; nothing is known yet."""
        starts = collection.stack.starts
        blocks = object_blocks(starts, parts=_BLOCK)
        found = [_candidates(query, collection, block, matching) for block in blocks]
        distance, forward, backward = (np.concatenate(pieces, axis=1) for pieces in zip(*found, strict=True))
        ahead = _by_object(np.where(forward, distance, np.inf), starts)
        behind = np.where(backward, distance, np.inf).min(axis=0, initial=np.inf)
        known = ~(forward | backward)
        exact = collection.stack.lacking | (not len(distance))
        return cls(query, collection, matching, distance, known, forward, backward, ahead, behind, exact)

    @property
    def nearest(self) -> Nearest:
        """The nearest candidates of the query's parts in each object, and their distances or bounds."""
        starts = self.collection.stack.starts
        hit = self.forward & (self.distance == np.repeat(self.ahead, np.diff(starts), axis=1))
        first = _by_object(np.where(hit, np.arange(self.distance.shape[1]), np.inf), starts)
        part = np.where(np.isfinite(first), first - starts[:-1], -1).astype(np.int64)
        return Nearest(self.there, part)

    @property
    def there(self) -> np.ndarray:
        """(P, M) distances of the query's parts to the objects, or bounds."""
        return np.where(np.isinf(self.ahead), self.matching.max_distance, self.ahead)

    @property
    def here(self) -> np.ndarray:
        """(M,) mean distance of an object's parts to the query; NaN for an object without."""
        areas, starts = self.collection.objects.areas, self.collection.stack.starts
        return object_distances(self.behind[:, None], areas, starts, self.matching)[:, 0]

    def settle(self, objects: np.ndarray, few: int) -> None:
        """Compute, in each of the objects, a few of the candidates that may be nearest: those with the least bounds."""
        stack = self.collection.stack
        columns, starts = stack.parts_of(objects)
        ahead = np.where(self.forward[:, columns], self.distance[:, columns], np.inf)
        behind = np.where(self.backward[:, columns], self.distance[:, columns], np.inf)
        sizes = np.diff(starts)
        least = (ahead == np.repeat(self.ahead[:, objects], sizes, axis=1)) & np.isfinite(ahead)
        least |= (behind == self.behind[columns]) & np.isfinite(behind)
        i, at = np.nonzero(least & ~self.known[:, columns])
        of_object = np.repeat(np.arange(len(objects)), sizes)[at]
        now = _least_of_each(self.distance[i, columns[at]], of_object, few)
        i, at = i[now], at[now]
        pairs = np.stack([i, columns[at]], axis=1)
        matching = self.matching
        found = part_distances(self.query.stack, stack, pairs, matching, matching.aligner)
        self.distance[i, columns[at]], self.known[i, columns[at]] = found, True
        ahead[i, at] = np.where(self.forward[i, columns[at]], found, np.inf)
        behind[i, at] = np.where(self.backward[i, columns[at]], found, np.inf)
        self.ahead[:, objects], self.behind[columns] = _by_object(ahead, starts), behind.min(axis=0, initial=np.inf)
        unknown = ~self.known[:, columns]
        open_ = (
            unknown & (ahead < np.repeat(_by_object(np.where(unknown, np.inf, ahead), starts), sizes, axis=1))
        ).any(axis=0)
        open_ |= (unknown & (behind < np.where(unknown, np.inf, behind).min(axis=0, initial=np.inf))).any(axis=0)
        self.exact[objects] = np.isinf(_by_object(np.where(open_, 0.0, np.inf)[None], starts)[0])


def _least_of_each(values: np.ndarray, group: np.ndarray, count: int) -> np.ndarray:
    """Indices of the `count` least values (N,) of each group, (N,) numbers."""
    order = np.lexsort((values, group))
    sorted_ = group[order]
    return order[np.arange(len(order)) - np.searchsorted(sorted_, sorted_) < count]


def _by_object(values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """The least of the values (P, Q) of each object's parts, (P, M); inf for an object without parts."""
    found = np.full((len(values), len(starts) - 1), np.inf)
    some = np.diff(starts) > 0
    if some.any() and len(values):
        found[:, some] = np.minimum.reduceat(values, starts[:-1][some], axis=1)
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
    values = levels.values + np.where(levels.both, least_distance(products), np.float32(0))
    return rough, levels._replace(values=values).joined(matching) - _SLACK
