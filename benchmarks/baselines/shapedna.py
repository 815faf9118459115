"""ShapeDNA: the lowest eigenvalues of the surface's Laplacian, which do not change when it is bent.

Reuter, Wolter, Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and solids, Computer-Aided Design 38(4),
2006. The Laplacian is that of linear elements with the vertices' areas as masses, theirs of cubic ones.
"""

from collections.abc import Sequence

import numpy as np

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._spectrum import spectrum

EIGENVALUES = 15  # besides the first, which is 0


def describe(mesh: Mesh) -> np.ndarray:
    """The first eigenvalues above 0, ascending, times the area, which makes them free of scale."""
    return spectrum(mesh, EIGENVALUES)


def compare(queries: Sequence[np.ndarray], objects: Sequence[np.ndarray]) -> np.ndarray:
    """The L2 norm of relative differences: eigenvalues grow with their index, and would weigh by it otherwise."""
    query, other = np.stack(queries)[:, None], np.stack(objects)[None]
    return np.linalg.norm((query - other) / ((query + other) / 2), axis=2)
