"""11-point interpolated precision-recall of this method and the baselines; the query is never counted.

    python -m benchmarks.figures.precision_recall [FOLDER] [--out DIR] [--methods default paper D2 ...]
        [--baselines FILE.json]

Methods are `default`, `paper` (slow), and the baselines by name; all but `paper` without `--methods`. Figures of the
baselines can be taken from what `python -m benchmarks.baselines FOLDER --out FILE.json` has written. The JSON says of
every method at which recall the first one is not above it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.baselines import BASELINES
from benchmarks.baselines._run import measured
from benchmarks.figures._common import MATCHINGS, Collection, Figure, Numbers, command, say
from benchmarks.figures._plots import precision_recall
from benchmarks.figures._queries import scores

_NAMES = tuple(baseline.name for baseline in BASELINES)


def own_precision(collection: Collection, method: str) -> list[float]:
    """Of the default or the paper's method."""
    return scores(collection.matrix(method), range(len(collection.labels)), collection.labels)["precision_11"]


def measured_baselines(collection: Collection, names: Sequence[str]) -> dict[str, list[float]]:
    """Describe and compare all models. The baselines come together: a mesh is loaded and cleaned once for them all."""
    if not names:
        return {}
    found: Numbers = measured(collection.name, collection.models, collection.jobs)
    return _precision(found["baselines"], names)


def known_baselines(path: Path, collection: str, names: Sequence[str]) -> dict[str, list[float]]:
    """What a file says of this collection.

    Raises:
        ValueError: it says nothing.
    """
    found = [
        each["baselines"] for each in json.loads(path.read_text())["collections"] if each["collection"] == collection
    ]
    if not found:
        raise ValueError(f"{path} has no collection {collection}")
    return _precision(found[0], names)


def _precision(rows: Sequence[Numbers], names: Sequence[str]) -> dict[str, list[float]]:
    return {row["name"]: row["measures"]["precision_11"] for row in rows if row["name"] in names and row["measures"]}


def not_above(curves: Mapping[str, Sequence[float]]) -> dict[str, list[float]]:
    """Of each other method, the recalls at which the first one is below it, or the same below 1."""
    first, *others = curves
    return {
        name: [k / 10 for k, (a, b) in enumerate(zip(curves[first], curves[name], strict=True)) if a < b or a == b < 1]
        for name in others
    }


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Every method in one plot."""
    wanted = [name for name in arguments.methods if name in _NAMES]
    curves = {name: own_precision(collection, name) for name in arguments.methods if name in MATCHINGS}
    if arguments.baselines:
        curves |= known_baselines(arguments.baselines, collection.name, wanted)
    else:
        curves |= measured_baselines(collection, wanted)
    precision_recall(curves, picture, collection.name)
    behind = not_above(curves)
    for name, recalls in behind.items():
        where = (
            f"not above it at recall {', '.join(map(str, recalls))}" if recalls else "above it at every recall level"
        )
        say(f"{next(iter(curves))} and {name}: {where}")
    return {"precision_11": curves, "not_above": behind}


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--methods", nargs="+", choices=[*MATCHINGS, *_NAMES], default=["default", *_NAMES])
    parser.add_argument("--baselines", type=Path, metavar="FILE.json", help="take the baselines' figures from here")


FIGURE = Figure("precision_recall", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
