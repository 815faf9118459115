"""How much parts depend on the triangles: models at several meshings.

    python -m benchmarks remeshing [--poses 1] [--raw DIR --even DIR] [--out FILE.json]

Every creature is made at 2,000, 5,000 and 20,000 vertices, by marching cubes as they come, decimated unevenly, and with
every edge of one half halved. With `--raw` and `--even`, files of one name in both folders are one model twice.
Said of each model's meshings against the first:

- points: the share of feature points that have one of the other meshing within `epsilon` diameters, both ways;
- parts: by how many their number differs;
- diameter: by what share it differs.
- distance: the dissimilarity of two meshings of one model, over the median one of models of two classes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from curvematch_jax import Extraction, Mesh, Parts, dissimilarity_matrix, extract_parts, load_mesh
from curvematch_jax.datasets import CREATURES, creature
from curvematch_jax.surface._prep import decimate
from curvematch_jax.surface._refine import edge_lengths, refine

from ._measure import say
from ._record import record

SIZES = (2000, 5000, 20_000)


def meshings(name: str, pose: int) -> dict[str, Mesh]:
    """One creature, meshed in different ways."""
    found = {f"{size} vertices": creature(name, pose, vertices=size).mesh for size in SIZES}
    fine = found[f"{SIZES[-1]} vertices"]
    vertices, faces = decimate(fine.vertices, fine.faces, SIZES[1])
    found["uneven"] = Mesh(vertices, faces, fine.name)
    coarse = found[f"{SIZES[0]} vertices"]
    halved = refine(
        coarse.vertices, coarse.faces, 0.7 * float(edge_lengths(coarse.vertices, coarse.faces).mean()), 10**5
    )
    assert halved is not None
    found["halved"] = Mesh(*halved, coarse.name)
    return found


def compared(first: Parts, other: Parts) -> dict[str, float]:
    """What differs between the parts of two meshings."""
    reach = first.settings.epsilon * first.diameter
    apart = np.linalg.norm(first.points[:, None] - other.points[None], axis=2)
    near = np.concatenate([apart.min(axis=1), apart.min(axis=0)]) <= reach
    return {
        "points": float(near.mean()),
        "parts": float(abs(len(first.areas) - len(other.areas))),
        "diameter": float(abs(other.diameter / first.diameter - 1)),
    }


def measured(models: Sequence[tuple[str, dict[str, Mesh]]]) -> dict[str, dict[str, float]]:
    """Means over the models, by meshing; the first meshing of each is what the others are compared with."""
    extracted = [
        (label, {name: extract_parts(mesh, Extraction()) for name, mesh in made.items()}) for label, made in models
    ]
    names = list(models[0][1])
    labels = np.array([label for label, _ in extracted])
    rows = {}
    for name in names[1:]:
        pairs = [(made[names[0]], made[name]) for _, made in extracted]
        matrix = dissimilarity_matrix([parts for pair in zip(*pairs, strict=True) for parts in pair])
        half = len(pairs)
        between = matrix[:half, half:]
        others = between[labels[:, None] != labels]
        values = [compared(*pair) for pair in pairs]
        rows[name] = {key: float(np.mean([value[key] for value in values])) for key in values[0]}
        rows[name]["distance"] = float(np.mean(np.diag(between)) / np.median(others)) if len(others) else float("nan")
        say(f"{name:20s}" + "  ".join(f"{key} {value:.3f}" for key, value in rows[name].items()))
    return rows


def folders(raw: Path, even: Path) -> list[tuple[str, dict[str, Mesh]]]:
    """Models of one name in two folders; a class is the name without its digits."""
    twice = [(path, even / path.name) for path in sorted(raw.glob("*.off")) if (even / path.name).exists()]
    if not twice:
        raise ValueError(f"no mesh of {raw} has one of the same name in {even}")
    return [(a.stem.rstrip("0123456789"), {"even": load_mesh(b), "raw": load_mesh(a)}) for a, b in twice]


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=int, default=1, metavar="N", help="creatures of a class")
    parser.add_argument("--classes", nargs="+", choices=CREATURES, default=CREATURES, metavar="NAME")
    parser.add_argument("--raw", type=Path, metavar="DIR")
    parser.add_argument("--even", type=Path, metavar="DIR")


def run(arguments: argparse.Namespace) -> None:
    made = [(name, meshings(name, pose)) for name in arguments.classes for pose in range(arguments.poses)]
    results = {"creatures": measured(made)}
    if arguments.raw and arguments.even:
        results["folders"] = measured(folders(arguments.raw, arguments.even))
    record(arguments, results)
