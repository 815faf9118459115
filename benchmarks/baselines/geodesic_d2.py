"""Geodesic D2: how far apart two random points of the surface are, along the surface.

Hamza, Krim: Geodesic matching of triangulated surfaces, IEEE Trans. Image Processing 15(8), 2006, for the distribution
of geodesic distances as a signature; here with the sampling and the density of D2.
"""

import numpy as np

from curvematch_jax.surface import Mesh

from ._common import geodesics_between, l1
from .d2 import density

SOURCES = 256

compare = l1


def describe(mesh: Mesh) -> np.ndarray:
    """The density of the distances between points spread over the surface and all its vertices, these by their area."""
    distances, areas = geodesics_between(mesh, SOURCES)
    return density(distances.ravel(), np.tile(areas, SOURCES))
