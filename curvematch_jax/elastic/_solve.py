"""One chunk of pairs: start points, dynamic programming, refinement in both directions."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from . import _refine as refinement
from . import _warp as warps
from ._aligner import Aligner
from ._curve import Representative
from ._dynamic import best_path
from ._lanes import frobenius
from ._rotation import best_rotation, covariance, rotate, rotation_gain
from ._start import find_starts, peak_shift, shift_covariances

_AGREEMENT_STEPS = 5
_LEAST_START_SLOPE = 0.02


class Direction(NamedTuple):
    """One of the two readings of an alignment, lanes last; the warp has its samples on the first curve's."""

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
    distance = jnp.arccos(jnp.clip(frobenius(rotation, c), -1, 1))
    turn = shift / first.tangents.shape[-1]
    forth = _to_parameter(lambda x: x + turn[None], _lanes(first.arcs), _lanes(second.times))
    back = _to_parameter(lambda x: x - turn[None], _lanes(second.arcs), _lanes(first.times))
    return Direction(distance, rotation, forth), Direction(distance, jnp.swapaxes(rotation, 0, 1), back)


def _search(first: Representative, second: Representative, aligner: Aligner) -> Float[Array, "nodes k b"]:
    """The best seeds' warps between arc lengths: the best path from each start, scored with its best rotation."""
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

    def refine_again(found, _):
        warp, cosine = found
        swapped = warps.strictly_increasing(jnp.roll(warps.invert(warp), kept * pairs, axis=-1), _LEAST_START_SLOPE)
        other = refinement.match(q1, table, swapped)
        better = jnp.where((other.cosine > cosine)[None], swapped, warp)
        return refinement.refine(q1, table, better, aligner.steps), None

    found = refinement.refine(q1, table, warps.strictly_increasing(start, _LEAST_START_SLOPE), aligner.steps)
    (warp, _), _ = lax.scan(refine_again, found, None, length=aligner.rounds - 1)
    here = refinement.match(q1, table, warp)
    forth, back = _best_of_seeds(refinement.distance(q1, here), here, (2, kept, pairs))
    ends = tuple(x[..., :pairs] for x in (q1, table)), tuple(x[..., kept * pairs :][..., :pairs] for x in (q1, table))
    return _agreed(forth, back, *ends)


def _best_of_seeds(distance, here: refinement.Match, shape) -> tuple[Direction, Direction]:
    split = lambda x: x.reshape(*x.shape[:-1], *shape)  # noqa: E731
    top = jnp.argmin(split(distance), axis=1, keepdims=True)
    pick = lambda x: jnp.take_along_axis(split(x), top.reshape((1,) * (x.ndim - 1) + top.shape), axis=-2)[..., 0, :]  # noqa: E731
    distance, rotation, warp = pick(distance), pick(here.rotation), pick(here.gamma)
    forth, back = (Direction(distance[i], rotation[:, :, i], warp[:, i]) for i in range(2))
    return forth, back


def _agreed(forth: Direction, back: Direction, ends1, ends2) -> tuple[Direction, Direction]:
    """Make the two readings one alignment, of one distance.

    Where curve2 skips a piece of curve1, `n` samples on curve1 hold the skip exactly, and those on curve2 spend an
    interval on it: the readings differ by a few hundredths. Both can hold the larger distance. The better one moves
    towards the inverse of the other until it is there: false position and bisection, halfway between the two.
    """
    lead = forth.distance < back.distance
    choose = lambda a, b: jnp.where(lead.reshape((1,) * (a.ndim - 1) + (-1,)), a, b)  # noqa: E731
    better, worse = jax.tree.map(choose, forth, back), jax.tree.map(choose, back, forth)
    q1, table = jax.tree.map(choose, ends1, ends2)
    inverse = warps.invert(worse.warp)
    inverse = inverse + jnp.round(jnp.mean(better.warp - inverse, axis=0, keepdims=True))
    at = lambda share: refinement.match(q1, table, better.warp + share[None] * (inverse - better.warp))  # noqa: E731

    target = worse.distance
    line = lambda low, high, below, above: low + (high - low) * _share(target - below, above - below)  # noqa: E731

    def narrow(_, bracket):
        low, high, below, above = bracket
        middle = (line(*bracket) + (low + high) / 2) / 2
        reached = refinement.distance(q1, at(middle))
        short = reached < target
        keep = lambda new, old: jnp.where(short, new, old)  # noqa: E731
        return keep(middle, low), keep(high, middle), keep(reached, below), keep(above, reached)

    zero = jnp.zeros_like(target)
    bracket = (zero, zero + 1, better.distance, refinement.distance(q1, at(zero + 1)))
    here = at(line(*lax.fori_loop(0, _AGREEMENT_STEPS, narrow, bracket)))
    agreed = Direction(worse.distance, here.rotation, here.gamma)
    return jax.tree.map(choose, agreed, worse), jax.tree.map(choose, worse, agreed)


def _share(part: Float[Array, " l"], whole: Float[Array, " l"]) -> Float[Array, " l"]:
    """`part / whole` in [0, 1]; 1/2 where the whole is nothing."""
    return jnp.where(whole > 0, jnp.clip(part / jnp.where(whole > 0, whole, 1), 0, 1), 0.5)


def _sides(first: Representative, second: Representative, nodes: int):
    """What refinement onto `first` needs: its SRVF at the nodes, the other's table, and the parameters' maps."""
    b, d, size = first.field.shape
    q1 = first.field[..., 1::2].reshape(b, d, size // (2 * nodes), nodes)
    return q1, second.field, first.arcs, second.times


def _to_parameter(gamma, arcs: Float[Array, "nodes l"], times: Float[Array, "grid_nodes l"]) -> Float[Array, "nodes l"]:
    """A warp between arc lengths, as one from the samples of the first curve to the parameter of the second."""
    return warps.evaluate(times, gamma(arcs))
