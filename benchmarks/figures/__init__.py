"""The figures of the paper, each a picture with its numbers in a JSON file beside it.

    python -m benchmarks figures [DIR] [--only NAME...] [--models NAME...] [--methods default paper] [--per-class N]
                                 [--raw DIR] [--baselines FILE.json] [--out FOLDER]

DIR is a labelled folder of meshes; without one the built-in creatures are taken. Files go to the folder `figures`
unless `--out` names another. What one figure has computed, the next one uses. A figure that fails is reported, and the
others are made.

    feature_points, level_curves, part_geodesic, part_masses, ranked_rows
        of `--models`, or else of the class with the most models
    matrix, precision_recall
        of the whole collection
    noise, moved_points, dirt
        queries that have been changed against the collection as it is. The model that a query was made from is not
        among those that it is compared with. Pictures are 11-point precision-recall of the first method

What a topological short cut does is measured by the benchmark `shortcut`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from curvematch_jax.extraction._workers import one_line
from curvematch_jax.retrieval import run_settings
from curvematch_jax.surface import Extraction

from .._measure import say, timed, use_every_core
from .._models import jobs_option
from .._record import provenance, rounded, write
from . import changes, parts, rankings
from ._collection import MATCHINGS, Collection, Numbers

FIGURES: dict[str, Callable[[Collection, Path, argparse.Namespace], Numbers]] = {
    each.__name__: each
    for each in (
        parts.feature_points,
        parts.level_curves,
        parts.part_geodesic,
        rankings.part_masses,
        rankings.matrix,
        rankings.ranked_rows,
        rankings.precision_recall,
        changes.noise,
        changes.moved_points,
        changes.dirt,
    )
}


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="by default the built-in creatures")
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=list(FIGURES), metavar="NAME")
    parser.add_argument("--models", nargs="+", default=[], metavar="NAME", help="what is drawn, or queries")
    parser.add_argument("--methods", nargs="+", choices=MATCHINGS, default=["default"], help="the paper's is slow")
    parser.add_argument("--per-class", type=int, metavar="N", help="changed queries of each class; by default all")
    parser.add_argument("--raw", type=Path, metavar="DIR", help="raw meshes of the same classes, for `dirt`")
    parser.add_argument("--baselines", type=Path, metavar="FILE.json", help="results of `baselines` to draw")
    jobs_option(parser)


def run(arguments: argparse.Namespace) -> None:
    """Make the figures.

    Raises:
        ValueError: some of them could not be made, after the others were.
    """
    use_every_core()
    collection = Collection.of(arguments.folder, arguments.jobs)
    failed = []
    for name in arguments.only:
        try:
            perform(name, collection, arguments)
        except Exception as error:  # of one figure, which costs the others nothing
            failed.append(name)
            say(f"{name}: {one_line(error)}")
    if failed:
        raise ValueError(f"could not make {', '.join(failed)}: the reasons are above")


def perform(name: str, collection: Collection, arguments: argparse.Namespace) -> None:
    """Make a figure and write its picture and its numbers; says which files these are."""
    folder = arguments.out or Path("figures")
    folder.mkdir(parents=True, exist_ok=True)
    picture, numbers = folder / f"{name}.png", folder / f"{name}.json"
    found, seconds = timed(lambda: FIGURES[name](collection, picture, arguments))
    facts = {
        **provenance(arguments),
        "collection": collection.name,
        "objects": len(collection.models),
        "failed": collection.failed,
        "settings": {method: run_settings(Extraction(), matching()) for method, matching in MATCHINGS.items()},
        "seconds": seconds,
    }
    write(numbers, rounded({**facts, name: found}))
    say(f"{picture}\n{numbers}")
