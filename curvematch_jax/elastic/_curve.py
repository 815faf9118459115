"""Closed curves: length, centre, resampling.

A closed curve is the trigonometric interpolant of its samples: smooth between them, and differentiated exactly.
"""

import functools as ft
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Shaped

from ._check import as_framed, traced
from ._distinct import distinct, distinct_parameter, is_new
from ._frame import A, AnyArray, Frame, namespace, to_jax

_OVERSAMPLING = 4
_MOST_SAMPLES = 2**24
_BLOCK = 2**19  # numbers in a table of waves


def velocity(curve: Float[A, "*b d n"], m: int) -> Float[A, "*b d m"]:
    """Derivative of the trigonometric interpolant at `k/m`, `m >= n`. Its mean is zero: the curve is closed."""
    n, xp = curve.shape[-1], namespace(curve)
    frequency = np.arange(n // 2 + 1)
    frequency[n // 2 :] *= n % 2  # The derivative of the Nyquist mode is not determined by the samples.
    factor = (2j * np.pi * frequency * (m / n)).astype(np.result_type(curve.dtype, np.complex64))
    spectrum = xp.fft.rfft(curve, axis=-1) * factor.reshape((1,) * (curve.ndim - 1) + (-1,))
    return xp.fft.irfft(spectrum, n=m, axis=-1).astype(curve.dtype)


def oversampled(curve: Float[Array, "*b d n"], m: int) -> Float[Array, "*b d m"]:
    """The trigonometric interpolant at `k/m`, `m >= n`, without the alternating mode of even n."""
    n = curve.shape[-1]
    kept = (np.arange(n // 2 + 1) < n / 2).reshape((1,) * (curve.ndim - 1) + (-1,))
    spectrum = jnp.fft.rfft(curve, axis=-1)
    return jnp.fft.irfft(jnp.where(kept, spectrum, 0) * (m / n), n=m, axis=-1).astype(curve.dtype)


def norm(field: Float[A, "*b d n"]) -> Float[A, "*b n"]:
    """Pointwise Euclidean norm over the components, with derivative 0 where it vanishes."""
    xp = namespace(field)
    square = xp.sum(field * field, axis=-2)
    safe = xp.where(square > 0, square, 1)
    return xp.where(square > 0, xp.sqrt(safe), 0)


def length(curve: ArrayLike | Sequence) -> Float[Array, "*b"]:
    """Length of closed curves `(*b, d, n)`: the mean speed of the trigonometric interpolant, in the curves' units.

    Repeated samples are left out, unless the array is traced. Raises `ValueError` for what is no closed curve, and for
    a length that the dtype cannot hold.
    """
    shape, frame = as_framed("curve", curve)
    shape = without_repeats(shape, frame)
    speed = norm(velocity(shape, _OVERSAMPLING * shape.shape[-1]))
    return frame.lengths("curve", speed.mean(axis=-1, keepdims=True))


def centre(curve: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """The curves `(*b, d, n)` with the mean of their distinct samples moved to the origin, in the precision that came.

    Raises `ValueError` for what is no closed curve, and for a size that the dtype cannot hold.
    """
    shape, frame = as_framed("curve", curve)
    shape = shape.astype(float) if isinstance(shape, np.ndarray) else shape
    counted = is_new(shape, frame.dtype)[..., None, :].astype(shape.dtype)
    mean = (shape * counted).sum(axis=-1, keepdims=True) / counted.sum(axis=-1, keepdims=True)
    return frame.offsets("curve", shape - mean)


def resample(curve: ArrayLike | Sequence, n: int) -> Float[Array, "*b d {n}"]:
    """`n` samples at equal arc length along closed curves `(*b, d, m)`; the first sample stays first.

    The trigonometric interpolant is evaluated exactly at the parameters where its arc length is `k/n` of the whole.
    Repeated samples are left out, and no new n or m costs a compilation, unless the array is traced.
    Raises `ValueError` for what is no closed curve, for `n` below 3 or above 2^24, and for samples that the dtype
    cannot hold.
    """
    if not 3 <= n <= _MOST_SAMPLES:
        raise ValueError(f"n = {n}: a closed curve needs 3 samples or more, and {_MOST_SAMPLES:,} at most.")
    shape, frame = as_framed("curve", curve)
    if not isinstance(shape, np.ndarray):
        return frame.points("curve", _resampled(shape, n))
    flat = shape.astype(float).reshape(-1, *shape.shape[-2:])
    new = is_new(flat, frame.dtype)
    found = np.empty((*flat.shape[:2], n))
    whole, count = np.flatnonzero(new.all(axis=1)), max(1, _BLOCK // (flat.shape[2] * n))
    for start in range(0, len(whole), count):
        rows = whole[start : start + count]
        found[rows] = _resampled(flat[rows], n)
    for row in np.flatnonzero(~new.all(axis=1)):
        found[row] = _resampled(flat[row][:, new[row]] if new[row].sum() > 2 else flat[row], n)
    return frame.points("curve", found.reshape(*shape.shape[:-1], n))


def _resampled(shape: Float[AnyArray, "*b d m"], n: int) -> Float[AnyArray, "*b d {n}"]:
    """`n` samples at equal arc length of curves without repeated samples."""
    m, xp = shape.shape[-1], namespace(shape)
    times = _times(_arc_length(norm(velocity(shape, _OVERSAMPLING * m))), n)[..., :-1]
    half = (m - 1) // 2
    spectrum = xp.fft.rfft(shape, axis=-1)[..., : half + 1] / m
    if xp is jnp:
        return _waves(spectrum, times)
    block = max(1, _BLOCK // (half + 1))
    return np.concatenate([_waves(spectrum, times[..., s : s + block]) for s in range(0, n, block)], axis=-1)


def without_repeats(shape: Shaped[AnyArray, "*b d n"], frame: Frame) -> Float[AnyArray, "*b d n"]:
    """Concrete shapes in float64, without repeated samples; traced ones as they are."""
    if not isinstance(shape, np.ndarray):
        return shape
    return distinct(shape.astype(float).reshape(-1, *shape.shape[-2:]), frame.dtype)[0].reshape(shape.shape)


def unrepeated(curve: Float[Array, "*c d n"], warp: Float[Array, "*b nodes"]) -> tuple[Array, Array]:
    """A curve without repeated samples, and a lifted warp of it as one of that curve; the batches broadcast.

    For what reads a curve as it was given where an alignment of it says. Traced ones, and curves without repeated
    samples, come back as they are.
    """
    if traced(curve, warp) or is_new(np.asarray(curve)).all():
        return curve, warp
    batch = np.broadcast_shapes(curve.shape[:-2], warp.shape[:-1])
    curves = np.broadcast_to(np.asarray(curve), (*batch, *curve.shape[-2:])).reshape(-1, *curve.shape[-2:])
    warps = np.broadcast_to(np.asarray(warp), (*batch, warp.shape[-1])).reshape(-1, warp.shape[-1])
    found, places = distinct(curves)
    there = distinct_parameter(warps, places)
    return to_jax(found.reshape(*batch, *curve.shape[-2:])), to_jax(there.reshape(*batch, -1))


def _waves(spectrum: Any, times: Float[AnyArray, "*b n"]) -> Float[AnyArray, "*b d n"]:
    """The real trigonometric polynomial of coefficients `(*b, d, k)` at any parameters."""
    xp = namespace(times)
    frequency = np.arange(1, spectrum.shape[-1], dtype=times.dtype)
    angle = 2 * np.pi * frequency.reshape((1,) * (times.ndim - 1) + (-1, 1)) * times[..., None, :]
    product = np.matmul if xp is np else ft.partial(jnp.matmul, precision="highest")
    waves = product(spectrum.real[..., 1:], xp.cos(angle)) - product(spectrum.imag[..., 1:], xp.sin(angle))
    return spectrum.real[..., :1] + 2 * waves


def srvf_of(speed_vector: Float[A, "*b d n"]) -> Float[A, "*b d n"]:
    """`v / sqrt|v|`, scaled to unit L2 norm; zero where `v` is."""
    xp, speed = namespace(speed_vector), norm(speed_vector)
    root = xp.sqrt(xp.where(speed > 0, speed, 1) * xp.mean(speed, axis=-1, keepdims=True))
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


def _arc_length(speed: Float[AnyArray, "*b m"]) -> Float[AnyArray, "*b m+1"]:
    """Arc length at equal parameters, the whole 1, by the trapezoidal rule."""
    xp = namespace(speed)
    arcs = xp.cumsum(speed + xp.roll(speed, -1, axis=-1), axis=-1)
    arcs = xp.concatenate([xp.zeros_like(arcs[..., :1]), arcs], axis=-1)
    return arcs / xp.where(arcs[..., -1:] > 0, arcs[..., -1:], 1)


def _times(arcs: Float[AnyArray, "*b nodes"], n: int) -> Float[AnyArray, "*b {n}+1"]:
    """Parameters at which the arc length is `k/n`."""
    xp, last = namespace(arcs), arcs.shape[-1] - 1
    target = np.arange(n + 1, dtype=arcs.dtype) / n
    first_beyond = xp.ceil(arcs * n).astype(np.int32).reshape(-1, last + 1)  # counting is faster than n searches
    count = _counts if xp is np else jax.vmap(lambda at, bins: jnp.zeros(bins, jnp.int32).at[at].add(1), (0, None))
    after = xp.clip(xp.cumsum(count(first_beyond, n + 1), axis=-1), 1, last).reshape(*arcs.shape[:-1], n + 1)
    low = xp.take_along_axis(arcs, after - 1, axis=-1)
    run = xp.take_along_axis(arcs, after, axis=-1) - low
    target = target.astype(arcs.dtype).reshape((1,) * (arcs.ndim - 1) + (-1,))
    share = xp.clip((target - low) / xp.where(run > 0, run, 1), 0, 1)
    return ((after - 1).astype(arcs.dtype) + share) / last


def _counts(at: np.ndarray, bins: int) -> np.ndarray:
    """How often each number below `bins` is in each row of `at`."""
    rows = bins * np.arange(len(at))[:, None]
    return np.bincount((at + rows).ravel(), minlength=bins * len(at)).reshape(-1, bins)
