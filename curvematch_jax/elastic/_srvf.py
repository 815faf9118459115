"""Curves and their square-root velocity functions, `q = v / sqrt|v|` (Srivastava et al., PAMI 2011)."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._check import as_field, as_framed, traced
from ._curve import norm, srvf_of, velocity, without_repeats
from ._frame import AnyArray, namespace, to_jax


def to_srvf(curve: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """SRVF of closed curves `(*b, d, n)`, at their samples, of unit L2 norm: `mean |q|^2 = 1`.

    Position and scale are forgotten. The closure `mean q|q| = 0` holds to rounding: the derivative is spectral.
    Curves with repeated samples, unless traced, are sampled anew without them, as often as they were.
    Raises `ValueError` for what is no closed curve.
    """
    shape, frame = as_framed("curve", curve)
    q = srvf_of(velocity(without_repeats(shape, frame), shape.shape[-1]))
    return to_jax(q.astype(frame.dtype))


def to_curve(q: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """The closed curves `(*b, d, n)`, centred and of unit length, whose SRVF is `q`: the integral of `q|q|`.

    What `q` misses to closure (`project_closed` brings it) is taken out evenly. The left inverse of `to_srvf` up to
    position, scale, and, for even n, the alternating mode, whose velocity the samples do not determine.
    Raises `ValueError` unless `q` is real and finite, of shape `(*b, d >= 2, n)`.
    """
    field = as_field("q", q)
    computed = field if traced(q) else np.asarray(field).astype(float)
    return to_jax(_integral(computed).astype(field.dtype))


def _integral(q: Float[AnyArray, "*b d n"]) -> Float[AnyArray, "*b d n"]:
    """The closed curves of unit length whose velocity is `q|q|`, up to a factor and its mean."""
    xp, n = namespace(q), q.shape[-1]
    largest = abs(q).max(axis=(-2, -1), keepdims=True)
    q = q / xp.where(largest > 0, largest, 1)
    speed_vector = q * norm(q)[..., None, :]
    mean_speed = xp.mean(norm(speed_vector), axis=-1)[..., None, None]
    speed_vector = speed_vector / xp.where(mean_speed > 0, mean_speed, 1)
    frequency = np.arange(n // 2 + 1, dtype=float)
    factor = np.zeros(n // 2 + 1, complex)
    half = (n - 1) // 2
    factor[1 : half + 1] = 1 / (2j * np.pi * frequency[1 : half + 1])
    factor = factor.astype(np.result_type(q.dtype, np.complex64)).reshape((1,) * (q.ndim - 1) + (-1,))
    return xp.fft.irfft(xp.fft.rfft(speed_vector, axis=-1) * factor, n=n, axis=-1).astype(q.dtype)
