"""The search for a path: from every start point on a coarse grid, then on finer ones around the paths that survive.

A path is a pair of lifted warps `(gamma1, gamma2)` of one time, to arc lengths. The first round compares the curves by
the mean tangents of their pieces, from every start point. Each of the others carries both along the path found so far
and looks for a better one in a strip around it (`_dynamic`), the rotation solved before. It begins where the round
before had its middle, so that the start point is free, too.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from ._aligner import Round
from ._dynamic import best_path
from ._lanes import fusion_barrier, rotate
from ._lookup import nearest
from ._rotation import best_rotation, covariance
from ._start import shift_covariances
from ._tables import CurveTable, mean_tangents


class Paths(NamedTuple):
    """Some paths of each pair, both warps at equal times, and the cosine that each achieves with its rotation."""

    warp1: Float[Array, "b k m+1"]
    warp2: Float[Array, "b k m+1"]
    rotation: Float[Array, "d d b k"]
    cosine: Float[Array, "b k"]

    def at(self, pairs: Int[Array, " p"]) -> "Paths":
        return Paths(self.warp1[pairs], self.warp2[pairs], self.rotation[:, :, pairs], self.cosine[pairs])

    def best(self, count: int) -> "Paths":
        if count == self.cosine.shape[1]:
            return self
        _, order = lax.top_k(self.cosine, count)
        take = lambda x: jnp.take_along_axis(x, order[..., None], axis=1)  # noqa: E731
        rotation = jnp.take_along_axis(self.rotation, order[None, None], axis=3)
        return Paths(take(self.warp1), take(self.warp2), rotation, jnp.take_along_axis(self.cosine, order, axis=1))


def search(first: CurveTable, second: CurveTable, rounds: tuple[Round, ...], true: Bool[Array, ""] | None) -> Paths:
    """The paths of the last round."""
    paths = from_all_starts(first, second, rounds[0], true)
    for round_ in rounds[1:]:
        paths = _better(first, second, paths.best(round_.paths), round_, true)
    return paths


def from_all_starts(first: CurveTable, second: CurveTable, round_: Round, true: Bool[Array, ""] | None) -> Paths:
    """Both curves by arc length, from evenly spaced start points, each with the rotation that brings them nearest."""
    fine, starts = round_.slopes * round_.nodes, round_.paths
    shifts = np.round(np.arange(starts) * (fine / starts)).astype(int)
    t1, t2 = mean_tangents(first, fine), mean_tangents(second, fine)
    (pairs, d, _), dtype = t1.shape, t1.dtype
    # Lanes start by start: those of one start are as the tables lie.
    rotation = best_rotation(shift_covariances(t1, t2)[:, :, shifts].reshape(d, d, -1))
    from_start = (np.arange(fine)[:, None] + shifts) % fine

    def laid_out(t1, t2, rotation):
        t1, t2 = jnp.moveaxis(t1, 0, -1), jnp.moveaxis(t2, 0, -1)
        return jnp.tile(t1, starts), rotate(rotation[:, :, None], t2[:, from_start].reshape(d, fine, -1))

    q1, q2 = fusion_barrier(laid_out, true, t1, t2, rotation)
    v, cosine = best_path(q1, q2, round_.width, round_.slopes)
    v = jnp.moveaxis(v.reshape(-1, starts, pairs), 0, -1).swapaxes(0, 1)
    time = jnp.asarray(np.arange(round_.nodes + 1) * round_.slopes, jnp.int32)[None, None]
    warp1, warp2 = time - v, time + v + jnp.asarray(shifts, jnp.int32)[None, :, None]
    rotation, cosine = rotation.reshape(d, d, starts, pairs), cosine.reshape(starts, pairs)
    return Paths(warp1.astype(dtype) / fine, warp2.astype(dtype) / fine, rotation.swapaxes(2, 3), cosine.T)


def _better(first: CurveTable, second: CurveTable, paths: Paths, round_: Round, true) -> Paths:
    """Paths from the middle of the ones before, in a strip around them."""
    pairs, kept = paths.cosine.shape
    warps = [_half_on(_divided(warp.reshape(pairs * kept, -1), round_.slopes * round_.nodes)) for warp in paths[:2]]
    q1, q2 = (fusion_barrier(_carried, true, table, warp) for table, warp in zip((first, second), warps, strict=True))
    rotation = best_rotation(covariance(q1, q2))
    lanes_last = lambda q: jnp.swapaxes(q, 1, 2)  # noqa: E731
    v, cosine = best_path(lanes_last(q1), lanes_last(rotate(rotation[..., None], q2)), round_.width, round_.slopes)
    place = jnp.asarray(np.arange(round_.nodes + 1) * round_.slopes, jnp.int32)[None]
    moved = [_at(warp, place + sign * v.T) for warp, sign in zip(warps, (-1, 1), strict=True)]
    warp1, warp2 = (warp.reshape(pairs, kept, -1) for warp in moved)
    return Paths(warp1, warp2, rotation.reshape(*rotation.shape[:2], pairs, kept), cosine.reshape(pairs, kept))


def _carried(table: CurveTable, warp: Float[Array, "l nodes"]) -> Float[Array, "d l f"]:
    """`t(gamma) sqrt(gamma')` at equal times: the slope is the mean of those before and after."""
    (pairs, _, size), lanes, fine = table.tangents.shape, warp.shape[0], warp.shape[1] - 1
    field = nearest(table.tangents, jnp.full(pairs, size, jnp.int32), warp[:, :-1].reshape(pairs, -1))
    slope = jnp.maximum(jnp.diff(warp, axis=1), 0) * fine
    root = jnp.sqrt((slope + jnp.roll(slope, 1, axis=1)) / 2)
    return field.reshape(-1, lanes, fine) * root[None]


def _at(warp: Float[Array, "l nodes"], index: Int[Array, "l n"]) -> Float[Array, "l n"]:
    """The lifted warp at whole entries, less than a turn before the first or behind the last."""
    fine = warp.shape[1] - 1
    turns = (index >= fine).astype(jnp.int32) - (index < 0).astype(jnp.int32)
    found = jnp.take_along_axis(warp, index - turns * fine, axis=1, mode="promise_in_bounds")
    return found + turns.astype(warp.dtype)


def _divided(warp: Float[Array, "l nodes"], pieces: int) -> Float[Array, "l {pieces}+1"]:
    """The same warp with every piece divided evenly."""
    share = np.arange(pieces // (warp.shape[1] - 1)) * (warp.shape[1] - 1) / pieces
    rise = jnp.diff(warp, axis=1)[..., None] * jnp.asarray(share, warp.dtype)[None, None]
    inside = (warp[:, :-1, None] + rise).reshape(warp.shape[0], pieces)
    return jnp.concatenate([inside, warp[:, -1:]], axis=1)


def _half_on(warp: Float[Array, "l nodes"]) -> Float[Array, "l nodes"]:
    """The same warp from its middle on."""
    half = warp.shape[1] // 2
    return jnp.concatenate([warp[:, half:-1], warp[:, : half + 1] + 1], axis=1)
