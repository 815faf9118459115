"""One query against a collection."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .._given import require_type
from .._progress import Progress, reporter
from ..surface import Parts
from ._belief import Belief, combine, masses, odds_masses, weighted_evidence
from ._cohort import Cohort, object_distances, significance, witness_distances
from ._collection import Collection
from ._matching import DEFAULT, Matching
from ._objects import own
from ._search import Search

# Objects that are compared by shape before it is asked again which are the likeliest; and at most, for a report.
_AT_ONCE = 128
_MOST_AT_ONCE = 512
# Pairs of parts of each that are compared then: of most objects a few pairs show that they are not among the best.
_FEW = 2


class Match(NamedTuple):
    """A part of a query and the nearest part of one object.

    Attributes:
        part: index of the query's part.
        other: index of the object's part.
        distance: D of the two parts, in radians (equation D).
        mass: of the query's part on the object, in [0, 1].
    """

    part: int
    other: int
    distance: float
    mass: float


@dataclass(frozen=True, eq=False)
class Ranking:
    """A collection of M objects, ordered by similarity to a query of P parts.

    Attributes:
        order: (M,) indices into the collection, best first; ties are broken by the lower index. With `exclude_self`,
            order and beliefs leave out the query itself, whose dissimilarity, probability and masses are 0.
        names: of the M objects, in the order of the collection, as everything below.
        dissimilarity: (M,) what the order follows; smaller is more similar.
        probability: (M,) pignistic probability of the belief model, whatever the fusion that made the order.
        conflict: mass on the empty set: how far the sources of belief contradict each other.
        ignorance: mass on the whole collection: what the sources leave undecided.
        evidence: (M,) evidence of each source for the objects, by name: `"parts"`, and the witnesses. Empty for one-way
            fusions.
        distances: (P, M) of the query's parts to the objects (equation 5), or lower bounds of them.
        matched: (P, M) which part of the object that is; -1 for an object without parts.
        masses: (P, M) of the query's parts on the objects, before combination.
        exact: (M,) bool, whether an object's distances are known. With `rank(..., top=k)` most are not, and the values
            above follow from lower bounds: these objects come after the first k, their `dissimilarity` is a lower
            bound, and probabilities, conflict and ignorance are those of a collection in which they are as near as
            the bounds permit.
        notes: a sentence on the query and on every object without parts; such objects come last.
        seconds: of each stage: `stack`, to prepare collection and query, `bounds`, and `distances`, with the
            fusion.
    """

    order: np.ndarray
    names: tuple[str, ...]
    dissimilarity: np.ndarray
    probability: np.ndarray
    conflict: float
    ignorance: float
    evidence: Mapping[str, np.ndarray]
    distances: np.ndarray
    matched: np.ndarray
    masses: np.ndarray
    exact: np.ndarray
    notes: tuple[str, ...]
    seconds: dict[str, float]

    def explain(self, j: int) -> tuple[Match, ...]:
        """Which part of the query matched which part of object j, nearest first.

        Args:
            j: index into the collection; the best object's is `order[0]`.

        Returns:
            a `Match` for every part of the query; none when the object has no parts.

        Raises:
            IndexError: when there is no such object.
            ValueError: when `j` is no index, or its distances are not known.
        """
        require_type("j", j, (int, np.integer), "give an index, e.g. ranking.order[0] or ranking.names.index(name)")
        if not 0 <= j < len(self.names):
            raise IndexError(f"object {j} does not exist: the collection has the objects 0 to {len(self.names) - 1}")
        if not self.exact[j]:
            raise ValueError(f"object {j} was not compared by shape: rank with a larger top to explain it")
        return tuple(
            Match(int(i), int(self.matched[i, j]), float(self.distances[i, j]), float(self.masses[i, j]))
            for i in np.argsort(self.distances[:, j], kind="stable")
            if self.matched[i, j] >= 0
        )


class Fused(NamedTuple):
    """What the parts of a query say together about M objects."""

    dissimilarity: np.ndarray  # (M,) larger for objects without parts than for all others
    belief: Belief  # about those that are not left out
    masses: np.ndarray  # (P, M)
    evidence: Mapping[str, np.ndarray]  # (M,) each


def rank(
    query: Parts,
    collection: Sequence[Parts] | Collection,
    matching: Matching = DEFAULT,
    progress: Progress = False,
    top: int | None = None,
    exclude_self: bool = False,
) -> Ranking:
    """Rank a collection by similarity to a query (equations D, 5, 4, 2 and 3).

    By default query and objects say what they find in each other, in the eyes of a cohort of the collection (see
    `_cohort.py`); an object that `Collection.added` adds never changes the order of the others. With
    `fusion="mean"`, none that joins or leaves does. The masses of equation 4 (`masses="shares"`) are shares of a sum
    over the collection: there the order of two nearly equal objects can depend on which others there are.

    With `top`, the first `top` objects of the order are those of the whole ranking, and most others are not compared
    by shape: what sizes and signatures of their curves say is a lower bound of their distances, by which they are in
    order (see `Ranking.exact`). With `masses="shares"` every distance enters all masses: there all are computed.

    Args:
        query: may be a member of the collection.
        collection: at least one object, extracted with the query's settings; `Collection.of` makes a collection ready
            once for many queries.
        matching: how parts are compared and joined.
        progress: `True` for a bar on stderr, or a function of `(done, total)` part pairs.
        top: how many of the best objects are wanted; all without it.
        exclude_self: leave out of the order, and of what is believed, the objects with the query's own parts.

    Raises:
        ValueError: when something is of another type, the collection is empty or has nothing but the excluded query,
            settings of the extraction differ, naming the setting, the collection was made ready for another matching,
            or `top` is not 1 or more.
    """
    require_type("query", query, Parts, "give Parts, e.g. extract_parts(mesh)")
    if top is not None and top < 1:
        raise ValueError(f"top must be 1 or more, found {top}")
    started = time.perf_counter()
    ready = collection if isinstance(collection, Collection) else Collection.of(collection, matching)
    asked = Collection.gathered([query], matching)
    ready.require(asked, matching)
    listed = np.ones(len(ready.names), bool)
    if exclude_self:
        listed = ~own(ready.objects.fingerprints, asked.objects.fingerprints)[:, 0]
        if not listed.any():
            raise ValueError("the collection has nothing but the query itself: add objects, or do not exclude it")
    score, judged = _judge(asked, ready, listed, query.areas, matching)
    stacked = time.perf_counter()
    search = Search.begin(asked, ready, matching)
    bounded = time.perf_counter()
    count = int(listed.sum())
    if top is not None and matching.separate:
        count = min(top, count)
    order = _settled(search, score, listed, count, progress)
    found, fused = search.nearest, judged(search)
    ended = time.perf_counter()
    return Ranking(
        order=order,
        names=ready.names,
        dissimilarity=fused.dissimilarity,
        probability=_spread(fused.belief.probability, listed),
        conflict=fused.belief.conflict,
        ignorance=fused.belief.ignorance,
        evidence=fused.evidence,
        distances=found.distance,
        matched=found.part,
        masses=fused.masses,
        exact=search.exact,
        notes=asked.lacking_notes("the query") + ready.lacking_notes("object"),
        seconds={"stack": stacked - started, "bounds": bounded - stacked, "distances": ended - bounded},
    )


def _settled(
    search: Search, score: Callable[[Search], np.ndarray], listed: np.ndarray, count: int, progress: Progress
) -> np.ndarray:
    """The order, once its first `count` objects are certain.

    An object's bound puts it no later than its distances will. So as soon as the first ones in the order of bounds
    are exact, no other can come before them.
    """
    report, total = reporter(progress, "query", "pairs"), search.known.size
    few = _FEW if count < listed.sum() else total
    compared = np.zeros(len(listed), bool)
    while True:
        order = np.argsort(score(search), kind="stable")
        order = order[listed[order]]
        exact = search.exact[order]
        if exact[:count].all():
            report(total, total)
            return order
        likely = order[~exact][: max(count, _AT_ONCE, int(compared.sum()) // 6)]
        compared[likely] = True
        for some in np.split(likely, range(_MOST_AT_ONCE, len(likely), _MOST_AT_ONCE)):
            report(int(search.known.sum()), total)
            search.settle(some, few)


def _judge(
    asked: Collection, ready: Collection, listed: np.ndarray, areas: np.ndarray, matching: Matching
) -> tuple[Callable[[Search], np.ndarray], Callable[[Search], Fused]]:
    """What makes of distances or bounds the dissimilarities of all objects, and what makes of them all there is.

    Beliefs are about the `listed` objects alone, (M,) bool.
    """
    present = ~ready.stack.lacking
    if not matching.mutual:

        def one_way(search: Search) -> Fused:
            fused = fuse(search.there[:, listed], areas, present[listed], matching)
            spread = {"dissimilarity": _spread(fused.dissimilarity, listed), "masses": _spread(fused.masses, listed)}
            return fused._replace(**spread)

        return lambda search: one_way(search).dissimilarity, one_way
    cohort, moments = ready.cohort, ready.moments
    assert cohort is not None
    assert moments is not None
    own_moments = cohort.moments(asked.distances_to(ready.members))
    witnesses = witness_distances(asked.objects.descriptors, ready.objects.descriptors, matching)
    known = present if len(areas) else np.zeros_like(present)

    def said(search: Search) -> np.ndarray:
        ahead = object_distances(search.there, areas, np.array([0, len(areas)]), matching)
        there = cohort.evidence(np.stack([ahead, *witnesses]), own_moments)[:, 0]
        here = cohort.evidence(np.stack([search.here[:, None], *(each.T for each in witnesses)]), moments)[:, :, 0]
        return np.where(known, there + here, 0.0)

    def dissimilarity(evidence: np.ndarray) -> np.ndarray:
        return np.where(listed, mutual(cohort, evidence.sum(axis=0), known), 0.0)

    def judged(search: Search) -> Fused:
        evidence = said(search)
        belief = combine(*odds_masses(evidence[:, listed]))
        singletons, _ = _part_masses(search.there[:, listed], areas, matching)
        names = ("parts", *(witness.name for witness in matching.witnesses))
        sources = dict(zip(names, evidence, strict=True))
        return Fused(dissimilarity(evidence), belief, _spread(singletons, listed), sources)

    return lambda search: dissimilarity(said(search)), judged


def _spread(values: np.ndarray, listed: np.ndarray) -> np.ndarray:
    """Values (..., K) of the K listed objects, among those of all, (..., M); 0 for the others."""
    found = np.zeros((*values.shape[:-1], len(listed)))
    found[..., listed] = values
    return found


def mutual(cohort: Cohort, evidence: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Dissimilarities from the evidence of all sources in both directions: 1 where one of the two has no parts.

    Args:
        evidence: any shape.
        present: of the same shape.
    """
    return np.where(present, np.minimum(cohort.dissimilarity(evidence), np.nextafter(1.0, 0.0)), 1.0)


def mutual_among(collection: Collection, objects: np.ndarray) -> np.ndarray:
    """Dissimilarities (K, K) of some objects of a collection with a cohort, (K,) indices, ascending."""
    some, cohort, moments = collection.taken(objects), collection.cohort, collection.moments
    assert cohort is not None
    assert moments is not None
    said = cohort.evidence(some.distances_to(some, np.eye(len(objects), dtype=bool)), moments[:, objects]).sum(axis=0)
    present = ~some.stack.lacking
    found = mutual(cohort, said + said.T, present[:, None] & present)
    np.fill_diagonal(found, 0.0)
    return found


def fuse(distances: np.ndarray, areas: np.ndarray, present: np.ndarray, matching: Matching) -> Fused:
    """Join what the parts of a query say about M objects.

    Args:
        distances: (P, M) of the query's parts to the objects.
        areas: (P,) shares of the query's surface; significance by area is `exp(-p^2)`, p the share that a part lacks.
        present: (M,) bool, False for an object without parts.
    """
    singletons, frame = _part_masses(distances, areas, matching)
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
    return Fused(np.where(present, dissimilarity, last), belief, singletons, {})


def _part_masses(distances: np.ndarray, areas: np.ndarray, matching: Matching) -> tuple[np.ndarray, np.ndarray]:
    """Masses of the query's parts on the objects, (P, M), and on the whole collection, (P,)."""
    worth = significance(areas, matching)
    if matching.masses == "shares":
        return masses(matching.normalised(distances), worth)
    closeness = np.maximum(matching.max_distance - distances, 0.0)
    return odds_masses(worth[:, None] * closeness / matching.scale)
