"""A query in a collection: what the parts can be apart at least, and what they are, where it matters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..elastic import least_distance
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
    """Distances of a query's P parts to the C candidates in each of M objects, as far as they are known.

    Attributes:
        query, collection, matching: what is compared, and how.
        part: (P, M, C) which parts of the object the candidates are, ascending; -1 for none.
        distance: (P, M, C) the candidates' distances, or bounds of them from below; inf for none.
        known: (P, M, C) bool, whether `distance` is the distance itself.
    """

    query: Collection
    collection: Collection
    matching: Matching
    part: np.ndarray
    distance: np.ndarray
    known: np.ndarray

    @classmethod
    def begin(cls, query: Collection, collection: Collection, matching: Matching) -> Search:
        """Candidates and bounds; nothing is known yet."""
        starts = collection.stack.starts
        count = matching.candidates or int(np.diff(starts).max())
        blocks = object_blocks(starts, parts=_BLOCK)
        found = [_candidates(query, collection, block, matching, max(count, 1)) for block in blocks]
        part, distance = (np.concatenate(pieces, axis=1) for pieces in zip(*found, strict=True))
        return cls(query, collection, matching, part, distance, part < 0)

    @property
    def exact(self) -> np.ndarray:
        """(M,) bool, whether all distances of the query's parts to the object are known."""
        return np.logical_and.reduce(self._at_least(self.known), axis=0)

    @property
    def nearest(self) -> Nearest:
        """The nearest candidates, and their distances or bounds."""
        distance = self._at_least(self.distance)
        return Nearest(np.where(np.isinf(distance), self.matching.max_distance, distance), self._at_least(self.part))

    def settle(self, objects: np.ndarray) -> None:
        """Compute, in each of the objects, the candidates that may be nearest: the least ones not known yet."""
        least = np.argmin(self.distance[:, objects], axis=2)
        i, at = np.nonzero(~np.take_along_axis(self.known[:, objects], least[..., None], axis=2)[..., 0])
        where = i, objects[at], least[i, at]
        stack = self.collection.stack
        pairs = np.stack([i, stack.starts[objects[at]] + self.part[where]], axis=1)
        found = part_distances(self.query.stack, stack, pairs, self.matching, self.matching.aligner)
        self.distance[where], self.known[where] = found, True

    def _at_least(self, values: np.ndarray) -> np.ndarray:
        """Of each part and object, the value (P, M) at its nearest candidate."""
        least = np.argmin(self.distance, axis=2)[..., None]
        return np.take_along_axis(values, least, axis=2)[..., 0]


def _candidates(
    query: Collection, collection: Collection, block: slice, matching: Matching, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Candidates (P, M, C) of a run of M objects, and bounds of their distances."""
    starts = collection.stack.starts[block.start : block.stop + 1]
    parts = slice(int(starts[0]), int(starts[-1]))
    rough, bound = _bounds(query, collection, parts, matching)
    sizes = np.diff(starts)
    place = np.arange(max(count, int(sizes.max(initial=0))))
    column = np.where(place < sizes[:, None], starts[:-1, None] - parts.start + place, rough.shape[1])
    part = np.argpartition(_extended(rough)[:, column], count - 1, axis=2)[..., :count]
    part.sort(axis=2)
    distance = _extended(bound)[np.arange(len(bound))[:, None, None], column[np.arange(len(sizes))[:, None], part]]
    return np.where(np.isinf(distance), -1, part), distance


def _extended(distances: np.ndarray) -> np.ndarray:
    """With one more column, of parts that are not there."""
    return np.pad(distances, ((0, 0), (0, 1)), constant_values=np.inf)


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
