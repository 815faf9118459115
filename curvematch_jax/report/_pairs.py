"""Which parts of queries matched which parts of their best objects, and what they believe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._progress import Progress, reporter
from ..pictures._colours import matched_by
from ..retrieval import Collection, Matching, Ranking, rank
from ..surface import Parts


def explained(
    parts: Sequence[Parts], rows: dict[int, list[int]], matching: Matching, progress: Progress = False
) -> dict[str, object]:
    """The matched parts of queries and the best objects of their rankings.

    Arguments:
        parts: of the collection, extracted with the same settings.
        rows: of each query, the objects to explain; indices into `parts`.

    Returns:
        of each query: the `ignorance` of its parts, their masses on the whole collection; the `conflict` and `ignorance`
        of their combination; and the `objects`, each with its pignistic probability and its `matches`.

    Raises:
        ValueError: as `Collection.of`.
    """
    collection = Collection.of(iter(parts), matching, progress)
    report, found = reporter(progress, "explanations", "queries"), {}
    for done, (query, objects) in enumerate(rows.items(), start=1):
        found[str(query)] = _query(rank(parts[query], collection, matching, top=len(objects) + 1), objects)
        report(done, len(rows))
    return found


def _query(ranking: Ranking, objects: list[int]) -> dict[str, object]:
    known = [j for j in objects if ranking.exact[j]]
    ignorance = np.clip(1 - ranking.masses.sum(axis=1), 0.0, 1.0)
    return {
        "ignorance": [_short(value) for value in ignorance],
        "conflict": _short(ranking.conflict),
        "open": _short(ranking.ignorance),
        "objects": {str(j): _object(ranking, j, ignorance) for j in known},
    }


def _object(ranking: Ranking, j: int, ignorance: np.ndarray) -> dict[str, object]:
    """One object: of each match the two parts, distance, mass, and the part's own pignistic probability.

    A part's masses are on single objects and on all M together, so that its pignistic probability of object j is
    `m({j}) + m(all) / M` (equation 3).
    """
    matches = ranking.explain(j)
    count = len(ranking.names)
    return {
        "probability": _short(ranking.probability[j]),
        "matches": [
            [m.part, m.other, _short(m.distance), _short(m.mass), _short(m.mass + ignorance[m.part] / count)]
            for m in matches
        ],
        "owner": matched_by(matches, max((m.other for m in matches), default=-1) + 1).tolist(),
    }


def _short(value: float) -> float:
    return float(f"{value:.4g}")
