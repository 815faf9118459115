"""What misplaced feature points cost: queries from moved points against the collection from unmoved ones.

    python -m benchmarks.figures.moved_points [FOLDER] [--out DIR] [--amounts 0.01 0.02] [--methods default paper]

Every feature point of a query moves to a random vertex at a geodesic distance of a share of the diameter. The model
that a query was made from is not among those that it is compared with. The picture is 11-point precision-recall of
the first method.
"""

from __future__ import annotations

import argparse
import dataclasses
import zlib
from pathlib import Path

import numpy as np

from benchmarks.baselines._run import Model
from benchmarks.figures._common import Collection, Figure, Numbers, command
from benchmarks.figures._queries import changed, compared, query_options
from curvematch_jax.surface import Extraction, Parts
from curvematch_jax.surface._features import feature_points
from curvematch_jax.surface._fields import distances_on
from curvematch_jax.surface._parts import described, parts_around, prepared

# Vertices this far from where a point is to be, as a share of the way, are as good as any.
_TOLERANCE = 0.25


def moved(field: np.ndarray, away: float, random: np.random.Generator) -> int:
    """A random vertex where the distance field of a feature point (v,) is about `away`; without one, the nearest."""
    off = np.abs(field - away)
    near = np.flatnonzero(off <= _TOLERANCE * away)
    return int(random.choice(near)) if len(near) else int(np.argmin(off))


def parts_from_moved_points(task: tuple[Model, float]) -> Parts:
    """Parts of one model, every feature point moved by a share of the diameter."""
    (model, amount), settings = task, Extraction()
    mesh, report = prepared(model.load(*model.source), settings)
    distances = distances_on(mesh, settings.field)
    features = feature_points(mesh, distances, settings.epsilon, settings.least)
    random = np.random.default_rng(zlib.crc32(model.name.encode()))
    vertices = [moved(distances(v), amount * features.diameter, random) for v in features.vertices.tolist()]
    features = features._replace(vertices=np.array(vertices))
    parts = parts_around(mesh, distances, features, settings, report.messages)
    return dataclasses.replace(parts, **described(mesh))


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Scores of all amounts and methods."""
    variants = changed(collection, parts_from_moved_points, arguments.amounts, arguments.per_class)
    return compared(collection, variants, arguments.methods, picture, "feature points moved, in diameters")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--amounts", type=float, nargs="+", default=[0.01, 0.02], help="shares of the diameter")
    query_options(parser)


FIGURE = Figure("moved_points", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
