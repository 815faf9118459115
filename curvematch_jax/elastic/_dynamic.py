"""Dynamic programming over warps: the best monotone path of two closed curves on a grid, in a band.

Maximises `integral <q1(t), q2(gamma(t))> sqrt(gamma'(t)) dt` over piecewise-linear `gamma` with `gamma(0) = 0`,
`gamma(1) = 1`, nodes on the n x n grid, and slopes b/a of coprime steps (Mio, Srivastava and Joshi, IJCV 2007).

Lanes (pairs) are the last axis of every array: rows are contiguous, and one row of the band is one vectorised loop.
The number of the step that reaches a node best is kept in the lowest bits of the node's total, so that one maximum
finds both (three times as fast as two selections): a relative change of 1e-6 in float32.
"""

import functools as ft
import math

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from ._lanes import dot, once

_IMPOSSIBLE = -1e9


def steps_up_to(largest: int) -> tuple[tuple[int, int], ...]:
    """Coprime steps (a, b) of at most `largest` in either direction: 3, 7, 11, 19 and 23 of them for 2 to 6."""
    sizes = range(1, largest + 1)
    return tuple((a, b) for a in sizes for b in sizes if math.gcd(a, b) == 1)


def best_path(q1: Float[Array, "d n l"], q2: Float[Array, "d n l"], band: int, largest: int) -> Float[Array, "n+1 l"]:
    """The best warp, in grid units, at the nodes 0..n; it stays within `band` nodes of the diagonal."""
    steps = steps_up_to(largest)
    return _backward(_forward(q1, q2, band, steps), band, steps)


def _products(q1: Float[Array, "d n l"], q2: Float[Array, "d n l"], band: int) -> Float[Array, "n o l"]:
    """`<q1, q2>` in the band: rows 1 to n, offsets -band to band from the diagonal."""
    n, width = q1.shape[1], 2 * band + 1
    around = jnp.concatenate([q2[:, n - band :], q2, q2[:, : band + 1]], axis=1)[:, 1:]
    q1 = jnp.roll(q1, -1, axis=1)
    return jnp.stack([dot(q1, around[:, o : o + n]) for o in range(width)], axis=1)


def _forward(q1: Float[Array, "d n l"], q2: Float[Array, "d n l"], band: int, steps) -> Float[Array, "n o l"]:
    """The best total of every node, as (row, offset from the diagonal), with the step that reaches it in its bits."""
    _, n, lanes = q1.shape
    width, reach = 2 * band + 1, max(a for a, _ in steps)
    margin, blocks = reach - 1, -(-n // reach)
    products = _products(q1, q2, band)
    padded = jnp.concatenate([products, jnp.zeros((blocks * reach - n, width, lanes), q1.dtype)])

    def block(table, rows):
        """The next `reach` rows: row k is slot k mod reach of a table of the latest rows, totals beside products."""
        found = []
        for k, here in enumerate(rows, start=1):
            best = once(ft.partial(_relaxed, k=k, steps=steps, n=n), table, here)
            table = lax.dynamic_update_slice(table, jnp.stack([best, here])[None], (k % reach, 0, margin, 0))
            found.append(best)
        return table, jnp.stack(found)

    table = jnp.full((reach, 2, width + 2 * margin, lanes), _IMPOSSIBLE, q1.dtype).at[:, 1].set(0)
    table = table.at[0, 0, margin + band].set(0).at[0, 1, margin : margin + width].set(products[-1])
    rows = padded.reshape(blocks, reach, width, lanes)
    return lax.scan(block, table, rows)[1].reshape(blocks * reach, width, lanes)[:n]


def _relaxed(table: Float[Array, "r 2 w l"], here: Float[Array, "o l"], k: int, steps, n: int) -> Float[Array, "o l"]:
    """Best totals of row k from the rows before it; the trapezoidal rule along each step."""
    reach, width = table.shape[0], here.shape[0]
    candidates = []
    for number, (a, b) in enumerate(steps):
        start, slot = reach - 1 + a - b, (k - a) % reach
        total, product = table[slot, :, start : start + width]
        weight = math.sqrt(a * b) / (2 * n)
        candidates.append(_marked(total + weight * (product + here), number, len(steps)))
    return ft.reduce(jnp.maximum, candidates)


def _marked(total: Float[Array, "o l"], number: int, count: int) -> Float[Array, "o l"]:
    bits = lax.bitcast_convert_type(total, _integer(total.dtype))
    return lax.bitcast_convert_type((bits & ~_mask(count)) | number, total.dtype)


def _integer(dtype) -> jnp.dtype:
    return jnp.dtype(f"int{8 * jnp.dtype(dtype).itemsize}")


def _mask(count: int) -> int:
    return (1 << (count - 1).bit_length()) - 1


def _backward(totals: Float[Array, "n o l"], band: int, steps) -> Float[Array, "n+1 l"]:
    n, width, lanes = totals.shape
    dtype = totals.dtype
    rises: Int[Array, " s"] = jnp.asarray([a for a, _ in steps], jnp.int32)
    runs: Int[Array, " s"] = jnp.asarray([b for _, b in steps], jnp.int32)

    def row_step(carry, scanned):
        offset, stop, gamma, slope = carry
        row, total = scanned
        reached = jnp.take_along_axis(total, offset[None], axis=0, mode="promise_in_bounds")[0]
        step = (lax.bitcast_convert_type(reached, _integer(dtype)) & _mask(len(steps))).astype(jnp.int32)
        step = jnp.minimum(step, len(steps) - 1)
        a, b = rises[step], runs[step]
        arrived = stop == row
        slope = jnp.where(arrived, b.astype(dtype) / a.astype(dtype), slope)
        offset = jnp.where(arrived, jnp.clip(offset + a - b, 0, width - 1), offset)
        stop = jnp.where(arrived, stop - a, stop)
        return (offset, stop, gamma - slope, slope), gamma

    full = jnp.full((lanes,), n, jnp.int32)
    carry = (jnp.full((lanes,), band, jnp.int32), full, full.astype(dtype), jnp.ones((lanes,), dtype))
    _, gamma = lax.scan(row_step, carry, (jnp.arange(n, 0, -1, dtype=jnp.int32), totals[::-1]))
    return jnp.concatenate([jnp.zeros((1, lanes), dtype), gamma[::-1]])
