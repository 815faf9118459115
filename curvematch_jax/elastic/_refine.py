"""Refinement of a warp on the continuous problem, by Gauss-Newton steps over its samples and the rotation.

With `gamma` linear between its samples `g_k`, the residual `q1 - R q2(gamma) sqrt(gamma')` of an interval depends on
`g_k` and `g_{k+1}` alone, so the Gauss-Newton matrix is cyclic tridiagonal, and one step costs O(n). Its part in
`gamma'`, `|q2|^2 / 4 gamma'`, is the Fisher-Rao metric on warps: the steps are Sobolev steps, and do not depend on n.
The rotation follows by its closed form at every evaluation. Steps are accepted only when they improve the match.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ._lanes import dot, frobenius, mean_rows, once
from ._rotation import best_rotation, covariance, rotate
from ._warp import from_increments

LEAST_SLOPE = 1e-4
_SHRINK = 0.15  # an interval keeps at least this share of its length in one step
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-2, 1e-3, 1e3


class Match(NamedTuple):
    """A warp with what it does to a pair: lanes last, `m` nodes to each of `n` intervals."""

    gamma: Float[Array, "n+1 l"]
    cosine: Float[Array, " l"]
    rotation: Float[Array, "d d l"]
    q2: Float[Array, "d n m l"]  # q2(gamma), without the factor sqrt(gamma')
    dq2: Float[Array, "d n m l"]  # derivative of q2 there
    root: Float[Array, "n l"]  # sqrt(gamma')


def match(q1: Float[Array, "d n m l"], table: Float[Array, "d t l"], gamma: Float[Array, "n+1 l"]) -> Match:
    """The cosine `integral <q1, R q2(gamma)> sqrt(gamma')` with the best R, for q2 tabulated at `k/t`.

    `q1` is given at the midpoints of `m` equal pieces of each interval.
    """
    d, n, m, lanes = q1.shape
    steps = jnp.diff(gamma, axis=0)
    x = gamma[:-1, None] + _pieces(m, gamma.dtype)[0] * steps[:, None]
    q2, dq2 = once(_look_up, x.reshape(n * m, lanes), table)
    q2, dq2 = q2.reshape(q1.shape), dq2.reshape(q1.shape)
    root = jnp.sqrt(jnp.maximum(steps * n, LEAST_SLOPE))
    c = covariance(q1.reshape(d, n * m, lanes), (q2 * root[None, :, None]).reshape(d, n * m, lanes))
    rotation = best_rotation(c)
    return Match(gamma, frobenius(rotation, c), rotation, q2, dq2, root)


def distance(q1: Float[Array, "d n m l"], here: Match) -> Float[Array, " l"]:
    """Angle between `q1` and `R q2(gamma) sqrt(gamma')`, each scaled to unit norm on the nodes.

    Through the chord, `2 arcsin(|u - v| / 2)`: precise near 0, where the arc cosine of a rounded cosine is not.
    """
    q2 = rotate(here.rotation[:, :, None, None], here.q2) * here.root[None, :, None]
    size = lambda q: jnp.sqrt(mean_rows(dot(q, q).reshape(-1, q.shape[-1])))  # noqa: E731
    unit = lambda q: q / size(q)[None, None, None]  # noqa: E731
    chord = size(unit(q1) - unit(q2))
    return 2 * jnp.arcsin(jnp.minimum(chord / 2, 1))


class _State(NamedTuple):
    """Where a refinement stands: the warp, its cosine, and the normal equations there."""

    gamma: Float[Array, "n+1 l"]
    cosine: Float[Array, " l"]
    gradient: Float[Array, "n l"]
    diagonal: Float[Array, "n l"]
    beside: Float[Array, "n l"]


def refine(
    q1: Float[Array, "d n m l"], table: Float[Array, "d t l"], gamma: Float[Array, "n+1 l"], steps: int
) -> tuple[Float[Array, "nodes l"], Float[Array, " l"]]:
    """The warp after `steps` damped Gauss-Newton steps, each lane with its own damping, and its cosine."""

    def state(gamma) -> _State:
        here = match(q1, table, gamma)
        return _State(gamma, here.cosine, *_normal_equations(q1, here))

    def step(carry, _):
        old, damping = carry
        new = state(_moved(old, damping))
        better = new.cosine > old.cosine
        kept = jax.tree.map(lambda x, y: jnp.where(better.reshape((1,) * (x.ndim - 1) + (-1,)), x, y), new, old)
        lower, higher = jnp.maximum(damping * 0.3, _LEAST_DAMPING), jnp.minimum(damping * 8, _MOST_DAMPING)
        return (kept, jnp.where(better, lower, higher)), None

    first = state(gamma)
    damping = jnp.full_like(first.cosine, _FIRST_DAMPING)
    (last, _), _ = lax.scan(step, (first, damping), None, length=steps)
    return last.gamma, last.cosine


def _moved(here: _State, damping: Float[Array, " l"]) -> Float[Array, "nodes l"]:
    """The warp after one damped step, its intervals kept positive."""
    n = here.gradient.shape[0]
    diagonal = here.diagonal * (1 + damping[None]) + 1e-6 * n
    change = solve_cyclic(diagonal, here.beside, here.gradient)
    steps = jnp.diff(here.gamma, axis=0)
    longer = steps + jnp.roll(change, -1, axis=0) - change
    longer = jnp.maximum(jnp.maximum(longer, _SHRINK * steps), LEAST_SLOPE / n)
    moved = from_increments(here.gamma[0], longer)
    drift = mean_rows(here.gamma[:-1] + change - moved[:-1])
    return moved + drift[None]


def _normal_equations(q1: Float[Array, "d n m l"], here: Match) -> tuple[Float[Array, "n l"], ...]:
    """Gradient of the cosine, and diagonal and off-diagonal of the Gauss-Newton matrix, in the samples of the warp."""
    _, n, m, _ = q1.shape
    share, rest = _pieces(m, q1.dtype)
    root = here.root[:, None]
    target = rotate(jnp.swapaxes(here.rotation, 0, 1)[:, :, None, None], q1)
    stretch = n / (2 * root)
    total = lambda values: reduce(add, (values[:, i] for i in range(m))) / (n * m)  # noqa: E731
    dq_dq, q_dq = dot(here.dq2, here.dq2) * root * root, dot(here.q2, here.dq2) * (n / 2)
    q_q = dot(here.q2, here.q2) * stretch * stretch
    t_dq, t_q = dot(target, here.dq2) * root, dot(target, here.q2) * stretch
    left, right = total(t_dq * rest - t_q), total(t_dq * share + t_q)
    left_left = total(dq_dq * rest * rest - 2 * q_dq * rest + q_q)
    right_right = total(dq_dq * share * share + 2 * q_dq * share + q_q)
    left_right = total(dq_dq * share * rest + q_dq * (rest - share) - q_q)
    return left + jnp.roll(right, 1, axis=0), left_left + jnp.roll(right_right, 1, axis=0), left_right


def _pieces(m: int, dtype) -> tuple[Float[Array, "1 m 1"], Float[Array, "1 m 1"]]:
    """Midpoints of m equal pieces of an interval, as shares from its left and from its right end."""
    share = ((jnp.arange(m, dtype=dtype) + 0.5) / m)[None, :, None]
    return share, 1 - share


def _look_up(x: Float[Array, "k l"], table: Float[Array, "d t l"]):
    """Periodic linear interpolation along the middle axis, and its derivative."""
    size = table.shape[1]
    position = x * size
    floor = jnp.floor(position)
    index = floor.astype(jnp.int32) % size
    take = lambda at: jnp.stack([jnp.take_along_axis(row, at, axis=0, mode="promise_in_bounds") for row in table])  # noqa: E731
    left, right = take(index), take((index + 1) % size)
    rise = right - left
    return left + rise * (position - floor)[None], rise * size


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
