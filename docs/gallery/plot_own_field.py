"""
Bring your own distance field
=============================

Parts are made with one of four distances along the surface (``Extraction.field``). The engine itself compares any
closed curves, so the level curves of any other function on a surface can be compared in the same way. Here the
function is the heat-method distance of potpourri3d from the tip of a limb.
"""

import numpy as np
import potpourri3d

from curvematch_jax import creature, distance_matrix, extract_parts
from curvematch_jax.pictures import matrix_picture

LEVELS = np.linspace(0.08, 0.24, 5)


def limb_curves(mesh, tip):
    """The level curves (5, 3, 100) around a point of a mesh, at shares of the mesh's extent."""
    source = int(np.linalg.norm(mesh.vertices - tip, axis=1).argmin())
    field = potpourri3d.MeshHeatMethodDistanceSolver(mesh.vertices, mesh.faces).compute_distance(source)
    extent = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    return np.stack([level_curve(mesh, field, share * extent) for share in LEVELS])


def level_curve(mesh, field, level):
    """The longest closed curve (3, 100) on which the field has a value."""
    edges = potpourri3d.edges(mesh.vertices, mesh.faces)
    pieces = potpourri3d.marching_triangles(mesh.vertices, mesh.faces, field, level)
    crossed, shares = zip(*max(pieces, key=len), strict=True)  # edges, and where on each; the last point is the first
    start, end = mesh.vertices[edges[list(crossed)]].swapaxes(0, 1)
    points = start + np.array(shares) * (end - start)
    travelled = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    places = travelled[-1] * np.arange(100) / 100  # equal arc lengths along the polygon
    return np.stack([np.interp(places, travelled, x) for x in points.T])


names, curves = [], []
for kind in ("horse", "human"):
    mesh = creature(kind).mesh
    tips = extract_parts(mesh).points[:4]  # feature points; any points of your own will do
    curves += [limb_curves(mesh, tip) for tip in tips]
    names += [f"{kind} {i}" for i in range(len(tips))]

# %%
# The distance of two limbs is the mean distance of their curves, level by level.

levels = [distance_matrix(np.stack(level)) for level in zip(*curves, strict=True)]
matrix_picture(np.mean(levels, axis=0), names, "limbs.png")
print(np.mean(levels, axis=0).round(2))
