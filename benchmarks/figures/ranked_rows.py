"""Queries with what is most similar to them, best first: green frames are of the query's class, dashed red ones not.

    python -m benchmarks.figures.ranked_rows [FOLDER] [--out DIR] [--queries NAME ...] [--top 8]

Without `--queries` the first model of each class queries the others, of at most ten classes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.figures._common import Collection, Figure, Numbers, command
from curvematch_jax.pictures import Tile, sheet

_ROWS = 10


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The sheet, and the names in it."""
    chosen = collection.named(arguments.queries) or collection.first_of_each_class(1)[:_ROWS]
    matrix, models = collection.matrix(), collection.described
    rows, named = [], {}
    for k in chosen:
        best = [j for j in np.argsort(matrix[k], kind="stable").tolist() if j != k][: arguments.top]
        right = [models[j].label == models[k].label for j in best]
        rows.append([Tile(models[k].mesh, models[k].name)])
        rows[-1] += [Tile(models[j].mesh, models[j].name, same) for j, same in zip(best, right, strict=True)]
        named[models[k].name] = [{"name": models[j].name, "right": same} for j, same in zip(best, right, strict=True)]
    sheet(rows, picture)
    return named


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--queries", nargs="+", metavar="NAME", default=[])
    parser.add_argument("--top", type=int, default=8, help="models in a row")


FIGURE = Figure("ranked_rows", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
