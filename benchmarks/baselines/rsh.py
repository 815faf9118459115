"""RSH: how far the surface reaches in every direction from its centroid, in spherical harmonics.

Saupe, Vranic: 3D model retrieval with spherical harmonics and moments, DAGM, 2001. Directions and quadrature are those
of Healy, Rockmore, Kostelec, Moore: FFTs for the 2-sphere, J. Fourier Anal. Appl. 9(4), 2003.
"""

import numpy as np
from scipy.spatial import KDTree
from scipy.special import sph_harm_y

from curvematch_jax.surface import Mesh

from ._common import l1
from ._pose import canonical_vertices

GRID = 128  # latitudes, and as many longitudes
DEGREES = 16
POLAR = (2 * np.arange(GRID) + 1) * np.pi / (2 * GRID)
AZIMUTH = 2 * np.pi * np.arange(GRID) / GRID
_SLACK = 1e-9  # rays along an edge meet both of its triangles, and never slip between them

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


def reach(triangles: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """The farthest intersection of rays from the origin with triangles; 0 where there is none.

    Args:
        triangles: `(f, 3, 3)`, corners in rows.
        directions: `(r, 3)`, of unit length.
    """
    triangle, ray = _candidates(triangles, directions)
    a, b, c = np.moveaxis(triangles[triangle], 1, 0)
    along = directions[ray]
    # The ray's barycentric coordinates, up to a common factor: volumes that it spans with two corners.
    volumes = np.stack([(along * np.cross(*pair)).sum(axis=1) for pair in ((b, c), (c, a), (a, b))])
    whole = volumes.sum(axis=0)
    met = (volumes * np.sign(whole) >= -_SLACK * np.abs(volumes).max(axis=0)).all(axis=0) & (whole != 0)
    height = (a * np.cross(b - a, c - a)).sum(axis=1)[met] / whole[met]
    farthest = np.zeros(len(directions))
    np.maximum.at(farthest, ray[met], height)
    return farthest


def _candidates(triangles: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles and rays that may meet, as index pairs: the rays in the smallest cone about a triangle's middle."""
    outwards = triangles / np.maximum(np.linalg.norm(triangles, axis=2, keepdims=True), np.finfo(float).tiny)
    middle = outwards.sum(axis=1)
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), np.finfo(float).tiny)
    cosine = np.einsum("fki,fi->fk", outwards, middle).min(axis=1)
    # A cone of less than a half space is convex, so it holds the triangle with its corners; others hold everything.
    chord = np.where(cosine > 0, np.sqrt(np.maximum(2 - 2 * cosine, 0)) + _SLACK, 2 + _SLACK)
    rays = KDTree(directions).query_ball_point(middle, chord)
    return np.repeat(np.arange(len(rays)), [len(found) for found in rays]), np.concatenate(rays).astype(int)
