"""The Laplacian of a surface, in linear elements, and systems with it."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

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


def factors(matrix: Any) -> scipy.sparse.linalg.SuperLU:
    """What solves a symmetric system whose real part is positive."""
    # Symmetric and positive: an ordering for such matrices, no pivoting and no dense panels take half of the time.
    return scipy.sparse.linalg.splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        relax=1,
        panel_size=1,
        options={"SymmetricMode": True},
    )
