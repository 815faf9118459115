"""The work of `python -m benchmarks.baselines`. Not in `__main__`, where worker processes find no functions."""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks._record import machine, versions, write
from curvematch_jax._progress import reporter
from curvematch_jax.datasets import CREATURES, creature, labelled_folder
from curvematch_jax.extraction._workers import cores, in_processes, one_line
from curvematch_jax.retrieval import Scores, evaluate
from curvematch_jax.surface import Mesh, clean, load_mesh

from . import BASELINES, Baseline

POSES = 5
_MEASURES = {"NN": "nn", "FT": "ft", "ST": "st", "E": "e", "DCG": "dcg", "mAP": "map"}


@dataclass(frozen=True)
class Model:
    """Where a mesh comes from, without the mesh: `load(*source)` in the process that needs it."""

    name: str
    label: str
    load: Callable[..., Mesh]
    source: tuple


@dataclass(frozen=True)
class Described:
    """What a baseline made of a model, and in what time; or why it could not."""

    description: Any = None
    seconds: float = 0.0
    failure: str | None = None


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.baselines", description="Measures of all baselines.")
    parser.add_argument("folders", nargs="*", type=Path, metavar="DIR", help="by default the generated creatures")
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    parser.add_argument("--jobs", type=int, default=cores())
    arguments = parser.parse_args()
    collections = {folder.name: models_in(folder) for folder in arguments.folders} or {"creatures": generated()}
    results = {
        "versions": versions(),
        "machine": machine(),
        "collections": [measured(name, models, arguments.jobs) for name, models in collections.items()],
    }
    if arguments.out:
        write(arguments.out, results)


def models_in(folder: Path) -> list[Model]:
    """The models of a labelled folder."""
    return [Model(path.name, label, load_mesh, (path,)) for path, label in labelled_folder(folder)]


def generated() -> list[Model]:
    """The creatures that `curvematch demo` uses."""
    return [Model(f"{kind}{pose}", kind, made, (kind, pose)) for kind in CREATURES for pose in range(POSES)]


def made(kind: str, pose: int) -> Mesh:
    """One creature's mesh."""
    return creature(kind, pose).mesh


def measured(name: str, models: Sequence[Model], jobs: int) -> dict[str, object]:
    """Everything there is to say about one collection; prints it."""
    found = describe_all(models, jobs)
    print(f"{name}, {len(models)} models\n{'':12}" + "".join(f"{key:>8}" for key in (*_MEASURES, "s each")))
    rows = [scored(baseline, models, [row[k] for row in found]) for k, baseline in enumerate(BASELINES)]
    return {"collection": name, "objects": len(models), "baselines": rows}


def describe_all(models: Sequence[Model], jobs: int) -> list[tuple[Described, ...]]:
    """What each baseline made of each model. A model that cannot be loaded fails for all of them."""
    report = reporter(sys.stderr.isatty(), "describing", "models")
    found: list[tuple[Described, ...]] = [()] * len(models)
    for done, outcome in enumerate(in_processes(describe, models, jobs), start=1):
        found[outcome.task] = outcome.result or (Described(failure=outcome.failure),) * len(BASELINES)
        report(done, len(models))
    return found


def describe(model: Model) -> tuple[Described, ...]:
    """What each baseline makes of one model."""
    mesh, _ = clean(model.load(*model.source))
    return tuple(tried(baseline, mesh) for baseline in BASELINES)


def tried(baseline: Baseline, mesh: Mesh) -> Described:
    """One description; an error is part of the result, since the other baselines may know better."""
    started = time.perf_counter()
    try:
        return Described(baseline.describe(mesh), time.perf_counter() - started)
    except Exception as error:
        return Described(failure=one_line(error))


def scored(baseline: Baseline, models: Sequence[Model], found: Sequence[Described]) -> dict[str, object]:
    """The measures of one baseline over the models it could describe; prints them, and the models it could not."""
    pairs = list(zip(models, found, strict=True))
    good = [(model, result) for model, result in pairs if result.failure is None]
    failed = [{"name": model.name, "reason": result.failure} for model, result in pairs if result.failure is not None]
    for failure in failed:
        print(f"{baseline.name}: {failure['name']}: {failure['reason']}", file=sys.stderr)
    if not good:
        return {"name": baseline.name, "failed": failed, "measures": None}
    descriptions = [result.description for _, result in good]
    started = time.perf_counter()
    matrix = baseline.compare(descriptions, descriptions)
    comparing = time.perf_counter() - started
    scores = evaluate(matrix, [model.label for model, _ in good])
    seconds = sum(result.seconds for _, result in good) / len(good)
    print(table_row(baseline.name, scores, seconds))
    times = {"describe_each": seconds, "compare_all": comparing}
    return {"name": baseline.name, "failed": failed, "seconds": times, "measures": scores.summary()}


def table_row(name: str, scores: Scores, seconds: float) -> str:
    """One line of the table."""
    values = [getattr(scores, key) for key in _MEASURES.values()]
    return f"{name:<12}" + "".join(f"{value:8.3f}" for value in values) + f"{seconds:8.2f}"
