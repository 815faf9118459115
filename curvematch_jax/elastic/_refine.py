"""Refinement of paths on the continuous problem: Gauss-Newton steps in the path and the rotation together.

Both curves are traversed at once: at the times `k/m` curve1 has the arc length `k/m - u_k` and curve2 `k/m + u_k`. u is
periodic, `|u'| < 1`, and in between the curves' own parameters are linear. The residual of a piece is the mean of
`q1(gamma1) sqrt(gamma1') - R q2(gamma2) sqrt(gamma2')` over it, from the integrals of q: it changes with where a piece
ends even where q jumps, at the corners of outlines. It depends on two of the u and on the rotation: the Gauss-Newton
matrix is cyclic tridiagonal, bordered by the rotation's `d (d - 1) / 2` unknowns, and a step costs
O(m log m). On a copy of a curve the residual vanishes at the solution, and the steps converge quadratically. They are
damped, and accepted only when they improve.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from ._cyclic import solve_cyclic
from ._lanes import dot, filled, fusion_barrier, multiply, rotate, running_sum, solve
from ._lookup import lifted, summed
from ._rotation import cayley, covariance, generator_components, generator_products, generators
from ._tables import CurveTable

_STEEPEST = 1 - 1e-4  # of u': neither curve ever stands quite still
_SHRINK = 0.15  # each curve keeps at least this share of its progress on a piece in one step
_BALANCING = 2  # of slopes within their limits, to mean 0
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-5, 1e3
_EASING = 0.1  # of the damping after a step that improves


class State(NamedTuple):
    """Where a refinement stands: path, rotation, squared chord, and the normal equations there."""

    u: Float[Array, "l m"]
    rotation: Float[Array, "d d l"]
    chord: Float[Array, " l"]
    gradient: Float[Array, "l m"]
    diagonal: Float[Array, "l m"]
    beside: Float[Array, "l m"]  # couples k and k + 1
    border: Float[Array, "g l m"]  # couples u and the rotation
    corner: Float[Array, "g g l"]  # of the rotation alone
    turning: Float[Array, "g l"]  # gradient in the rotation


_LANES_LAST = ("rotation", "chord", "corner", "turning")


class _Sampled(NamedTuple):
    """A curve at the knots of a path, the last a turn after the first."""

    integral: Float[Array, "d l m+1"]  # of q
    q: Float[Array, "d l m+1"]
    pace: Float[Array, "l m+1"]  # parameter to arc length
    root: Float[Array, "l m"]  # m / sqrt(gamma'), of the pieces


def refine(
    first: CurveTable,
    second: CurveTable,
    u: Float[Array, "l m"],
    rotation: Float[Array, "d d l"],
    steps: int,
    true: Bool[Array, ""] | None,
    shifted: bool = False,
) -> State:
    """The state after `steps` damped steps, each lane with its own damping; the lanes of a pair follow each other.

    `shifted` for steps in the start point and the rotation alone.
    """
    move = _shifted if shifted else _moved

    def step(carry, number):
        old, damping, place = carry
        new = _state(first, second, true, *place)
        better = new.chord < old.chord
        damping = jnp.where(
            better, jnp.maximum(damping * _EASING, _LEAST_DAMPING), jnp.minimum(damping * 8, _MOST_DAMPING)
        )
        state = _chosen(better, new, old)
        place = lax.cond(number < steps, move, lambda state, _: (state.u, state.rotation), state, damping)
        return (state, damping, place), None

    shapes = jax.eval_shape(partial(_state, first, second, None), u, rotation)
    nothing = State(*(filled(jnp.inf, x, u) for x in shapes))
    damping = filled(_FIRST_DAMPING / _EASING, u[:, 0], u)
    return lax.scan(step, (nothing, damping, (u, rotation)), jnp.arange(steps + 1))[0][0]


def _chosen(better: Bool[Array, " l"], new: State, old: State) -> State:
    pick = lambda name, x, y: jnp.where(_beside(better, name, x), x, y)  # noqa: E731
    return State(*map(pick, State._fields, new, old))


def _beside(better: Bool[Array, " l"], name: str, x: Array) -> Bool[Array, "..."]:
    lanes = better if name in _LANES_LAST else better[:, None]
    return lanes.reshape((1,) * (x.ndim - lanes.ndim) + lanes.shape)


def warps_of(
    first: CurveTable, second: CurveTable, u: Float[Array, "l m"]
) -> tuple[Float[Array, "l m+1"], Float[Array, "l m+1"]]:
    """The path between the curves' own parameters. u below rounding is 0: that of a curve and itself."""
    knots = u.shape[1]
    u = jnp.where(jnp.abs(u) < 4 * jnp.finfo(u.dtype).eps, 0, u)
    u = jnp.concatenate([u, u[:, :1]], axis=1)
    time = jnp.asarray(np.arange(knots + 1) / knots, u.dtype)
    return _by_pairs(lifted, first.times, time[None] - u)[0], _by_pairs(lifted, second.times, time[None] + u)[0]


def from_warps(warp1: Float[Array, "l nodes"], warp2: Float[Array, "l nodes"], knots: int) -> Float[Array, "l {knots}"]:
    """A path between arc lengths as u, in the mean less than half a turn from 0."""
    warp2 = warp2 - jnp.round(jnp.mean(warp2 - warp1, axis=1, keepdims=True))
    middle = (warp1 + warp2) / 2
    time = jnp.asarray(np.arange(knots) / knots, warp1.dtype)
    place = time[None] - middle[:, :1]
    place = place - jnp.floor(place) + middle[:, :1]
    return jax.vmap(jnp.interp)(place, middle, (warp2 - warp1) / 2)


def _by_pairs(look_up, table, x, *rest):
    """A look-up of several paths of each pair."""
    pairs = table.shape[0]
    found = look_up(table, *rest, x.reshape(pairs, -1))
    return jax.tree.map(lambda y: y.reshape(*y.shape[:-2], *x.shape), found)


def _state(first: CurveTable, second: CurveTable, true, u: Float[Array, "l m"], rotation) -> State:
    time = jnp.asarray(np.arange(u.shape[1]) / u.shape[1], u.dtype)[None]
    at1 = fusion_barrier(partial(_sampled, first), true, time - u)
    at2 = fusion_barrier(lambda place, turn: _turned(_sampled(second, place), turn), true, time + u, rotation)
    return State(u, rotation, *_normal_equations(*fusion_barrier(_vectors, true, at1, at2)))


def _sampled(table: CurveTable, place: Float[Array, "l m"]) -> _Sampled:
    pieces = place.shape[1]
    knot, pace = _by_pairs(lifted, table.times, jnp.concatenate([place, place[:, :1] + 1], axis=1))
    integral, q = _by_pairs(summed, table.sums, knot, table.count)
    run = jnp.maximum(jnp.diff(knot, axis=1) * pieces, 1e-9)
    return _Sampled(integral, q, pace, pieces / jnp.sqrt(run))


def _turned(at: _Sampled, rotation: Float[Array, "d d l"]) -> _Sampled:
    integral, q = (rotate(rotation[..., None], field) for field in (at.integral, at.q))
    return at._replace(integral=integral, q=q)


def _vectors(at1: _Sampled, at2: _Sampled):
    """Of every piece: the residual, its part of curve2, and its derivatives in u at its two ends."""
    (carried1, left1, right1), (carried2, left2, right2) = _carried(at1), _carried(at2)
    return carried1 - carried2, carried2, -left1 - left2, -right1 - right2


def _carried(at: _Sampled):
    """`(Q(b) - Q(a)) / sqrt((b - a) / m)`, Q the integral of q, and its derivatives in the arc lengths of a and b."""
    root, before, after = at.root[None], at.pace[None, :, :-1], at.pace[None, :, 1:]
    mean = jnp.diff(at.integral, axis=2) * root
    longer = mean * (root * root / (2 * root.shape[-1]))
    return mean, (longer - at.q[..., :-1] * root) * before, (at.q[..., 1:] * root - longer) * after


def _normal_equations(residual, q2, left, right):
    """The squared chord, normalised, and gradient and Gauss-Newton matrix of half of it."""
    share, d = 1 / residual.shape[-1], len(q2)
    turned = generators(q2)  # how the residual changes as the rotation is turned back
    along = lambda end: jnp.stack([dot(end, residual), dot(end, end), *(dot(end, w) for w in turned)])  # noqa: E731
    at_knots = (along(left) + jnp.roll(along(right), 1, axis=-1)) * share
    fields = jnp.concatenate([residual, q2])
    moments = covariance(fields, fields)
    of_residual, mixed, of_q2 = moments[:d, :d], moments[:d, d:], moments[d:, d:]
    size2, more = jnp.trace(of_q2), jnp.trace(of_residual + 2 * mixed)  # |q2|^2, |q1|^2 - |q2|^2
    size = jnp.sqrt(size2) + jnp.sqrt(size2 + more)
    chord = (jnp.trace(of_residual) - (more / size) ** 2) / jnp.sqrt(size2 * (size2 + more))
    corner, turning = generator_products(of_q2), generator_components(mixed)
    return chord, at_knots[0], at_knots[1], dot(left, right) * share, at_knots[2:], corner, turning


def _moved(here: State, damping: Float[Array, " l"]) -> tuple[Float[Array, "l m"], Float[Array, "d d l"]]:
    """Path and rotation after one damped step, both curves still moving forwards."""
    knots = here.u.shape[1]
    diagonal = here.diagonal * (1 + damping[:, None]) + 1e-6 * knots
    sides = jnp.concatenate([here.gradient[None], here.border])
    solved = solve_cyclic(diagonal, here.beside, sides)
    coupling = covariance(here.border, solved) * knots
    corner = here.corner * (1 + 1e-6 * jnp.eye(len(here.corner), dtype=damping.dtype)[..., None])
    turn = solve(corner - coupling[:, 1:], (here.turning - coupling[:, 0])[:, None])[:, 0]
    change = dot(solved[1:], turn[..., None]) - solved[0]
    rotation = multiply(cayley(turn, here.rotation.shape[0]), here.rotation)
    return _within_limits(here.u, change), rotation


def _shifted(here: State, damping: Float[Array, " l"]) -> tuple[Float[Array, "l m"], Float[Array, "d d l"]]:
    """The same with all of u moved as one."""
    border = jnp.sum(here.border, axis=2)
    curvature = jnp.sum(here.diagonal + 2 * here.beside, axis=1) * (1 + damping)
    sides = jnp.concatenate([jnp.sum(here.gradient, axis=1)[None], border]) / jnp.maximum(curvature, 1e-9)[None]
    corner = here.corner * (1 + 1e-6 * jnp.eye(len(here.corner), dtype=damping.dtype)[..., None])
    turn = solve(corner - border[:, None] * sides[None, 1:], (here.turning - border * sides[:1])[:, None])[:, 0]
    change = dot(sides[1:], turn) - sides[0]
    return here.u + change[:, None], multiply(cayley(turn, here.rotation.shape[0]), here.rotation)


def _within_limits(u: Float[Array, "l m"], change: Float[Array, "l m"]) -> Float[Array, "l m"]:
    knots = u.shape[1]
    rise = lambda x: (jnp.roll(x, -1, axis=1) - x) * knots  # noqa: E731
    average = lambda x: jnp.mean(x, axis=1, keepdims=True)  # noqa: E731
    old, keep = jnp.clip(rise(u), -_STEEPEST, _STEEPEST), 1 - _SHRINK
    low = jnp.maximum(old - keep * (1 + old), -_STEEPEST)
    high = jnp.minimum(old + keep * (1 - old), _STEEPEST)
    slope = jnp.clip(old + rise(change), low, high)
    for _ in range(_BALANCING):
        room = 1 - slope * slope
        slope = jnp.clip(slope - average(slope) / average(room) * room, low, high)
    slope = slope - average(slope)
    moved = running_sum(slope) / knots
    return moved + average(u + change - moved)
