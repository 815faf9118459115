"""Dynamic programming over warps: the best monotone path of two closed curves on a grid, in a band.

Maximises `integral <q1(t), q2(gamma(t))> sqrt(gamma'(t)) dt` over piecewise-linear `gamma` with `gamma(0) = 0`,
`gamma(1) = 1`, nodes on the n x n grid, and slopes b/a of coprime steps (Mio, Srivastava and Joshi, IJCV 2007).
Lanes (pairs) are the last axis of every array: rows are contiguous, and one row of the band is one fused loop.
"""

import math

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from ._lanes import dot

_IMPOSSIBLE = -1e9


def steps_up_to(largest: int) -> tuple[tuple[int, int], ...]:
    """Coprime steps (a, b) of at most `largest` in either direction: 3, 7, 11, 19 and 23 of them for 2 to 6."""
    sizes = range(1, largest + 1)
    return tuple((a, b) for a in sizes for b in sizes if math.gcd(a, b) == 1)


def best_path(q1: Float[Array, "d n l"], q2: Float[Array, "d n l"], band: int, largest: int) -> Float[Array, "n+1 l"]:
    """The best warp, in grid units, at the nodes 0..n; it stays within `band` nodes of the diagonal."""
    steps = steps_up_to(largest)
    choices = _forward(q1, q2, band, steps)
    return _backward(choices, band, steps, q1.dtype)


def _forward(q1, q2, band: int, steps) -> Int[Array, "n o l"]:
    """For every node, as (row, offset from the diagonal), the step that reaches it best."""
    _, n, lanes = q1.shape
    width, reach = 2 * band + 1, max(a for a, _ in steps)
    q1 = jnp.concatenate([q1, q1[:, :1]], axis=1)
    q2 = jnp.concatenate([q2[:, n - band :], q2, q2[:, : band + 1]], axis=1)
    impossible = jnp.full((width, lanes), _IMPOSSIBLE, q1.dtype)

    def products(row):
        window = lax.dynamic_slice_in_dim(q2, row, width, axis=1)
        point = lax.dynamic_slice_in_dim(q1, row, 1, axis=1)
        return dot(point, window)

    def shifted(values, by):
        if by == 0:
            return values
        rows = impossible[: abs(by)]
        return jnp.concatenate([rows, values[:-by]] if by > 0 else [values[-by:], rows])

    def row_step(carry, row):
        totals, inner = carry
        here = products(row)
        best, choice = impossible, jnp.zeros(here.shape, jnp.int8)
        for index, (a, b) in enumerate(steps):
            weight = math.sqrt(a * b) / (2 * n)  # trapezoidal rule along the step
            candidate = shifted(totals[a - 1] + weight * inner[a - 1], b - a) + weight * here
            better = candidate > best
            best = jnp.where(better, candidate, best)
            choice = jnp.where(better, jnp.int8(index), choice)
        return ((best, *totals[:-1]), (here, *inner[:-1])), choice

    start = jnp.broadcast_to(jnp.where(np.arange(width)[:, None] == band, 0.0, _IMPOSSIBLE), (width, lanes))
    totals = (start.astype(q1.dtype),) + (impossible,) * (reach - 1)
    inner = (products(0),) + (jnp.zeros_like(impossible),) * (reach - 1)
    return lax.scan(row_step, (totals, inner), jnp.arange(1, n + 1))[1]


def _backward(choices: Int[Array, "n o l"], band: int, steps, dtype) -> Float[Array, "n+1 l"]:
    n, width, lanes = choices.shape
    rises = jnp.asarray([a for a, _ in steps], jnp.int32)
    runs = jnp.asarray([b for _, b in steps], jnp.int32)

    def row_step(carry, scanned):
        offset, stop, gamma, slope = carry
        row, choice = scanned
        step = jnp.take_along_axis(choice, offset[None], axis=0)[0].astype(jnp.int32)
        a, b = rises[step], runs[step]
        arrived = stop == row
        slope = jnp.where(arrived, b.astype(dtype) / a.astype(dtype), slope)
        offset = jnp.where(arrived, jnp.clip(offset + a - b, 0, width - 1), offset)
        stop = jnp.where(arrived, stop - a, stop)
        return (offset, stop, gamma - slope, slope), gamma

    full = jnp.full((lanes,), n, jnp.int32)
    carry = (jnp.full((lanes,), band, jnp.int32), full, full.astype(dtype), jnp.ones((lanes,), dtype))
    _, gamma = lax.scan(row_step, carry, (jnp.arange(n, 0, -1, dtype=jnp.int32), choices[::-1]))
    return jnp.concatenate([jnp.zeros((1, lanes), dtype), gamma[::-1]])
