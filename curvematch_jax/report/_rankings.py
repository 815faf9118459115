"""Which queries a report lists, what they found, and which of it is drawn."""

from __future__ import annotations

from itertools import chain
from typing import NamedTuple

import numpy as np

from ._limits import Limits
from ._packed import packed, spread


class Rankings(NamedTuple):
    """The rankings of Q queries; objects are indices into the matrix."""

    queries: np.ndarray  # (Q,)
    ranked: np.ndarray  # (Q, R), best first, without the query
    values: np.ndarray  # (Q, R) dissimilarities
    explained: dict[int, list[int]]  # of some queries, the objects that are set beside them

    def packed(self) -> dict[str, object]:
        """As the page reads it."""
        return {
            "queries": packed(self.queries, "u4"),
            "ranked": packed(self.ranked, "u4"),
            "values": packed(self.values, "f4"),
            "count": self.ranked.shape[1],
        }

    def drawn(self, limit: int) -> list[int]:
        """At most `limit` objects to draw: the explained queries, their best objects, the second best, and so on."""
        beside = zip(*self.explained.values(), strict=True)
        return list(dict.fromkeys([*self.explained, *chain.from_iterable(beside)]))[:limit]


def rankings(matrix: np.ndarray, order: np.ndarray, limits: Limits) -> Rankings:
    """The rankings of a matrix (M, M); of equally dissimilar objects the one of lower index comes first.

    Args:
        order: (M,) the objects class by class, along which queries are spread.
    """
    queries = order[spread(len(order), limits.queries)]
    count = min(limits.ranked, len(matrix) - 1)
    ranked = np.empty((len(queries), count), int)
    for k, query in enumerate(queries.tolist()):
        found = np.argsort(matrix[query], kind="stable")
        ranked[k] = found[found != query][:count]
    some = spread(len(queries), limits.explained).tolist()
    explained = {int(queries[k]): ranked[k, : limits.pairs].tolist() for k in some}
    return Rankings(queries, ranked, matrix[queries[:, None], ranked], explained)
