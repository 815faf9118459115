"""Dynamic programming over paths of two closed curves, in a strip around the diagonal.

A path is `gamma1 = tau - v`, `gamma2 = tau + v`: v = 0 at either end, `|v'| <= 1`. Of all v that are linear between
the times `k/n` and hold multiples of `1/(S n)` there, no more than `width` of them away from 0, it finds the one with
the largest `integral <q1(gamma1), q2(gamma2)> sqrt(1 - v'^2) dtau`, by the trapezoidal rule. A step spans one row
whatever its slope, so nothing on its way is passed over; and both curves are treated alike (compare Bernal, Dogan and
Hagwood, "Fast dynamic programming for elastic registration of curves", 2016).

Lanes (pairs) are the last axis of every array: one row of the strip is one vectorised loop. The number of the step that
reaches a node best is kept in the lowest bits of the node's total, so that one maximum finds both: a relative change of
1e-6 in float32.
"""

import functools as ft
import math

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from ._lanes import dot, filled

_IMPOSSIBLE = -1e9
_FIRST = 1.0  # total at the start: away from 0, near which marks would be denormal numbers


def best_path(
    q1: Float[Array, "d f l"], q2: Float[Array, "d f l"], width: int, slopes: int
) -> tuple[Int[Array, "rows l"], Float[Array, " l"]]:
    """The best v at `k/n`, in units of `1/f`, and its integral; fields at multiples of `1/f`, `f = slopes * n`."""
    total, marks = _forward(_products(q1, q2, width, slopes), slopes)
    return _backward(marks, width, slopes), total[width] - _FIRST


def _products(
    q1: Float[Array, "d f l"], q2: Float[Array, "d f l"], width: int, slopes: int
) -> Float[Array, "rows o l"]:
    """`<q1(k/n - j/f), q2(k/n + j/f)>` for rows k and offsets j from -width to width."""
    f = q1.shape[1]
    around = [jnp.concatenate([q[:, f - width :], q, q[:, : width + 1]], axis=1) for q in (q1, q2)]
    rows = lambda q, start: q[:, start : start + f + 1 : slopes]  # noqa: E731
    offsets = range(-width, width + 1)
    return jnp.stack([dot(rows(around[0], width - j), rows(around[1], width + j)) for j in offsets], axis=1)


def _forward(products: Float[Array, "rows o l"], slopes: int) -> tuple[Float[Array, "o l"], Int[Array, "n o l"]]:
    """Totals of the last row, and the step that reaches every node best."""
    rows, span, _ = products.shape
    steps = range(-slopes, slopes + 1)
    weights = [math.sqrt(1 - (step / slopes) ** 2) / (2 * (rows - 1)) for step in steps]
    mask = (1 << (2 * slopes).bit_length()) - 1
    padded = lambda x, value: jnp.pad(x, ((slopes, slopes), (0, 0)), constant_values=value)  # noqa: E731

    def row(carry, here):
        total, before = padded(carry[0], _IMPOSSIBLE), padded(carry[1], 0)
        candidates = []
        for number, (step, weight) in enumerate(zip(steps, weights, strict=True)):
            source = slice(slopes - step, slopes - step + span)
            candidate = total[source] + weight * (before[source] + here) if weight else total[source]
            candidates.append(_marked(candidate, number, mask))
        best = ft.reduce(jnp.maximum, candidates)
        mark = lax.bitcast_convert_type(best, _integer(best.dtype)) & mask
        return (best, here), mark.astype(jnp.int8)

    first = filled(_IMPOSSIBLE, products[0], products).at[span // 2].set(_FIRST)
    (total, _), marks = lax.scan(row, (first, products[0]), products[1:])
    return total, marks


def _marked(total: Float[Array, "o l"], number: int, mask: int) -> Float[Array, "o l"]:
    bits = lax.bitcast_convert_type(total, _integer(total.dtype))
    return lax.bitcast_convert_type((bits & ~mask) | number, total.dtype)


def _integer(dtype) -> jnp.dtype:
    return jnp.dtype(f"int{8 * jnp.dtype(dtype).itemsize}")


def _backward(marks: Int[Array, "n o l"], width: int, slopes: int) -> Int[Array, "n+1 l"]:
    _, span, lanes = marks.shape

    def row(offset, mark):
        step = jnp.take_along_axis(mark, offset[None], axis=0, mode="promise_in_bounds")[0]
        before = jnp.clip(offset - (step.astype(jnp.int32) - slopes), 0, span - 1)
        return before, before

    last = filled(width, jnp.zeros(lanes, jnp.int32), marks)
    _, offsets = lax.scan(row, last, marks, reverse=True)
    return jnp.concatenate([offsets, last[None]]) - width
