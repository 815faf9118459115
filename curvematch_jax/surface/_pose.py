"""The canonical frame of a surface: no place, turn, reflection or scale is left in it.

Vranic, Saupe, Richter: Tools for 3D-object retrieval: Karhunen-Loeve transform and spherical harmonics, IEEE Workshop
on Multimedia Signal Processing, 2001.
"""

import numpy as np

from ._blas import on_one_thread
from ._mesh import Mesh
from ._topology import norms


@on_one_thread
def canonical_vertices(mesh: Mesh) -> np.ndarray:
    """Vertices `(v, 3)` with the surface's centroid as origin and its mean distance from there as unit.

    The axes are the principal ones of the surface, the longest first (continuous PCA: every point of every triangle
    counts, not only vertices). Each points to where the surface's second moment about the centroid is greater.
    """
    shares = mesh.face_areas / mesh.area
    a, b, c = (mesh.vertices[corner] for corner in mesh.faces.T)
    centroid = shares @ (a + b + c) / 3
    vertices = mesh.vertices - centroid
    corners = [corner - centroid for corner in (a, b, c)]
    sums = corners[0] + corners[1] + corners[2]
    moments = sum((shares[:, None] * x).T @ x for x in (*corners, sums))
    axes = np.linalg.eigh(moments / 12)[1][:, ::-1]
    # The mean of a quadratic over a triangle is that of its values at the middles of the three edges.
    middles = [(x + y) / 2 @ axes for x, y in zip(corners, corners[1:] + corners[:1], strict=True)]
    sides = shares @ sum(np.sign(middle) * middle**2 for middle in middles)
    scale = shares @ sum(norms(middle) for middle in middles) / 3
    return vertices @ axes * np.where(sides < 0, -1, 1) / scale
