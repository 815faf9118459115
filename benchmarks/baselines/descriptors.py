"""Baselines that describe a surface by a vector of numbers: D2, geodesic D2, RSH, DSR and ShapeDNA."""

from collections.abc import Sequence
from typing import Any

import contourpy
import numpy as np
import potpourri3d
from scipy.spatial.distance import cdist

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._fields import Geodesics
from curvematch_jax.surface._pose import canonical_vertices
from curvematch_jax.surface._spectrum import spectrum
from curvematch_jax.surface._topology import face_areas
from curvematch_jax.surface._views import (
    PIXELS,
    WINDOW,
    depth_images,
    image_magnitudes,
    nearness,
    reach_magnitudes,
)

PAIRS = 1024**2
BINS = 1024
KNOTS = 64
REACH = 3.0  # in means of the distances: the ends of a rod are that far apart
SOURCES = 256
CONTOUR_FREQUENCIES = 50
EIGENVALUES = 15  # besides the first, which is 0
_CONTOUR_POINTS = 512


def l1(queries: Sequence[np.ndarray], objects: Sequence[np.ndarray]) -> np.ndarray:
    """Sums of absolute differences `(Q, M)` of descriptions."""
    return cdist(np.stack(queries), np.stack(objects), "cityblock")


def d2(mesh: Mesh) -> np.ndarray:
    """D2: the density of the distances between points that are uniform on the surface, at `KNOTS` knots.

    Osada, Funkhouser, Chazelle, Dobkin: Shape distributions, ACM Trans. Graph. 21(4), 2002.
    """
    random = np.random.default_rng(0)
    first, second = (uniform_points(mesh, PAIRS, random) for _ in range(2))
    return density(np.linalg.norm(first - second, axis=1))


def geodesic_d2(mesh: Mesh) -> np.ndarray:
    """Geodesic D2: the density of distances along the surface, from points spread over it to its vertices by area.

    Hamza, Krim: Geodesic matching of triangulated surfaces, IEEE Trans. Image Processing 15(8), 2006, for the
    distribution of geodesic distances as a signature; here with the sampling and the density of D2.
    """
    distances, areas = geodesics_between(mesh, SOURCES)
    return density(distances.ravel(), np.tile(areas, SOURCES))


def rsh(mesh: Mesh) -> np.ndarray:
    """RSH: `|c_lm|` `(136,)` of how far the surface reaches in each direction from its centroid, canonically turned.

    Saupe, Vranic: 3D model retrieval with spherical harmonics and moments, DAGM, 2001.
    """
    return reach_magnitudes(canonical_vertices(mesh)[mesh.faces])


def dsr(mesh: Mesh) -> np.ndarray:
    """DSR: 186 numbers of six depth images, 150 of three silhouettes and 136 of rays; each kind sums up to 1.

    Vranic: 3D model retrieval, PhD thesis, University of Leipzig, 2004; also as DESIRE in: DESIRE: a composite 3D-shape
    descriptor, IEEE ICME, 2005. Chosen here: the window, contours by their distance from the centroid at equal steps of
    arc length, and equal weights of the three kinds.
    """
    triangles = canonical_vertices(mesh)[mesh.faces]
    images = depth_images(triangles)
    depth = [image_magnitudes(nearness(image)) for image in images]
    silhouette = [contour_magnitudes(np.isfinite(image)) for image in images[::2]]
    parts = np.concatenate(depth), np.concatenate(silhouette), reach_magnitudes(triangles)
    return np.concatenate([part / part.sum() for part in parts])


def shape_dna(mesh: Mesh) -> np.ndarray:
    """ShapeDNA: the first eigenvalues above 0 of the Laplacian, ascending, times the area, which frees them of scale.

    Reuter, Wolter, Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and solids, Computer-Aided Design
    38(4), 2006. The Laplacian is that of linear elements with the vertices' areas as masses, theirs of cubic ones.
    """
    return spectrum(mesh, EIGENVALUES)


def relative(queries: Sequence[np.ndarray], objects: Sequence[np.ndarray]) -> np.ndarray:
    """L2 norms of relative differences `(Q, M)`: eigenvalues grow with their index, and would weigh by it otherwise."""
    query, other = np.stack(queries)[:, None], np.stack(objects)[None]
    return np.linalg.norm((query - other) / ((query + other) / 2), axis=2)


def uniform_points(mesh: Mesh, count: int, random: np.random.Generator) -> np.ndarray:
    """Points `(count, 3)`, in a random order, of which every face holds its share by area to within one."""
    shares = np.cumsum(face_areas(mesh.vertices, mesh.faces))
    places = (np.arange(count) + random.random(count)) / count * shares[-1]
    faces = random.permutation(np.searchsorted(shares[:-1], places))
    a, b, c = (mesh.vertices[mesh.faces[faces, corner]] for corner in range(3))
    along, across = np.sqrt(random.random((count, 1))), random.random((count, 1))
    return (1 - along) * a + along * (1 - across) * b + along * across * c


def density(distances: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """A piecewise linear density of distances over their mean, scaled to knots one apart.

    A histogram of `BINS` bins is shared out to the nearest of `KNOTS` equidistant knots on `[0, REACH]`. So the L1
    distance of two shapes is that of their densities: 0 when they are equal, 2 when they have nothing in common.

    Args:
        distances: any number of them; those beyond `REACH` means are counted as `REACH` means.
        weights: how much each counts, by default all the same.
    """
    scaled = np.minimum(distances / np.average(distances, weights=weights), REACH)
    shares, edges = np.histogram(scaled, BINS, (0, REACH), weights=weights)
    place = (edges[:-1] + edges[1:]) / 2 * (KNOTS - 1) / REACH
    left = place.astype(int)
    to_right = (place - left) * shares
    knots = np.bincount(left, shares - to_right, KNOTS) + np.bincount(left + 1, to_right, KNOTS)
    return knots / shares.sum()


def geodesics_between(mesh: Mesh, sources: int) -> tuple[np.ndarray, np.ndarray]:
    """Geodesic distances from vertices that are spread over the surface by its area.

    Returns:
        distances `(sources, v)`, and the area that each vertex stands for `(v,)`.
    """
    areas = potpourri3d.vertex_areas(mesh.vertices, mesh.faces)
    order = np.random.default_rng(0).permutation(len(areas))  # neighbours in the file are often so on the surface
    shares = np.cumsum(areas[order])
    places = (np.arange(sources) + 0.5) / sources * shares[-1]
    distances = Geodesics(mesh)
    return np.stack([distances(v) for v in order[np.searchsorted(shares[:-1], places)].tolist()]), areas


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
    covered = np.pad(silhouette, 1).astype(float)  # so that lines close where the window cuts
    places = ((np.arange(-1, PIXELS + 1) + 0.5) * 2 / PIXELS - 1) * WINDOW
    lines: Any = contourpy.contour_generator(places, places, covered, line_type="Separate").lines(0.5)
    return max(lines, key=lambda line: np.linalg.norm(np.diff(line, axis=0), axis=1).sum(), default=None)
