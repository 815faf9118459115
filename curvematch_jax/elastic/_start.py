"""Start points: the alignment of two curves by rotation and cyclic shift, for every shift at once."""

from functools import reduce
from operator import add
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._rotation import rotation_gain


def shift_covariances(t1: Float[Array, "b d n"], t2: Float[Array, "b d n"]) -> Float[Array, "d d n b"]:
    """`C[s] = mean_k t1_k t2_{k+s}^T` for every shift s, by the correlation theorem; n is even.

    The inverse transform of so few samples is two small matrix products, faster, and lanes stay last: half a turn on,
    even modes are as before and odd ones negative.
    """
    n = t1.shape[-1]
    f1, f2 = (jnp.moveaxis(jnp.fft.rfft(t, axis=-1), 2, 0).swapaxes(1, 2) for t in (t1, t2))
    product = jnp.conj(f1)[:, :, None] * f2[:, None]

    def of_modes(first):
        """For the shifts before half a turn, of every other mode."""
        one = np.eye(n // 2 + 1)[first::2]
        waves = np.concatenate([np.fft.irfft(one, n), np.fft.irfft(1j * one, n)])[:, : n // 2].T / n
        parts = jnp.concatenate([product.real[first::2], product.imag[first::2]])
        return jnp.tensordot(jnp.asarray(waves, t1.dtype), parts, 1, precision="highest")

    even, odd = of_modes(0), of_modes(1)
    return jnp.moveaxis(jnp.concatenate([even + odd, even - odd]), 0, 2)


class Peak(NamedTuple):
    """The best shift of one curve against another.

    Between the samples it is the vertex of the parabola through the gain at the peak and beside it; `weights` are those
    of the parabola through three samples there, the nearest in the middle, and `covariance` is so interpolated.
    """

    shift: Float[Array, " b"]  # in samples
    nearest: Int[Array, " b"]
    weights: tuple[Float[Array, " b"], Float[Array, " b"], Float[Array, " b"]]
    covariance: Float[Array, "d d b"]


def best_start(c: Float[Array, "d d n b"]) -> Peak:
    """The shift with the largest rotation gain."""
    gain = rotation_gain(c)
    n = gain.shape[0]
    top = jnp.argmax(gain, axis=0).astype(jnp.int32)

    def at(field, offset):
        index = ((top + offset) % n).reshape((1,) * (field.ndim - 1) + (-1,))
        return jnp.take_along_axis(field, index, axis=-2)[..., 0, :]

    left, mid, right = at(gain, -1), at(gain, 0), at(gain, 1)
    curvature = left - 2 * mid + right
    offset = jnp.where(curvature < 0, (left - right) / (2 * jnp.where(curvature < 0, curvature, -1)), 0)
    x = jnp.clip(offset, -0.5, 0.5)
    weights = (x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2)
    covariance = reduce(add, (w[None, None] * at(c, k) for w, k in zip(weights, (-1, 0, 1), strict=True)))
    return Peak(top.astype(x.dtype) + x, top, weights, covariance)
