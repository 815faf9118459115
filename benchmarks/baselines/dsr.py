"""DSR: depth images, silhouettes and rays of the posed surface, in one vector.

Vranic: 3D model retrieval, PhD thesis, University of Leipzig, 2004; also as DESIRE in: DESIRE: a composite 3D-shape
descriptor, IEEE ICME, 2005. Chosen here: the window, contours by their distance from the centroid at equal steps of
arc length, and equal weights of the three kinds.
"""

import numpy as np

from curvematch_jax._optional import require
from curvematch_jax.surface import Mesh

from ._common import l1
from ._pose import canonical_vertices
from ._rays import depths
from .rsh import magnitudes

PIXELS = 256  # on a side
WINDOW = 2.0  # half a side, in mean distances from the centroid; what is beyond is cut off
FREQUENCIES = 5  # of images: |p| + |q| at most
CONTOUR_FREQUENCIES = 50
_CONTOUR_POINTS = 512

compare = l1


def describe(mesh: Mesh) -> np.ndarray:
    """186 numbers of six depth images, 150 of three silhouettes and 136 of rays; each kind sums up to 1."""
    triangles = canonical_vertices(mesh)[mesh.faces]
    images = [depths(np.roll(triangles, axis, axis=2), WINDOW, PIXELS) for axis in range(3)]
    depth = [image_magnitudes(view) for low, high in images for view in (nearness(high), nearness(-low))]
    silhouette = [contour_magnitudes(np.isfinite(high)) for _, high in images]
    parts = np.concatenate(depth), np.concatenate(silhouette), magnitudes(triangles)
    return np.concatenate([part / part.sum() for part in parts])


def nearness(height: np.ndarray) -> np.ndarray:
    """A depth image: 1 on the near side of the cube that the window is a side of, 0 on the far side and in the void."""
    return np.clip(height + WINDOW, 0, 2 * WINDOW) / (2 * WINDOW)


def image_magnitudes(image: np.ndarray) -> np.ndarray:
    """Magnitudes of the lowest frequencies, `(31,)`: of each pair `(p, q)` and `(-p, -q)`, which are equal, one."""
    p, q = np.mgrid[0 : FREQUENCIES + 1, -FREQUENCIES : FREQUENCIES + 1]
    low = (p + abs(q) <= FREQUENCIES) & ((p > 0) | (q >= 0))
    return np.abs(np.fft.fft2(image)[p[low], q[low]]) / image.size


def contour_magnitudes(silhouette: np.ndarray) -> np.ndarray:
    """Magnitudes of the lowest frequencies `(50,)` of the outline's distance from the middle of the image."""
    contour = longest_contour(silhouette)
    if contour is None:  # seen edge-on, and thinner than a pixel
        return np.zeros(CONTOUR_FREQUENCIES)
    arcs = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(contour, axis=0), axis=1))])
    places = np.arange(_CONTOUR_POINTS) / _CONTOUR_POINTS * arcs[-1]
    points = np.stack([np.interp(places, arcs, coordinate) for coordinate in contour.T])
    distance = np.linalg.norm(points, axis=0)
    return np.abs(np.fft.rfft(distance)[:CONTOUR_FREQUENCIES]) / _CONTOUR_POINTS


def longest_contour(silhouette: np.ndarray) -> np.ndarray | None:
    """The longest line between what is covered and what is not, closed, in units of the window and from its middle."""
    contourpy = require("contourpy", "bench", "describing silhouettes")
    covered = np.pad(silhouette, 1).astype(float)  # so that lines close where the window cuts
    places = ((np.arange(-1, PIXELS + 1) + 0.5) * 2 / PIXELS - 1) * WINDOW
    lines = contourpy.contour_generator(places, places, covered, line_type="Separate").lines(0.5)
    return max(lines, key=lambda line: np.linalg.norm(np.diff(line, axis=0), axis=1).sum(), default=None)
