"""
A geodesic between two outlines
===============================

The shortest deformation of one closed curve into another one. Start point, rotation and parametrisation are chosen so
that the deformation is as short as it can be: tips move to tips, and not to wherever the sampling happened to begin.
"""

import jax.numpy as jnp

from curvematch_jax import Aligner, geodesic
from curvematch_jax.pictures import geodesic_picture

t = jnp.linspace(0, 2 * jnp.pi, 100, endpoint=False)
star = (1 + 0.4 * jnp.cos(5 * t)) * jnp.stack([jnp.cos(t), jnp.sin(t)])  # (d, n), without the repeated end point
x, y = (1 + 0.3 * jnp.cos(5 * t)) * jnp.stack([2 * jnp.cos(t + 2), jnp.sin(t + 2)])
bent = jnp.stack([x, y + 0.3 * x**2])

path = geodesic(star, bent, steps=6, aligner=Aligner.fast())
print(f"length {path.length:.3f} radians, converged: {path.converged}")

# %%
# `path.path` holds the square-root velocity functions along the geodesic, and `path.curves()` the curves.

geodesic_picture(path.curves(), "geodesic.png")
