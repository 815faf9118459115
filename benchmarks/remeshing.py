"""How much parts depend on the triangles: models at several meshings.

    python -m benchmarks remeshing [--poses 1] [--raw DIR --even DIR] [--out FILE.json]

Every creature is meshed at 5,000 vertices, and then at 2,000, 20,000 and 50,000; as marching cubes leave it; decimated
unevenly; and with the edges of one half halved twice. With `--raw` and `--even`, files of one name in both folders are
one model twice. Said of each meshing against the first, in the mean over the models:

- points: the share of feature points that have one of the other meshing within `epsilon` diameters, both ways;
- parts: by how many their number differs;
- diameter: by what share it differs;
- lengths: the median change of a level curve's length, as a share; of parts whose points are one place;
- distance: of two meshings of one model, by parts alone, over the median of models of two classes;
- nearest: the share of models that are nearer to their other meshing than to any model of another class in it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from curvematch_jax import Extraction, Matching, Mesh, Parts, dissimilarity_matrix, extract_parts, load_mesh
from curvematch_jax.datasets import CREATURES, creature
from curvematch_jax.datasets._creatures import individuals
from curvematch_jax.datasets._implicit import edge_for, level_set
from curvematch_jax.surface._prep import decimate
from curvematch_jax.surface._refine import halve
from curvematch_jax.surface._topology import edges

from ._measure import say
from ._record import record

FIRST, SIZES = 5000, (2000, 20_000, 50_000)
# Parts alone, their distances in radians: an exponential of evidence would make anything look near.
BY_PARTS = Matching(fusion="mean", witnesses=())

Parted = tuple[str, dict[str, Parts]]


def meshings(kind: str, pose: int) -> dict[str, Mesh]:
    """One creature, meshed in different ways."""
    found = {f"{size} vertices": creature(kind, pose, vertices=size).mesh for size in (FIRST, *SIZES)}
    capsules = next(individuals(kind, pose, seed=0))
    found["marching cubes"] = Mesh(*level_set(capsules, edge_for(capsules, FIRST)))
    fine, coarse = found[f"{SIZES[1]} vertices"], found[f"{SIZES[0]} vertices"]
    found["uneven"] = Mesh(*decimate(fine.vertices, fine.faces, FIRST))
    found["graded"] = graded(coarse)
    return found


def graded(mesh: Mesh) -> Mesh:
    """The same surface, on one half of which edges are a quarter as long."""
    vertices, faces = mesh.vertices, mesh.faces
    middle = np.median(vertices[:, 0])
    for _ in range(2):
        table = edges(faces)
        vertices, faces, _ = halve(vertices, faces, table, (vertices[table.ends, 0] > middle).all(axis=1))
    return Mesh(vertices, faces, mesh.name)


def compared(first: Parts, other: Parts) -> dict[str, float]:
    """What differs between the parts of two meshings."""
    reach = first.settings.epsilon * first.diameter
    apart = np.linalg.norm(first.points[:, None] - other.points[None], axis=2)
    near = np.concatenate([apart.min(axis=1), apart.min(axis=0)]) <= reach
    kept = np.flatnonzero(apart.min(axis=1) <= reach)
    partner = apart.argmin(axis=1)[kept]
    both = first.mask[kept] & other.mask[partner]
    change = np.log(other.lengths[partner][both] * other.diameter) - np.log(first.lengths[kept][both] * first.diameter)
    return {
        "points": float(near.mean()),
        "parts": float(abs(len(first.areas) - len(other.areas))),
        "diameter": float(abs(other.diameter / first.diameter - 1)),
        "lengths": float(np.median(np.abs(change))),
    }


def separated(first: Sequence[Parts], other: Sequence[Parts], labels: np.ndarray) -> dict[str, float]:
    """Distances of one model's two meshings, beside those of models of two classes."""
    matrix = dissimilarity_matrix([*first, *other], BY_PARTS)
    half = len(first)
    between = (matrix[:half, half:] + matrix[half:, :half].T) / 2
    own, strangers = np.diag(between), np.where(labels[:, None] != labels, between, np.nan)
    return {
        "distance": float(own.mean() / np.nanmedian(strangers)),
        "nearest": float((own < np.nanmin(strangers, axis=1)).mean()),
    }


def measured(models: Sequence[Parted]) -> dict[str, dict[str, float]]:
    """Means over the models, by meshing; the first meshing of each is what the others are compared with.

    Raises:
        ValueError: all models are of one class.
    """
    labels = np.array([label for label, _ in models])
    if len(set(labels)) < 2:
        raise ValueError(f"models of two classes are needed, and all are of {labels[0]}")
    first, *names = models[0][1]
    rows = {}
    for name in names:
        pairs = [(made[first], made[name]) for _, made in models]
        values = [compared(*pair) for pair in pairs]
        rows[name] = {key: float(np.mean([value[key] for value in values])) for key in values[0]}
        rows[name] |= separated([one for one, _ in pairs], [other for _, other in pairs], labels)
        say(f"{name:15s}" + "  ".join(f"{key} {value:.3f}" for key, value in rows[name].items()))
    return rows


def folders(raw: Path, even: Path) -> list[Parted]:
    """Models of one name in two folders; a class is the name without its digits."""
    twice = [(path, even / path.name) for path in sorted(raw.glob("*.off")) if (even / path.name).exists()]
    if not twice:
        raise ValueError(f"no mesh of {raw} has one of the same name in {even}")
    return [(a.stem.rstrip("0123456789"), parted({"even": load_mesh(b), "raw": load_mesh(a)})) for a, b in twice]


def parted(made: dict[str, Mesh]) -> dict[str, Parts]:
    """Meshes are large, and their parts are not: none is kept."""
    return {name: extract_parts(mesh, Extraction()) for name, mesh in made.items()}


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=int, default=1, metavar="N", help="creatures of a class")
    parser.add_argument("--classes", nargs="+", choices=CREATURES, default=CREATURES, metavar="NAME")
    parser.add_argument("--raw", type=Path, metavar="DIR", help="meshes N.off as they came")
    parser.add_argument("--even", type=Path, metavar="DIR", help="the same models in other triangles")


def run(arguments: argparse.Namespace) -> None:
    if (arguments.raw is None) != (arguments.even is None):
        raise ValueError("--raw and --even are compared with each other: give both or none")
    made = [(kind, parted(meshings(kind, pose))) for kind in arguments.classes for pose in range(arguments.poses)]
    results = {"creatures": measured(made)}
    if arguments.raw:
        results["folders"] = measured(folders(arguments.raw, arguments.even))
    record(arguments, results)
