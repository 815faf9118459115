"""
Outlines of an image, and matched points
========================================

Two silhouettes become closed curves. The alignment matches their points: it finds the rotation, the start point and
the parametrisation in which the two outlines are nearest.
"""

import numpy as np
from matplotlib.figure import Figure

from curvematch_jax import Aligner, align, matched_points
from curvematch_jax.outlines import outlines_of

rows, columns = np.mgrid[-60:61, -60:61]
angle, radius = np.arctan2(rows, columns), np.hypot(rows, columns)
flower = radius < 38 + 14 * np.cos(5 * angle)  # any binary mask, such as those of a segmentation
bent = radius < 36 + 12 * np.cos(5 * angle + 1.2) + 7 * np.cos(angle)
first, second = (outlines_of(mask).curves[0] for mask in (flower, bent))

alignment = align(first, second, Aligner.fast())
points1, points2 = matched_points(first, second, alignment)  # (2, 256) each
print(f"distance {alignment.distance:.3f} radians")

# %%
# Points that are matched have the same colour.

figure = Figure(figsize=(7, 3.5), layout="constrained")
axes = figure.subplots()
time = np.arange(points1.shape[1])
for points in (points1, points2 + np.array([[130.0], [0.0]])):
    axes.scatter(*points, c=time, cmap="twilight", s=12)
axes.set_aspect("equal")
axes.set_axis_off()
figure.savefig("matched.png", dpi=120)
