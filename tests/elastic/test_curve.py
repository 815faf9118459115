"""Length, centre and resampling, against closed forms and plain sums of waves."""

import logging
import warnings

import jax
import numpy as np
import pytest
from elastic.shapes import ellipse, fourier, moved, spectral, warps, x64
from scipy.special import ellipe

from curvematch_jax.elastic import _curve as curves
from curvematch_jax.elastic import centre, length, resample, to_curve, to_srvf
from curvematch_jax.elastic._distinct import distinct, original_parameter


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
    with pytest.raises(ValueError, match="n = 1000000000"):
        resample(ellipse(20), 10**9)


def repeats(curve):
    """The curve with repeated samples, in several ways."""
    n = curve.shape[-1]
    yield "twice", np.repeat(curve, 2, axis=-1)
    yield "runs", np.repeat(curve, 1 + 3 * (np.arange(n) % 7 == 2), axis=-1)
    yield "end", np.concatenate([curve, curve[..., :1], curve[..., :1]], axis=-1)
    yield "start", np.concatenate([curve[..., :1], curve[..., :1], curve], axis=-1)
    yield (
        "noise",
        np.repeat(curve, 2, axis=-1) + 1e-9 * np.random.default_rng(0).normal(size=(*curve.shape[:-1], 2 * n)),
    )


@pytest.mark.usefixtures("float32")
@pytest.mark.parametrize("n", [40, 41])
@pytest.mark.parametrize("name", ["twice", "runs", "end", "start", "noise"])
def test_repeated_samples_change_nothing(name, n):
    curve = fourier(4, 2, n=n, modes=5, bend=0.1)
    other = dict(repeats(curve))[name]
    kept = other.copy()
    np.testing.assert_allclose(length(other), length(curve), rtol=2e-3)
    np.testing.assert_allclose(resample(other, 100), resample(curve, 100), atol=1e-6)
    for one, alone in zip(centre(other), curve, strict=True):
        expected = alone - alone.mean(axis=-1, keepdims=True)
        assert np.abs(np.asarray(one)[:, :, None] - expected[:, None]).max(axis=0).min(axis=1).max() < 1e-6
    np.testing.assert_array_equal(other, kept)


@pytest.mark.parametrize("name", ["twice", "runs", "end", "start"])
def test_a_curve_is_read_without_its_repeats_where_a_warp_of_it_says(name):
    """Carried to the given curve, and read there, a warp is at the same points."""
    curve, gamma = fourier(4, n=40, bend=0.1), warps(5, 3, 60).T
    given = dict(repeats(curve))[name][None]
    places = distinct(given)[1][0]
    on_given = original_parameter(gamma, dict.fromkeys(range(3), places))
    with x64():
        found, back = curves.unrepeated(jax.numpy.asarray(given), jax.numpy.asarray(on_given))
        assert found.shape == (3, *given.shape[1:])
        np.testing.assert_allclose(back, gamma, atol=1e-9)
        for one, warp in zip(found, back, strict=True):
            at = spectral(np.asarray(one), np.asarray(warp))
            np.testing.assert_allclose(at, spectral(curve, np.asarray(warp)), atol=1e-9)
        smooth, same = jax.numpy.asarray(curve), jax.numpy.asarray(gamma)
        assert curves.unrepeated(smooth, same)[0] is smooth
    traced = jax.jit(lambda c, w: curves.unrepeated(c, w))(given, gamma)
    np.testing.assert_allclose(traced[0], given, atol=1e-6)


@pytest.mark.parametrize(("m", "n", "d"), [(8, 40, 2), (41, 9, 3), (60, 60, 4)])
def test_concrete_and_traced_arrays_get_one_result(m, n, d):
    curve = fourier(m, 5, n=m, d=d, modes=3).astype(np.float32)
    traced = jax.jit(lambda c: (length(c), centre(c), resample(c, n), to_srvf(c)))(curve)
    concrete = length(curve), centre(curve), resample(curve, n), to_srvf(curve)
    for one, other, accuracy in zip(traced, concrete, (2e-6, 1e-6, 1e-4, 1e-4), strict=True):
        np.testing.assert_allclose(one, other, atol=accuracy)


@pytest.mark.parametrize("size", [1e-30, 1e-20, 1e19, 1e25, 1e36])
@pytest.mark.parametrize("transform", [lambda f: f, jax.jit], ids=["concrete", "traced"])
def test_results_keep_the_curves_units_at_every_size(size, transform):
    curve = fourier(8, 2, n=30).astype(np.float32)
    large = curve * np.float32(size)
    np.testing.assert_allclose(transform(length)(large) / np.float32(size), length(curve), rtol=1e-5)
    for function in (centre, lambda c: resample(c, 20)):
        np.testing.assert_allclose(transform(function)(large) / np.float32(size), function(curve), atol=1e-4)


@pytest.mark.usefixtures("float32")
def test_position_is_kept_or_taken_away_in_the_precision_that_came():
    far = np.array([[5e5], [4.6e6], [300.0]])
    curve = fourier(9, 2, n=30) * 3
    np.testing.assert_allclose(length(curve + far), length(curve), rtol=1e-6)
    np.testing.assert_allclose(centre(curve + far), centre(curve), atol=1e-6)
    with pytest.raises(ValueError, match=r"^curve is so far from the origin that float32 .* centre\(curve\)"):
        resample(curve + far, 30)
    found = np.asarray(resample(curve * 1e5 + far, 30))
    np.testing.assert_allclose(found - far, resample(curve * 1e5, 30), atol=0.3)
    with x64():
        np.testing.assert_allclose(resample(curve + far, 30), np.asarray(resample(curve, 30)) + far, atol=1e-8)


def test_derivatives_are_finite_and_right():
    with x64():
        curve, direction = (jax.numpy.asarray(fourier(s, n=20)) for s in (10, 11))
        for function in (length, lambda c: (resample(c, 15) ** 2).sum(), lambda c: (centre(c) ** 3).sum()):
            slope = jax.jit(lambda c, v, f=function: jax.jvp(f, (c,), (v,))[1])(curve, direction)
            difference = (function(curve + 1e-6 * direction) - function(curve - 1e-6 * direction)) / 2e-6
            np.testing.assert_allclose(slope, difference, rtol=1e-4)
        doubled = jax.numpy.repeat(curve, 2, axis=-1)
        assert np.isfinite(jax.jit(jax.grad(length))(doubled)).all()


def test_a_new_number_of_samples_compiles_nothing():
    """Nothing at all: 40 outlines of 40 lengths compiled for a second each, and kept 60 MB."""
    outlines = [fourier(m, n=m, d=2) for m in range(50, 90)]
    with jax.log_compiles(), warnings.catch_warnings(record=True):
        compiled = []
        handler = logging.Handler()
        handler.emit = lambda record: compiled.append(record.getMessage())
        logger = logging.getLogger("jax")
        logger.addHandler(handler)
        try:
            for k, outline in enumerate(outlines):
                found = resample(outline, 60 + k)
                length(outline), centre(outline), to_srvf(outline), to_curve(found)
        finally:
            logger.removeHandler(handler)
    assert compiled == []


def test_many_samples_need_little_memory():
    found = resample(ellipse(6000), 5000)
    np.testing.assert_allclose((found[0] / 2) ** 2 + found[1] ** 2, 1, atol=1e-5)


def test_a_batch_is_its_curves():
    batch = fourier(12, 6, n=30).reshape(2, 3, 3, 30).astype(np.float32)
    for function in (length, centre, lambda c: resample(c, 20)):
        assert isinstance(function(batch), jax.Array)
        assert isinstance(function(batch[0, 0]), jax.Array)
        np.testing.assert_allclose(function(batch)[1, 2], function(batch[1, 2]), atol=1e-6)
        assert function(batch[:0]).shape[:2] == (0, 3)


def test_periodic_interpolation_is_exact_at_nodes_and_linear_between():
    table = jax.numpy.asarray(fourier(1, n=10), np.float32)
    x = jax.numpy.asarray([0.0, 0.3, 0.95, -0.05, 1.35], np.float32)
    left = np.asarray(table)[:, [0, 3, 9, 9, 3]]
    right = np.asarray(table)[:, [1, 4, 0, 0, 4]]
    weight = np.array([0, 0, 0.5, 0.5, 0.5])
    np.testing.assert_allclose(curves.interpolate(table, x), left + (right - left) * weight, atol=1e-5)
