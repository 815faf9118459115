"""Whether feature points fall on hand-picked landmarks, and whether the tips of limbs are found.

    python -m benchmarks features DIR [--out FILE.json]

DIR is a folder like the SHREC'07 watertight track: mesh files, `labels.csv` (`file,class`) and `landmarks/N.vts`
(vertex number, x, y, z on each line; Kim, Lipman, Funkhouser: Blended intrinsic maps, SIGGRAPH 2011). Only classes
with limbs are judged.

Landmarks are what a person thought worth picking, tips and others (elbows, navels). A landmark is a *tip* when the
mean geodesic distance to the surface, which is highest at the ends of protrusions, has a maximum close to it: some
vertex within 0.05 diameters of the landmark is the highest within 0.1 diameters of itself. That does not depend on the
fields from which feature points are made.
"""

import argparse
from pathlib import Path

import numpy as np

from curvematch_jax.datasets import labelled_folder
from curvematch_jax.surface import Extraction, Mesh, load_mesh
from curvematch_jax.surface._features import feature_points
from curvematch_jax.surface._fields import Distances, distances_on
from curvematch_jax.surface._parts import prepared

from ._measure import say
from ._record import record

LIMBED = ("human", "ant", "octopus", "hand", "plier", "fourleg", "teddy", "armadillo", "bird", "airplane")
NEAR = 0.05
PEAK = 0.1
SOURCES = 64


def read_landmarks(path: Path) -> np.ndarray:
    """Positions `(k, 3)` of the landmarks."""
    return np.loadtxt(path, ndmin=2)[:, 1:4]


def nearest_vertices(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """The vertex of the mesh nearest to each point."""
    return np.array([int(np.argmin(np.linalg.norm(mesh.vertices - point, axis=1))) for point in points])


def mean_distance(distances: Distances, start: int) -> np.ndarray:
    """Mean geodesic distance `(v,)` to vertices spread evenly over the surface by farthest-point sampling."""
    nearest = total = distances(start)
    for _ in range(SOURCES - 1):
        field = distances(int(np.argmax(nearest)))
        nearest, total = np.minimum(nearest, field), total + field
    return total / SOURCES


def is_tip(distances: Distances, landmark: int, centrality: np.ndarray, diameter: float) -> bool:
    """Whether the mean distance has a maximum close to the landmark (see the head of this file)."""
    close = np.flatnonzero(distances(landmark) <= NEAR * diameter)
    peak = int(close[np.argmax(centrality[close])])
    around = distances(peak) <= PEAK * diameter
    return bool(centrality[around].max() <= centrality[peak])


def judge(mesh_path: Path, settings: Extraction) -> dict[str, int]:
    """Counts for one model: points, points near a landmark, tips, tips found."""
    mesh, _ = prepared(load_mesh(mesh_path), settings)
    distances = distances_on(mesh, settings.field)
    features = feature_points(mesh, distances, settings.epsilon)
    landmarks = nearest_vertices(mesh, read_landmarks(mesh_path.parent / "landmarks" / f"{mesh_path.stem}.vts"))
    reach = NEAR * features.diameter
    between = np.stack([distances(v) for v in landmarks.tolist()])[:, features.vertices] <= reach
    centrality = mean_distance(distances, features.ends[0])
    tips = np.array([is_tip(distances, v, centrality, features.diameter) for v in landmarks.tolist()])
    return {
        "points": len(features.vertices),
        "near": int(between.any(axis=0).sum()),
        "tips": int(tips.sum()),
        "found": int(between[tips].any(axis=1).sum()),
    }


def limbed_models(folder: Path) -> list[tuple[Path, str]]:
    """Models of the classes with limbs that have landmarks."""
    landmarks = folder / "landmarks"
    return [
        (path, kind)
        for path, kind in labelled_folder(folder)
        if kind in LIMBED and (landmarks / f"{path.stem}.vts").is_file()
    ]


def shares(rows: list[dict[str, int]]) -> dict[str, float]:
    """Counts of several models added up, and the two shares."""
    total = {key: sum(row[key] for row in rows) for key in rows[0]}
    return {
        "models": len(rows),
        **total,
        "points_near_a_landmark": total["near"] / max(total["points"], 1),
        "tips_found": total["found"] / max(total["tips"], 1),
    }


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR")


def run(arguments: argparse.Namespace) -> None:
    settings = Extraction()
    by_class: dict[str, list[dict[str, int]]] = {}
    for path, kind in limbed_models(arguments.folder):
        by_class.setdefault(kind, []).append(judge(path, settings))
    if not by_class:
        raise ValueError(f"{arguments.folder} has no model with landmarks of a class with limbs")
    table = {kind: shares(by_class[kind]) for kind in LIMBED if kind in by_class}
    table["all"] = shares([row for rows in by_class.values() for row in rows])
    say(f"{'class':10} models points  near a landmark  tips  found")
    for kind, row in table.items():
        say(
            f"{kind:10} {row['models']:6} {row['points']:6}  {row['points_near_a_landmark']:15.3f}"
            f"  {row['tips']:4}  {row['tips_found']:.3f}"
        )
    record(arguments, {"settings": vars(settings), "classes": table})
