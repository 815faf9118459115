"""Queries made of halves of two models: whether both classes come first, here and with the baselines.

    python -m benchmarks composites [DIR] [--count 30] [--seed 0] [--out FILE.json]

DIR is a labelled folder of meshes; without one the built-in creatures are taken. The queries are 30 composites
(`curvematch_jax.composites`): half of one model joined to half of another of a different class. Each query is ranked
against all models of the collection, the two that it was made of among them. Models of its two classes have grade 2,
models of a related class grade 1, all others 0. Classes are related by the groups of `related.json`, in which classes
with other names have no relatives, or by DIR/related.csv (columns class,related), if there is one.

This is this project's own protocol; its figures compare with no published ones.

Measures: NDCG and average dynamic recall over the whole ranking; in how many queries both classes are among the first
10; NN, the share of queries whose first result has grade 2; in the JSON also mean interpolated precision at recall
0, .1, ..., 1, for grade 2 and for grade 1 or more. With `--out` a picture is drawn beside the file, where a green frame
is grade 2 and a grey one grade 1.
"""

from __future__ import annotations

import argparse
import functools as ft
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from curvematch_jax import (
    Collection,
    Extraction,
    Matching,
    Mesh,
    Parts,
    clean,
    composites,
    extract_parts,
    rank,
)
from curvematch_jax.datasets import Composite
from curvematch_jax.pictures import Tile, sheet
from curvematch_jax.retrieval import run_settings

from ._graded import RELATED, SOURCE, Relatives, graded, judged, relatives
from ._measure import say, timed, use_every_core
from ._models import Model, in_order, jobs_option, models_in, name_of
from ._record import record
from .baselines import BASELINES

METHODS = {"default": Matching(), "partial": Matching.partial(), "paper": Matching.paper()}
_ROWS, _RESULTS = 10, 8  # of the picture


@dataclass(frozen=True, eq=False)
class Described:
    """A cleaned mesh, its parts, and what each baseline says of it, by the baseline's name."""

    mesh: Mesh
    parts: Parts
    baselines: dict[str, Any]


def described(model: Model) -> Described:
    """A mesh, cleaned once for all methods."""
    mesh, _ = clean(model.mesh(), vertices=Extraction().vertices)
    return Described(mesh, extract_parts(mesh), {baseline.name: baseline.describe(mesh) for baseline in BASELINES})


def all_described(models: Sequence[Model], jobs: int) -> tuple[dict[int, Described], list[dict[str, str]]]:
    """By index, and those that cannot be described, with the reasons."""
    outcomes = in_order(described, models, jobs, "describing")
    failed = [{"name": models[each.task].name, "reason": each.failure} for each in outcomes if each.failure is not None]
    for failure in failed:
        say(f"{failure['name']}: {failure['reason']}")
    return {each.task: each.result for each in outcomes if each.failure is None}, failed


def given(mesh: Mesh) -> Mesh:
    """The mesh of a model that is in memory already."""
    return mesh


def dissimilarities(
    queries: Sequence[Described], models: Sequence[Described], methods: Sequence[str]
) -> Iterator[tuple[str, np.ndarray]]:
    """Of every method: its name, and the dissimilarities `(Q, M)`."""
    parts = [model.parts for model in models]
    for name in methods:
        ready = Collection.of(parts, METHODS[name])
        yield name, np.stack([rank(query.parts, ready, METHODS[name]).dissimilarity for query in queries])
    for baseline in BASELINES:
        first, second = ([each.baselines[baseline.name] for each in side] for side in (queries, models))
        yield baseline.name, baseline.compare(first, second)


def evaluation(
    queries: Sequence[Described],
    sources: Sequence[Composite],
    models: Sequence[Described],
    labels: Sequence[str],
    related: Relatives,
    own_methods: Sequence[str],
) -> tuple[dict[str, dict[str, Any]], np.ndarray]:
    """The measures of every method, and the first method's order of the models for each query; says a table."""
    say(f"{'method':18} {'NDCG':>6} {'ADR':>6} {'both in top 10':>15} {'NN':>6}")
    methods, orders = {}, []
    for name, matrix in dissimilarities(queries, models, own_methods):
        found = judged(matrix, [source.labels for source in sources], labels, related)
        count = f"{found['both_in_top_10']} of {len(queries)}"
        say(f"{name:18} {found['ndcg']:6.3f} {found['adr']:6.3f} {count:>15} {found['nn']:6.3f}")
        methods[name] = found
        orders.append(np.argsort(matrix, axis=1, kind="stable"))
    return methods, orders[0]


def draw(
    path: Path, sources: Sequence[Composite], grades: np.ndarray, order: np.ndarray, models: Sequence[Mesh]
) -> None:
    """The first queries, each with its best results."""
    frames = {SOURCE: True, RELATED: None, 0: False}
    rows = [
        [Tile(source.mesh, " + ".join(source.labels))]
        + [Tile(models[k], models[k].name, frames[int(grade[k])]) for k in ranked[:_RESULTS]]
        for source, grade, ranked in zip(sources[:_ROWS], grades, order, strict=False)
    ]
    sheet(rows, path)


def measured(arguments: argparse.Namespace) -> tuple[dict[str, Any], Callable[[Path], None]]:
    """Everything there is to say about one collection, and what draws the first method's answers."""
    collection = models_in(arguments.folder)
    found, failed = all_described(collection, arguments.jobs)
    models, labels = list(found.values()), [collection[index].label for index in found]
    solids = [(each.mesh, label) for each, label in zip(models, labels, strict=True)]
    made = list(composites(solids, arguments.count, arguments.seed))
    asked = [Model(each.mesh.name, " + ".join(each.labels), given, (each.mesh,)) for each in made]
    answers, lost = all_described(asked, arguments.jobs)
    queries, sources = list(answers.values()), [made[index] for index in answers]
    related = relatives(arguments.folder)
    methods, order = evaluation(queries, sources, models, labels, related, arguments.methods)
    grades = graded([source.labels for source in sources], labels, related)
    picture = ft.partial(draw, sources=sources, grades=grades, order=order, models=[each.mesh for each in models])
    facts = {
        "collection": name_of(arguments.folder),
        "objects": len(models),
        "failed": failed + lost,
        "queries": [{"sources": source.sources, "classes": source.labels} for source in sources],
        "related": {label: sorted(related[label]) for label in sorted(set(labels) & related.keys())},
        "methods": methods,
    }
    return facts, picture


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="by default the built-in creatures")
    parser.add_argument("--count", type=int, default=30, metavar="N", help="composites")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS), help="the paper's is slow")
    jobs_option(parser)


def run(arguments: argparse.Namespace) -> None:
    use_every_core()
    settings = {name: run_settings(Extraction(), METHODS[name]) for name in arguments.methods}
    (facts, picture), seconds = timed(lambda: measured(arguments))
    record(arguments, {"settings": settings, **facts, "seconds": seconds})
    if arguments.out:
        picture(arguments.out.with_suffix(".png"))
