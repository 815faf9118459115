"""Feature points of one class in several poses, each in the colour and under the number of the first model's.

    python -m benchmarks.figures.feature_points [FOLDER] [--out DIR] [--label CLASS] [--top 6]

Without `--label` the class with the most models is shown. Parts are assigned one to one, so that their distances
add up to the least; left and right may be exchanged. Points without a partner are grey. The JSON has how many points
each pose has, which point of the first each one is (-1: none), and how far assigned parts are apart on average.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.figures._common import Collection, Described, Figure, Numbers, command
from benchmarks.figures._drawing import draw, points, surface, tiles
from curvematch_jax.pictures._canvas import save
from curvematch_jax.pictures._colours import part_colours
from curvematch_jax.pictures._view import frame_of
from curvematch_jax.retrieval import Matching
from curvematch_jax.retrieval._distances import part_distances
from curvematch_jax.retrieval._stack import stack
from curvematch_jax.surface import Parts

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def assigned(first: Parts, other: Parts) -> tuple[np.ndarray, float]:
    """Which part of the first each of the other's parts (p,) is, -1 for none, and the mean distance of these pairs."""
    matching, shape = Matching(), (len(first.areas), len(other.areas))
    pairs = np.argwhere(np.ones(shape, bool))
    left, right = stack([first], matching.unit), stack([other], matching.unit)
    distances = part_distances(left, right, pairs, matching, matching.aligner).reshape(shape)
    rows, columns = linear_sum_assignment(distances)
    owner = np.full(shape[1], -1)
    owner[columns] = rows
    return owner, float(distances[rows, columns].mean())


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """A tile for each pose."""
    chosen = [collection.described[k] for k in collection.members(arguments.label)[: arguments.top]]
    first, poses = chosen[0], {}
    figure, axes = tiles(len(chosen))
    for each, model in zip(axes, chosen, strict=True):
        owner, distance = assigned(first.parts, model.parts)
        _draw(each, model, owner)
        poses[model.name] = {"points": len(owner), "is": owner.tolist(), "distance": distance}
    save(figure, picture)
    return {"class": first.label, "first": first.name, "poses": poses}


def _draw(axes: Axes, model: Described, owner: np.ndarray) -> None:
    frame = frame_of(model.mesh.vertices)
    draw(axes, [surface(model.mesh, frame)])
    names = [str(k) if k >= 0 else "" for k in owner.tolist()]
    points(axes, model.parts.points.astype(float), frame, part_colours(owner), names)
    axes.set_xlabel(model.name, fontsize=8)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--label", metavar="CLASS", help="by default the class with the most models")
    parser.add_argument("--top", type=int, default=6, help="models")


FIGURE = Figure("feature_points", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
