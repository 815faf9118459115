"""One query against a collection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._progress import Progress, reporter
from ..surface import Parts
from ._belief import Belief, combine, masses, weighted_evidence
from ._matching import BEST, Matching, nearest, object_blocks, stack
from ._store import require_same_settings

# Of every part, when all are worth the same. Between .1 and .9 it changes the order of next to nothing.
EQUAL_SIGNIFICANCE = 0.5


@dataclass(frozen=True, eq=False)
class Ranking:
    """A collection of M objects in the order of their likeness to a query.

    Attributes:
        order: (M,) indices into the collection, best first; of equal objects the one of lower index comes first.
        names: of the M objects, in the order of the collection, as everything below.
        dissimilarity: (M,) what the order follows; smaller is more similar.
        probability: (M,) pignistic probability of the belief model, whatever the fusion that made the order.
        conflict: mass on the empty set: how far the query's parts contradict each other.
        unknown: mass on the whole collection: what the query's parts leave open.
        notes: a sentence on the query and on every object without parts; such objects come last.
    """

    order: np.ndarray
    names: tuple[str, ...]
    dissimilarity: np.ndarray
    probability: np.ndarray
    conflict: float
    unknown: float
    notes: tuple[str, ...]


def rank(query: Parts, collection: Sequence[Parts], matching: Matching = BEST, progress: Progress = False) -> Ranking:
    """Rank a collection by likeness to a query (equations D, 5, 4, 2 and 3).

    Distances are only ever scaled by constants, so that with `fusion="mean"` an object that joins or leaves the
    collection never changes the order of the others. The masses of the belief model (equation 4) are shares of a sum
    over the collection: there a part that is close to many objects says little about each, which is worth a few per
    cent of precision, and the order of two nearly equal objects can depend on which others there are.

    Arguments:
        query: may be a member of the collection.
        collection: at least one object, extracted with the query's settings.
        matching: how parts are compared and joined.
        progress: `True` for a bar on stderr, or a function of `(done, total)` part pairs.

    Raises:
        ValueError: when the collection is empty, or settings of the extraction differ, naming the setting.
    """
    require_same_settings([*collection, query])
    first, second = stack([query]), stack(collection)
    report = reporter(progress, "query", "pairs")
    total = len(first.rows) * len(second.rows)
    report(0, total)
    distances = np.empty((len(first.rows), second.objects))
    for block in object_blocks(second.starts):
        members = second[block]
        apart = np.ones((1, members.objects), bool)
        distances[:, block], _ = nearest(first, members, apart, matching)
        report(len(first.rows) * int(second.starts[block.stop]), total)
    dissimilarity, belief = fuse(distances, query.areas, ~second.lacking, matching)
    return Ranking(
        order=np.argsort(dissimilarity, kind="stable"),
        names=tuple(parts.name for parts in collection),
        dissimilarity=dissimilarity,
        probability=belief.probability,
        conflict=belief.conflict,
        unknown=belief.unknown,
        notes=lacking_notes([query], "the query") + lacking_notes(collection, "object"),
    )


def fuse(
    distances: np.ndarray, areas: np.ndarray, present: np.ndarray, matching: Matching
) -> tuple[np.ndarray, Belief]:
    """Join what the parts of a query say about M objects.

    Arguments:
        distances: (P, M) of the query's parts to the objects.
        areas: (P,) shares of the query's surface; significance by area is `exp(-p^2)`, p the share that a part lacks.
        present: (M,) bool, False for an object without parts.

    Returns:
        the dissimilarities (M,), larger for objects without parts than for all others, and the belief.
    """
    if matching.significance == "area":
        significance = np.exp(-((1.0 - np.clip(areas, 0.0, 1.0)) ** 2))
    else:
        significance = np.full(len(distances), EQUAL_SIGNIFICANCE)
    singletons, frame = masses(matching.normalised(distances), significance)
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
    return np.where(present, dissimilarity, last), belief


def lacking_notes(collection: Sequence[Parts], what: str) -> tuple[str, ...]:
    """A sentence on every object without parts."""
    return tuple(
        f"{what} {parts.name or index} has no feature point, so nothing is known about it"
        for index, parts in enumerate(collection)
        if not len(parts.areas)
    )
