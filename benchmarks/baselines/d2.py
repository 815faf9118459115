"""D2: how far apart two random points of the surface are.

Osada, Funkhouser, Chazelle, Dobkin: Shape distributions, ACM Trans. Graph. 21(4), 2002.
"""

import numpy as np

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._topology import face_areas

from ._common import l1

PAIRS = 1024**2
BINS = 1024
KNOTS = 64
REACH = 3.0  # in means of the distances: the ends of a rod are that far apart

compare = l1


def describe(mesh: Mesh) -> np.ndarray:
    """The density of the distances between points that are uniform on the surface, at `KNOTS` knots."""
    random = np.random.default_rng(0)
    first, second = (uniform_points(mesh, PAIRS, random) for _ in range(2))
    return density(np.linalg.norm(first - second, axis=1))


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
