"""How a surface looks from outside: depth images of it, and how far it reaches in every direction.

Depth images: D. Vranic, "3D model retrieval", PhD thesis, University of Leipzig, 2004. Reach: D. Saupe, D. Vranic, "3D
model retrieval with spherical harmonics and moments", DAGM 2001, with the directions and the quadrature of D. Healy, D.
Rockmore, P. Kostelec, S. Moore, "FFTs for the 2-sphere", J. Fourier Anal. Appl. 9(4), 2003.
"""

from __future__ import annotations

import functools as ft

import numpy as np
from scipy.special import sph_harm_y

from ._mesh import Mesh
from ._pose import canonical_vertices
from ._rays import depths, reach

PIXELS = 256  # on a side
WINDOW = 2.0  # half a side, in mean distances from the centroid; what is beyond is cut off
FREQUENCIES = 5  # of images: |p| + |q| at most
GRID = 128  # latitudes, and as many longitudes
DEGREES = 16
POLAR = (2 * np.arange(GRID) + 1) * np.pi / (2 * GRID)
AZIMUTH = 2 * np.pi * np.arange(GRID) / GRID


def views(mesh: Mesh) -> np.ndarray:
    """186 numbers of six depth images and 136 of the reach, `(322,)`; each kind sums up to 1.

    Place, size, turn and reflection of the surface do not matter: it is seen in its canonical frame.
    """
    triangles = canonical_vertices(mesh)[mesh.faces]
    kinds = (
        np.concatenate([image_magnitudes(nearness(image)) for image in depth_images(triangles)]),
        reach_magnitudes(triangles),
    )
    return np.concatenate([kind / kind.sum() for kind in kinds])


def depth_images(triangles: np.ndarray) -> list[np.ndarray]:
    """What is nearest to the six sides of the window: heights `(PIXELS, PIXELS)`, `-inf` where nothing is seen."""
    pairs = [depths(np.roll(triangles, axis, axis=2), WINDOW, PIXELS) for axis in range(3)]
    return [view for low, high in pairs for view in (high, -low)]


def nearness(height: np.ndarray) -> np.ndarray:
    """A depth image: 1 on the near side of the cube that the window is a side of, 0 on the far side and in the void."""
    return np.clip(height + WINDOW, 0, 2 * WINDOW) / (2 * WINDOW)


def image_magnitudes(image: np.ndarray) -> np.ndarray:
    """Magnitudes of the lowest frequencies, `(31,)`: of each pair `(p, q)` and `(-p, -q)`, which are equal, one."""
    p, q = np.mgrid[0 : FREQUENCIES + 1, -FREQUENCIES : FREQUENCIES + 1]
    low = (p + abs(q) <= FREQUENCIES) & ((p > 0) | (q >= 0))
    waves = np.fft.fft(np.fft.rfft(image, axis=0)[: FREQUENCIES + 1], axis=1)
    return np.abs(waves[p[low], q[low]]) / image.size


def reach_magnitudes(triangles: np.ndarray) -> np.ndarray:
    """`|c_lm|` `(136,)` of the reach of triangles `(f, 3, 3)`, by order `0 <= m < 16`, then by degree `m <= l < 16`."""
    order, _ = np.triu_indices(DEGREES)
    waves = np.fft.rfft(reach(triangles, POLAR, AZIMUTH), axis=1).T[order]
    return np.abs((_harmonics() * waves).sum(axis=1))


@ft.cache
def _harmonics() -> np.ndarray:
    """Harmonics of degree l and order m along a meridian, `(136, GRID)`, weighted for the sum over latitudes.

    The weights are exact for products of harmonics whose degrees add up to less than `GRID`.
    """
    odd = 2 * np.arange(GRID // 2) + 1
    weights = 8 * np.pi / GRID**2 * np.sin(POLAR) * (np.sin(np.outer(POLAR, odd)) / odd).sum(axis=1)
    order, degree = np.triu_indices(DEGREES)
    return weights * sph_harm_y(degree, order, POLAR[:, None], 0.0).T.real
