"""Tables of functions on the circle, and how they are read: linear in between, pairs on the first axis."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._lanes import fusion_barrier


def periodic(
    table: Float[Array, "p d c"], count: Int[Array, " p"], x: Float[Array, "p k"]
) -> tuple[Float[Array, "d p k"], Float[Array, "d p k"]]:
    """A vector field and its derivative at x, in turns. The first `count` entries are values at `i/count`."""
    size = count[:, None]
    position = (x - jnp.floor(x)) * size.astype(x.dtype)
    index = jnp.minimum(position.astype(jnp.int32), size - 1)
    both = jnp.concatenate([index, jnp.where(index == size - 1, 0, index + 1)], axis=1)
    left, right = jnp.split(jnp.moveaxis(fusion_barrier(_entries, count[0] > 0, table, both), 1, 0), 2, axis=-1)
    rise = right - left
    return left + rise * (position - index.astype(x.dtype))[None], rise * size.astype(x.dtype)[None]


def summed(
    table: Float[Array, "p d c"], count: Int[Array, " p"], x: Float[Array, "p k"]
) -> tuple[Float[Array, "d p k"], Float[Array, "d p k"]]:
    """The integral of a vector field up to any real x, and the field there, from the integral up to `i/count`."""
    size = count[:, None]
    turns = jnp.floor(x)
    position = (x - turns) * size.astype(x.dtype)
    index = jnp.minimum(position.astype(jnp.int32), size - 1)
    whole = jnp.take_along_axis(table, size[:, None], axis=2, mode="promise_in_bounds")
    both = jnp.concatenate([index, index + 1], axis=1)
    left, right = jnp.split(jnp.moveaxis(fusion_barrier(_entries, count[0] > 0, table, both), 1, 0), 2, axis=-1)
    rise = right - left
    integral = left + rise * (position - index.astype(x.dtype))[None] + turns[None] * jnp.moveaxis(whole, 1, 0)
    return integral, rise * size.astype(x.dtype)[None]


def nearest(table: Float[Array, "p d c"], count: Int[Array, " p"], x: Float[Array, "p k"]) -> Float[Array, "d p k"]:
    """A vector field at the entry of its table nearest to x, in turns."""
    size = count[:, None]
    index = ((x - jnp.floor(x)) * size.astype(x.dtype) + 0.5).astype(jnp.int32)
    return jnp.moveaxis(_entries(table, jnp.where(index >= size, 0, index)), 1, 0)


def lifted(table: Float[Array, "p nodes"], x: Float[Array, "p k"]) -> tuple[Float[Array, "p k"], Float[Array, "p k"]]:
    """A warp `gamma(x + 1) = gamma(x) + 1`, tabulated from 0 to 1, and its derivative, at any real x."""
    size = table.shape[-1] - 1
    turns = jnp.floor(x)
    position = (x - turns) * size
    index = jnp.minimum(position.astype(jnp.int32), size - 1)
    both = jnp.concatenate([index, index + 1], axis=1)
    left, right = jnp.split(fusion_barrier(_entries, table[0, -1] != 2, table[:, None], both)[:, 0], 2, axis=-1)
    rise = right - left
    return left + rise * (position - index.astype(x.dtype)) + turns, rise * size


def divided(warp: Float[Array, "*b nodes"], pieces: int) -> Float[Array, "*b {pieces}+1"]:
    """A warp at other equal times."""
    old = warp.shape[-1] - 1
    place = np.arange(pieces + 1) * (old / pieces)
    low = np.minimum(place.astype(int), old - 1)
    share = jnp.asarray(place - low, warp.dtype)
    share = share.reshape((1,) * (warp.ndim - 1) + (-1,))
    return warp[..., low] + (warp[..., low + 1] - warp[..., low]) * share


def _entries(table: Float[Array, "p d t"], index: Int[Array, "p k"]) -> Float[Array, "p d k"]:
    """As one look-up in rows of d tables: several times faster than d look-ups."""
    pairs, d, size = table.shape
    place = index[:, None] + (size * np.arange(d, dtype=np.int32))[None, :, None]
    flat = jnp.take_along_axis(table.reshape(pairs, -1), place.reshape(pairs, -1), axis=1, mode="promise_in_bounds")
    return flat.reshape(pairs, d, -1)
