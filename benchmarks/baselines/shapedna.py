"""ShapeDNA: the lowest eigenvalues of the surface's Laplacian, which do not change when it is bent.

Reuter, Wolter, Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and solids, Computer-Aided Design 38(4),
2006. The Laplacian is that of linear elements with the vertices' areas as masses, theirs of cubic ones.
"""

from collections.abc import Sequence

import numpy as np
import potpourri3d
import scipy.sparse as sp
import scipy.sparse.linalg

from curvematch_jax.surface import Mesh

EIGENVALUES = 15  # besides the first, which is 0
_SHIFT = -1e-2  # just below 0, where the matrix to be factorised is regular
_LEAST_AREA = 1e-10  # of the whole: keeps degenerate triangles from dividing by zero


def describe(mesh: Mesh) -> np.ndarray:
    """The first eigenvalues above 0, ascending, times the area, which makes them free of scale."""
    areas = potpourri3d.vertex_areas(mesh.vertices, mesh.faces)
    unit = (mesh.vertices - mesh.vertices.mean(axis=0)) / np.sqrt(areas.sum())
    stiffness = potpourri3d.cotan_laplacian(unit, mesh.faces, denom_eps=_LEAST_AREA).tocsc()
    mass = sp.diags_array(np.maximum(areas / areas.sum(), _LEAST_AREA))
    start = np.random.default_rng(0).standard_normal(len(areas))
    eigenvalues = scipy.sparse.linalg.eigsh(
        stiffness, EIGENVALUES + 1, M=mass, sigma=_SHIFT, v0=start, return_eigenvectors=False
    )
    return np.sort(eigenvalues)[1:]


def compare(queries: Sequence[np.ndarray], objects: Sequence[np.ndarray]) -> np.ndarray:
    """The L2 norm of relative differences: eigenvalues grow with their index, and would weigh by it otherwise."""
    query, other = np.stack(queries)[:, None], np.stack(objects)[None]
    return np.linalg.norm((query - other) / ((query + other) / 2), axis=2)
