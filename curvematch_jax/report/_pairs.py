"""Which parts of queries matched which parts of their best objects, and what they believe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._progress import Progress, reporter
from ..pictures._colours import matched_by
from ..retrieval import Collection, Matching, Ranking, rank
from ..retrieval._belief import combine, odds_masses
from ..retrieval._ranking import fuse
from ..surface import Parts


def explained(
    parts: Sequence[Parts], rows: dict[int, list[int]], matching: Matching, progress: Progress = False
) -> dict[str, object]:
    """The matched parts of queries and of the best objects of their rankings.

    Beliefs are on the other objects: the query itself, which is as near as can be, is left out.

    Args:
        parts: (M,) of the collection, extracted with the same settings.
        rows: of each query, the objects that are set beside it; indices into `parts`.

    Returns:
        of each query: the `ignorance` of its parts, which is their mass on all objects together; of the combination of
        all, the `conflict` and what stays `open`; and the `objects`, each with its pignistic probability and its
        `matches`: the two parts, their distance, the mass on the object, and the part's own pignistic probability.

    Raises:
        ValueError: as `Collection.of`.
    """
    collection = Collection.of(iter(parts), matching, progress)
    present = ~collection.stack.lacking
    report, found = reporter(progress, "explanations", "queries"), {}
    for done, (query, objects) in enumerate(rows.items(), start=1):
        asked = parts[query]
        found[str(query)] = _beliefs(rank(asked, collection, matching), query, objects, asked.areas, present, matching)
        report(done, len(rows))
    return found


def _beliefs(
    ranking: Ranking, query: int, objects: Sequence[int], areas: np.ndarray, present: np.ndarray, matching: Matching
) -> dict[str, object]:
    others = np.delete(np.arange(len(present)), query)
    fused = fuse(ranking.distances[:, others], areas, present[others], matching)
    belief = fused.belief
    if matching.mutual:
        belief = combine(*odds_masses(np.stack([said[others] for said in ranking.evidence.values()])))
    ignorance = np.clip(1 - fused.masses.sum(axis=1), 0.0, 1.0)
    # A part's masses are on single objects and on all together: BetP(j) = m({j}) + m(all) / M (equation 3).
    pignistic = fused.masses + ignorance[:, None] / len(others)
    column = {int(j): k for k, j in enumerate(others)}
    shown = {}
    for j in objects:
        k, matches = column[j], ranking.explain(j)
        shown[str(j)] = {
            "probability": _short(belief.probability[k]),
            "matches": [
                [m.part, m.other, _short(m.distance), _short(fused.masses[m.part, k]), _short(pignistic[m.part, k])]
                for m in matches
            ],
            "owner": matched_by(matches, max((m.other for m in matches), default=-1) + 1).tolist(),
        }
    known = {"conflict": _short(belief.conflict), "open": _short(belief.ignorance)}
    return {"ignorance": [_short(value) for value in ignorance], **known, "objects": shown}


def _short(value: float) -> float:
    return float(f"{value:.4g}")
