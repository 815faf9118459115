"""One chunk of pairs: start points, dynamic programming, refinement, and the alignment as both curves read it."""

import functools as ft
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from . import _warp as warps
from ._aligner import Aligner, Stage
from ._curve import Representative
from ._dynamic import best_path
from ._lanes import dot, frobenius, mean_rows, once
from ._refine import refine, rotation_of
from ._rotation import best_rotation, covariance, rotate, rotation_gain
from ._start import find_starts, peak_shift, shift_covariances
from ._table import pack, position_at, positions

_AGREEMENT_STEPS = 2
_ROUNDING = 1e-3  # of the straightness of an arc


class Reading(NamedTuple):
    """An alignment as seen from one of its curves, lanes last; the warp is between arc lengths, at the curve's arcs."""

    distance: Float[Array, " l"]
    rotation: Float[Array, "d d l"]
    warp: Float[Array, "nodes l"]


class _Curve(NamedTuple):
    """One curve's tables, lanes last."""

    tangents: Int[Array, "d t l"]  # packed
    positions: Float[Array, "d t l"]
    arcs: Float[Array, "nodes l"]


class _Side(NamedTuple):
    """A curve and the one that is laid onto it."""

    arcs: Float[Array, "nodes l"]
    chords: Float[Array, "d m l"]  # of the curve, between the arcs
    other: _Curve
    rotation: Float[Array, "d d l"]


def solve(first: Representative, second: Representative, aligner: Aligner) -> tuple[Reading, Reading]:
    """Align `b` pairs; the second onto the first, and the first onto the second."""
    if aligner.slope == 0:
        return _rigid(first, second, aligner.grid)
    gamma = _search(first, second, aligner)
    one, two = _tables(first), _tables(second)
    u, rotation = _refined(one.tangents, two.tangents, gamma, aligner.stages)
    forth = _Side(one.arcs, _chords(one.arcs, one), two, rotation)
    back = _Side(two.arcs, _chords(two.arcs, two), one, jnp.swapaxes(rotation, 0, 1))
    return _agreed(_read(u, forth), _read(-u, back), forth, back)


def _tables(curve: Representative) -> _Curve:
    tangents = _lanes(curve.tangents)
    return _Curve(pack(tangents), positions(tangents), _lanes(curve.arcs))


def _chords(x: Float[Array, "nodes l"], curve: _Curve) -> Float[Array, "d m l"]:
    return jnp.diff(once(position_at, x, curve.tangents, curve.positions), axis=1)


def _lanes(array: Float[Array, "b ..."]) -> Float[Array, "..."]:
    return jnp.moveaxis(array, 0, -1)


def on_grid(curve: Representative, grid: int) -> Float[Array, "b d {grid}"]:
    """The tangents at `grid` equal arc lengths."""
    return curve.tangents[..., :: curve.tangents.shape[-1] // grid]


def _rigid(first: Representative, second: Representative, grid: int) -> tuple[Reading, Reading]:
    t1, t2 = on_grid(first, grid), on_grid(second, grid)
    shift, c = peak_shift(shift_covariances(t1, t2))
    rotation = best_rotation(c)
    distance = jnp.arccos(jnp.clip(frobenius(rotation, c), -1, 1))
    turn = (shift / t1.shape[-1])[None]
    back = Reading(distance, jnp.swapaxes(rotation, 0, 1), _lanes(second.arcs) - turn)
    return Reading(distance, rotation, _lanes(first.arcs) + turn), back


def _search(first: Representative, second: Representative, aligner: Aligner) -> Float[Array, "nodes k b"]:
    """Warps between arc lengths, best first: the best path from each start, its rotation solved before each pass."""
    t1, t2 = on_grid(first, aligner.grid), on_grid(second, aligner.grid)
    n, pairs = aligner.grid, t1.shape[0]
    shift, c = find_starts(shift_covariances(t1, t2), aligner.seeds)
    flat = lambda x: x.reshape(*x.shape[:-2], -1)  # noqa: E731
    index = (jnp.arange(n, dtype=shift.dtype)[:, None, None] + shift[None]) % n
    shifted = jnp.take_along_axis(_lanes(t2)[:, :, None], index[None], axis=1, mode="promise_in_bounds")
    q1, q2 = flat(jnp.broadcast_to(_lanes(t1)[:, :, None], shifted.shape)), flat(shifted)
    solved = lambda c: once(lambda r, q: rotate(r[:, :, None], q), best_rotation(c), q2)  # noqa: E731
    path = ft.partial(best_path, band=max(1, round(aligner.band * n)), largest=aligner.slope)
    c, score, gamma = flat(c), jnp.full(q1.shape[-1], -jnp.inf, q1.dtype), jnp.zeros((n + 1, q1.shape[-1]), q1.dtype)
    for _ in range(aligner.passes):
        found = path(q1, solved(c))
        c = covariance(q1, once(warps.act, q2, found / n))
        gain = rotation_gain(c)
        gamma, score = jnp.where((gain > score)[None], found, gamma), jnp.maximum(gain, score)
    gamma = (gamma.reshape(n + 1, aligner.seeds, pairs) + shift.astype(gamma.dtype)[None]) / n
    return _best(gamma, score.reshape(aligner.seeds, pairs), aligner.stages[0].kept if aligner.stages else 1)


def _best(x: Float[Array, "n k b"], score: Float[Array, "k b"], kept: int) -> Float[Array, "n {kept} b"]:
    _, order = lax.top_k(score.T, kept)
    return jnp.take_along_axis(x, order.T[None], axis=1)


def _refined(
    t1: Int[Array, "d t b"], t2: Int[Array, "d t b"], gamma: Float[Array, "nodes k b"], stages: tuple[Stage, ...]
) -> tuple[Float[Array, "knots b"], Float[Array, "d d b"]]:
    """The best alignment as a path, after all stages, and its rotation."""
    nodes, kept, pairs = gamma.shape
    u = warps.to_path(gamma.reshape(nodes, -1), stages[0].knots if stages else nodes - 1)
    score = jnp.zeros((kept, pairs), u.dtype)
    for stage in stages:
        u = _best(u.reshape(-1, kept, pairs), score, stage.kept).reshape(u.shape[0], -1)
        kept = stage.kept
        many1, many2 = (jnp.tile(t, kept) for t in (t1, t2))
        u, chord = refine(many1, many2, warps.resampled(u, stage.knots), stage.steps, stage.nodes)
        score = -chord.reshape(kept, pairs)
    u = _best(u.reshape(-1, kept, pairs), score, 1)[:, 0]
    return u, rotation_of(t1, t2, u, stages[-1].nodes if stages else 2)


def _read(u: Float[Array, "k l"], side: _Side) -> Reading:
    warp = warps.from_path(u, side.arcs)
    return Reading(_distance(side, warp), side.rotation, warp)


def _distance(side: _Side, warp: Float[Array, "nodes l"]) -> Float[Array, " l"]:
    """Angle between `q1` and `R q2(gamma) sqrt(gamma')`, for gamma linear between the arcs.

    An interval of lengths a and b adds `sqrt(a b)` times the mean of `<q1, R q2>`. That is the cosine between the
    curves' chords, also where gamma races along curve2: there it is times the share that the chord is of the arc.
    Through the distance on the sphere, `2 arcsin(|u - v| / 2)`: precise near 0, where a rounded cosine is not.
    """
    a, b = (jnp.maximum(jnp.diff(x, axis=0), 0) for x in (side.arcs, warp))
    direction1, straight1 = _polar(side.chords, a)
    direction2, straight2 = _polar(_chords(warp, side.other), b)
    apart = direction1 - rotate(side.rotation[:, :, None], direction2)
    bent = jnp.maximum(jnp.abs(straight1 - straight2) - _ROUNDING, 0)
    root1, root2 = jnp.sqrt(a), jnp.sqrt(b)
    square = (root1 - root2) ** 2 + root1 * root2 * ((1 - bent) * dot(apart, apart) + 2 * bent)
    chord = jnp.sqrt(mean_rows(square) * len(square))
    return 2 * jnp.arcsin(jnp.minimum(chord / 2, 1))


def _polar(chords: Float[Array, "d m l"], arcs: Float[Array, "m l"]):
    """Unit directions of chords, and how straight their arcs are: 1 for a segment, 0 for a loop."""
    size = jnp.sqrt(jnp.maximum(dot(chords, chords), 1e-24))
    return chords / size[None], jnp.minimum(size / jnp.maximum(arcs, 1e-12), 1)


def _agreed(forth: Reading, back: Reading, side1: _Side, side2: _Side) -> tuple[Reading, Reading]:
    """Make the two readings one alignment, of one distance.

    A reading spends one of its intervals on every piece of the other curve that the path skips, so they differ a
    little. Both can hold the larger distance: the better one gives up a little of its warp, by false position, until it
    is there.
    """
    lead = forth.distance < back.distance
    choose = lambda a, b: jnp.where(lead.reshape((1,) * (a.ndim - 1) + (-1,)), a, b)  # noqa: E731
    better, worse = jax.tree.map(choose, forth, back), jax.tree.map(choose, back, forth)
    side = jax.tree.map(choose, side1, side2)
    plain = side.arcs + mean_rows(better.warp - side.arcs)[None]
    at = lambda share: better.warp + share[None] ** 2 * (plain - better.warp)  # noqa: E731
    share = _false_position(lambda s: _distance(side, at(s)), better.distance, worse.distance)
    agreed = Reading(worse.distance, better.rotation, at(share))
    return jax.tree.map(choose, agreed, worse), jax.tree.map(choose, worse, agreed)


def _false_position(
    reached: Callable[[Float[Array, " l"]], Float[Array, " l"]], least: Float[Array, " l"], target: Float[Array, " l"]
) -> Float[Array, " l"]:
    """Where in [0, 1] a function that is `least` at 0 comes to `target`; halfway between the secant and bisection."""

    def line(low, high, below, above):
        rise = above - below
        share = jnp.where(rise > 0, jnp.clip((target - below) / jnp.where(rise > 0, rise, 1), 0, 1), 0.5)
        return low + (high - low) * share

    def narrow(_, bracket):
        low, high, below, above = bracket
        middle = (line(*bracket) + (low + high) / 2) / 2
        value = reached(middle)
        short = value < target
        keep = lambda new, old: jnp.where(short, new, old)  # noqa: E731
        return keep(middle, low), jnp.where(short, high, middle), keep(value, below), jnp.where(short, above, value)

    zero = jnp.zeros_like(target)
    return line(*lax.fori_loop(0, _AGREEMENT_STEPS, narrow, (zero, zero + 1, least, reached(zero + 1))))
