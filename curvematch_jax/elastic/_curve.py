"""Closed curves: length, centre, resampling.

A closed curve is the trigonometric interpolant of its samples: smooth between them, and differentiated exactly.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._check import as_curves

_OVERSAMPLING = 4


def velocity(curve: Float[Array, "*b d n"], m: int) -> Float[Array, "*b d m"]:
    """Derivative of the trigonometric interpolant at `k/m`, `m >= n`. Its mean is zero: the curve is closed."""
    n = curve.shape[-1]
    frequency = np.arange(n // 2 + 1)
    frequency[n // 2 :] *= n % 2  # The derivative of the Nyquist mode is not determined by the samples.
    factor = jnp.asarray(2j * np.pi * frequency * (m / n), np.result_type(curve.dtype, np.complex64))
    spectrum = jnp.fft.rfft(curve, axis=-1) * factor.reshape((1,) * (curve.ndim - 1) + (-1,))
    return jnp.fft.irfft(spectrum, n=m, axis=-1).astype(curve.dtype)


def oversampled(curve: Float[Array, "*b d n"], m: int) -> Float[Array, "*b d m"]:
    """The trigonometric interpolant at `k/m`, `m >= n`, without the alternating mode of even n."""
    n = curve.shape[-1]
    kept = (np.arange(n // 2 + 1) < n / 2).reshape((1,) * (curve.ndim - 1) + (-1,))
    spectrum = jnp.fft.rfft(curve, axis=-1)
    return jnp.fft.irfft(jnp.where(kept, spectrum, 0) * (m / n), n=m, axis=-1).astype(curve.dtype)


def norm(field: Float[Array, "*b d n"]) -> Float[Array, "*b n"]:
    """Pointwise Euclidean norm over the components, with derivative 0 where it vanishes."""
    square = jnp.sum(field * field, axis=-2)
    safe = jnp.where(square > 0, square, 1)
    return jnp.where(square > 0, jnp.sqrt(safe), 0)


def length(curve: ArrayLike) -> Float[Array, "*b"]:
    """Length of closed curves `(*b, d, n)`: the mean speed of the trigonometric interpolant, in the curves' units.

    Raises `ValueError` for what is no closed curve.
    """
    curve = as_curves("curve", curve)
    return jnp.mean(norm(velocity(curve, _OVERSAMPLING * curve.shape[-1])), axis=-1)


def centre(curve: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    """The curve with its samples' mean moved to the origin."""
    return curve - jnp.mean(curve, axis=-1, keepdims=True)


def resample(curve: ArrayLike, n: int) -> Float[Array, "*b d {n}"]:
    """`n` samples at equal arc length along closed curves `(*b, d, m)`; the first sample stays first.

    The trigonometric interpolant is evaluated exactly at the parameters where its arc length is `k/n` of the whole.
    Raises `ValueError` for what is no closed curve, and for `n` below 3.
    """
    curve = as_curves("curve", curve)
    if n < 3:
        raise ValueError(f"n = {n}: a closed curve needs 3 samples or more.")
    m = curve.shape[-1]
    speed = norm(velocity(curve, _OVERSAMPLING * m))
    times = _times(_arc_length(speed), n)[..., :-1]
    half = (m - 1) // 2
    spectrum = jnp.fft.rfft(curve, axis=-1)[..., : half + 1] / m
    frequency = jnp.arange(1, half + 1, dtype=curve.dtype)
    angle = 2 * jnp.pi * frequency.reshape((1,) * (times.ndim - 1) + (-1, 1)) * times[..., None, :]
    waves = jnp.einsum("...dk,...kn->...dn", spectrum.real[..., 1:], jnp.cos(angle))
    waves -= jnp.einsum("...dk,...kn->...dn", spectrum.imag[..., 1:], jnp.sin(angle))
    return spectrum.real[..., :1] + 2 * waves


def srvf_of(speed_vector: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    """`v / sqrt|v|`, scaled to unit L2 norm; zero where `v` is."""
    speed = norm(speed_vector)
    root = jnp.sqrt(jnp.where(speed > 0, speed, 1) * jnp.mean(speed, axis=-1, keepdims=True))
    return speed_vector / root[..., None, :]


def interpolate(table: Float[Array, "*b d m"], x: Float[Array, "*b k"]) -> Float[Array, "*b d k"]:
    """Periodic linear interpolation of a table at `k/m`."""
    m = table.shape[-1]
    position = x * m
    floor = jnp.floor(position)
    index = floor.astype(jnp.int32) % m
    weight = (position - floor)[..., None, :]
    left = jnp.take_along_axis(table, index[..., None, :], axis=-1)
    right = jnp.take_along_axis(table, ((index + 1) % m)[..., None, :], axis=-1)
    return left + (right - left) * weight


def _arc_length(speed: Float[Array, "*b m"]) -> Float[Array, "*b m+1"]:
    """Arc length at equal parameters, the whole 1, by the trapezoidal rule."""
    arcs = jnp.cumsum(speed + jnp.roll(speed, -1, axis=-1), axis=-1)
    arcs = jnp.concatenate([jnp.zeros_like(arcs[..., :1]), arcs], axis=-1)
    return arcs / jnp.where(arcs[..., -1:] > 0, arcs[..., -1:], 1)


def _times(arcs: Float[Array, "*b nodes"], n: int) -> Float[Array, "*b {n}+1"]:
    """Parameters at which the arc length is `k/n`."""
    last = arcs.shape[-1] - 1
    target = jnp.arange(n + 1, dtype=arcs.dtype) / n
    first_beyond = jnp.ceil(arcs * n).astype(jnp.int32)  # counting is faster than n searches
    flat = first_beyond.reshape(-1, last + 1)
    counts = jax.vmap(lambda at: jnp.zeros(n + 1, jnp.int32).at[at].add(1))(flat)
    after = jnp.clip(jnp.cumsum(counts, axis=-1), 1, last).reshape(*arcs.shape[:-1], n + 1)
    low = jnp.take_along_axis(arcs, after - 1, axis=-1)
    run = jnp.take_along_axis(arcs, after, axis=-1) - low
    target = target.reshape((1,) * (arcs.ndim - 1) + (-1,))
    share = jnp.clip((target - low) / jnp.where(run > 0, run, 1), 0, 1)
    return ((after - 1).astype(arcs.dtype) + share) / last
