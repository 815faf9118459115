"""What noise on the surface costs: noisy queries against the clean collection.

    python -m benchmarks.figures.noise [FOLDER] [--out DIR] [--amounts 0.002 0.005] [--methods default paper]

Every vertex moves along its normal by a Gaussian step whose standard deviation is a share of the bounding box's
diagonal. The model that a query was made from is not among those that it is compared with. The picture is 11-point
precision-recall of the first method.
"""

from __future__ import annotations

import argparse
import zlib
from pathlib import Path

import numpy as np

from benchmarks.baselines._run import Model
from benchmarks.figures._common import Collection, Figure, Numbers, command
from benchmarks.figures._queries import changed, compared, query_options
from curvematch_jax.surface import Mesh, Parts, extract_parts


def with_noise(mesh: Mesh, amount: float, seed: int = 0) -> Mesh:
    """A mesh whose vertices have moved along their normals, `amount` diagonals of the bounding box in the r.m.s."""
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    steps = np.random.default_rng(seed).normal(scale=amount * diagonal, size=(len(mesh.vertices), 1))
    return Mesh(mesh.vertices + steps * vertex_normals(mesh), mesh.faces, mesh.name)


def vertex_normals(mesh: Mesh) -> np.ndarray:
    """Unit normals (v, 3), those of the faces around weighted by area; 0 where there are none."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    normals = np.zeros_like(mesh.vertices)
    for corner in mesh.faces.T:
        np.add.at(normals, corner, np.cross(b - a, c - a))
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(size > 0, size, 1)


def noisy_parts(task: tuple[Model, float]) -> Parts:
    """Parts of one noisy model; another model, another noise."""
    model, amount = task
    return extract_parts(with_noise(model.load(*model.source), amount, zlib.crc32(model.name.encode())))


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Scores of all amounts and methods."""
    variants = changed(collection, noisy_parts, arguments.amounts, arguments.per_class)
    return compared(collection, variants, arguments.methods, picture, "noise, in diagonals of the bounding box")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--amounts", type=float, nargs="+", default=[0.002, 0.005], help="shares of the diagonal")
    query_options(parser)


FIGURE = Figure("noise", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
