"""How good rankings of composites are: related classes, grades of relevance, measures."""

from __future__ import annotations

import csv
import itertools as it
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from curvematch_jax.retrieval import evaluate_graded
from curvematch_jax.retrieval._measures import eleven_point_precision, nearest_neighbour

SOURCE, RELATED = 2, 1
TOP = 10
_TABLE = Path(__file__).with_name("related.json")
_FILE = "related.csv"

Relatives = Mapping[str, frozenset[str]]


def relatives(folder: Path | None = None) -> Relatives:
    """The related classes of each class that has any: those of the folder's `related.csv`, or else of `related.json`.

    `related.csv` has a row `class,related` for each pair; being related goes both ways. In `related.json` all classes
    of a group are related to each other.

    Raises:
        ValueError: a `related.csv` without these columns, or with a row that lacks one.
    """
    path = folder / _FILE if folder else None
    if path and path.exists():
        return _symmetric(_pairs_of_rows(path))
    groups = json.loads(_TABLE.read_text())
    return _symmetric(pair for group in groups for pair in it.combinations(group["classes"], 2))


def graded(sources: Sequence[tuple[str, str]], labels: Sequence[str], related: Relatives) -> np.ndarray:
    """Grades `(Q, M)` of M models for Q composites of two classes: of one of the two, related to one, or neither."""
    grades = np.zeros((len(sources), len(labels)), dtype=np.int64)
    for row, pair in zip(grades, sources, strict=True):
        near = frozenset().union(*(related.get(label, frozenset()) for label in pair))
        row[np.isin(labels, sorted(near))] = RELATED
        row[np.isin(labels, pair)] = SOURCE
    return grades


def judged(
    dissimilarity: np.ndarray, sources: Sequence[tuple[str, str]], labels: Sequence[str], related: Relatives
) -> dict[str, object]:
    """Every measure of Q rankings of M models, in types that JSON knows."""
    grades = graded(sources, labels, related)
    scores = evaluate_graded(dissimilarity, grades)
    order = np.argsort(dissimilarity, axis=1, kind="stable")
    ranked = np.take_along_axis(grades, order, axis=1)
    both = [set(pair) <= set(np.asarray(labels)[row[:TOP]]) for pair, row in zip(sources, order, strict=True)]
    return {
        "ndcg": scores.ndcg,
        "adr": scores.adr,
        "both_in_top_10": sum(both),
        "nn": float(np.mean([nearest_neighbour(row == SOURCE) for row in ranked])),
        "precision_11_related": _precision(ranked >= RELATED),
        "precision_11_sources": _precision(ranked == SOURCE),
        "by_query": {
            "ndcg": scores.by_query["ndcg"].tolist(),
            "adr": scores.by_query["adr"].tolist(),
            "both_in_top_10": both,
        },
    }


def _precision(relevant: np.ndarray) -> list[float]:
    """Mean interpolated precision at recall 0, .1, ..., 1."""
    return np.mean([eleven_point_precision(row) for row in relevant], axis=0).tolist()


def _symmetric(pairs: Iterable[tuple[str, str]]) -> Relatives:
    found: dict[str, set[str]] = {}
    for one, other in pairs:
        found.setdefault(one, set()).add(other)
        found.setdefault(other, set()).add(one)
    return {label: frozenset(near) for label, near in found.items()}


def _pairs_of_rows(path: Path) -> list[tuple[str, str]]:
    reader = csv.DictReader(path.read_text(encoding="utf-8-sig").splitlines(), skipinitialspace=True)
    if not {"class", "related"} <= set(reader.fieldnames or ()):
        raise ValueError(f"{path}: the first line must name the columns class,related")
    pairs = [((row["class"] or "").strip(), (row["related"] or "").strip()) for row in reader]
    if not all(one and other for one, other in pairs):
        raise ValueError(f"{path}: each row needs a class and a related one")
    return pairs
