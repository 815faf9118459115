"""The geodesic between two parts: the shapes of their level curves deformed, and the surfaces in between.

    python -m benchmarks.figures.part_geodesic [FOLDER] [--out DIR] [--models NAME NAME] [--parts I J] [--steps 6]

Without `--models` these are the first of the class with the most models, and what of another class is most similar to
it; without `--parts` the two parts that match best. Surfaces are tubes through the curves, from the feature point on.
Sizes and places of the curves are interpolated. The JSON has the length of each level's geodesic in radians.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.figures._common import Collection, Figure, Numbers, command
from benchmarks.figures._drawing import curve, draw, tiles, tube
from benchmarks.figures._loft import lofted, way
from curvematch_jax.pictures._canvas import save
from curvematch_jax.pictures._view import frame_of
from curvematch_jax.retrieval import rank

# Of the surfaces at both ends.
_FIRST, _LAST = np.array([0.62, 0.74, 0.90]), np.array([0.95, 0.80, 0.58])
_LINE = (0.25, 0.25, 0.3)


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """A tile for each step."""
    first, second = collection.named(arguments.models) or default_models(collection)
    one, other = collection.parts[first], collection.parts[second]
    i, j = arguments.parts or rank(one, [other]).explain(0)[0][:2]
    found = way(one, i, other, j, arguments.levels, arguments.steps)
    figure, axes = tiles(len(found.curves), columns=len(found.curves))
    frame = frame_of(np.concatenate([found.curves.reshape(-1, 3), np.zeros((1, 3))]))
    for each, curves, time in zip(axes, found.curves, np.linspace(0, 1, len(axes)), strict=True):
        surface = tube(lofted(curves), np.zeros(3), frame, (1 - time) * _FIRST + time * _LAST)
        draw(each, [surface, *(curve(ring, frame, _LINE, 0.6) for ring in curves)])
    names = [collection.described[k].name for k in (first, second)]
    axes[0].set_xlabel(f"{names[0]}, part {i}", fontsize=8)
    axes[-1].set_xlabel(f"{names[1]}, part {j}", fontsize=8)
    save(figure, picture)
    return {
        "models": names,
        "parts": [i, j],
        "steps": arguments.steps,
        "levels": found.levels.tolist(),
        "lengths": np.asarray(found.geodesics.length, float).round(4).tolist(),
        "converged": np.asarray(found.geodesics.converged).tolist(),
    }


def default_models(collection: Collection) -> tuple[int, int]:
    """The first model of the class with the most, and what is most similar to it of another class."""
    first = collection.members()[0]
    others = [j for j, label in enumerate(collection.labels) if label != collection.labels[first]]
    if not others:
        raise ValueError(f"{collection.name} has one class: name two models with --models")
    ranking = rank(collection.parts[first], [collection.parts[j] for j in others])
    return first, others[int(ranking.order[0])]


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--models", nargs=2, metavar="NAME", default=[])
    parser.add_argument("--parts", nargs=2, type=int, metavar=("I", "J"))
    parser.add_argument("--levels", type=int, default=12, help="level curves of a part, from the feature point on")
    parser.add_argument("--steps", type=int, default=6)


FIGURE = Figure("part_geodesic", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
