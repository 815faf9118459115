"""Periodic tables of unit tangents, packed: a value and its rise to the next one in one integer, lanes last.

Looking up is what refinement spends most of its time on, and what costs there is the number of reads from memory:
packing halves them. Half of a float's bits each resolve a component to 3e-5 (float32) or 5e-10 (float64).
"""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from ._lanes import cumulative, mean_rows


def pack(values: Float[Array, "d t l"]) -> Int[Array, "d t l"]:
    """The table of `values`, components within [-1, 1], at equal distances on the circle."""
    half = _half(values.dtype)
    integer = jnp.dtype(f"int{2 * half}")
    scale = 2 ** (half - 1) - 1
    rise = jnp.roll(values, -1, axis=1) - values
    high = jnp.round(values * scale).astype(integer)
    low = jnp.round(rise * (scale // 2)).astype(integer)
    return (high << half) | (low & (2**half - 1))


def value_at(x: Float[Array, "k l"], table: Int[Array, "d t l"]) -> Float[Array, "d k l"]:
    """Linear interpolation along the middle axis, at x in turns."""
    left, rise, share = _around(x, table)
    return left + rise * share[None]


def positions(tangents: Float[Array, "d t l"]) -> Float[Array, "d t l"]:
    """Where the curve of these tangents is, at equal arc lengths: their integral, closed, by the trapezoidal rule."""
    step = (tangents + jnp.roll(tangents, -1, axis=1)) / 2
    step = step - mean_rows(step)[:, None]
    return cumulative(step) / tangents.shape[1]


def position_at(
    x: Float[Array, "k l"], tangents: Int[Array, "d t l"], positions: Float[Array, "d t l"]
) -> Float[Array, "d k l"]:
    """The curve at arc length x, for tangents linear between those in the table."""
    left, rise, share = _around(x, tangents)
    index = jnp.minimum((x - jnp.floor(x)) * tangents.shape[1], tangents.shape[1] - 1).astype(jnp.int32)
    start = jnp.stack([jnp.take_along_axis(row, index, axis=0, mode="promise_in_bounds") for row in positions])
    return start + (left + rise * (share / 2)[None]) * (share / tangents.shape[1])[None]


def look_up(x: Float[Array, "k l"], table: Int[Array, "d t l"]) -> tuple[Float[Array, "d k l"], Float[Array, "d k l"]]:
    """Linear interpolation along the middle axis, at x in turns, and its derivative."""
    left, rise, share = _around(x, table)
    return left + rise * share[None], rise * table.shape[1]


def _around(x: Float[Array, "k l"], table: Int[Array, "d t l"]):
    size, half = table.shape[1], _half(x.dtype)
    position = (x - jnp.floor(x)) * size
    index = jnp.minimum(position.astype(jnp.int32), size - 1)
    found = jnp.stack([jnp.take_along_axis(row, index, axis=0, mode="promise_in_bounds") for row in table])
    scale = 2 ** (half - 1) - 1
    left = lax.shift_right_arithmetic(found, _like(found, half)).astype(x.dtype) * (1 / scale)
    rise = lax.shift_right_arithmetic(found << half, _like(found, half)).astype(x.dtype) * (1 / (scale // 2))
    return left, rise, position - index.astype(x.dtype)


def _half(dtype) -> int:
    return 4 * jnp.dtype(dtype).itemsize


def _like(array: Int[Array, "d k l"], value: int) -> Int[Array, "d k l"]:
    return jnp.full_like(array, value)
