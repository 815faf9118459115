"""What a batch of closed curves has to be; asked before any tracing, in numpy."""

from typing import Any

import jax
import jax.core
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._aligner import Aligner

MIN_SAMPLES = 8
_OPEN = 4.0


def traced(*values: object) -> bool:
    """Whether some value is abstract (under jit, grad or vmap), so that its numbers cannot be looked at."""
    return any(isinstance(value, jax.core.Tracer) for value in values)


def as_curves(name: str, curve: ArrayLike) -> Float[Array, "*b d n"]:
    """`curve` as a float array `(*b, d, n)` of closed curves.

    Its numbers are checked as well unless it is traced.

    Raises `ValueError`, naming the argument and what was found: wrong rank, d < 2, too few samples, NaN or infinity,
    fewer than 3 distinct points, an open polyline.
    """
    if not traced(curve):
        curve = _checked(name, np.asarray(curve))
    array = jax.numpy.asarray(curve)
    _check_shape(name, array.shape)
    if not jax.numpy.issubdtype(array.dtype, jax.numpy.floating):
        raise ValueError(f"{name} has dtype {array.dtype}: give real floating-point samples.")
    return array


def check_pair(curve1: Array | np.ndarray, curve2: Array | np.ndarray) -> None:
    """Raises `ValueError` unless both hold curves of one (d, n), in batches that broadcast."""
    if curve1.shape[-2:] != curve2.shape[-2:]:
        raise ValueError(
            f"curve1 and curve2 hold curves of (d, n) = {curve1.shape[-2:]} and {curve2.shape[-2:]}: "
            "both need the same dimension and number of samples; resample(curve, n) changes n."
        )
    try:
        np.broadcast_shapes(curve1.shape[:-2], curve2.shape[:-2])
    except ValueError:
        raise ValueError(
            f"the batches of curve1 and curve2, {curve1.shape[:-2]} and {curve2.shape[:-2]}, do not broadcast."
        ) from None


def _check_shape(name: str, shape: tuple[int, ...]) -> None:
    if len(shape) < 2:
        raise ValueError(f"{name} has shape {shape}: give closed curves as (*batch, d, n), component-major.")
    if shape[-2] < 2:
        raise ValueError(f"{name} has shape {shape}, so d = {shape[-2]}: curves need d >= 2, as (*batch, d, n).")
    if shape[-1] < MIN_SAMPLES:
        raise ValueError(f"{name} has shape {shape}, so n = {shape[-1]}: curves need {MIN_SAMPLES} samples or more.")


def _checked(name: str, curve: np.ndarray) -> np.ndarray:
    if curve.dtype.kind in "iub":
        curve = curve.astype(float)
    if curve.dtype.kind != "f":
        raise ValueError(f"{name} has dtype {curve.dtype}: give real numbers.")
    _check_shape(name, curve.shape)
    flat = curve.reshape(-1, *curve.shape[-2:])
    bad = ~np.isfinite(flat).all(axis=(1, 2))
    if bad.any():
        raise ValueError(f"{name} holds NaN or infinity in {_which(bad)}: remove or repair those curves.")
    steps = np.linalg.norm(np.roll(flat, -1, axis=2) - flat, axis=1)
    few = np.count_nonzero(steps > 0, axis=1) < 3
    if few.any():
        raise ValueError(f"{name} has fewer than 3 distinct points in {_which(few)}: that is no closed curve.")
    opened = steps[:, -1] > _OPEN * steps[:, :-1].max(axis=1)
    if opened.any():
        ratio = steps[opened, -1][0] / steps[opened, :-1][0].max()
        raise ValueError(
            f"{name} is open in {_which(opened)}: the step from its last sample to its first is {ratio:.0f} times "
            "the longest other step; give closed curves, without the repeated end point."
        )
    return curve


def _which(bad: Any) -> str:
    first = int(np.argmax(bad))
    more = int(bad.sum()) - 1
    return f"curve {first}" + (f" and {more} more" if more else "") + f" of {bad.size}"


def as_shapes(name, curve):
    return as_curves(name, curve)


def as_aligner(aligner: Any, default: Any) -> Any:
    """The aligner, or what `default` makes where it is None; `ValueError` for anything else."""
    if aligner is None:
        return default()
    if not isinstance(aligner, Aligner):
        raise ValueError(f"aligner = {aligner!r}: give an aligner, such as Aligner.fast() or Aligner.accurate().")
    return aligner


def check_path(curve1: Array, curve2: Array, rotation: Array, warp1: Array, warp2: Array) -> tuple[int, ...]:
    """The batch of a path; `ValueError` unless its shapes are those of a path of these curves."""
    d = curve1.shape[-2]
    if rotation.shape[-2:] != (d, d):
        raise ValueError(f"rotation has shape {rotation.shape}: for curves of d = {d} give (*batch, {d}, {d}).")
    if warp1.ndim < 1 or warp1.shape[-1:] != warp2.shape[-1:] or warp1.shape[-1] < 2:
        raise ValueError(
            f"warp1 and warp2 have shapes {warp1.shape} and {warp2.shape}: give the two warps of one path, "
            "(*batch, m + 1) with one m, at least 1."
        )
    batches = [x.shape[:-k] for x, k in ((curve1, 2), (curve2, 2), (rotation, 2), (warp1, 1), (warp2, 1))]
    try:
        return np.broadcast_shapes(*batches)
    except ValueError:
        raise ValueError(
            f"the batches of curve1, curve2, rotation, warp1 and warp2, {', '.join(map(str, batches))}, do not broadcast."
        ) from None
