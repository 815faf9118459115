"""Refinement of an alignment on the continuous problem: Gauss-Newton steps over a path of both curves.

Both curves are traversed at once, `gamma1 = tau - u` and `gamma2 = tau + u` with `u` periodic and `|u'| <= 1`; the warp
is `gamma2(gamma1^-1)`. A path treats the curves alike, and either may stand still while the other moves.
With u linear between its knots, the residual `q1(gamma1) sqrt(gamma1') - R q2(gamma2) sqrt(gamma2')` of a piece depends
on two knots, so the Gauss-Newton matrix is cyclic tridiagonal, and one step costs O(knots). Its part in `u'`,
`(1 / (1 - u'^2) + <q1, R q2> / sqrt(1 - u'^2)) / 2` for unit tangents, is a Fisher-Rao metric on warps: the steps are
Sobolev steps. The rotation follows by its closed form at every evaluation. Steps are accepted only when they improve.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from ._lanes import cumulative, dot, mean_rows, once
from ._rotation import best_rotation, covariance, rotate
from ._table import look_up, value_at

STEEPEST = 1 - 1e-3  # of u': neither curve ever stands quite still
_SHRINK = 0.15  # each curve keeps at least this share of its progress on a piece in one step
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-2, 1e-3, 1e3


class _State(NamedTuple):
    """Where a refinement stands: the path, its squared chord, and the normal equations there."""

    u: Float[Array, "k l"]
    chord: Float[Array, " l"]
    slope: Float[Array, "k l"]
    gradient: Float[Array, "k l"]
    diagonal: Float[Array, "k l"]
    beside: Float[Array, "k l"]


class _Products(NamedTuple):
    """Inner products at the quadrature nodes, nodes of a piece first: of `q1` and `R q2`, and of their derivatives."""

    q_q: Float[Array, "m k l"]
    dq_q: Float[Array, "m k l"]
    q_dq: Float[Array, "m k l"]
    dq_dq: Float[Array, "m k l"]
    square1: Float[Array, "m k l"]
    square2: Float[Array, "m k l"]
    apart: Float[Array, "m k l"]  # |q1 - R q2|^2


def refine(
    t1: Int[Array, "d t l"], t2: Int[Array, "d t l"], u: Float[Array, "k l"], steps: int, nodes: int
) -> tuple[Float[Array, "k l"], Float[Array, " l"]]:
    """The path after `steps` damped Gauss-Newton steps, each lane with its own damping, and its squared chord.

    The chord is `|q1(gamma1) sqrt(gamma1') - R q2(gamma2) sqrt(gamma2')|`, so the cosine is `1 - chord^2 / 2`; near 0 a
    difference is precise where a rounded cosine is not.
    `t1` and `t2` are packed tables of the curves' unit tangents at equal arc lengths.
    """

    def step(carry, _):
        old, damping = carry
        new = _state(t1, t2, _moved(old, damping), nodes)
        better = new.chord < old.chord
        kept = jax.tree.map(lambda x, y: jnp.where(better.reshape((1,) * (x.ndim - 1) + (-1,)), x, y), new, old)
        lower, higher = jnp.maximum(damping * 0.3, _LEAST_DAMPING), jnp.minimum(damping * 8, _MOST_DAMPING)
        return (kept, jnp.where(better, lower, higher)), None

    first = _state(t1, t2, u, nodes)
    damping = jnp.full_like(first.chord, _FIRST_DAMPING)
    (last, _), _ = lax.scan(step, (first, damping), None, length=steps)
    return last.u, last.chord


def rotation_of(
    t1: Int[Array, "d t l"], t2: Int[Array, "d t l"], u: Float[Array, "k l"], nodes: int
) -> Float[Array, "d d l"]:
    """The best rotation for a path."""
    slope, x1, x2 = _places(u, nodes)
    return best_rotation(_covariance(once(value_at, x1, t1), once(value_at, x2, t2), slope))


def _state(t1: Int[Array, "d t l"], t2: Int[Array, "d t l"], u: Float[Array, "k l"], nodes: int) -> _State:
    slope, x1, x2 = _places(u, nodes)
    q1, dq1 = once(look_up, x1, t1)
    q2, dq2 = once(look_up, x2, t2)
    rotation = best_rotation(_covariance(q1, q2, slope))
    products = once(_products, q1, dq1, q2, dq2, rotation)
    split = _Products(*(x.reshape(nodes, *u.shape) for x in products))
    return _State(u, _chord(split, slope), slope, *_normal_equations(split, slope))


def _chord(at: _Products, p: Float[Array, "k l"]) -> Float[Array, " l"]:
    """`(sqrt(1 - p) - sqrt(1 + p))^2 + sqrt(1 - p^2) |q1 - R q2|^2`, integrated."""
    s = jnp.sqrt(1 - p * p)
    return mean_rows(2 * p * p / (1 + s) + s * (reduce(add, at.apart) / len(at.apart)))


def _places(u: Float[Array, "k l"], nodes: int) -> tuple[Float[Array, "k l"], Float[Array, "n l"], Float[Array, "n l"]]:
    """Slope of each piece, and where both curves are at the nodes: the first nodes of all pieces, then the second."""
    knots = u.shape[0]
    rise = jnp.roll(u, -1, axis=0) - u
    at = jnp.concatenate([u + share * rise for share in _shares(nodes)])
    time = (np.arange(knots)[None] + np.array(_shares(nodes))[:, None]) / knots
    time = jnp.asarray(time.reshape(-1, 1), u.dtype)
    return jnp.clip(rise * knots, -STEEPEST, STEEPEST), time - at, time + at


def _shares(nodes: int) -> list[float]:
    return [(i + 0.5) / nodes for i in range(nodes)]


def _covariance(q1: Float[Array, "d n l"], q2: Float[Array, "d n l"], slope: Float[Array, "k l"]):
    weight = jnp.sqrt(1 - slope * slope)
    return covariance(q1, q2 * jnp.concatenate([weight] * (q1.shape[1] // slope.shape[0]))[None])


def _products(q1, dq1, q2, dq2, rotation) -> tuple[Float[Array, "n l"], ...]:
    q2, dq2 = rotate(rotation[:, :, None], q2), rotate(rotation[:, :, None], dq2)
    apart = q1 - q2
    return dot(q1, q2), dot(dq1, q2), dot(q1, dq2), dot(dq1, dq2), dot(dq1, dq1), dot(dq2, dq2), dot(apart, apart)


def _normal_equations(at: _Products, p: Float[Array, "k l"]) -> tuple[Float[Array, "k l"], ...]:
    """Gradient of the cosine, and diagonal and off-diagonal of the Gauss-Newton matrix, in the knots' u.

    Tangents are unit, so `<q, q'> = 0`, which the formulas use.
    """
    nodes, knots, _ = at.q_q.shape
    s = jnp.sqrt(1 - p * p)
    left = right = left_left = right_right = left_right = jnp.zeros_like(p)
    for i, share in enumerate(_shares(nodes)):
        rest = 1 - share
        along_u = (at.q_dq[i] - at.dq_q[i]) * s
        along_p = -knots * at.q_q[i] * p / s
        u_u = at.square1[i] * (1 - p) + at.square2[i] * (1 + p) + 2 * s * at.dq_dq[i]
        u_p = knots / 2 * (at.dq_q[i] * (1 - p) + at.q_dq[i] * (1 + p)) / s
        p_p = knots * knots / 2 * (1 / s + at.q_q[i]) / s
        left, right = left + along_u * rest - along_p, right + along_u * share + along_p
        left_left = left_left + u_u * rest * rest - 2 * u_p * rest + p_p
        right_right = right_right + u_u * share * share + 2 * u_p * share + p_p
        left_right = left_right + u_u * share * rest + u_p * (rest - share) - p_p
    weight = 1 / (knots * nodes)
    gradient, diagonal = left + jnp.roll(right, 1, axis=0), left_left + jnp.roll(right_right, 1, axis=0)
    return gradient * weight, diagonal * weight, left_right * weight


def _moved(here: _State, damping: Float[Array, " l"]) -> Float[Array, "k l"]:
    """The path after one damped step, both curves still moving forwards."""
    knots, p = here.u.shape[0], here.slope
    change = solve_cyclic(here.diagonal * (1 + damping[None]) + 1e-6 * knots, here.beside, here.gradient)
    keep = 1 - _SHRINK
    slope = p + knots * (jnp.roll(change, -1, axis=0) - change)
    slope = jnp.clip(slope, p - keep * (1 + p), p + keep * (1 - p))
    slope = jnp.clip(slope, -STEEPEST, STEEPEST)
    room = 1 - slope * slope
    slope = slope - mean_rows(slope)[None] * room / mean_rows(room)[None]
    moved = cumulative(slope) / knots
    return moved + mean_rows(here.u + change - moved)[None]


def solve_cyclic(
    diagonal: Float[Array, "n l"], beside: Float[Array, "n l"], right: Float[Array, "n l"]
) -> Float[Array, "n l"]:
    """Solve a symmetric positive definite cyclic tridiagonal system; `beside[k]` couples k and k+1, the last wraps.

    The Thomas algorithm along the first axis, with the corner entries by the Sherman-Morrison formula.
    """
    corner, pivot = beside[-1], -diagonal[0]
    diagonal = diagonal.at[0].add(-pivot).at[-1].add(-corner * corner / pivot)
    above = beside.at[-1].set(0)
    below = jnp.roll(above, 1, axis=0)
    border = jnp.zeros_like(right).at[0].set(pivot).at[-1].set(corner)
    sides = jnp.stack([right, border], axis=1)

    def down(carry, row):
        ratio, value = carry
        middle, lower, upper, side = row
        inverse = 1 / (middle - lower * ratio)
        state = (upper * inverse, (side - lower[None] * value) * inverse[None])
        return state, state

    def up(after, row):
        ratio, value = row
        solved = value - ratio[None] * after
        return solved, solved

    zero = (jnp.zeros_like(corner), jnp.zeros_like(sides[0]))
    _, rows = lax.scan(down, zero, (diagonal, below, above, sides))
    solved = lax.scan(up, zero[1], rows, reverse=True)[1]
    x, z = solved[:, 0], solved[:, 1]
    factor = (x[0] + corner * x[-1] / pivot) / (1 + z[0] + corner * z[-1] / pivot)
    return x - factor[None] * z
