"""Alignment of closed curves, and the distance that it achieves."""

import functools as ft
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, ArrayLike, Float

from . import _chunks as chunks
from ._aligner import Aligner
from ._check import as_curves, check_pair, traced
from ._curve import Representative, represent
from ._distinct import distinct, original_warp
from ._solve import Reading, on_grid, solve
from ._warp import evaluate

_SMALL = 8  # pairs in the chunk of a small batch
_TANGENTS = 5  # in the tables, to a sample of a curve, at least: with fewer, sharp turns are cut


class Alignment(NamedTuple):
    """How curve2 is laid onto curve1: `q1 ~ R q2(gamma) sqrt(gamma')`, and the distance that this achieves.

    Attributes:
        rotation: `(*b, d, d)`, R in SO(d).
        warp: `(*b, m + 1)`, the lifted gamma at `k/m`, linear in between: increasing, `warp[m] = warp[0] + 1`;
            `warp[0]` is the start point. m is `aligner.fineness` times n: `warp[::fineness]` is gamma at the samples.
        distance: `(*b,)`, radians.
    """

    rotation: Float[Array, "*b d d"]
    warp: Float[Array, "*b n+1"]
    distance: Float[Array, "*b"]


def align(curve1: ArrayLike, curve2: ArrayLike, aligner: Aligner | None = None) -> Alignment:
    """Lay curve2 onto curve1 by rotation, start point and reparametrisation.

    Position and scale play no part; reflection and reversal are never used. When the curves are exchanged, the
    distance is the same. Repeated samples are harmless, unless the arrays are traced.

    Args:
        curve1, curve2: closed curves `(*b, d, n)`, periodic, without the repeated end point, d >= 2; the batches
            broadcast.
        aligner: `Aligner.accurate()` unless given.

    Returns:
        The rotation, the warp, and the distance in radians that the two achieve.

    Raises:
        ValueError: for what is no pair of batches of closed curves; it names the argument and what was found.
    """
    aligner = Aligner.accurate() if aligner is None else aligner
    curve1, curve2 = as_curves("curve1", curve1), as_curves("curve2", curve2)
    check_pair(curve1, curve2)
    batch, shape = jnp.broadcast_shapes(curve1.shape[:-2], curve2.shape[:-2]), curve1.shape[-2:]
    dtype = jnp.promote_types(curve1.dtype, curve2.dtype)
    flat1, flat2 = (jnp.broadcast_to(c.astype(dtype), (*batch, *shape)).reshape(-1, *shape) for c in (curve1, curve2))
    if traced(flat1, flat2):
        found = _align_traced(flat1, flat2, aligner)
    else:
        found = _align_concrete(np.asarray(flat1), np.asarray(flat2), aligner)
    return Alignment(*(jnp.asarray(x).reshape(*batch, *x.shape[1:]) for x in found))


def _align_concrete(curve1: np.ndarray, curve2: np.ndarray, aligner: Aligner) -> tuple[np.ndarray, ...]:
    total, d, n = curve1.shape
    size = aligner.chunk if total > _SMALL else _SMALL
    (curve1, place1), (curve2, place2) = distinct(curve1), distinct(curve2)
    shapes = (d, d), (aligner.fineness * n + 1,), ()
    rotation, warp, distance = (np.empty((total, *shape), curve1.dtype) for shape in shapes)

    def compute(part: slice) -> Alignment:
        return align_chunk(chunks.padded(curve1[part], size), chunks.padded(curve2[part], size), aligner)

    for part, values in chunks.run(compute, (slice(s, min(s + size, total)) for s in range(0, total, size))):
        for whole, piece in zip((rotation, warp, distance), values, strict=True):
            whole[part] = piece[: part.stop - part.start]
    return rotation, original_warp(warp, place1, place2), distance


def _align_traced(curve1: Float[Array, "b d n"], curve2: Float[Array, "b d n"], aligner: Aligner) -> Alignment:
    total = curve1.shape[0]
    if total <= aligner.chunk:
        return align_chunk(curve1, curve2, aligner)
    pad = -total % aligner.chunk
    split = [
        jnp.concatenate([c, jnp.repeat(c[-1:], pad, axis=0)]).reshape(-1, aligner.chunk, *c.shape[1:])
        for c in (curve1, curve2)
    ]
    found = lax.map(lambda pair: align_chunk(*pair, aligner), tuple(split))
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:])[:total], found)


@ft.partial(jax.jit, static_argnames="aligner")
def align_chunk(curve1: Float[Array, "b d n"], curve2: Float[Array, "b d n"], aligner: Aligner) -> Alignment:
    """`align` of one chunk of pairs."""
    first, second = (represent_for(aligner, c) for c in (curve1, curve2))
    found = read(first, second, aligner)
    gamma = evaluate(second.times.T, found.warp)
    return Alignment(jnp.moveaxis(found.rotation, -1, 0), gamma.T, found.distance)


def represent_for(aligner: Aligner, curve: Float[Array, "b d n"]) -> Representative:
    """The tables that `read` needs."""
    factor = max(aligner.table, -(-_TANGENTS * curve.shape[-1] // aligner.grid))
    return represent(curve, factor * aligner.grid, aligner.fineness)


def read(first: Representative, second: Representative, aligner: Aligner) -> Reading:
    """The alignment of one chunk of pairs of tabulated curves, as the first ones see it.

    The pair is put in an order that depends on its curves alone, aligned, and read in the order that was asked for:
    so the distance is symmetric, up to the rounding with which two lanes of a chunk may differ.
    """
    swap = _key(first, aligner.grid) > _key(second, aligner.grid)
    choose = lambda a, b: jnp.where(swap.reshape((-1,) + (1,) * (a.ndim - 1)), a, b)  # noqa: E731
    lower, upper = jax.tree.map(choose, second, first), jax.tree.map(choose, first, second)
    forth, back = solve(lower, upper, aligner)
    return jax.tree.map(lambda a, b: jnp.where(swap.reshape((1,) * (a.ndim - 1) + (-1,)), b, a), forth, back)


def _key(curve: Representative, grid: int) -> Float[Array, " b"]:
    """A number for each curve, to put two curves in order."""
    tangents = on_grid(curve, grid)
    weights = np.sin(np.arange(1, tangents[0].size + 1) ** 2 * 0.7).reshape(tangents.shape[1:])
    return jnp.sum(tangents * jnp.asarray(weights, tangents.dtype)[None], axis=(1, 2))
