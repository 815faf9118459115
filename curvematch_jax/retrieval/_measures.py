"""What a single ranking is worth.

Every function takes one query's ranking, best first and without the query itself: either `relevant` (n,) bool, or
the `grades` (n,) >= 0 of a graded judgement. At least one object has to be relevant.

Sources: P. Shilane, P. Min, M. Kazhdan, T. Funkhouser, "The Princeton Shape Benchmark", SMI 2004 (nearest neighbour,
tiers, E, DCG, the 20 bins); K. Järvelin, J. Kekäläinen, "Cumulated gain-based evaluation of IR techniques", TOIS 2002
(NDCG); R. Typke, R. Veltkamp, F. Wiering, "A measure for evaluating retrieval techniques based on partially ordered
ground truth lists", ICME 2006 (ADR).
"""

from __future__ import annotations

import numpy as np

E_MEASURE_DEPTH = 32
ELEVEN_POINTS = np.linspace(0.0, 1.0, 11)
TWENTY_BINS = np.linspace(0.05, 1.0, 20)


def nearest_neighbour(relevant: np.ndarray) -> float:
    """Whether the first object is relevant."""
    return float(relevant[0])


def tier(relevant: np.ndarray, multiple: int) -> float:
    """Share of the C relevant objects among the first `multiple * C`: the first and the second tier."""
    count = int(relevant.sum())
    return float(relevant[: multiple * count].sum() / count)


def e_measure(relevant: np.ndarray) -> float:
    """Harmonic mean of precision and recall of the first 32. Its ceiling depends on C: .745 for C = 19."""
    depth = min(E_MEASURE_DEPTH, relevant.size)
    return float(2.0 * relevant[:depth].sum() / (depth + relevant.sum()))


def discounted_gain(gains: np.ndarray) -> np.ndarray:
    """Gains summed down the ranking, (n,): the first counts in full, the i-th as `gain / log2 i`."""
    discount = np.ones(gains.size)
    discount[1:] = np.log2(np.arange(2, gains.size + 1))
    return np.cumsum(gains / discount)


def dcg(relevant: np.ndarray) -> float:
    """Discounted gain of the whole ranking as a share of the best possible."""
    ideal = discounted_gain(np.sort(relevant)[::-1])
    return float(discounted_gain(relevant)[-1] / ideal[-1])


def average_precision(relevant: np.ndarray) -> float:
    """Mean of the precisions at the ranks of the relevant objects."""
    return float(_precision_at_hits(relevant).mean())


def eleven_point_precision(relevant: np.ndarray) -> np.ndarray:
    """Highest precision at recall r or beyond, (11,) for r = 0, .1, ..., 1."""
    precision = _precision_at_hits(relevant)
    best_from_here = np.maximum.accumulate(precision[::-1])[::-1]
    # The tolerance keeps .1 * 10 at the first hit, whatever the rounding of .1.
    needed = np.ceil(ELEVEN_POINTS * precision.size - 1e-9).astype(int)
    return best_from_here[np.maximum(needed - 1, 0)]


def twenty_bin_precision(relevant: np.ndarray) -> np.ndarray:
    """Precision at recall r, linear between the hits, (20,) for r = .05, .1, ..., 1.

    NaN below the first hit's recall `1 / C`, where the precision is unknown; the benchmark's own program leaves
    those queries out of the bin's mean.
    """
    precision = _precision_at_hits(relevant)
    recall = np.arange(1, precision.size + 1) / precision.size
    values = np.interp(TWENTY_BINS, recall, precision)
    return np.where(recall[0] - 1e-9 > TWENTY_BINS, np.nan, values)


def ndcg(grades: np.ndarray) -> np.ndarray:
    """Discounted gain down to every depth as a share of the best possible to that depth, (n,). Gain = grade."""
    return discounted_gain(grades) / discounted_gain(np.sort(grades)[::-1])


def average_dynamic_recall(grades: np.ndarray) -> float:
    """Mean over i = 1..R of the share of the first i that are at least as good as the i-th of an ideal ranking.

    R is the number of objects of positive grade.
    """
    ideal = np.sort(grades)[::-1]
    count = int((grades > 0).sum())
    return float(np.mean([(grades[:i] >= ideal[i - 1]).sum() / i for i in range(1, count + 1)]))


def _precision_at_hits(relevant: np.ndarray) -> np.ndarray:
    """Precision at the rank of each relevant object, (C,)."""
    ranks = np.flatnonzero(relevant) + 1
    return np.arange(1, ranks.size + 1) / ranks
