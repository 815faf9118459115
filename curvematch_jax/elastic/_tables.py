"""What the search and the refinement need to know of a curve, in tables whose size does not depend on its samples."""

import functools as ft
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._curve import norm, velocity
from ._frame import AnyArray
from ._lanes import filled, fusion_barrier, running_sum
from ._lookup import divided, nearest

CAPACITY = 1024
_PER_SAMPLE = 10  # entries to a sample of the curve, where there is room
TANGENTS = 768  # entries at equal arc lengths
_TIMES = 64


class CurveTable(NamedTuple):
    """Curves as alignment sees them; parameters and arc lengths in turns.

    `srvf` has its entries at equal parameters, a whole number of them to a sample where there is room: curves whose
    samples are counted from another one have the same entries. The other two are at equal arc lengths; they are for the
    search, and a coordinate for the refinement, in which curves have unit speed: only `srvf` is measured.
    """

    srvf: Float[Array, "b d c"]  # of unit norm; the first `count` entries, then zeros
    count: Int[Array, " b"]
    sums: Float[Array, "b d c+1"]  # the integral of srvf up to each entry, the last up to a whole turn
    tangents: Float[Array, "b d t"]
    times: Float[Array, "b t+1"]  # parameters at equal arc lengths, 0 to 1


def tabulate(curve: Float[AnyArray, "b d n"], times: int = _TIMES) -> CurveTable:
    """The tables of closed curves. A new n compiles their derivative alone."""
    n = curve.shape[-1]
    count = n * min(_PER_SAMPLE, CAPACITY // n) if n <= CAPACITY else CAPACITY
    return _tables(_velocity(curve, count), jnp.asarray(count, jnp.int32), times)


def mean_tangents(table: CurveTable, grid: int) -> Float[Array, "b d {grid}"]:
    """Means over two pieces of length `1/grid`, one before and one after each of `grid` equal arc lengths."""
    pieces = jnp.mean(table.tangents.reshape(*table.tangents.shape[:2], grid, -1), axis=-1)
    return (pieces + jnp.roll(pieces, 1, axis=-1)) / 2


@ft.partial(jax.jit, static_argnums=1)
def _velocity(curve: Float[AnyArray, "b d n"], count: int) -> Float[Array, "b d c"]:
    return jnp.pad(velocity(curve, count), ((0, 0), (0, 0), (0, CAPACITY - count)))


@ft.partial(jax.jit, static_argnums=2)
def _tables(speed_vector: Float[Array, "b d c"], count: Int[Array, ""], times: int) -> CurveTable:
    counts = filled(0, jax.ShapeDtypeStruct(speed_vector.shape[:1], count.dtype), speed_vector) + count
    srvf, speed = fusion_barrier(_srvf, counts[0] > 0, speed_vector, count)
    at = _times(speed, count, times)
    direction = jnp.moveaxis(nearest(srvf, counts, divided(at, TANGENTS)[:, :-1]), 0, 1)
    size = norm(direction)[:, None]
    return CurveTable(srvf, counts, _sums(srvf, count), direction / jnp.where(size > 0, size, 1), at)


def _srvf(speed_vector: Float[Array, "b d c"], count: Int[Array, ""]):
    """The SRVF of unit norm, and the speed."""
    speed = jnp.asarray(norm(speed_vector))
    mean = jnp.sum(speed, axis=-1, keepdims=True) / count.astype(speed.dtype)
    return speed_vector / jnp.sqrt(jnp.where(speed > 0, speed, 1) * jnp.where(mean > 0, mean, 1))[:, None], speed


def _sums(srvf: Float[Array, "b d c"], count: Int[Array, ""]) -> Float[Array, "b d c+1"]:
    """The integral of what is linear between the entries of `srvf`."""
    sums = running_sum(srvf, own=0.5)
    sums = jnp.concatenate([sums, sums[..., -1:] + srvf[..., -1:] / 2], axis=-1)
    inside = jnp.arange(sums.shape[-1], dtype=jnp.int32) < count  # at the whole turn, the first entry counts again
    return (sums - jnp.where(inside[None, None], srvf[..., :1] / 2, 0)) / count.astype(srvf.dtype)


def _times(speed: Float[Array, "b c"], count: Int[Array, ""], entries: int) -> Float[Array, "b {entries}+1"]:
    """Parameters at which the arc length is `k/entries`, from arc lengths at every few entries of the speed."""
    block = CAPACITY // entries
    arcs = running_sum(jnp.sum(speed.reshape(len(speed), entries, block), axis=-1))
    whole = jnp.sum(speed, axis=-1, keepdims=True)
    arcs = jnp.concatenate([arcs / jnp.where(whole > 0, whole, 1), jnp.ones_like(whole)], axis=1)
    nodes = jnp.minimum(jnp.asarray(np.arange(entries + 1) * block, jnp.int32), count).astype(
        speed.dtype
    ) / count.astype(speed.dtype)
    first_beyond = jnp.clip(jnp.ceil(arcs * entries), 0, entries).astype(jnp.int32)
    counts = jax.vmap(lambda at: jnp.zeros(entries + 1, jnp.int32).at[at].add(1))(first_beyond)
    after = jnp.clip(jnp.cumsum(counts, axis=-1), 1, entries)
    low, high = (jnp.take_along_axis(arcs, at, axis=1) for at in (after - 1, after))
    target = jnp.asarray(np.arange(entries + 1) / entries, speed.dtype)
    share = jnp.clip((target[None] - low) / jnp.where(high > low, high - low, 1), 0, 1)
    start = nodes[after - 1]
    return start + (nodes[after] - start) * share
