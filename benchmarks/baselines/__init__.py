"""Other retrieval methods, each from its own publication, by every measure.

    python -m benchmarks baselines [DIR...] [--out FILE.json]

A DIR has `labels.csv` with the columns `file,class`, or a folder of meshes per class; without one the generated
creatures are asked. Meshes are cleaned and described in worker processes; seconds are those of describing one model,
after its cleaning.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from curvematch_jax.extraction._workers import one_line
from curvematch_jax.retrieval import Scores, evaluate
from curvematch_jax.surface import Mesh, clean

from .._measure import say, timed
from .._models import Model, in_order, jobs_option, models_in, name_of
from .._record import record
from . import erg
from .descriptors import d2, dsr, geodesic_d2, l1, relative, rsh, shape_dna

_MEASURES = {"NN": "nn", "FT": "ft", "ST": "st", "E": "e", "DCG": "dcg", "mAP": "map"}


@dataclass(frozen=True)
class Baseline:
    """A method: one mesh to a description, and descriptions to dissimilarities.

    Attributes:
        name: what tables call it.
        describe: a closed connected mesh, as `clean` makes it, to something that can be pickled. The same mesh always
            gets the same description.
        compare: Q descriptions and M descriptions to dissimilarities `(Q, M)`; smaller is more similar.
    """

    name: str
    describe: Callable[[Mesh], Any]
    compare: Callable[[Sequence[Any], Sequence[Any]], np.ndarray]


BASELINES: tuple[Baseline, ...] = (
    Baseline("D2", d2, l1),
    Baseline("geodesic D2", geodesic_d2, l1),
    Baseline("RSH", rsh, l1),
    Baseline("DSR", dsr, l1),
    Baseline("ERG", erg.describe, erg.compare),
    Baseline("ShapeDNA", shape_dna, relative),
)


@dataclass(frozen=True)
class Described:
    """What a baseline made of a model, and in what time; or why it could not."""

    description: Any = None
    seconds: float = 0.0
    failure: str | None = None


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folders", nargs="*", type=Path, metavar="DIR", help="by default the generated creatures")
    jobs_option(parser)


def run(arguments: argparse.Namespace) -> None:
    folders = arguments.folders or [None]
    found = [measured(name_of(folder), models_in(folder), arguments.jobs) for folder in folders]
    record(arguments, {"collections": found})


def measured(name: str, models: Sequence[Model], jobs: int) -> dict[str, Any]:
    """Everything there is to say about one collection; says a table."""
    found = describe_all(models, jobs)
    say(f"{name}, {len(models)} models\n{'':12}" + "".join(f"{key:>8}" for key in (*_MEASURES, "s each")))
    rows = [scored(baseline, models, [row[k] for row in found]) for k, baseline in enumerate(BASELINES)]
    return {"collection": name, "objects": len(models), "baselines": rows}


def describe_all(models: Sequence[Model], jobs: int) -> list[tuple[Described, ...]]:
    """What each baseline made of each model. A model that cannot be loaded fails for all of them."""
    outcomes = in_order(describe, models, jobs, "describing")
    return [each.result or (Described(failure=each.failure),) * len(BASELINES) for each in outcomes]


def describe(model: Model) -> tuple[Described, ...]:
    """What each baseline makes of one model."""
    mesh, _ = clean(model.mesh())
    return tuple(tried(baseline, mesh) for baseline in BASELINES)


def tried(baseline: Baseline, mesh: Mesh) -> Described:
    """One description; an error is part of the result, since the other baselines may know better."""
    try:
        return Described(*timed(lambda: baseline.describe(mesh)))
    except Exception as error:
        return Described(failure=one_line(error))


def scored(baseline: Baseline, models: Sequence[Model], found: Sequence[Described]) -> dict[str, Any]:
    """The measures of one baseline over the models it could describe; says them, and the models it could not."""
    pairs = list(zip(models, found, strict=True))
    good = [(model, result) for model, result in pairs if result.failure is None]
    failed = [{"name": model.name, "reason": result.failure} for model, result in pairs if result.failure is not None]
    for failure in failed:
        say(f"{baseline.name}: {failure['name']}: {failure['reason']}")
    if not good:
        return {"name": baseline.name, "failed": failed, "measures": None}
    descriptions = [result.description for _, result in good]
    matrix, comparing = timed(lambda: baseline.compare(descriptions, descriptions))
    scores = evaluate(matrix, [model.label for model, _ in good])
    seconds = sum(result.seconds for _, result in good) / len(good)
    say(table_row(baseline.name, scores, seconds))
    times = {"describe_each": seconds, "compare_all": comparing}
    return {"name": baseline.name, "failed": failed, "seconds": times, "measures": scores.summary()}


def table_row(name: str, scores: Scores, seconds: float) -> str:
    """One line of the table."""
    values = [getattr(scores, key) for key in _MEASURES.values()]
    return f"{name:<12}" + "".join(f"{value:8.3f}" for value in values) + f"{seconds:8.2f}"
