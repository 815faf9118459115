"""Warps of the circle: evaluation, inverse, group action."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, warps
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import _warp as warping

N = 24
invert = jax.jit(warping.invert)


def evaluated(gamma, x):
    """The lift of one warp `(n + 1,)`, by numpy."""
    turns = np.floor(x)
    return np.interp(x - turns, np.linspace(0, 1, len(gamma)), gamma) + turns


def test_a_warp_is_evaluated_at_any_real():
    gamma = warps(0, 3, N)
    x = np.random.default_rng(0).uniform(-3, 3, size=(50, 3))
    expected = np.stack([evaluated(gamma[:, k], x[:, k]) for k in range(3)], axis=1)
    np.testing.assert_allclose(warping.evaluate(jnp.asarray(gamma), jnp.asarray(x)), expected, atol=2e-6)


def test_the_lift_through_nodes_is_evaluated_at_any_real():
    nodes, values = warps(1, 3, N), warps(2, 3, N)
    x = np.random.default_rng(0).uniform(-3, 3, size=(50, 3))
    found = warping.interpolate_monotone(jnp.asarray(x), jnp.asarray(nodes), jnp.asarray(values))
    for lane in range(3):
        tiled_x = np.concatenate([nodes[:-1, lane] + turn for turn in range(-6, 7)])
        tiled_y = np.concatenate([values[:-1, lane] + turn for turn in range(-6, 7)])
        np.testing.assert_allclose(found[:, lane], np.interp(x[:, lane], tiled_x, tiled_y), atol=1e-5)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 100_000), st.floats(0, 1))
def test_the_inverse_undoes_a_warp(seed, rough):
    gamma = warps(seed, 2, N, rough)
    back = np.asarray(invert(jnp.asarray(gamma)), float)
    np.testing.assert_allclose(back[-1], back[0] + 1, atol=1e-5)
    assert (np.diff(back, axis=0) > 0).all()
    grid = np.arange(N + 1) / N
    for lane in range(2):
        np.testing.assert_allclose(evaluated(gamma[:, lane], back[:, lane]), grid, atol=2e-5)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 100_000), st.floats(1e-4, 0.3))
def test_slopes_are_kept_above_the_least(seed, least):
    generator = np.random.default_rng(seed)
    steps = generator.uniform(-0.2, 1, size=(N, 2))
    gamma = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]) / steps.sum(axis=0) + 0.3
    found = np.asarray(warping.strictly_increasing(jnp.asarray(gamma), least), float)
    np.testing.assert_allclose(found[0], gamma[0], atol=1e-6)
    np.testing.assert_allclose(found[-1], found[0] + 1, atol=1e-6)
    assert (np.diff(found, axis=0) > 0).all()
    shortened = np.maximum(np.diff(gamma, axis=0), least / N).sum(axis=0)
    assert (np.diff(found, axis=0) * N >= least / shortened - 1e-4).all()


def test_increments_are_scaled_to_one_turn():
    found = warping.from_increments(jnp.asarray([0.5, -1.0]), jnp.asarray([[1.0, 2.0], [3.0, 2.0]]))
    np.testing.assert_allclose(found, [[0.5, -1.0], [0.75, -0.5], [1.5, 0.0]], atol=1e-6)


def test_the_identity_acts_as_such():
    q = jnp.asarray(fourier(0, 3, n=N).transpose(1, 2, 0))
    np.testing.assert_allclose(warping.act(q, warping.nodes_like(jnp.zeros((N + 1, 3)))), q, atol=1e-5)


@pytest.mark.parametrize("shift", [-5, 7])
def test_a_turn_acts_as_a_cyclic_shift(shift):
    q = fourier(0, 3, n=N).transpose(1, 2, 0)
    gamma = warping.nodes_like(jnp.zeros((N + 1, 3))) + shift / N
    np.testing.assert_allclose(warping.act(jnp.asarray(q), gamma), np.roll(q, -shift, axis=1), atol=1e-5)


def test_the_action_keeps_the_norm():
    """`mean |q(gamma)|^2 gamma' = mean |q|^2`: the warps are isometries, here to the order of the quadrature."""
    n = 400
    q = fourier(2, 4, n=n).transpose(1, 2, 0)
    x = np.arange(n + 1)[:, None] / n
    gamma = x + 0.1 * np.sin(2 * np.pi * x) / 2 / np.pi * np.arange(1, 5) + 0.2
    moved = np.asarray(warping.act(jnp.asarray(q), jnp.asarray(gamma)))
    np.testing.assert_allclose(np.sum(moved**2, axis=(0, 1)), np.sum(q**2, axis=(0, 1)), rtol=1e-3)
