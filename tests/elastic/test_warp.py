"""Warps and paths of the circle: evaluation, from one to the other and back, group action."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, paths, warps
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import _warp as warping

N, KNOTS, LANES = 24, 32, 3
evaluate, interpolate, from_path, act = (
    jax.jit(f) for f in (warping.evaluate, warping.interpolate, warping.from_path, warping.act)
)
to_path = jax.jit(warping.to_path, static_argnames="knots")
resampled = jax.jit(warping.resampled, static_argnames="knots")


def lifted(x, nodes, values):
    """The lift through `(nodes, values)` of one lane, by numpy."""
    turns = np.floor(x - nodes[0])
    return np.interp(x - turns, nodes, values) + turns


def evaluated(gamma, x):
    return lifted(x, np.linspace(0, 1, len(gamma)), gamma)


def each_lane(function, *arrays):
    return np.stack([function(*(np.asarray(a, float)[:, k] for a in arrays)) for k in range(LANES)], axis=1)


def identity(n=N):
    return np.broadcast_to(np.arange(n + 1)[:, None] / n, (n + 1, LANES))


def anywhere(seed=0):
    return np.random.default_rng(seed).uniform(-3, 3, size=(50, LANES))


def test_a_warp_is_evaluated_at_any_real():
    gamma, x = warps(0, LANES, N), anywhere()
    np.testing.assert_allclose(evaluate(jnp.asarray(gamma), jnp.asarray(x)), each_lane(evaluated, gamma, x), atol=2e-6)


@pytest.mark.parametrize("n", [7, 16, 24, 50], ids=lambda n: f"{n} pieces")
def test_the_lift_through_nodes_is_evaluated_at_any_real(n):
    """With fewer pieces than one fused loop takes, as many, and more."""
    nodes, values, x = warps(1, LANES, n), warps(2, LANES, n), anywhere()
    found = interpolate(*(jnp.asarray(a) for a in (x, nodes, values)))
    np.testing.assert_allclose(found, each_lane(lifted, x, nodes, values), atol=1e-5)


def test_a_lift_with_a_jump_stays_finite():
    """Two nodes at one place: the values on either side are kept, and nothing is NaN."""
    nodes = identity().copy()
    nodes[5] = nodes[6]
    values = warps(3, LANES, N)
    x = (np.arange(N)[:, None] + 0.5) / N + np.zeros(LANES)
    found = np.asarray(interpolate(*(jnp.asarray(a) for a in (x, nodes, values))))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[:4], each_lane(evaluated, values, x)[:4], atol=1e-5)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 100_000), st.floats(0, 1))
def test_both_curves_of_a_path_are_joined_by_the_warp(seed, rough):
    """`gamma(tau - u) = tau + u` at every knot, and u is steep in neither direction: `|u'| < 1`."""
    gamma = warps(seed, LANES, N, rough)
    u = np.asarray(to_path(jnp.asarray(gamma), knots=KNOTS), float)
    time = np.arange(KNOTS)[:, None] / KNOTS
    np.testing.assert_allclose(each_lane(evaluated, gamma, time - u), time + u, atol=3e-5)
    assert (np.abs(np.roll(u, -1, axis=0) - u) * KNOTS < 1 + 1e-4).all()


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 100_000), st.floats(0.01, 0.95))
def test_the_warp_of_a_path_joins_both_curves_and_increases(seed, steep):
    u = paths(seed, LANES, KNOTS, steep)
    x = identity()
    gamma = np.asarray(from_path(jnp.asarray(u), jnp.asarray(x)), float)
    time = np.arange(KNOTS + 1)[:, None] / KNOTS
    closed = np.concatenate([u, u[:1]])
    np.testing.assert_allclose(gamma, each_lane(lifted, x, time - closed, time + closed), atol=2e-5)
    np.testing.assert_allclose(gamma[-1], gamma[0] + 1, atol=1e-6)
    assert np.diff(gamma, axis=0).min() > 0


def test_a_path_read_from_the_other_curve_is_the_inverse_warp():
    u, x = jnp.asarray(paths(4, LANES, KNOTS)), jnp.asarray(identity())
    np.testing.assert_allclose(from_path(-u, from_path(u, x)), x, atol=1e-5)


def test_a_curve_that_stands_still_leaves_the_warp_monotone():
    """`u' = 1` on a quarter of the path, -1 on another: curve1 stands still there, then curve2."""
    slope = np.repeat([1.0, 0.0, -1.0, 0.0], KNOTS // 4)[:, None] * np.ones(LANES)
    u = np.concatenate([np.zeros((1, LANES)), np.cumsum(slope, axis=0)[:-1]]) / KNOTS
    gamma = np.asarray(from_path(jnp.asarray(u), jnp.asarray(identity(100))), float)
    assert np.isfinite(gamma).all()
    assert np.diff(gamma, axis=0).min() > -1e-6
    np.testing.assert_allclose(gamma[-1], gamma[0] + 1, atol=1e-6)
    assert np.diff(gamma, axis=0).max() > 0.4  # the skipped half of curve2 falls into one interval


def test_a_warp_survives_the_way_through_its_path():
    """A smooth one, to second order in the distance of the knots."""
    x = identity(96)
    gamma = x + 0.1 * np.sin(2 * np.pi * x) + np.array([0.3, -0.2, 0.7])
    error = []
    for knots in (KNOTS, 2 * KNOTS):
        u = to_path(jnp.asarray(gamma), knots=knots)
        error.append(np.abs(np.asarray(from_path(u, jnp.asarray(x))) - gamma).max())
    assert error[0] < 4e-3
    assert error[1] < 0.4 * error[0]


@pytest.mark.parametrize("knots", [16, 31, 32, 64, 100])
def test_paths_are_resampled_linearly(knots):
    u = paths(5, LANES, KNOTS)
    expected = each_lane(lambda v: np.interp(np.arange(knots) / knots, np.arange(KNOTS + 1) / KNOTS, [*v, v[0]]), u)
    np.testing.assert_allclose(resampled(jnp.asarray(u), knots=knots), expected, atol=1e-6)


def test_the_identity_acts_as_such():
    q = jnp.asarray(fourier(0, LANES, n=N).transpose(1, 2, 0))
    np.testing.assert_allclose(act(q, jnp.asarray(identity())), q, atol=1e-5)


@pytest.mark.parametrize("shift", [-5, 7])
def test_a_turn_acts_as_a_cyclic_shift(shift):
    q = fourier(0, LANES, n=N).transpose(1, 2, 0)
    found = act(jnp.asarray(q), jnp.asarray(identity() + shift / N))
    np.testing.assert_allclose(found, np.roll(q, -shift, axis=1), atol=1e-5)


def test_the_action_keeps_the_norm():
    """`mean |q(gamma)|^2 gamma' = mean |q|^2`: the warps are isometries, here to the order of the quadrature."""
    n = 400
    q = fourier(2, LANES, n=n).transpose(1, 2, 0)
    x = identity(n)
    gamma = x + 0.1 * np.sin(2 * np.pi * x) / 2 / np.pi * np.arange(1, LANES + 1) + 0.2
    moved = np.asarray(act(jnp.asarray(q), jnp.asarray(gamma)))
    np.testing.assert_allclose(np.sum(moved**2, axis=(0, 1)), np.sum(q**2, axis=(0, 1)), rtol=1e-3)
