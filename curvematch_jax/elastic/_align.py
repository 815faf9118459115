"""Alignment of closed curves, and what follows from one: its distance, matched points, warps, the aligned curve."""

import functools as ft
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, ArrayLike, Bool, Float

from . import _chunks as chunks
from ._aligner import Aligner, Alignment
from ._check import as_aligner, as_shapes, check_pair, traced
from ._distinct import distinct, original_parameter
from ._frame import AnyArray
from ._mirror import forwards

_SMALL = 8  # pairs in the chunk of a small batch


def align(curve1: ArrayLike, curve2: ArrayLike, aligner: Aligner | None = None) -> Alignment:
    """Lay two closed curves onto each other by rotation, start point and reparametrisation.

    Position and scale play no part; reflection and reversal are used only by aligners with `mirror`, and then together.
    When the curves are exchanged, so are the warps, and the rotation is turned back; the distance is the same, and a
    path that mirrors is run through in the sense of the new curve1. Repeated samples are harmless, unless the arrays
    are traced. The path has no derivatives: `elastic_distance` has.

    Args:
        curve1, curve2: closed curves `(*b, d, n)`, periodic, without the repeated end point, d >= 2; the batches
            broadcast.
        aligner: `Aligner.accurate()` unless given.

    Returns:
        The rotation, both warps, and the distance in radians that they achieve.

    Raises:
        ValueError: for what is no pair of batches of closed curves; it names the argument and what was found.
    """
    aligner = as_aligner(aligner, Aligner.accurate)
    curve1, curve2 = as_shapes("curve1", curve1), as_shapes("curve2", curve2)
    check_pair(curve1, curve2)
    batch, shape = jnp.broadcast_shapes(curve1.shape[:-2], curve2.shape[:-2]), curve1.shape[-2:]
    dtype = jnp.promote_types(curve1.dtype, curve2.dtype)
    xp: Any = jnp if traced(curve1, curve2) else np
    flat1, flat2 = (
        xp.broadcast_to(xp.asarray(c, dtype), (*batch, *shape)).reshape(-1, *shape) for c in (curve1, curve2)
    )
    found = (_align_traced if xp is jnp else _align_concrete)(aligner, flat1, flat2)
    return Alignment(*(jnp.asarray(x.reshape((*batch, *x.shape[1:]))) for x in found))


def _align_concrete(aligner: Aligner, curve1: np.ndarray, curve2: np.ndarray) -> Alignment:
    total = len(curve1)
    if not total:
        some = jax.ShapeDtypeStruct((1, *curve1.shape[1:]), curve1.dtype)
        shapes = jax.eval_shape(ft.partial(align_chunk, aligner), some, some)
        return jax.tree.map(lambda shape: np.empty((0, *shape.shape[1:]), shape.dtype), shapes)
    size = aligner.chunk if total > _SMALL else _SMALL
    (curve1, place1), (curve2, place2) = distinct(curve1), distinct(curve2)

    def compute(part: slice) -> Alignment:
        return align_chunk(aligner, chunks.padded(curve1[part], size), chunks.padded(curve2[part], size))

    whole: Any = None
    for part, found in chunks.run(compute, (slice(s, min(s + size, total)) for s in range(0, total, size))):
        if whole is None:
            whole = jax.tree.map(lambda x: np.empty((total, *x.shape[1:]), x.dtype), found)
        for array, piece in zip(whole, found, strict=True):
            array[part] = piece[: part.stop - part.start]
    warp1, warp2 = original_parameter(whole.warp1, place1), original_parameter(whole.warp2, place2)
    return whole._replace(warp1=warp1, warp2=warp2)


@ft.partial(jax.custom_jvp, nondiff_argnums=(0,))
def _align_traced(aligner: Aligner, curve1: Float[Array, "b d n"], curve2: Float[Array, "b d n"]) -> Alignment:
    total = curve1.shape[0]
    if total <= aligner.chunk:
        return align_chunk(aligner, curve1, curve2)
    pad = -total % aligner.chunk
    split = [
        jnp.concatenate([c, jnp.repeat(c[-1:], pad, axis=0)]).reshape(-1, aligner.chunk, *c.shape[1:])
        for c in (curve1, curve2)
    ]
    found = lax.map(lambda pair: align_chunk(aligner, *pair), tuple(split))
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:])[:total], found)


@_align_traced.defjvp
def _no_derivative(aligner: Aligner, primals, tangents):
    raise ValueError(
        "alignments have no derivatives here, so distances have no second ones: differentiate elastic_distance, once."
    )


def align_chunk(aligner: Aligner, curve1: Float[AnyArray, "b d n"], curve2: Float[AnyArray, "b d n"]) -> Alignment:
    """`align` of one chunk of pairs.

    Each pair is aligned in an order that depends on its curves alone, and turned round afterwards: so the distance is
    symmetric, up to the rounding with which two lanes of a chunk may differ.
    """
    swap, lower, upper = _in_order(curve1, curve2)
    return _align_tables(aligner, aligner.tabulate(lower), aligner.tabulate(upper), swap)


@ft.partial(jax.jit, static_argnums=0)
def _align_tables(aligner: Aligner, first: Any, second: Any, swap: Bool[Array, " b"]) -> Alignment:
    found = aligner.align(first, second)
    wide = swap[:, None]
    rotation = jnp.where(wide[..., None], jnp.swapaxes(found.rotation, 1, 2), found.rotation)
    warp1, warp2 = jnp.where(wide, found.warp2, found.warp1), jnp.where(wide, found.warp1, found.warp2)
    found = forwards(Alignment(rotation, warp1, warp2, found.distance))
    whole = lambda warp: warp - jnp.floor(warp[:, :1])  # noqa: E731
    return found._replace(warp1=whole(found.warp1), warp2=whole(found.warp2))


@jax.jit
def _in_order(curve1: Float[Array, "b d n"], curve2: Float[Array, "b d n"]):
    """Which pairs are exchanged, and both sides afterwards."""
    swap = order_key(curve1) > order_key(curve2)
    wide = swap[:, None, None]
    return swap, jnp.where(wide, curve2, curve1), jnp.where(wide, curve1, curve2)


def order_key(curve: Float[AnyArray, "b d n"]) -> Float[AnyArray, " b"]:
    """A number for each curve, to put two curves in order."""
    d, n = curve.shape[1:]
    weights = np.sin(np.arange(1, d * n + 1) ** 2 * 0.7).reshape(d, n)
    return (curve * weights.astype(curve.dtype)[None]).sum(axis=(1, 2))
