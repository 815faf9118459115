"""Composite queries: do both classes come first of which a query was made, for this method and the baselines?

    python -m benchmarks.composites [DIR] [--out FILE.json] [--picture FILE.png]

DIR is a labelled folder of meshes; without one the built-in creatures are taken. The queries are 30 composites
(`curvematch_jax.composites`): half of one model joined to half of another of a different class. Each query is ranked
against all models of the collection, the two that it was made of among them. Models of its two classes have grade 2,
models of a related class grade 1, all others 0. Classes are related by the groups of `related.json`, in which classes
with other names have no relatives, or by DIR/related.csv (columns class,related), if there is one.

This is this project's own protocol; its figures compare with no published ones.

Measures: NDCG and average dynamic recall over the whole ranking; in how many queries both classes are among the first
10; NN, the share of queries whose first result has grade 2; in the JSON also mean interpolated precision at recall
0, .1, ..., 1, for grade 2 and for grade 1 or more. In the picture a green frame is grade 2, a grey one grade 1.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._graded import RELATED, SOURCE, Relatives, graded, measured, relatives
from benchmarks._record import versions, write
from benchmarks.baselines import BASELINES
from curvematch_jax import (
    Collection,
    Extraction,
    Matching,
    Mesh,
    Parts,
    clean,
    composites,
    creatures,
    extract_parts,
    load_mesh,
    rank,
)
from curvematch_jax.cli._jax import configure_jax
from curvematch_jax.datasets import Composite, labelled_folder
from curvematch_jax.extraction import Failure
from curvematch_jax.extraction._sources import Source
from curvematch_jax.extraction._workers import cores, in_processes
from curvematch_jax.pictures import Tile, sheet
from curvematch_jax.retrieval import run_settings

METHODS = {"default": Matching(), "partial": Matching.partial(), "paper": Matching.paper()}
_ROWS, _RESULTS = 10, 8  # of the picture


@dataclass(frozen=True, eq=False)
class Described:
    """A cleaned mesh, its parts, and what each baseline says of it, by the baseline's name."""

    mesh: Mesh
    parts: Parts
    baselines: dict[str, Any]


def described(source: Mesh | Source) -> Described:
    """A mesh, or the file of one, cleaned once for all methods."""
    given = source if isinstance(source, Mesh) else load_mesh(source.path, source.name)
    mesh, _ = clean(given, vertices=Extraction().vertices)
    return Described(mesh, extract_parts(mesh), {baseline.name: baseline.describe(mesh) for baseline in BASELINES})


def collection(folder: Path | None) -> list[tuple[Mesh | Source, str]]:
    """Every model and its class."""
    if folder is None:
        return [(creature.mesh, creature.label) for creature in creatures()]
    return [(Source(path, path.relative_to(folder).as_posix()), label) for path, label in labelled_folder(folder)]


def all_described(sources: Sequence[Mesh | Source], jobs: int) -> tuple[dict[int, Described], list[Failure]]:
    """By index, and those that failed, which cost themselves alone."""
    outcomes = sorted(in_processes(described, sources, jobs), key=lambda outcome: outcome.task)
    failed = [Failure(sources[each.task].name, each.failure) for each in outcomes if each.failure is not None]
    for failure in failed:
        print(f"{failure.name}: {failure.reason}", file=sys.stderr)
    return {each.task: each.result for each in outcomes if each.failure is None}, failed


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
    """The measures of every method, and the first method's order of the models for each query; prints a table."""
    print(f"{'method':18} {'NDCG':>6} {'ADR':>6} {'both in top 10':>15} {'NN':>6}")
    methods, orders = {}, []
    for name, matrix in dissimilarities(queries, models, own_methods):
        found = measured(matrix, [source.labels for source in sources], labels, related)
        count = f"{found['both_in_top_10']} of {len(queries)}"
        print(f"{name:18} {found['ndcg']:6.3f} {found['adr']:6.3f} {count:>15} {found['nn']:6.3f}", flush=True)
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


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Everything there is to say about one collection."""
    folder, jobs = arguments.folder, arguments.jobs
    start = time.perf_counter()
    given = collection(folder)
    found, failed = all_described([source for source, _ in given], jobs)
    models, labels = list(found.values()), [given[index][1] for index in found]
    made = list(
        composites([(m.mesh, label) for m, label in zip(models, labels, strict=True)], arguments.count, arguments.seed)
    )
    answers, lost = all_described([composite.mesh for composite in made], jobs)
    queries, sources = list(answers.values()), [made[index] for index in answers]
    related = relatives(folder)
    methods, order = evaluation(queries, sources, models, labels, related, arguments.methods)
    if arguments.picture:
        grades = graded([source.labels for source in sources], labels, related)
        draw(arguments.picture, sources, grades, order, [model.mesh for model in models])
    return {
        "collection": folder.resolve().name if folder else "creatures",
        "objects": len(models),
        "failed": [dataclasses.asdict(failure) for failure in failed + lost],
        "seed": arguments.seed,
        "queries": [{"sources": source.sources, "classes": source.labels} for source in sources],
        "related": {label: sorted(related[label]) for label in sorted(set(labels) & related.keys())},
        "methods": methods,
        "seconds": time.perf_counter() - start,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Composite queries: this method and the baselines.")
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the figures here, too")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw queries with their best results")
    parser.add_argument("--jobs", type=int, default=cores())
    parser.add_argument("--count", type=int, default=30, help="composites")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS), help="the paper's is slow")
    arguments = parser.parse_args()
    configure_jax(cache=False)
    results = {
        "versions": versions(),
        "settings": {
            name: run_settings(Extraction(), matching)
            for name, matching in METHODS.items()
            if name in arguments.methods
        },
        **run(arguments),
    }
    if arguments.out:
        write(arguments.out, results)


if __name__ == "__main__":
    main()
