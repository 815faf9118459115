"""
Fit the parameters of a shape with optimistix
=============================================

Which parameters of a family of shapes describe a given outline? `optimistix <https://docs.kidger.site/optimistix/>`_
minimises the elastic distance over them. Neither the pose nor the sampling of the outline has to be known. Solvers
that need first derivatives only can be used; second derivatives of the distance are refused.
"""

import jax.numpy as jnp
import optimistix as optx

from curvematch_jax import Aligner, elastic_distance
from curvematch_jax.pictures import geodesic_picture

t = jnp.linspace(0, 2 * jnp.pi, 100, endpoint=False)


def flower(parameters):
    """A closed curve (2, 100) with five petals of some depth, stretched."""
    depth, stretch = parameters
    return (1 + depth * jnp.cos(5 * t)) * jnp.stack([jnp.exp(stretch) * jnp.cos(t), jnp.sin(t)])


true = jnp.array([0.3, 0.4])
turn = jnp.array([[0.6, -0.8], [0.8, 0.6]])
outline = jnp.roll(3.0 * turn @ flower(true) + 5.0, 17, axis=1)  # scaled, rotated, moved, started elsewhere


def misfit(parameters, outline):
    return elastic_distance(flower(parameters)[None], outline[None], Aligner.fast())[0] ** 2


start = jnp.array([0.1, 0.1])
solver = optx.BFGS(rtol=1e-3, atol=1e-3)
found = optx.minimise(misfit, solver, start, args=outline, max_steps=30, throw=False).value
print("found", found.round(3), "true", true)

# %%
# The first guess, the fitted shape, and the outline.

geodesic_picture(jnp.stack([flower(start), flower(found), turn.T @ (outline - 5.0) / 3.0]), "fit.png")
