"""Closed curves: length, centre, resampling, and what alignment needs to know of one curve.

A closed curve is the trigonometric interpolant of its samples: smooth between them, and differentiated exactly.
"""

from typing import NamedTuple

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


class Representative(NamedTuple):
    """What alignment needs to know of curves. Arc length is counted from the first sample, the whole is 1."""

    tangents: Float[Array, "*b d g"]  # unit tangents at equal arc lengths: the SRVF of the arc-length representative
    times: Float[Array, "*b g+1"]  # parameter at those arc lengths, 0 to 1
    arcs: Float[Array, "*b n+1"]  # arc length at the samples, 0 to 1
    field: Float[Array, "*b d m"]  # SRVF in the curve's own parameter, of unit norm, on a grid finer than the samples


def represent(curve: Float[Array, "*b d n"], grid: int, nodes: int) -> Representative:
    """Tabulate closed curves for alignment: `grid` arc-length samples, and `2 nodes` SRVF samples to an interval."""
    n = curve.shape[-1]
    speed_vector = velocity(curve, 2 * nodes * n)
    speed = norm(speed_vector)
    arcs = _arc_length(speed)
    times = _times(arcs, grid)
    field = srvf_of(speed_vector)
    tangents = interpolate(field, times[..., :-1])
    size = norm(tangents)[..., None, :]
    tangents = tangents / jnp.where(size > 0, size, 1)
    return Representative(tangents, times, arcs[..., :: 2 * nodes], field)


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
    steps = speed + jnp.roll(speed, -1, axis=-1)
    arcs = jnp.cumsum(steps, axis=-1)
    arcs = jnp.concatenate([jnp.zeros_like(arcs[..., :1]), arcs], axis=-1)
    return arcs / jnp.where(arcs[..., -1:] > 0, arcs[..., -1:], 1)


def _times(arcs: Float[Array, "*b nodes"], n: int) -> Float[Array, "*b {n}+1"]:
    """Parameters at which the arc length is `k/n`."""
    grid = jnp.linspace(0, 1, arcs.shape[-1], dtype=arcs.dtype)
    targets = jnp.arange(n + 1, dtype=arcs.dtype) / n
    flat = jax.vmap(lambda arc: jnp.interp(targets, arc, grid))(arcs.reshape(-1, arcs.shape[-1]))
    return flat.reshape(*arcs.shape[:-1], n + 1)
