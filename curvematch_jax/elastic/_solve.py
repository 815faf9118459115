"""One chunk of pairs: start points, dynamic programming, refinement in both directions."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from . import _refine as refinement
from . import _warp as warps
from ._aligner import Aligner
from ._curve import Representative
from ._dynamic import best_path
from ._rotation import best_rotation, covariance, rotate, rotation_gain
from ._start import find_starts, peak_shift, shift_covariances


class Direction(NamedTuple):
    """One of the two readings of an alignment, lanes last: distance, rotation and warp onto the first curve's samples."""

    distance: Float[Array, " l"]
    rotation: Float[Array, "d d l"]
    warp: Float[Array, "n+1 l"]


def solve(first: Representative, second: Representative, aligner: Aligner) -> tuple[Direction, Direction]:
    """Align `b` pairs; the second onto the first, and the first onto the second."""
    if aligner.slope == 0:
        return _rigid(first, second)
    gamma = _search(first, second, aligner)
    return _refined(first, second, gamma, aligner)


def _lanes(array: Float[Array, "b ..."]) -> Float[Array, "..."]:
    return jnp.moveaxis(array, 0, -1)


def _rigid(first: Representative, second: Representative) -> tuple[Direction, Direction]:
    shift, c = peak_shift(shift_covariances(first.tangents, second.tangents))
    rotation = best_rotation(c)
    distance = jnp.arccos(jnp.clip(jnp.sum(rotation * c, axis=(0, 1)), -1, 1))
    turn = shift / first.tangents.shape[-1]
    forth = _to_parameter(lambda x: x + turn[None], _lanes(first.arcs), _lanes(second.times))
    back = _to_parameter(lambda x: x - turn[None], _lanes(second.arcs), _lanes(first.times))
    return Direction(distance, rotation, forth), Direction(distance, jnp.swapaxes(rotation, 0, 1), back)


def _search(first: Representative, second: Representative, aligner: Aligner) -> Float[Array, "g+1 k b"]:
    """The warps between arc lengths of the best seeds: the best path from each start, the rotation solved again after it."""
    n, pairs = aligner.grid, first.tangents.shape[0]
    shift, c = find_starts(shift_covariances(first.tangents, second.tangents), aligner.seeds)
    t1, t2 = _lanes(first.tangents), _lanes(second.tangents)
    index = (jnp.arange(n, dtype=shift.dtype)[:, None, None] + shift[None]) % n
    shifted = jnp.take_along_axis(t2[:, :, None], index[None], axis=1)
    fixed = jnp.broadcast_to(t1[:, :, None], shifted.shape)
    flat = lambda x: x.reshape(*x.shape[:-2], -1)  # noqa: E731
    q1, q2, rotation = flat(fixed), flat(shifted), flat(best_rotation(c))
    path = best_path(q1, rotate(rotation[:, :, None], q2), max(1, round(aligner.band * n)), aligner.slope) / n
    score = rotation_gain(covariance(q1, warps.act(q2, path))).reshape(aligner.seeds, pairs)
    _, best = lax.top_k(score.T, aligner.kept)
    gamma = path.reshape(n + 1, aligner.seeds, pairs) + (shift.astype(path.dtype) / n)[None]
    return jnp.take_along_axis(gamma, best.T[None], axis=1)


def _refined(first: Representative, second: Representative, gamma, aligner: Aligner) -> tuple[Direction, Direction]:
    """Refine in both directions side by side: the lanes are forth and back, then the kept seeds, then the pairs."""
    grid, kept, pairs = gamma.shape
    gamma = gamma.reshape(grid, kept * pairs)
    q1, table, arcs, times = (
        jnp.concatenate([jnp.tile(_lanes(x), kept), jnp.tile(_lanes(y), kept)], axis=-1)
        for x, y in zip(_sides(first, second, aligner.nodes), _sides(second, first, aligner.nodes), strict=True)
    )
    both = jnp.concatenate([gamma, warps.invert(gamma)], axis=-1)
    start = _to_parameter(lambda x: warps.evaluate(both, x), arcs, times)
    here = refinement.refine(q1, table, warps.strictly_increasing(start, 0.02), aligner.steps)
    for _ in range(aligner.rounds - 1):
        half = kept * pairs
        swapped = jnp.roll(warps.invert(here.gamma), half, axis=-1)
        other = refinement.match(q1, table, warps.strictly_increasing(swapped, 0.02))
        start = jnp.where((other.cosine > here.cosine)[None], other.gamma, here.gamma)
        here = refinement.refine(q1, table, start, aligner.steps)
    return _best_of_seeds(refinement.distance(q1, here), here, (2, kept, pairs))


def _best_of_seeds(distance, here: refinement.Match, shape) -> tuple[Direction, Direction]:
    split = lambda x: x.reshape(*x.shape[:-1], *shape)  # noqa: E731
    top = jnp.argmin(split(distance), axis=1, keepdims=True)
    pick = lambda x: jnp.take_along_axis(split(x), top.reshape((1,) * (x.ndim - 1) + top.shape), axis=-2)[..., 0, :]  # noqa: E731
    distance, rotation, warp = pick(distance), pick(here.rotation), pick(here.gamma)
    forth, back = (Direction(distance[i], rotation[:, :, i], warp[:, i]) for i in range(2))
    return forth, back


def _sides(first: Representative, second: Representative, nodes: int):
    """What refinement onto `first` needs: its SRVF at the quadrature nodes, the other's table, and the maps between parameters."""
    b, d, size = first.field.shape
    q1 = first.field[..., 1::2].reshape(b, d, size // (2 * nodes), nodes)
    return q1, second.field, first.arcs, second.times


def _to_parameter(gamma, arcs: Float[Array, "n+1 l"], times: Float[Array, "g+1 l"]) -> Float[Array, "n+1 l"]:
    """A warp between arc lengths, as one from the samples of the first curve to the parameter of the second."""
    return warps.evaluate(times, gamma(arcs))
