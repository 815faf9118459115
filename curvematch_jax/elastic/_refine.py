"""Refinement of paths on the continuous problem: Gauss-Newton steps in the path and the rotation together.

Both curves are traversed at once: at the times `k/m` curve1 has the arc length `k/m - u_k` and curve2 `k/m + u_k`. u is
periodic, `|u'| < 1`, and in between the curves' own parameters are linear. The residual of a piece,
`q1(gamma1) sqrt(gamma1') - R q2(gamma2) sqrt(gamma2')` at its middle, depends on two of the u and on the rotation: the
Gauss-Newton matrix is cyclic tridiagonal, bordered by the rotation's `d (d - 1) / 2` unknowns, and a step costs
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
from ._lanes import dot, fusion_barrier, multiply, rotate, running_sum, solve
from ._lookup import lifted, periodic
from ._rotation import cayley, covariance, generators
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
    """Both curves in the middle of every piece, and how knots move there."""

    q1: Float[Array, "d l m"]
    slope1: Float[Array, "d l m"]
    q2: Float[Array, "d l m"]
    slope2: Float[Array, "d l m"]
    run1: Float[Array, "l m"]  # gamma'
    run2: Float[Array, "l m"]
    pace1: Float[Array, "l m"]  # parameter to arc length at the knots
    pace2: Float[Array, "l m"]


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
    nothing = State(*(jnp.full(x.shape, jnp.inf, x.dtype) for x in shapes))
    damping = jnp.full_like(u[:, 0], _FIRST_DAMPING / _EASING)
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
    """The path between the curves' own parameters."""
    knots = u.shape[1]
    u = jnp.concatenate([u, u[:, :1]], axis=1)
    time = jnp.asarray(np.arange(knots + 1) / knots, u.dtype)
    return _by_pairs(lifted, first.times, time[None] - u)[0], _by_pairs(lifted, second.times, time[None] + u)[0]


def from_warps(warp1: Float[Array, "l nodes"], warp2: Float[Array, "l nodes"], knots: int) -> Float[Array, "l {knots}"]:
    """A path between arc lengths as u."""
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


def _sampled(first: CurveTable, second: CurveTable, u: Float[Array, "l m"]) -> _Sampled:
    knots = u.shape[1]
    time = jnp.asarray(np.arange(knots) / knots, u.dtype)
    found = []
    for table, place in ((first, time[None] - u), (second, time[None] + u)):
        knot, pace = _by_pairs(lifted, table.times, place)
        after = jnp.concatenate([knot[:, 1:], knot[:, :1] + 1], axis=1)
        q, slope = _by_pairs(periodic, table.srvf, (knot + after) / 2, table.count)
        found.append((q, slope, jnp.maximum(after - knot, 1e-9) * knots, pace))
    (q1, slope1, run1, pace1), (q2, slope2, run2, pace2) = found
    return _Sampled(q1, slope1, q2, slope2, run1, run2, pace1, pace2)


def _state(first: CurveTable, second: CurveTable, true, u: Float[Array, "l m"], rotation) -> State:
    at = fusion_barrier(partial(_sampled, first, second), true, u)
    vectors = fusion_barrier(_vectors, true, at, rotation)
    return State(u, rotation, *_normal_equations(*vectors))


def _vectors(at: _Sampled, rotation: Float[Array, "d d l"]):
    """Of every piece: the residual, `R q2 sqrt(gamma2')`, and the residual's derivatives in u at its two ends."""
    knots = at.run1.shape[1]
    root1, root2 = jnp.sqrt(at.run1)[None], jnp.sqrt(at.run2)[None]
    turn = rotation[..., None]
    along1, along2 = at.slope1 * (root1 / 2), rotate(turn, at.slope2) * (root2 / 2)
    turned = rotate(turn, at.q2)
    longer1, longer2 = at.q1 * (knots / 2 / root1), turned * (knots / 2 / root2)
    pace1, pace2 = at.pace1[None], at.pace2[None]
    after1, after2 = (jnp.roll(pace, -1, axis=-1) for pace in (pace1, pace2))
    left = (longer1 - along1) * pace1 + (longer2 - along2) * pace2
    right = -(longer1 + along1) * after1 - (longer2 + along2) * after2
    return at.q1 * root1 - turned * root2, turned * root2, left, right


def _normal_equations(residual, q2, left, right):
    """The squared chord, normalised, and gradient and Gauss-Newton matrix of half of it."""
    share = 1 / residual.shape[-1]
    both = lambda x, y: (x + jnp.roll(y, 1, axis=-1)) * share  # noqa: E731
    turned = generators(q2)  # how the residual changes as the rotation is turned back
    gradient, diagonal = both(dot(left, residual), dot(right, residual)), both(dot(left, left), dot(right, right))
    border = jnp.stack([both(dot(left, w), dot(right, w)) for w in turned])
    mean = lambda x: jnp.mean(x, axis=-1)  # noqa: E731
    corner = jnp.stack([jnp.stack([mean(dot(v, w)) for v in turned]) for w in turned])
    turning = jnp.stack([mean(dot(w, residual)) for w in turned])
    size2 = mean(dot(q2, q2))
    more = mean(dot(residual, residual + 2 * q2))  # |q1|^2 - |q2|^2
    size = jnp.sqrt(size2) + jnp.sqrt(size2 + more)
    chord = (mean(dot(residual, residual)) - (more / size) ** 2) / jnp.sqrt(size2 * (size2 + more))
    return chord, gradient, diagonal, dot(left, right) * share, border, corner, turning


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
