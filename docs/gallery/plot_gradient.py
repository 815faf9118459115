"""
Fit a curve by gradient descent
===============================

The elastic distance is differentiable, so a curve can be moved towards others by plain gradient descent. The curve
here is a trigonometric polynomial: the distance depends on derivatives of curves, and a descent over single samples
would make the curve rough.
"""

import jax
import jax.numpy as jnp

from curvematch_jax import Aligner, centre, elastic_distance, length
from curvematch_jax.datasets import leaves
from curvematch_jax.pictures import geodesic_picture

target = jnp.asarray(leaves(1, seed=3).curves, jnp.float32)  # (1, 2, 100)
angles = 2 * jnp.pi * jnp.outer(jnp.arange(1, 9), jnp.arange(100) / 100)
basis = jnp.concatenate([jnp.cos(angles), jnp.sin(angles)])  # (16, 100)
circle = jnp.zeros((2, 16)).at[0, 0].set(1.0).at[1, 8].set(1.0)


@jax.jit
@jax.value_and_grad
def squared_distance(coefficients):
    return elastic_distance((coefficients @ basis)[None], target, Aligner.fast())[0] ** 2


coefficients, frames = circle, []
for step in range(31):
    value, slope = squared_distance(coefficients)
    if step % 6 == 0:
        print(f"step {step:2d}: distance {value**0.5:.3f} radians")
        frames.append(coefficients @ basis)
    coefficients = coefficients - 0.15 * slope

# %%
# The curve after 0, 6, ..., 30 steps, and the target, at the same length.

shown = [centre(curve / length(curve)) for curve in (*frames, target[0])]
geodesic_picture(jnp.stack(shown), "descent.png")
