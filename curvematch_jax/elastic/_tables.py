"""What the search and the refinement need to know of a curve, in tables whose size does not depend on its samples."""

import functools as ft
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._curve import norm, velocity
from ._lookup import nearest

CAPACITY = 2048
_PER_SAMPLE = 10  # entries to a sample of the curve, where there is room
_ARCS = 256  # entries at equal arc lengths
_TANGENTS = 2 * _ARCS
_BLOCK = CAPACITY // _ARCS


class CurveTable(NamedTuple):
    """Curves as alignment sees them; parameters and arc lengths in turns.

    `srvf` has its entries at equal parameters, a whole number of them to a sample where there is room: curves whose
    samples are counted from another one have the same entries. The other two are at equal arc lengths; they are for the
    search, and a coordinate for the refinement, in which curves have unit speed: only `srvf` is measured.
    """

    srvf: Float[Array, "b d c"]  # of unit norm; the first `count` entries, then zeros
    count: Int[Array, " b"]
    tangents: Float[Array, "b d t"]
    times: Float[Array, "b t+1"]  # parameters at equal arc lengths, 0 to 1


def tabulate(curve: Float[Array, "b d n"]) -> CurveTable:
    """The tables of closed curves. A new n compiles their derivative alone."""
    n = curve.shape[-1]
    count = n * min(_PER_SAMPLE, CAPACITY // n) if n <= CAPACITY else CAPACITY
    return _tables(_velocity(curve, count), jnp.int32(count))


@ft.partial(jax.jit, static_argnums=1)
def _velocity(curve: Float[Array, "b d n"], count: int) -> Float[Array, "b d c"]:
    return jnp.pad(velocity(curve, count), ((0, 0), (0, 0), (0, CAPACITY - count)))


@jax.jit
def _tables(speed_vector: Float[Array, "b d c"], count: Int[Array, ""]) -> CurveTable:
    speed = norm(speed_vector)
    mean = jnp.sum(speed, axis=-1, keepdims=True) / count
    srvf = speed_vector / jnp.sqrt(jnp.where(speed > 0, speed, 1) * jnp.where(mean > 0, mean, 1))[:, None]
    counts = jnp.broadcast_to(count, speed.shape[:1])
    times = _times(speed, count)
    even = jnp.stack([times[:, :-1], (times[:, :-1] + times[:, 1:]) / 2], axis=-1).reshape(len(times), _TANGENTS)
    direction = jnp.moveaxis(nearest(srvf, counts, even), 0, 1)
    size = norm(direction)[:, None]
    return CurveTable(srvf, counts, direction / jnp.where(size > 0, size, 1), times)


def _times(speed: Float[Array, "b c"], count: Int[Array, ""]) -> Float[Array, "b t+1"]:
    """Parameters at which the arc length is `k/t`, from arc lengths after every `_BLOCK` entries."""
    pairs = speed.shape[0]
    blocks = jnp.sum(speed.reshape(pairs, _ARCS, _BLOCK), axis=-1)
    arcs = jnp.matmul(blocks, jnp.asarray(np.triu(np.ones((_ARCS, _ARCS))), speed.dtype), precision="highest")
    arcs = jnp.concatenate([jnp.zeros_like(arcs[:, :1]), arcs / jnp.where(arcs[:, -1:] > 0, arcs[:, -1:], 1)], axis=1)
    nodes = jnp.minimum(jnp.arange(_ARCS + 1) * _BLOCK, count).astype(speed.dtype) / count
    first_beyond = jnp.clip(jnp.ceil(arcs * _ARCS), 0, _ARCS).astype(jnp.int32)
    counts = jax.vmap(lambda at: jnp.zeros(_ARCS + 1, jnp.int32).at[at].add(1))(first_beyond)
    after = jnp.clip(jnp.cumsum(counts, axis=-1), 1, _ARCS)
    low, high = (jnp.take_along_axis(arcs, at, axis=1) for at in (after - 1, after))
    target = jnp.asarray(np.arange(_ARCS + 1) / _ARCS, speed.dtype)
    share = jnp.clip((target - low) / jnp.where(high > low, high - low, 1), 0, 1)
    start = nodes[after - 1]
    return start + (nodes[after] - start) * share
