"""RSH: how far the surface reaches in every direction from its centroid, in spherical harmonics.

Saupe, Vranic: 3D model retrieval with spherical harmonics and moments, DAGM, 2001. Directions and quadrature are those
of Healy, Rockmore, Kostelec, Moore: FFTs for the 2-sphere, J. Fourier Anal. Appl. 9(4), 2003.
"""

import numpy as np
from scipy.special import sph_harm_y

from curvematch_jax.surface import Mesh

from ._common import l1
from ._pose import canonical_vertices
from ._rays import reach

GRID = 128  # latitudes, and as many longitudes
DEGREES = 16
POLAR = (2 * np.arange(GRID) + 1) * np.pi / (2 * GRID)
AZIMUTH = 2 * np.pi * np.arange(GRID) / GRID

compare = l1


def describe(mesh: Mesh) -> np.ndarray:
    """`|c_lm|` of the surface's reach in its canonical frame, `(136,)`."""
    return magnitudes(canonical_vertices(mesh)[mesh.faces])


def magnitudes(triangles: np.ndarray) -> np.ndarray:
    """`|c_lm|` `(136,)` of the reach of triangles `(f, 3, 3)`, by order `0 <= m < 16`, then by degree `m <= l < 16`."""
    polar, azimuth = np.meshgrid(POLAR, AZIMUTH, indexing="ij")
    grid = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    values = reach(triangles, grid.reshape(-1, 3)).reshape(polar.shape)
    order, degree = np.triu_indices(DEGREES)
    waves = np.fft.rfft(values, axis=1).T[order]
    return np.abs((_weights() * sph_harm_y(degree, order, POLAR[:, None], 0.0).T.real * waves).sum(axis=1))


def _weights() -> np.ndarray:
    """Weights of the latitudes' points `(GRID,)`: exact for products of harmonics whose degrees add up to < `GRID`."""
    odd = 2 * np.arange(GRID // 2) + 1
    return 8 * np.pi / GRID**2 * np.sin(POLAR) * (np.sin(np.outer(POLAR, odd)) / odd).sum(axis=1)
