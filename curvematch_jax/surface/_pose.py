"""The canonical frame of a surface: no place, turn, reflection or scale is left in it.

Vranic, Saupe, Richter: Tools for 3D-object retrieval: Karhunen-Loeve transform and spherical harmonics, IEEE Workshop
on Multimedia Signal Processing, 2001.
"""

import numpy as np

from ._mesh import Mesh


def canonical_vertices(mesh: Mesh) -> np.ndarray:
    """Vertices `(v, 3)` with the surface's centroid as origin and its mean distance from there as unit.

    The axes are the principal ones of the surface, the longest first (continuous PCA: every point of every triangle
    counts, not only vertices). Each points to where the surface's second moment about the centroid is greater.
    """
    shares = mesh.face_areas / mesh.area
    vertices = mesh.vertices - shares @ mesh.vertices[mesh.faces].mean(axis=1)
    corners = vertices[mesh.faces]
    sums = corners.sum(axis=1)
    moments = np.einsum("f,fki,fkj->ij", shares, corners, corners) + np.einsum("f,fi,fj->ij", shares, sums, sums)
    axes = np.linalg.eigh(moments / 12)[1][:, ::-1]
    # The mean of a quadratic over a triangle is that of its values at the middles of the three edges.
    middles = (corners + np.roll(corners, 1, axis=1)) / 2 @ axes
    sides = np.einsum("f,fki->i", shares, np.sign(middles) * middles**2)
    scale = shares @ np.linalg.norm(middles, axis=2).mean(axis=1)
    return vertices @ axes * np.where(sides < 0, -1, 1) / scale
