"""What a batch of closed curves has to be; asked before any tracing, in numpy."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.core
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Shaped

from ._aligner import Aligner
from ._distinct import resolution
from ._frame import AnyArray, Frame, framed, result_dtype, to_jax

MIN_SAMPLES = 8
_OPEN = 4.0


def traced(*values: object) -> bool:
    """Whether some value is abstract (under jit, grad or vmap), so that its numbers cannot be looked at."""
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(values))


def as_curves(name: str, curve: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """`curve` as a float array `(*b, d, n)` of closed curves, where they lie and as large as they are.

    Real numbers of any kind are taken: half precision becomes float32, all else float64 as far as JAX has it enabled.
    The numbers are checked as well unless they are traced.

    Raises `ValueError`, naming the argument and what was found: wrong rank, d < 2, too few samples, no real numbers,
    hidden samples of a masked array, NaN or infinity, fewer than 3 distinct points, an open polyline, and curves whose
    shape is lost in what JAX computes in: far from the origin, too large or too small.
    """
    if traced(curve):
        return _traced(name, curve)
    values = numbers(name, curve)
    shape, frame = _checked(name, values)
    if values.dtype == frame.dtype:
        return to_jax(values)
    return frame.points(name, shape)


def as_shapes(name: str, curve: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """`curve` for what is blind to position and scale: as `as_curves`, centred, the longest side of its box 1 to 2.

    That is done in the precision in which it came, before any cast; so curves of every size, and far from the origin,
    have the shape that they were given with. Derivatives are right for what is blind to position and scale.
    Raises `ValueError` as `as_curves`, but for place and size.
    """
    shape, frame = as_framed(name, curve)
    return to_jax(shape.astype(frame.dtype))


def as_framed(name: str, curve: ArrayLike | Sequence) -> tuple[Shaped[AnyArray, "*b d n"], Frame]:
    """The shapes of closed curves, and where they lie.

    Arrays of numpy in the precision that came, with numbers checked as in `as_curves`; traced ones are of JAX.
    """
    return framed(_traced(name, curve)) if traced(curve) else _checked(name, numbers(name, curve))


def check_pair(curve1: Array | np.ndarray, curve2: Array | np.ndarray) -> None:
    """Raises `ValueError` unless both hold curves of one (d, n), in batches that broadcast."""
    if curve1.shape[-2:] != curve2.shape[-2:]:
        raise ValueError(
            f"curve1 and curve2 hold curves of (d, n) = {curve1.shape[-2:]} and {curve2.shape[-2:]}: "
            "both need the same dimension and number of samples; resample(curve, n) changes n."
        )
    check_batches(curve1=curve1.shape[:-2], curve2=curve2.shape[:-2])


def check_batches(**batches: tuple[int, ...]) -> tuple[int, ...]:
    """The shape to which batches, by the names of their arguments, broadcast; `ValueError` if they do not."""
    try:
        return np.broadcast_shapes(*batches.values())
    except ValueError:
        names, shapes = (_listed([str(each) for each in many]) for many in (batches, batches.values()))
        raise ValueError(f"the batches of {names}, {shapes}, do not broadcast.") from None


def _listed(words: list[str]) -> str:
    return ", ".join(words[:-1]) + f" and {words[-1]}"


def numbers(name: str, values: Any) -> np.ndarray:
    """Real numbers of any kind as float32, float64 or longdouble of numpy; `ValueError` for what holds none."""
    if isinstance(values, np.ma.MaskedArray):
        hidden = int(np.ma.getmaskarray(values).sum())
        if hidden:
            raise ValueError(f"{name} is a masked array that hides {hidden} numbers: give curves without gaps.")
        values = np.ma.getdata(values)
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = array.astype(float)
    except (TypeError, ValueError, OverflowError):
        _check_uneven(name, values)
        raise ValueError(f"{name} is no array of real numbers: give one of floats, (*batch, d, n).") from None
    if array.dtype.kind in "iub" or jnp.issubdtype(array.dtype, jnp.integer):
        return array.astype(float)
    if not jnp.issubdtype(array.dtype, jnp.floating):
        raise ValueError(f"{name} has dtype {array.dtype}: give real numbers.")
    return array.astype(np.float32 if array.dtype.itemsize < 4 else array.dtype.newbyteorder("="), copy=False)


def _check_uneven(name: str, values: Any) -> None:
    """`ValueError` for a list of curves that do not fit into one array."""
    if isinstance(values, list | tuple) and all(isinstance(each, np.ndarray | jax.Array) for each in values):
        shapes = list(dict.fromkeys(each.shape for each in values))
        if len(shapes) > 1:
            raise ValueError(
                f"{name} holds curves of (d, n) = {shapes[0]} and {shapes[1]}: all need the same dimension and number "
                "of samples; resample(curve, n) changes n."
            ) from None


def as_field(name: str, q: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """`q` as one of SRVFs or of their tangent vectors: real, `(*b, d >= 2, n)`, half precision raised to float32.

    Raises `ValueError` for what is none and, unless it is traced, for NaN and infinity.
    """
    dtype = None if traced(q) else getattr(q, "dtype", np.dtype(float))
    if dtype is not None and jnp.issubdtype(dtype, jnp.floating):
        field = numbers(name, q)
        field = field.astype(result_dtype(field.dtype), copy=False)
        if not np.isfinite(field).all():
            raise ValueError(f"{name} holds NaN or infinity.")
    else:
        field = jnp.asarray(q)
    if field.ndim >= 2:
        _check_order(name, field.shape)
    if field.ndim < 2 or field.shape[-2] < 2 or not jnp.issubdtype(field.dtype, jnp.floating):
        raise ValueError(
            f"{name} has shape {field.shape} and dtype {field.dtype}: give real fields as (*batch, d, n), d >= 2."
        )
    return to_jax(_raised(field))


def _traced(name: str, curve: Any) -> Array:
    array = jnp.asarray(curve)
    check_shape(name, array.shape)
    if not jnp.issubdtype(array.dtype, jnp.floating):
        raise ValueError(f"{name} has dtype {array.dtype}: give real floating-point samples.")
    return _raised(array)


def _raised(array):
    """Half precision as float32."""
    return array.astype(np.float32) if array.dtype.itemsize < 4 else array


def check_shape(name: str, shape: tuple[int, ...]) -> None:
    """`ValueError` unless it is one of curves, `(*b, d >= 2, n >= 8)`."""
    if len(shape) < 2:
        raise ValueError(f"{name} has shape {shape}: give closed curves as (*batch, d, n), component-major.")
    _check_order(name, shape)
    if shape[-2] < 2:
        raise ValueError(f"{name} has shape {shape}, so d = {shape[-2]}: curves need d >= 2, as (*batch, d, n).")
    if shape[-1] < MIN_SAMPLES:
        raise ValueError(f"{name} has shape {shape}, so n = {shape[-1]}: curves need {MIN_SAMPLES} samples or more.")


def _check_order(name: str, shape: tuple[int, ...]) -> None:
    """`ValueError` for samples by components, `(*b, n, d)`: too few samples, and dimensions enough for samples."""
    if 2 <= shape[-1] < MIN_SAMPLES <= shape[-2]:
        given = name if name.isidentifier() else "curve"
        other = f"{given}.T" if len(shape) == 2 else f"np.swapaxes({given}, -1, -2)"
        raise ValueError(f"{name} has shape {shape}, which looks transposed: give (*batch, d, n), e.g. {other}.")


def _checked(name: str, curve: np.ndarray) -> tuple[np.ndarray, Frame]:
    """The shapes of curves that passed all checks, and where they lie."""
    check_shape(name, curve.shape)
    bad = ~np.isfinite(curve.reshape(-1, *curve.shape[-2:])).all(axis=(1, 2))
    if bad.any():
        raise ValueError(f"{name} holds NaN or infinity in {_which(bad)}: remove or repair those curves.")
    found, frame = framed(curve)
    shape = np.asarray(found)
    flat = shape.reshape(-1, *shape.shape[-2:])
    few = ~_has_area(flat, resolution(flat.shape[-1], frame.dtype))
    if few.any():
        raise ValueError(f"{name} has fewer than 3 distinct points in {_which(few)}: that is no closed curve.")
    steps = _squares(np.diff(flat, axis=-1, append=flat[..., :1]))
    ratio = steps[:, -1] / np.maximum(steps[:, :-1].max(axis=1), np.finfo(steps.dtype).tiny)
    opened = ratio > _OPEN**2
    if opened.any():
        raise ValueError(
            f"{name} is open in {_which(opened)}: the step from its last sample to its first is "
            f"{np.sqrt(ratio[opened][0]):.0f} times the longest other step; give closed curves, without the repeated "
            "end point."
        )
    return shape, frame


def _has_area(shape: np.ndarray, tolerance: float) -> np.ndarray:
    """Whether curves have 3 points apart: one away from the first sample and from the one farthest from that."""
    from_first = _squares(shape - shape[..., :1])
    farthest = from_first.argmax(axis=1)[:, None, None]
    from_second = _squares(shape - np.take_along_axis(shape, farthest, axis=2))
    return np.minimum(from_first, from_second).max(axis=1) > tolerance**2


def _squares(field: np.ndarray) -> np.ndarray:
    return np.einsum("bdn,bdn->bn", field, field)


def _which(bad: Any) -> str:
    first = int(np.argmax(bad))
    more = int(bad.sum()) - 1
    return f"curve {first}" + (f" and {more} more" if more else "") + f" of {bad.size}"


def as_aligner(aligner: Any, default: Callable[[], Aligner]) -> Aligner:
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
    return check_batches(
        curve1=curve1.shape[:-2],
        curve2=curve2.shape[:-2],
        rotation=rotation.shape[:-2],
        warp1=warp1.shape[:-1],
        warp2=warp2.shape[:-1],
    )
