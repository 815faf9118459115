"""How good a dissimilarity matrix is, given which objects belong together."""

from __future__ import annotations

import functools as ft
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from . import _measures
from ._matrix_file import refuse_saved

_MEASURES = {
    "nn": _measures.nearest_neighbour,
    "ft": ft.partial(_measures.tier, multiple=1),
    "st": ft.partial(_measures.tier, multiple=2),
    "e": _measures.e_measure,
    "dcg": _measures.dcg,
    "map": _measures.average_precision,
}


@dataclass(frozen=True, eq=False)
class Scores:
    """Retrieval measures in [0, 1], higher is better; the query itself is never counted.

    Attributes:
        nn, ft, st, e, dcg, map: means over the queries of nearest neighbour, first tier, second tier,
            E measure (depth 32), normalised discounted cumulated gain and average precision.
        map_macro: mean over the classes of the classes' mean average precision.
        precision_11: (11,) interpolated precision at recall 0, .1, ..., 1.
        precision_20: (20,) precision at recall .05, .1, ..., 1, linear between the hits (Princeton Shape Benchmark);
            NaN where no class is large enough to have that recall.
        by_query: the six measures, (Q,) each, of the queries `queries` (Q,), indices into the matrix.
        labels: (M,) the class of every object.
        left_out: classes of one member. Their objects have nothing to find: they are no queries, but stay among
            the objects that are ranked.
    """

    nn: float
    ft: float
    st: float
    e: float
    dcg: float
    map: float
    map_macro: float
    precision_11: np.ndarray
    precision_20: np.ndarray
    by_query: Mapping[str, np.ndarray]
    queries: np.ndarray
    labels: tuple[str, ...]
    left_out: tuple[str, ...]

    def by_class(self) -> dict[str, dict[str, float]]:
        """Mean of each measure over the queries of each class, in the classes' alphabetical order."""
        classes = np.array(self.labels)[self.queries]
        return {
            str(name): {measure: float(values[classes == name].mean()) for measure, values in self.by_query.items()}
            for name in np.unique(classes)
        }

    def summary(self) -> dict[str, object]:
        """Everything but the single queries, in types that JSON knows; an unknown precision is None."""
        means = {name: getattr(self, name) for name in (*_MEASURES, "map_macro")}
        return {
            **means,
            "precision_11": self.precision_11.tolist(),
            "precision_20": [None if np.isnan(p) else float(p) for p in self.precision_20],
            "queries": int(self.queries.size),
            "left_out": list(self.left_out),
            "classes": self.by_class(),
        }


@dataclass(frozen=True, eq=False)
class GradedScores:
    """Measures of rankings whose objects are relevant to a degree, for Q queries against M objects.

    Attributes:
        ndcg, adr: means over the queries of the whole ranking's normalised discounted cumulated gain and of the
            average dynamic recall, in [0, 1].
        ndcg_at: (M,) mean normalised gain of the first k, for k = 1..M.
        by_query: `ndcg` and `adr`, (Q,) each.
    """

    ndcg: float
    adr: float
    ndcg_at: np.ndarray
    by_query: Mapping[str, np.ndarray]


def evaluate(dissimilarity: np.ndarray, labels: Iterable[object]) -> Scores:
    """Measure a dissimilarity matrix against the objects' classes.

    Every object is a query against all the others; an object of equal dissimilarity and lower index comes first.

    Args:
        dissimilarity: (M, M), rows are queries, smaller is more similar. The diagonal is not used.
        labels: M classes; they are compared as text.

    Returns:
        `Scores`.

    Raises:
        `ValueError` when the matrix is not square, holds NaN, does not fit the labels, or when no class has
        two members.
    """
    matrix = _checked(dissimilarity, "dissimilarity")
    names = np.array([str(label) for label in labels])
    if matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"dissimilarity has shape {matrix.shape}: it must be square, a row and a column an object")
    if names.size != len(matrix):
        raise ValueError(
            f"{names.size} labels were given for the {len(matrix)} objects of the matrix: one each is needed"
        )
    classes, members = np.unique(names, return_counts=True)
    queries = np.flatnonzero(np.isin(names, classes[members > 1]))
    if queries.size == 0:
        raise ValueError(f"no class has two members among {len(matrix)} objects: there is nothing to retrieve")
    relevance = list(_relevance(matrix, names, queries))
    by_query = {name: np.array([measure(r) for r in relevance]) for name, measure in _MEASURES.items()}
    return Scores(
        **{name: float(values.mean()) for name, values in by_query.items()},
        map_macro=_class_mean(by_query["map"], names[queries]),
        precision_11=np.mean([_measures.eleven_point_precision(r) for r in relevance], axis=0),
        precision_20=_mean_of_known(np.array([_measures.twenty_bin_precision(r) for r in relevance])),
        by_query=by_query,
        queries=queries,
        labels=tuple(names.tolist()),
        left_out=tuple(classes[members == 1].tolist()),
    )


def evaluate_graded(dissimilarity: np.ndarray, grades: np.ndarray) -> GradedScores:
    """Measure rankings whose objects are relevant to a degree, such as those of composite queries.

    Args:
        dissimilarity: (Q, M), rows are queries, smaller is more similar. No query is among the M objects.
        grades: (Q, M), gains >= 0: 2 highly relevant, 1 marginally, 0 not.

    Returns:
        `GradedScores`.

    Raises:
        `ValueError` when the shapes differ, a value is NaN, a grade is negative, or a query has no relevant
        object.
    """
    matrix, gains = _checked(dissimilarity, "dissimilarity"), _checked(grades, "grades")
    if matrix.shape != gains.shape:
        raise ValueError(f"dissimilarity has shape {matrix.shape} and grades {gains.shape}: they must be equal")
    if (gains < 0).any() or np.isinf(gains).any():
        raise ValueError("grades must be finite and not negative")
    lacking = np.flatnonzero(~(gains > 0).any(axis=1))
    if lacking.size:
        raise ValueError(f"query {lacking[0]} has no relevant object: give it a positive grade, or leave it out")
    ranked = [row[np.argsort(scores, kind="stable")] for scores, row in zip(matrix, gains, strict=True)]
    curves = np.array([_measures.ndcg(row) for row in ranked])
    by_query = {"ndcg": curves[:, -1], "adr": np.array([_measures.average_dynamic_recall(row) for row in ranked])}
    return GradedScores(
        ndcg=float(by_query["ndcg"].mean()),
        adr=float(by_query["adr"].mean()),
        ndcg_at=curves.mean(axis=0),
        by_query=by_query,
    )


def _checked(values: np.ndarray, name: str) -> np.ndarray:
    refuse_saved(name, values)
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{name} holds {array.dtype} values: numbers are needed")
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"{name} has shape {array.shape}: a matrix, a row a query, is needed")
    array = array.astype(np.float64)
    unknown = np.argwhere(np.isnan(array))
    if len(unknown):
        raise ValueError(f"{name} holds {len(unknown)} NaN, the first at {tuple(unknown[0].tolist())}")
    return array


def _relevance(matrix: np.ndarray, names: np.ndarray, queries: np.ndarray) -> Iterator[np.ndarray]:
    """For each query, which of the others are of its class, in the order of their dissimilarity: (M - 1,) bool."""
    for query in queries:
        order = np.argsort(matrix[query], kind="stable")
        yield names[order[order != query]] == names[query]


def _class_mean(values: np.ndarray, classes: np.ndarray) -> float:
    return float(np.mean([values[classes == name].mean() for name in np.unique(classes)]))


def _mean_of_known(values: np.ndarray) -> np.ndarray:
    """Mean over the rows without the NaN, NaN where there is nothing else."""
    known = ~np.isnan(values)
    count = known.sum(axis=0)
    return np.where(count > 0, np.where(known, values, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)
