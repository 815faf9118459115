"""Queries that have been changed against a collection that has not: how much worse they are than they were."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from curvematch_jax.retrieval import rank
from curvematch_jax.retrieval._measures import average_precision, eleven_point_precision, nearest_neighbour, tier
from curvematch_jax.surface import Parts

from .._measure import say
from ._collection import MATCHINGS, Collection, Numbers
from ._drawing import precision_recall

# Changed queries, by the index of the model that each was made from.
Queries = Mapping[int, Parts]


def changed(
    collection: Collection, function: Callable[..., Parts], amounts: Sequence[float], per_class: int | None
) -> dict[str, Queries]:
    """Queries made by `function((model, amount))` in worker processes, for each amount."""
    chosen, variants = collection.first_of_each_class(per_class), {}
    for amount in amounts:
        name = f"{100 * amount:g} %"
        made = collection.each(function, [(collection.model(k), amount) for k in chosen], name)
        variants[name] = {k: parts for k, parts in zip(chosen, made, strict=True) if parts is not None}
    return variants


def compared(
    collection: Collection, variants: Mapping[str, Queries], methods: Sequence[str], picture: Path, title: str
) -> Numbers:
    """Scores of every method on every variant; the picture is 11-point precision-recall of the first method."""
    table = {method: against_clean(variants, collection, method) for method in methods}
    curves = {}
    for name, row in table[methods[0]].items():
        curves |= {"unchanged": row["clean"]["precision_11"], name: row["changed"]["precision_11"]}
    precision_recall(curves, picture, f"{collection.name}: {title}")
    return table


def query_rows(queries: Queries, collection: Collection, method: str = "default") -> np.ndarray:
    """Dissimilarities `(Q, M)` of queries, each made from the model that its key says; that one's column is 0."""
    rows = np.zeros((len(queries), len(collection.described)))
    for row, (own, query) in zip(rows, queries.items(), strict=True):
        others = [j for j in range(len(row)) if j != own]
        row[others] = rank(query, [collection.parts[j] for j in others], MATCHINGS[method]()).dissimilarity
    return rows


def scores(rows: np.ndarray, own: Sequence[int], labels: Sequence[str]) -> Numbers:
    """Means over Q queries against M models, of which number `own` is the query itself or what it was made from.

    Queries that are alone in their class have nothing to find and do not count.
    """
    names, ranked = np.asarray(labels), []
    for row, k in zip(rows, own, strict=True):
        order = np.argsort(row, kind="stable")
        relevant = names[order[order != k]] == names[k]
        ranked += [relevant] if relevant.any() else []
    if not ranked:
        raise ValueError("no query has another model of its class: there is nothing to retrieve")
    return {
        "queries": len(ranked),
        "nn": float(np.mean([nearest_neighbour(row) for row in ranked])),
        "ft": float(np.mean([tier(row, 1) for row in ranked])),
        "map": float(np.mean([average_precision(row) for row in ranked])),
        "precision_11": np.mean([eleven_point_precision(row) for row in ranked], axis=0).tolist(),
    }


def against_clean(variants: Mapping[str, Queries], collection: Collection, method: str) -> Numbers:
    """Scores of changed queries, of the unchanged models that they were made from, and what the change costs."""
    table = {}
    for name, queries in variants.items():
        own = list(queries)
        before = scores(collection.matrix(method)[own], own, collection.labels)
        after = scores(query_rows(queries, collection, method), own, collection.labels)
        loss = {measure: before[measure] - after[measure] for measure in ("nn", "ft", "map")}
        table[name] = {"clean": before, "changed": after, "loss": loss}
        say(f"{method}, {name}: mAP {before['map']:.3f} clean, {after['map']:.3f} changed; " +
            ", ".join(f"{measure} loses {lost:.3f}" for measure, lost in loss.items()))  # fmt: skip
    return table
