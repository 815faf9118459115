"""Warps of the circle, lifted to the line: `gamma(t + 1) = gamma(t) + 1`, sampled at `k/n`, lanes last.

A warp is piecewise linear between its samples. `gamma[n] = gamma[0] + 1`, and `gamma[0]` is the start point.
A path, `(tau - u(tau), tau + u(tau))` with periodic u, is a warp and its inverse at once.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

_BLOCK = 16  # pieces to one fused loop


def interpolate(
    x: Float[Array, "k l"], nodes: Float[Array, "nodes l"], values: Float[Array, "nodes l"]
) -> Float[Array, "k l"]:
    """The lift through `(nodes, values)`, both growing by 1 over the whole, at any real x.

    A sum of ramps, one for each piece: on whole rows it is faster than a search for the piece of every x.
    """
    turns = jnp.floor(x - nodes[:1])
    x = x - turns
    run, rise = jnp.diff(nodes, axis=0), jnp.diff(values, axis=0)
    slope = jnp.where(run > 0, rise / jnp.where(run > 0, run, 1), 0)

    def add_block(total, block):
        low, run, slope = block
        for start, length, steepness in zip(low, run, slope, strict=True):
            total = total + jnp.clip(x - start[None], 0, length[None]) * steepness[None]
        return total, None

    size = min(_BLOCK, run.shape[0])
    pad = -run.shape[0] % size
    blocks = [jnp.pad(v, ((0, pad), (0, 0))).reshape(-1, size, v.shape[1]) for v in (nodes[:-1], run, slope)]
    total, _ = lax.scan(add_block, jnp.broadcast_to(values[:1], x.shape), tuple(blocks))
    return total + turns


def to_path(gamma: Float[Array, "nodes l"], knots: int) -> Float[Array, "{knots} l"]:
    """The warp as a path `(tau - u, tau + u)`: u at `k/knots`."""
    n = gamma.shape[0] - 1
    grid = jnp.arange(n + 1, dtype=gamma.dtype)[:, None] / n
    times = jnp.broadcast_to(jnp.arange(knots, dtype=gamma.dtype)[:, None] / knots, (knots, gamma.shape[1]))
    return interpolate(times, (grid + gamma) / 2, gamma) - times


def from_path(u: Float[Array, "k l"], x: Float[Array, "nodes l"]) -> Float[Array, "nodes l"]:
    """The warp of a path, at x from 0 to 1."""
    knots = u.shape[0]
    time = jnp.arange(knots + 1, dtype=u.dtype)[:, None] / knots
    u = jnp.concatenate([u, u[:1]])
    return interpolate(x, time - u, time + u)


def resampled(u: Float[Array, "k l"], knots: int) -> Float[Array, "{knots} l"]:
    """The same path with another number of knots, by linear interpolation."""
    old = u.shape[0]
    if knots == old:
        return u
    place = np.arange(knots) * (old / knots)
    low = place.astype(int)
    weights = np.zeros((knots, old))
    weights[np.arange(knots), low] = 1 - (place - low)
    weights[np.arange(knots), (low + 1) % old] += place - low
    return jnp.matmul(jnp.asarray(weights, u.dtype), u, precision="highest")


def evaluate(gamma: Float[Array, "nodes l"], x: Float[Array, "k l"]) -> Float[Array, "k l"]:
    """`gamma(x)` at any real x, for gamma given at `k/n`."""
    n = gamma.shape[0] - 1
    turns = jnp.floor(x)
    position = (x - turns) * n
    index = jnp.clip(position.astype(jnp.int32), 0, n - 1)
    left = jnp.take_along_axis(gamma, index, axis=0, mode="promise_in_bounds")
    right = jnp.take_along_axis(gamma, index + 1, axis=0, mode="promise_in_bounds")
    return left + (right - left) * (position - index.astype(x.dtype)) + turns


def act(q: Float[Array, "d n l"], gamma: Float[Array, "n+1 l"]) -> Float[Array, "d n l"]:
    """The group action `(q, gamma) -> q(gamma) sqrt(gamma')` on the grid `k/n`, by linear interpolation."""
    n = q.shape[1]
    position = (gamma[:-1] - jnp.floor(gamma[:-1])) * n
    index = jnp.minimum(position.astype(jnp.int32), n - 1)
    share = position - index.astype(gamma.dtype)
    take = lambda at: jnp.take_along_axis(q, at[None], axis=1, mode="promise_in_bounds")  # noqa: E731
    left, right = take(index), take(jnp.where(index == n - 1, 0, index + 1))
    slope = jnp.diff(gamma, axis=0) * n
    centred = jnp.maximum((slope + jnp.roll(slope, 1, axis=0)) / 2, 0)
    return (left + (right - left) * share[None]) * jnp.sqrt(centred)[None]
