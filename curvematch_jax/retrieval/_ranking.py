"""One query against a collection."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .._progress import Progress, reporter
from ..surface import Parts
from ._belief import Belief, combine, masses, odds_masses, weighted_evidence
from ._distances import Nearest, nearest
from ._matching import BEST, Matching
from ._parts_file import require_same_settings
from ._stack import Stack, object_blocks, stack

# Of every part, when all are worth the same. Between .1 and .9 it changes the order of next to nothing.
EQUAL_SIGNIFICANCE = 0.5
# Parts of the collection that are compared with a query at once.
_QUERY_BLOCK = 4096


class Match(NamedTuple):
    """What one part of a query found in one object."""

    part: int
    """Index of the query's part."""
    other: int
    """Index of the object's part that is nearest to it."""
    distance: float
    """Distance D of the two parts, in radians (equation D)."""
    mass: float
    """Mass that the query's part puts on the object, in [0, 1]."""


@dataclass(frozen=True, eq=False)
class Ranking:
    """A collection of M objects in the order of their likeness to a query of P parts.

    Attributes:
        order: (M,) indices into the collection, best first; of equal objects the one of lower index comes first.
        names: of the M objects, in the order of the collection, as everything below.
        dissimilarity: (M,) what the order follows; smaller is more similar.
        probability: (M,) pignistic probability of the belief model, whatever the fusion that made the order.
        conflict: mass on the empty set: how far the query's parts contradict each other.
        unknown: mass on the whole collection: what the query's parts leave open.
        distances: (P, M) of the query's parts to the objects (equation 5).
        matched: (P, M) which part of the object that is; -1 for an object without parts.
        masses: (P, M) of the query's parts on the objects.
        notes: a sentence on the query and on every object without parts; such objects come last.
        seconds: what the stages took: `stack`, `distances`, `fusion`.
    """

    order: np.ndarray
    names: tuple[str, ...]
    dissimilarity: np.ndarray
    probability: np.ndarray
    conflict: float
    unknown: float
    distances: np.ndarray
    matched: np.ndarray
    masses: np.ndarray
    notes: tuple[str, ...]
    seconds: dict[str, float]

    def explain(self, j: int) -> tuple[Match, ...]:
        """Which part of the query matched which part of object j, nearest first.

        Arguments:
            j: index into the collection; the best object's is `order[0]`.

        Returns:
            a `Match` for every part of the query; none when the object has no parts.

        Raises:
            IndexError: when there is no such object.
        """
        if not 0 <= j < len(self.names):
            raise IndexError(f"object {j} was asked for, and the collection has the objects 0 to {len(self.names) - 1}")
        return tuple(
            Match(int(i), int(self.matched[i, j]), float(self.distances[i, j]), float(self.masses[i, j]))
            for i in np.argsort(self.distances[:, j], kind="stable")
            if self.matched[i, j] >= 0
        )


class Fused(NamedTuple):
    """What the parts of a query say together about M objects."""

    dissimilarity: np.ndarray  # (M,) larger for objects without parts than for all others
    belief: Belief
    masses: np.ndarray  # (P, M)


def rank(query: Parts, collection: Sequence[Parts], matching: Matching = BEST, progress: Progress = False) -> Ranking:
    """Rank a collection by likeness to a query (equations D, 5, 4, 2 and 3).

    By default, and with `fusion="mean"`, an object that joins or leaves the collection never changes the order of the
    others. The masses of equation 4 (`masses="shares"`) are shares of a sum over the collection: there the order of
    two nearly equal objects can depend on which others there are.

    Arguments:
        query: may be a member of the collection.
        collection: at least one object, extracted with the query's settings.
        matching: how parts are compared and joined.
        progress: `True` for a bar on stderr, or a function of `(done, total)` part pairs.

    Raises:
        ValueError: when the collection is empty, or settings of the extraction differ, naming the setting.
    """
    started = time.perf_counter()
    require_same_settings([*collection, query])
    first, second = stack([query], matching.unit), stack(collection, matching.unit)
    stacked = time.perf_counter()
    found = _nearest_of_query(first, second, matching, progress)
    compared = time.perf_counter()
    fused = fuse(found.distance, query.areas, ~second.lacking, matching)
    order = np.argsort(fused.dissimilarity, kind="stable")
    ended = time.perf_counter()
    return Ranking(
        order=order,
        names=tuple(parts.name for parts in collection),
        dissimilarity=fused.dissimilarity,
        probability=fused.belief.probability,
        conflict=fused.belief.conflict,
        unknown=fused.belief.unknown,
        distances=found.distance,
        matched=found.part,
        masses=fused.masses,
        notes=lacking_notes([query], "the query") + lacking_notes(collection, "object"),
        seconds={"stack": stacked - started, "distances": compared - stacked, "fusion": ended - compared},
    )


def fuse(distances: np.ndarray, areas: np.ndarray, present: np.ndarray, matching: Matching) -> Fused:
    """Join what the parts of a query say about M objects.

    Arguments:
        distances: (P, M) of the query's parts to the objects.
        areas: (P,) shares of the query's surface; significance by area is `exp(-p^2)`, p the share that a part lacks.
        present: (M,) bool, False for an object without parts.
    """
    if matching.significance == "area":
        significance = np.exp(-((1.0 - np.clip(areas, 0.0, 1.0)) ** 2))
    else:
        significance = np.full(len(distances), EQUAL_SIGNIFICANCE)
    if matching.masses == "shares":
        singletons, frame = masses(matching.normalised(distances), significance)
    else:
        closeness = np.maximum(matching.max_distance - distances, 0.0)
        singletons, frame = odds_masses(significance[:, None] * closeness / matching.scale)
    belief = combine(singletons, frame)
    if matching.fusion == "belief":
        dissimilarity = -belief.log_probability
    elif matching.fusion == "weighted":
        dissimilarity = 1.0 / (1.0 + weighted_evidence(singletons, frame))
    elif len(distances):
        dissimilarity = distances.mean(axis=0)
    else:
        dissimilarity = np.full(len(present), matching.max_distance)
    last = dissimilarity[present].max(initial=0.0) + 1.0
    return Fused(np.where(present, dissimilarity, last), belief, singletons)


def lacking_notes(collection: Sequence[Parts], what: str) -> tuple[str, ...]:
    """A sentence on every object without parts."""
    return tuple(
        f"{what} {parts.name or index} has no feature point, so nothing is known about it"
        for index, parts in enumerate(collection)
        if not len(parts.areas)
    )


def _nearest_of_query(query: Stack, collection: Stack, matching: Matching, progress: Progress) -> Nearest:
    """Distances of the parts of one object to all others, block by block."""
    report = reporter(progress, "query", "pairs")
    total = len(query.rows) * len(collection.rows)
    report(0, total)
    found = []
    for block in object_blocks(collection.starts, parts=_QUERY_BLOCK):
        members = collection[block]
        forward, _ = nearest(query, members, np.ones((1, members.objects), bool), matching, both_ways=False)
        found.append(forward)
        report(len(query.rows) * int(collection.starts[block.stop]), total)
    return Nearest(*(np.concatenate(column, axis=1) for column in zip(*found, strict=True)))
