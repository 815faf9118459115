"""Warps of the circle, lifted to the line: `gamma(t + 1) = gamma(t) + 1`, sampled at `k/n`, lanes last.

A warp is piecewise linear between its samples. `gamma[n] = gamma[0] + 1`, and `gamma[0]` is the start point.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def interpolate_monotone(
    x: Float[Array, "k l"], nodes: Float[Array, "nodes l"], values: Float[Array, "nodes l"]
) -> Float[Array, "k l"]:
    """The lift through `(nodes, values)`, both growing by 1 over the whole, at any real x."""

    def lane(x, nodes, values):
        turns = jnp.floor(x - nodes[0])
        return jnp.interp(x - turns, nodes, values) + turns

    return jax.vmap(lane, in_axes=1, out_axes=1)(x, nodes, values)


def evaluate(gamma: Float[Array, "nodes l"], x: Float[Array, "k l"]) -> Float[Array, "k l"]:
    """`gamma(x)` at any real x."""
    n = gamma.shape[0] - 1
    turns = jnp.floor(x)
    position = (x - turns) * n
    index = jnp.clip(position.astype(jnp.int32), 0, n - 1)
    left = jnp.take_along_axis(gamma, index, axis=0)
    right = jnp.take_along_axis(gamma, index + 1, axis=0)
    return left + (right - left) * (position - index.astype(x.dtype)) + turns


def invert(gamma: Float[Array, "nodes l"]) -> Float[Array, "nodes l"]:
    """The inverse warp at `k/n`."""
    grid = nodes_like(gamma)
    return interpolate_monotone(grid, gamma, grid)


def nodes_like(gamma: Float[Array, "nodes l"]) -> Float[Array, "nodes l"]:
    """The identity warp, `k/n`, on as many lanes."""
    n = gamma.shape[0] - 1
    return jnp.broadcast_to(jnp.arange(n + 1, dtype=gamma.dtype)[:, None] / n, gamma.shape)


def strictly_increasing(gamma: Float[Array, "nodes l"], least: float) -> Float[Array, "nodes l"]:
    """The warp with every slope at least about `least`, and its ends one turn apart."""
    n = gamma.shape[0] - 1
    return from_increments(gamma[0], jnp.maximum(jnp.diff(gamma, axis=0), least / n))


def from_increments(start: Float[Array, " l"], increments: Float[Array, "n l"]) -> Float[Array, "n+1 l"]:
    """The warp from its start point and increments, which are scaled to add up to 1."""
    total = jnp.cumsum(increments, axis=0)
    return start[None] + jnp.concatenate([jnp.zeros_like(total[:1]), total / total[-1:]])


def act(q: Float[Array, "d n l"], gamma: Float[Array, "n+1 l"]) -> Float[Array, "d n l"]:
    """The group action `(q, gamma) -> q(gamma) sqrt(gamma')` on the grid `k/n`, by linear interpolation."""
    n = q.shape[1]
    position = gamma[:-1] * n
    floor = jnp.floor(position)
    index = (floor.astype(jnp.int32) % n)[None]
    left = jnp.take_along_axis(q, index, axis=1)
    right = jnp.take_along_axis(q, (index + 1) % n, axis=1)
    slope = jnp.diff(gamma, axis=0) * n
    centred = jnp.maximum((slope + jnp.roll(slope, 1, axis=0)) / 2, 0)
    return (left + (right - left) * (position - floor)[None]) * jnp.sqrt(centred)[None]
