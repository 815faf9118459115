"""The search for a path: from every start point on a coarse grid, then on finer ones around the paths that survive.

A path is a pair of lifted warps `(gamma1, gamma2)` of one time, to arc lengths. Each round carries both curves along
the path found so far and looks for a better one in a strip around it (`_dynamic`), the rotation solved before. A round
begins where the one before had its middle, so that the start point is free, too.
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
from ._tables import CurveTable

MOST_STARTS = 64  # as many arc lengths as curves are compared at


class Paths(NamedTuple):
    """Some paths of each pair, both warps at equal times, and the cosine that each achieves with its rotation."""

    warp1: Float[Array, "b k m+1"]
    warp2: Float[Array, "b k m+1"]
    rotation: Float[Array, "d d b k"]
    cosine: Float[Array, "b k"]

    def best(self, count: int) -> "Paths":
        if count == self.cosine.shape[1]:
            return self
        _, order = lax.top_k(self.cosine, count)
        take = lambda x: jnp.take_along_axis(x, order[..., None], axis=1)  # noqa: E731
        rotation = jnp.take_along_axis(self.rotation, order[None, None], axis=3)
        return Paths(take(self.warp1), take(self.warp2), rotation, jnp.take_along_axis(self.cosine, order, axis=1))


def search(first: CurveTable, second: CurveTable, rounds: tuple[Round, ...], true: Bool[Array, ""] | None) -> Paths:
    """The paths of the last round."""
    paths = starts(first, second, rounds[0].paths)
    for number, round_ in enumerate(rounds):
        paths = _better(first, second, paths.best(round_.paths), round_, number > 0, true)
    return paths


def starts(first: CurveTable, second: CurveTable, count: int) -> Paths:
    """Both curves by arc length, from evenly spaced start points, each with the rotation that brings them nearest."""
    t1, t2 = (on_grid(table, MOST_STARTS) for table in (first, second))
    index = np.round(np.arange(count) * (MOST_STARTS / count)).astype(int)
    c = shift_covariances(t1, t2)[:, :, index]
    d, pairs = c.shape[0], c.shape[3]
    rotation = best_rotation(jnp.swapaxes(c, 2, 3).reshape(d, d, -1)).reshape(d, d, pairs, count)
    even = jnp.broadcast_to(jnp.asarray([0.0, 1.0], t1.dtype), (pairs, count, 2))
    shift = jnp.asarray(index / MOST_STARTS, t1.dtype)[None, :, None]
    return Paths(even, even + shift, rotation, jnp.zeros((pairs, count), t1.dtype))


def on_grid(table: CurveTable, grid: int) -> Float[Array, "b d {grid}"]:
    """The tangents at `grid` equal arc lengths."""
    return table.tangents[..., :: table.tangents.shape[-1] // grid]


def _better(first: CurveTable, second: CurveTable, paths: Paths, round_: Round, turned: bool, true) -> Paths:
    pairs, kept = paths.cosine.shape
    fine = round_.slopes * round_.nodes
    warps = [_divided(warp.reshape(pairs * kept, -1), fine) for warp in paths[:2]]
    if turned:
        warps = [_turned(warp) for warp in warps]
    q1, q2 = (fusion_barrier(_carried, true, table, warp) for table, warp in zip((first, second), warps, strict=True))
    rotation = best_rotation(covariance(q1, q2)) if turned else paths.rotation.reshape(*paths.rotation.shape[:2], -1)
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


def _turned(warp: Float[Array, "l nodes"]) -> Float[Array, "l nodes"]:
    """The same warp from its middle on."""
    half = warp.shape[1] // 2
    return jnp.concatenate([warp[:, half:-1], warp[:, : half + 1] + 1], axis=1)
