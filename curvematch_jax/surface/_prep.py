"""Repair and decimation by the libraries of the optional extra `prep`.

pymeshfix wraps GPL code, which is one reason why the extra is optional.
"""

import numpy as np

from .._optional import require
from ._topology import is_closed_manifold

# Of 0 to 10: with its library's 7, triangles are half as good and the surface moves twice as far.
_HASTE = 5


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
    points, triangles = simplification.simplify(
        np.array(vertices), faces.astype(np.int32), target_count=2 * target, agg=_HASTE
    )
    return np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
