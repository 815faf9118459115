"""Curves and their square-root velocity functions, `q = v / sqrt|v|` (Srivastava et al., PAMI 2011)."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._check import as_curves
from ._curve import norm, srvf_of, velocity


def to_srvf(curve: ArrayLike) -> Float[Array, "*b d n"]:
    """SRVF of closed curves `(*b, d, n)`, at their samples, of unit L2 norm: `mean |q|^2 = 1`.

    Position and scale are forgotten. The closure `mean q|q| = 0` holds to rounding: the derivative is spectral.
    Raises `ValueError` for what is no closed curve.
    """
    curve = as_curves("curve", curve)
    return srvf_of(velocity(curve, curve.shape[-1]))


def to_curve(q: ArrayLike) -> Float[Array, "*b d n"]:
    """The closed curves `(*b, d, n)`, centred and of unit length, whose SRVF is `q`: the integral of `q|q|`.

    What `q` misses to closure (`project_closed` brings it) is taken out evenly. The left inverse of `to_srvf` up to
    position, scale, and, for even n, the alternating mode, whose velocity the samples do not determine.
    Raises `ValueError` unless `q` is real of shape `(*b, d >= 2, n)`.
    """
    q = jnp.asarray(q)
    if q.ndim < 2 or q.shape[-2] < 2 or not jnp.issubdtype(q.dtype, jnp.floating):
        raise ValueError(f"q has shape {q.shape} and dtype {q.dtype}: give real SRVFs as (*batch, d, n), d >= 2.")
    speed_vector = q * norm(q)[..., None, :]
    mean_speed = jnp.mean(norm(speed_vector), axis=-1)[..., None, None]
    speed_vector = speed_vector / jnp.where(mean_speed > 0, mean_speed, 1)
    n = q.shape[-1]
    frequency = np.arange(n // 2 + 1, dtype=float)
    factor = np.zeros(n // 2 + 1, complex)
    half = (n - 1) // 2
    factor[1 : half + 1] = 1 / (2j * np.pi * frequency[1 : half + 1])
    factor = jnp.asarray(factor, np.result_type(q.dtype, np.complex64))
    spectrum = jnp.fft.rfft(speed_vector, axis=-1) * factor.reshape((1,) * (q.ndim - 1) + (-1,))
    return jnp.fft.irfft(spectrum, n=n, axis=-1).astype(q.dtype)
