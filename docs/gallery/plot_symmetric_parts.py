"""
Symmetric parts
===============

Which parts of a body does an intrinsic symmetry exchange? ``symmetric_parts`` finds left and right limbs of one
object from its parts alone. Parts that are nearly alike can end up in one group although no symmetry exchanges them:
the reference of the function states the limits.
"""

import numpy as np
from matplotlib.figure import Figure

from curvematch_jax import creature, extract_parts, symmetric_parts

parts = extract_parts(creature("human", pose=2).mesh)
groups = symmetric_parts(parts)
print(groups)  # the indices of the parts, in groups

# %%
# The level curves on the surface, in the colour of their group. Curves are stored centred and with unit length;
# ``lengths``, ``diameter`` and ``centres`` bring them back to the mesh.

figure = Figure(figsize=(6, 4.5), layout="constrained")
axes = figure.add_subplot(projection="3d", azim=-60, elev=10)
colour = {part: f"C{k}" for k, group in enumerate(groups) for part in group}
for part, mask in enumerate(parts.mask):
    for level in np.flatnonzero(mask[:12]):  # the levels next to the feature point
        scale = parts.lengths[part, level] * parts.diameter
        curve = parts.curves[part, level] * scale + parts.centres[part, level][:, None]
        axes.plot(*np.append(curve, curve[:, :1], axis=1), color=colour[part], linewidth=0.8)
axes.set_aspect("equal")
axes.set_axis_off()
figure.savefig("symmetric.png", dpi=120)
