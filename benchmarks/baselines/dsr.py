"""DSR: depth images, silhouettes and rays of the posed surface, in one vector.

Vranic: 3D model retrieval, PhD thesis, University of Leipzig, 2004; also as DESIRE in: DESIRE: a composite 3D-shape
descriptor, IEEE ICME, 2005. Chosen here: the window, contours by their distance from the centroid at equal steps of
arc length, and equal weights of the three kinds.
"""

import numpy as np

from curvematch_jax._optional import require
from curvematch_jax.surface import Mesh
from curvematch_jax.surface._pose import canonical_vertices
from curvematch_jax.surface._views import (
    PIXELS,
    WINDOW,
    depth_images,
    image_magnitudes,
    nearness,
    reach_magnitudes,
)

from ._common import l1

CONTOUR_FREQUENCIES = 50
_CONTOUR_POINTS = 512

compare = l1


def describe(mesh: Mesh) -> np.ndarray:
    """186 numbers of six depth images, 150 of three silhouettes and 136 of rays; each kind sums up to 1."""
    triangles = canonical_vertices(mesh)[mesh.faces]
    images = depth_images(triangles)
    depth = [image_magnitudes(nearness(image)) for image in images]
    silhouette = [contour_magnitudes(np.isfinite(image)) for image in images[::2]]
    parts = np.concatenate(depth), np.concatenate(silhouette), reach_magnitudes(triangles)
    return np.concatenate([part / part.sum() for part in parts])


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
