"""Repair, decimation and remeshing by the libraries of the optional extra `prep`.

pymeshfix wraps GPL code, which is one reason why the extra is optional.
"""

import math
import warnings

import numpy as np

from .._optional import require
from ._topology import face_areas, is_closed_manifold

_ITERATIONS = 5


def close(vertices: np.ndarray, faces: np.ndarray, join: bool) -> tuple[np.ndarray, np.ndarray]:
    """Fill every hole with triangles; with `join`, bridge separate patches at their closest boundaries first."""
    pymeshfix = require("pymeshfix", "prep", "closing the holes of a mesh")
    repair = pymeshfix.PyTMesh()
    repair.set_quiet(1)
    repair.load_array(np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int32))
    if join:
        repair.join_closest_components()
    repair.fill_small_boundaries(0, True)
    points, triangles = repair.return_arrays()
    if not is_closed_manifold(points, triangles.astype(np.int64)):
        repair.clean()
        points, triangles = repair.return_arrays()
    return np.asarray(points, dtype=np.float64), triangles.astype(np.int64)


def decimate(vertices: np.ndarray, faces: np.ndarray, target: int) -> tuple[np.ndarray, np.ndarray]:
    """Collapse edges, by quadric error, down to about `target` vertices."""
    simplification = require("fast_simplification", "prep", "decimating a mesh of this size")
    points, triangles = simplification.simplify(np.array(vertices), faces.astype(np.int32), target_count=2 * target)
    return np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64)


def edge_length(vertices: np.ndarray, faces: np.ndarray, target: int) -> float:
    """Of the edges of `target` vertices that are spread evenly over a closed surface of this area."""
    return math.sqrt(float(face_areas(vertices, faces).sum()) / target * 2 / math.sqrt(3))


def remesh(vertices: np.ndarray, faces: np.ndarray, target: int) -> tuple[np.ndarray, np.ndarray]:
    """Isotropic remeshing of a closed surface to about `target` vertices (Botsch, Kobbelt, SGP 2004).

    Where the surface is thinner than an edge the result can be pinched; then the edges are shortened, twice at most.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # its imports, not ours
        gpytoolbox = require("gpytoolbox", "prep", "remeshing an irregular, coarse or large mesh")
    start = np.array(vertices), faces.astype(np.int32)  # its bindings want arrays that they could write to
    for refinement in (1, 2, 4):
        edge = edge_length(vertices, faces, target * refinement)
        with np.errstate(all="ignore"):  # where it divides by the length of an edge that has none
            points, triangles = gpytoolbox.remesh_botsch(*start, _ITERATIONS, edge, True)
        points, triangles = np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
        if is_closed_manifold(points, triangles):
            break
    return points, triangles
