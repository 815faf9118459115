"""The Laplacian of a surface, in linear elements."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

# With the area as unit: vertices and faces of no area get this much, and divide nothing by zero. The energy of the
# degenerate face stays positive, as all its three cotangents are changed by one factor.
_LEAST_AREA = 1e-12


class Laplacian(NamedTuple):
    """The Laplacian of a surface scaled to unit area (Meyer, Desbrun, Schroeder, Barr: Discrete differential-geometry
    operators for triangulated 2-manifolds, 2003). Vertices without faces have next to no area and no cotangents."""

    mass: np.ndarray  # (v,) the vertices' areas
    cotangents: sp.csc_array  # (v, v)


def laplacian(vertices: np.ndarray, faces: np.ndarray, area: float) -> Laplacian:
    """The Laplacian of a surface whose area in squared mesh units is given."""
    import potpourri3d

    size = max(np.sqrt(area), np.finfo(float).tiny)
    unit = (vertices - vertices[faces].mean(axis=(0, 1))) / size
    mass = np.maximum(potpourri3d.vertex_areas(unit, faces), _LEAST_AREA)
    return Laplacian(mass, sp.csc_array(potpourri3d.cotan_laplacian(unit, faces, denom_eps=_LEAST_AREA)))
