"""Figures of rankings: masses of parts, the matrix, ranked rows, and precision against recall beside the baselines."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from curvematch_jax.pictures import Tile, masses_picture, matrix_picture, sheet
from curvematch_jax.retrieval import evaluate, rank

from .._measure import say
from ..baselines import measured
from . import _drawing
from ._changed import scores
from ._collection import Collection, Numbers

_OBJECTS = 20
_ROWS, _COLUMNS = 10, 8


def part_masses(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The masses that the parts of one query put on the other objects, by the belief model."""
    query = (collection.named(arguments.models[:1]) or collection.members())[0]
    others = [j for j in range(len(collection.described)) if j != query]
    ranking = rank(collection.parts[query], [collection.parts[j] for j in others])
    masses_picture(ranking, picture, _OBJECTS)
    best = ranking.order[:_OBJECTS].tolist()
    return {
        "query": collection.described[query].name,
        "conflict": ranking.conflict,
        "ignorance": ranking.ignorance,
        "objects": [
            {
                "name": collection.described[others[j]].name,
                "class": collection.labels[others[j]],
                "probability": float(ranking.probability[j]),
                "masses": ranking.masses[:, j].tolist(),
            }
            for j in best
        ],
    }


def matrix(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The dissimilarities of all pairs of models, classes in blocks.

    The JSON has the scores, and the mean dissimilarity of each class to each other.
    """
    found = collection.matrix()
    matrix_picture(found, collection.labels, picture)
    measures = evaluate(found, collection.labels).summary()
    return {"scores": measures, "class_means": class_means(found, collection.labels)}


def class_means(matrix: np.ndarray, labels: list[str]) -> dict[str, dict[str, float | None]]:
    """Mean dissimilarity of queries of one class to other models of each; None for a class of one model to itself."""
    names, other = np.array(labels), ~np.eye(len(labels), dtype=bool)

    def mean(query: str, model: str) -> float | None:
        pairs = other & (names == query)[:, None] & (names == model)
        return float(matrix[pairs].mean()) if pairs.any() else None

    return {query: {model: mean(query, model) for model in sorted(set(labels))} for query in sorted(set(labels))}


def ranked_rows(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Queries with what is most similar to them: green frames are of the query's class, dashed red ones are not.

    Without `--models` the first model of each class queries the others, of at most ten classes.
    """
    chosen = collection.named(arguments.models) or collection.first_of_each_class(1)[:_ROWS]
    found, models = collection.matrix(), collection.described
    rows, named = [], {}
    for k in chosen:
        best = [j for j in np.argsort(found[k], kind="stable").tolist() if j != k][:_COLUMNS]
        right = [models[j].label == models[k].label for j in best]
        rows.append([Tile(models[k].mesh, models[k].name)])
        rows[-1] += [Tile(models[j].mesh, models[j].name, same) for j, same in zip(best, right, strict=True)]
        named[models[k].name] = [{"name": models[j].name, "right": same} for j, same in zip(best, right, strict=True)]
    sheet(rows, picture)
    return named


def precision_recall(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """11-point interpolated precision-recall of `--methods` and the baselines; the query is never counted.

    Figures of the baselines are taken from the file of `--baselines`, if it is given. The JSON says of every method at
    which recall the first one is not above it.
    """
    labels = collection.labels
    curves = {
        name: scores(collection.matrix(name), range(len(labels)), labels)["precision_11"] for name in arguments.methods
    }
    if arguments.baselines:
        curves |= known_baselines(arguments.baselines, collection.name)
    else:
        curves |= _precision(measured(collection.name, collection.models, collection.jobs)["baselines"])
    _drawing.precision_recall(curves, picture, collection.name)
    behind = not_above(curves)
    for name, recalls in behind.items():
        where = (
            f"not above it at recall {', '.join(map(str, recalls))}" if recalls else "above it at every recall level"
        )
        say(f"{next(iter(curves))} and {name}: {where}")
    return {"precision_11": curves, "not_above": behind}


def known_baselines(path: Path, collection: str) -> dict[str, list[float]]:
    """What a file says of this collection.

    Raises:
        ValueError: it says nothing.
    """
    found = [
        each["baselines"] for each in json.loads(path.read_text())["collections"] if each["collection"] == collection
    ]
    if not found:
        raise ValueError(f"{path} has no collection {collection}")
    return _precision(found[0])


def _precision(rows: Sequence[Numbers]) -> dict[str, list[float]]:
    return {row["name"]: row["measures"]["precision_11"] for row in rows if row["measures"]}


def not_above(curves: Mapping[str, Sequence[float]]) -> dict[str, list[float]]:
    """Of each other method, the recalls at which the first one is below it, or the same below 1."""
    first, *others = curves
    return {
        name: [k / 10 for k, (a, b) in enumerate(zip(curves[first], curves[name], strict=True)) if a < b or a == b < 1]
        for name in others
    }
