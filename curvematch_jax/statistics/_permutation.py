"""Tests whether groups of shapes differ, from one matrix of distances, with exact p-values by permutation.

Under the hypothesis that the groups are from one distribution, all orders of the labels are equally likely: with N
random ones, `p = (1 + #{T_k >= T}) / (1 + N)` is exact for every N (Phipson and Smyth 2010)."""

from __future__ import annotations

import functools as ft
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._check import as_distances, as_groups_of, as_whole

_AT_ONCE = 256  # permutations
_TIE = 1e-5  # relative: statistics that differ by rounding count as equal


class PermutationTest(NamedTuple):
    """Attributes: the statistic, the p-value, and the statistics `(N,)` of the permuted labels."""

    statistic: float
    p: float
    permuted: np.ndarray


def energy_test(
    distances: ArrayLike, labels: Sequence | np.ndarray, permutations: int = 9999, seed: int = 0
) -> PermutationTest:
    """Do groups differ? By the energy distance of all pairs of groups (Szekely and Rizzo 2013; Rizzo and Szekely 2010).

    `T = sum_{a<b} n_a n_b / (2 n) (2 D_ab - D_aa - D_bb)`, with D_ab the mean distance of members of a and b, in units
    of the mean of the matrix.

    Args:
        distances: `(k, k)`, symmetric.
        labels: `(k,)`, two groups or more, of two members or more each.
        permutations: of the labels.
        seed: of the permutations.

    Raises:
        ValueError: for another matrix or labels that do not fit it.
    """
    matrix, groups = _checked(distances, labels)
    return _tested(_energy, (matrix,), groups, permutations, seed)


def variance_test(
    distances: ArrayLike, labels: Sequence | np.ndarray, permutations: int = 9999, seed: int = 0
) -> PermutationTest:
    """Do groups differ in mean or in spread? By the Frechet variances of Dubey and Mueller (Biometrika 2019).

    `T = n F^2 / sum_a l_a^2 s_a^2 + n U / sum_a l_a / s_a^2`, with `F = V - sum_a l_a V_a`, `U = sum_{a<b} l_a l_b (V_a
    - V_b)^2 / (s_a^2 s_b^2)`, `l_a` the groups' shares, `V_a` their variances about their medoids, which stand for the
    means, V that of all, and `s_a^2` the variances of the squared distances to the medoids.

    Arguments and errors as `energy_test`.
    """
    matrix, groups = _checked(distances, labels)
    return _tested(_frechet, (matrix**2, matrix**4), groups, permutations, seed)


def _checked(distances: ArrayLike, labels: Sequence | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    matrix = as_distances("distances", distances)
    if len(matrix) < 4:
        raise ValueError(f"distances has shape {matrix.shape}: give a matrix (k, k) of 4 shapes or more.")
    return matrix, as_groups_of(labels, len(matrix))


def _tested(statistic: Callable, matrices: tuple, groups: np.ndarray, permutations: int, seed: int) -> PermutationTest:
    permutations, seed = as_whole("permutations", permutations, 1), as_whole("seed", seed, 0)
    count, members = int(groups.max()) + 1, np.bincount(groups)
    scaled = tuple(jnp.asarray(m, jnp.float32) for m in matrices)
    shares = jnp.asarray(members, jnp.float32)
    random = np.random.default_rng(seed)
    found = []
    for start in range(-1, permutations, _AT_ONCE):  # the first order is the given one
        orders = random.permuted(np.tile(groups, (_AT_ONCE, 1)), axis=1)
        if start < 0:
            orders[0] = groups
        found.append(np.asarray(_statistics(statistic, count, scaled, shares, jnp.asarray(orders, jnp.int32))))
    values = np.concatenate(found)[: permutations + 1].astype(float)
    own, others = values[0], values[1:]
    return PermutationTest(float(own), p_value(own, others), others)


def p_value(own: float, others: np.ndarray) -> float:
    """`(1 + #{T_k >= T}) / (1 + N)`; what differs by rounding is equal."""
    return float((1 + np.sum(others >= own - _TIE * abs(own))) / (1 + len(others)))


@ft.partial(jax.jit, static_argnums=(0, 1))
def _statistics(statistic: Callable, count: int, matrices: tuple, members: Float[Array, " g"], orders):
    """The statistic for each order `(p, k)` of the labels."""
    marks = jax.nn.one_hot(orders, count, dtype=jnp.float32)  # (p, k, g)
    product = lambda m: jnp.einsum("ij,pjg->pig", m, marks, precision="highest")  # noqa: E731
    return statistic(marks, members, *(product(m) for m in matrices))


def _energy(marks, members, sums):
    """From the sums of distances of each shape to each group, `(p, k, g)`."""
    means = jnp.einsum("pig,pih->pgh", marks, sums, precision="highest") / (members[:, None] * members[None])[None]
    own = jnp.diagonal(means, axis1=1, axis2=2)
    gap = 2 * means - own[:, :, None] - own[:, None, :]
    weight = (members[:, None] * members[None]) / (4 * jnp.sum(members))
    return jnp.sum(gap * weight[None], axis=(1, 2))


def _frechet(marks, members, squares, fourths):
    """From the sums of squared and fourth powers of distances of each shape to each group."""
    share = (members / jnp.sum(members))[None]
    within = jnp.where(marks > 0, squares, jnp.inf)
    medoid = jnp.argmin(within, axis=1)  # (p, g)
    take = lambda sums: jnp.take_along_axis(sums, medoid[:, None], axis=1)[:, 0] / members[None]  # noqa: E731
    variance, fourth = take(squares), take(fourths)
    spread = jnp.maximum(fourth - variance**2, 1e-6)
    whole = jnp.min(jnp.sum(squares, axis=2), axis=1) / jnp.sum(members)
    apart = (variance[:, :, None] - variance[:, None]) ** 2 / (spread[:, :, None] * spread[:, None])
    u = jnp.sum(apart * (share[:, :, None] * share[:, None]), axis=(1, 2)) / 2
    f = whole - jnp.sum(share * variance, axis=1)
    n = jnp.sum(members)
    return n * u / jnp.sum(share / spread, axis=1) + n * f * f / jnp.sum(share**2 * spread, axis=1)
