"""RSH: how far the surface reaches in every direction from its centroid, in spherical harmonics.

Saupe, Vranic: 3D model retrieval with spherical harmonics and moments, DAGM, 2001.
"""

import numpy as np

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._pose import canonical_vertices
from curvematch_jax.surface._views import reach_magnitudes

from ._common import l1

compare = l1


def describe(mesh: Mesh) -> np.ndarray:
    """`|c_lm|` of the surface's reach in its canonical frame, `(136,)`."""
    return reach_magnitudes(canonical_vertices(mesh)[mesh.faces])
