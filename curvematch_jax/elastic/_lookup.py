"""Tables of functions on the circle, and how they are read: linear in between, pairs on the first axis."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._lanes import fusion_barrier


def periodic(table: Float[Array, "p d c"], count: Int[Array, " p"], x: Float[Array, "p k"]) -> Float[Array, "d p k"]:
    """A vector field at x, in turns. The first `count` entries are values at `i/count`."""
    size = count[:, None]
    index, share, _ = _place(size, x)
    left, rise = _piece(table, index, jnp.where(index == size - 1, 0, index + 1))
    return left + rise * share[None]


def summed(
    table: Float[Array, "p d c"], count: Int[Array, " p"], x: Float[Array, "p k"]
) -> tuple[Float[Array, "d p k"], Float[Array, "d p k"]]:
    """The integral of a vector field up to any real x, and the field there, from the integral up to `i/count`."""
    size = count[:, None]
    index, share, turns = _place(size, x)
    left, rise = _piece(table, index, index + 1)
    whole = jnp.take_along_axis(table, size[:, None], axis=2, mode="promise_in_bounds")
    integral = left + rise * share[None] + turns[None] * jnp.moveaxis(whole, 1, 0)
    return integral, rise * size.astype(x.dtype)[None]


def nearest(table: Float[Array, "p d c"], count: Int[Array, " p"], x: Float[Array, "p k"]) -> Float[Array, "d p k"]:
    """A vector field at the entry of its table nearest to x, in turns."""
    size = count[:, None]
    index = ((x - jnp.floor(x)) * size.astype(x.dtype) + 0.5).astype(jnp.int32)
    return jnp.moveaxis(_entries(table, jnp.where(index >= size, 0, index)), 1, 0)


def lifted(table: Float[Array, "p nodes"], x: Float[Array, "p k"]) -> tuple[Float[Array, "p k"], Float[Array, "p k"]]:
    """A warp `gamma(x + 1) = gamma(x) + 1`, tabulated from 0 to 1, and its derivative, at any real x."""
    size = table.shape[-1] - 1
    index, share, turns = _place(jnp.full((1, 1), size, jnp.int32), x)
    left, rise = _piece(table[:, None], index, index + 1)
    return left[0] + rise[0] * share + turns, rise[0] * size


def divided(warp: Float[Array, "*b nodes"], pieces: int) -> Float[Array, "*b {pieces}+1"]:
    """A warp at other equal times."""
    old = warp.shape[-1] - 1
    place = np.arange(pieces + 1) * (old / pieces)
    low = np.minimum(place.astype(int), old - 1)
    share = jnp.asarray(place - low, warp.dtype)
    share = share.reshape((1,) * (warp.ndim - 1) + (-1,))
    return warp[..., low] + (warp[..., low + 1] - warp[..., low]) * share


def _place(
    size: Int[Array, "#p 1"], x: Float[Array, "p k"]
) -> tuple[Int[Array, "p k"], Float[Array, "p k"], Float[Array, "p k"]]:
    """The piece of `1/size` of a turn in which x lies, its share of that piece, and the whole turns before."""
    turns = jnp.floor(x)
    position = (x - turns) * size.astype(x.dtype)
    index = jnp.minimum(position.astype(jnp.int32), size - 1)  # x - floor(x) of a tiny negative number rounds to 1
    return index, position - index.astype(x.dtype), turns


def _piece(
    table: Float[Array, "p d c"], index: Int[Array, "p k"], following: Int[Array, "p k"]
) -> tuple[Float[Array, "d p k"], Float[Array, "d p k"]]:
    """The entries at `index`, and the rise from them to those at `following`."""
    both = jnp.concatenate([index, following], axis=1)
    found = fusion_barrier(_entries, index[0, 0] < table.shape[-1], table, both)
    left, right = jnp.split(jnp.moveaxis(found, 1, 0), 2, axis=-1)
    return left, right - left


def _entries(table: Float[Array, "p d t"], index: Int[Array, "p k"]) -> Float[Array, "p d k"]:
    """As one look-up in rows of d tables: several times faster than d look-ups."""
    pairs, d, size = table.shape
    place = index[:, None] + (size * np.arange(d, dtype=np.int32))[None, :, None]
    flat = jnp.take_along_axis(table.reshape(pairs, -1), place.reshape(pairs, -1), axis=1, mode="promise_in_bounds")
    return flat.reshape(pairs, d, -1)
