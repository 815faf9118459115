"""Length, centre, resampling, and the tables of a curve, against closed forms and plain sums of waves."""

import jax
import numpy as np
import pytest
from elastic.shapes import ellipse, fourier, moved, spectral
from scipy.special import ellipe

from curvematch_jax.elastic import _curve as curves
from curvematch_jax.elastic import centre, length, resample


@pytest.mark.parametrize(("n", "relative"), [(16, 2e-5), (64, 1e-6), (400, 1e-6)])
def test_length_of_an_ellipse(n, relative):
    np.testing.assert_allclose(length(ellipse(n).astype(np.float32)), 8 * ellipe(0.75), rtol=relative)


def test_length_takes_batches_and_keeps_its_units():
    curve = fourier(0, 6, n=40).reshape(2, 3, 3, 40)
    found = length(curve)
    assert found.shape == (2, 3)
    np.testing.assert_allclose(length(moved(curve, 1, scale=7.0)), 7 * found, rtol=1e-5)


def test_centre_moves_the_mean_to_the_origin():
    found = centre(jax.numpy.asarray(fourier(0, 2, n=30, d=4) + 3))
    np.testing.assert_allclose(np.mean(found, axis=-1), 0, atol=1e-6)
    np.testing.assert_allclose(np.diff(found), np.diff(fourier(0, 2, n=30, d=4)), atol=1e-6)


@pytest.mark.parametrize("n", [15, 16, 101])
@pytest.mark.parametrize("d", [2, 4])
def test_velocity_is_the_derivative_of_the_interpolant(n, d):
    curve = fourier(3, n=n, d=d)
    x = np.arange(2 * n) / (2 * n)
    found = curves.velocity(jax.numpy.asarray(curve), 2 * n)
    np.testing.assert_allclose(found, spectral(curve, x, order=1), atol=2e-4 * n / 15)


def test_norm_has_derivative_zero_where_the_field_vanishes():
    gradient = jax.grad(lambda q: curves.norm(q).sum())(jax.numpy.zeros((3, 4)))
    np.testing.assert_array_equal(gradient, 0)


@pytest.mark.parametrize("m", [60, 61])
@pytest.mark.parametrize("n", [8, 50, 200])
def test_resampled_points_lie_on_the_curve_at_equal_arc_lengths(m, n):
    curve = ellipse(m)
    found = np.asarray(resample(curve, n))
    assert found.shape == (3, n)
    np.testing.assert_allclose(found[:, 0], curve[:, 0], atol=1e-5)
    np.testing.assert_allclose((found[0] / 2) ** 2 + found[1] ** 2, 1, atol=2e-5)
    angle = np.unwrap(np.arctan2(found[1], found[0] / 2))
    fine = np.linspace(0, 2 * np.pi, 20001)
    speed = np.hypot(2 * np.sin(fine), np.cos(fine))
    arc = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    np.testing.assert_allclose(np.interp(angle, fine, arc / arc[-1]), np.arange(n) / n, atol=2e-4)


def test_resampling_goes_round_once_and_has_equal_steps():
    found = np.asarray(resample(fourier(5, 3, n=80, bend=0.1), 80))
    steps = np.linalg.norm(np.roll(found, -1, axis=-1) - found, axis=-2)
    assert (steps.max(axis=-1) / steps.min(axis=-1)).max() < 1.2


def test_resampling_needs_three_samples():
    with pytest.raises(ValueError, match="n = 2"):
        resample(ellipse(20), 2)


@pytest.mark.parametrize("fineness", [1, 2, 3, 8])
def test_representative_follows_the_curve(fineness):
    """With fewer arcs than samples of the speed, with more, and with a number that does not divide them."""
    n, grid = 50, 64
    curve = fourier(7, n=n)
    found = jax.tree.map(lambda x: np.asarray(x[0]), curves.represent(jax.numpy.asarray(curve)[None], grid, fineness))
    fine = np.arange(20001) / 20000
    speed = np.linalg.norm(spectral(curve, fine, order=1), axis=0)
    arc = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    arc /= arc[-1]
    m = fineness * n
    np.testing.assert_allclose(found.arcs, np.interp(np.arange(m + 1) / m, fine, arc), atol=6e-4)
    assert np.diff(found.arcs).min() > 0
    np.testing.assert_allclose(found.arcs[[0, -1]], [0, 1], atol=1e-6)
    time = np.interp(np.arange(grid + 1) / grid, arc, fine)
    np.testing.assert_allclose(found.times, time, atol=5e-4)
    np.testing.assert_allclose(np.linalg.norm(found.tangents, axis=0), 1, atol=1e-5)
    direction = spectral(curve, time[:-1], order=1)
    direction = direction / np.linalg.norm(direction, axis=0)
    np.testing.assert_allclose(found.tangents, direction, atol=0.02)


def test_periodic_interpolation_is_exact_at_nodes_and_linear_between():
    table = jax.numpy.asarray(fourier(1, n=10), np.float32)
    x = jax.numpy.asarray([0.0, 0.3, 0.95, -0.05, 1.35], np.float32)
    left = np.asarray(table)[:, [0, 3, 9, 9, 3]]
    right = np.asarray(table)[:, [1, 4, 0, 0, 4]]
    weight = np.array([0, 0, 0.5, 0.5, 0.5])
    np.testing.assert_allclose(curves.interpolate(table, x), left + (right - left) * weight, atol=1e-5)
