"""Repeated samples: the same curve without them, and warps carried back to where the samples were."""

import jax
import numpy as np
from elastic.shapes import ellipse, fourier, warps
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic._distinct import distinct, distinct_parameter, is_new, original_parameter


def repeated(curve, at, times):
    return np.insert(curve, [at] * times, curve[:, [at]], axis=1)


def test_curves_without_repetition_are_handed_back():
    curves = fourier(0, 3, n=30)
    found, places = distinct(curves)
    assert found is curves
    assert places == {}


def test_a_repeated_sample_leaves_the_curve_and_the_callers_array_as_they_were():
    smooth = ellipse(24)
    curves = np.stack([repeated(smooth, 5, 4), ellipse(28)])
    kept = curves.copy()
    found, places = distinct(curves)
    np.testing.assert_array_equal(curves, kept)
    np.testing.assert_array_equal(found[1], curves[1])
    np.testing.assert_allclose(found[0], ellipse(28), atol=1e-12)
    assert list(places) == [0]
    expected = np.concatenate([np.arange(6), [5] * 4, np.arange(6, 25)]) / 24
    np.testing.assert_allclose(places[0], expected, atol=1e-12)


def test_a_run_across_the_seam():
    smooth = ellipse(24)
    curve = np.concatenate([smooth[:, :1], smooth, smooth[:, :1]], axis=1)
    found, places = distinct(curve[None])
    gap = np.linalg.norm(np.roll(found[0], -1, axis=1) - found[0], axis=0)
    assert gap.min() > 0.5 * gap.max() * 0.5
    place = places[0]
    assert (np.diff(place) >= 0).all()
    np.testing.assert_allclose(place[-1], place[0] + 1)


def test_samples_keep_their_places_on_the_curve():
    """Where `places` says that a sample lies, the distinct curve passes through that sample."""
    n = 32
    curve = repeated(ellipse(n - 3), 7, 3)
    found, places = distinct(curve[None])
    spectrum = np.fft.rfft(found[0], axis=1) / n
    k = np.arange(spectrum.shape[1])
    weights = np.where((k == 0) | (k == n / 2), 1, 2)
    at = lambda x: np.real(np.sum(weights * spectrum * np.exp(2j * np.pi * k * x), axis=1))  # noqa: E731
    for sample, place in zip(curve.T, places[0][:-1], strict=True):
        np.testing.assert_allclose(at(place), sample, atol=1e-9)


def test_the_first_of_a_run_is_new_also_over_the_end():
    smooth = ellipse(8)
    for order, new in [
        ([0, 0, 1, 2, 3, 4, 5, 6, 7], [1, 0, 1, 1, 1, 1, 1, 1, 1]),
        ([0, 1, 2, 2, 2, 3, 4, 5, 6, 7, 7], [1, 1, 1, 0, 0, 1, 1, 1, 1, 1, 0]),
        ([0, 1, 2, 3, 4, 5, 6, 7, 0], [1, 1, 1, 1, 1, 1, 1, 1, 0]),
        ([0, 0, 1, 2, 3, 4, 5, 6, 7, 7, 0, 0], [1, 0, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0]),
    ]:
        curve = smooth[:, order]
        np.testing.assert_array_equal(is_new(curve), np.array(new, bool))
        np.testing.assert_array_equal(jax.jit(is_new)(curve), np.array(new, bool))
        curve = curve + 1e-8 * np.random.default_rng(0).normal(size=curve.shape)
        np.testing.assert_array_equal(is_new(curve, np.float32), np.array(new, bool))


def test_places_over_the_end():
    order = [0, 0, 1, 2, 3, 4, 5, 6, 7, 7, 0, 0]
    place = distinct(ellipse(8)[None][:, :, order])[1][0]
    np.testing.assert_allclose(place * 8, [0, 0, 1, 2, 3, 4, 5, 6, 7, 7, 8, 8, 8])


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.lists(st.integers(0, 3), min_size=16, max_size=16))
def test_without_repeats_a_curve_is_sampled_from_its_first_sample(seed, extra):
    smooth = fourier(seed, n=16, modes=3)
    curve = np.repeat(smooth, np.array(extra) + 1, axis=1)
    found, places = distinct(curve[None])
    spectrum = np.fft.rfft(smooth, axis=1)
    spectrum[:, -1] = 0
    n = curve.shape[1]
    expected = np.fft.irfft(spectrum, n=n, axis=1) * n / 16 if n > 16 else curve
    np.testing.assert_allclose(found[0], expected, atol=1e-12)
    if n > 16:
        np.testing.assert_allclose(places[0], np.append(np.repeat(np.arange(16), np.array(extra) + 1), 16) / 16)


def test_warps_of_curves_without_repetition_stay():
    gamma = warps(0, 2, 16).T
    np.testing.assert_array_equal(original_parameter(gamma, {}), gamma)
    np.testing.assert_array_equal(distinct_parameter(gamma, {}), gamma)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.sampled_from([np.float32, np.float64]))
def test_a_warp_is_carried_to_the_given_curve_and_back(seed, dtype):
    """It stays a lifted warp, and undoes `places`."""
    random = np.random.default_rng(seed)
    curve = np.repeat(fourier(seed, n=12, modes=2), random.integers(1, 4, size=12), axis=1)
    places = {1: distinct(curve[None])[1].get(0, np.linspace(0, 1, curve.shape[1] + 1))}
    gamma = warps(seed, 2, 40).T.astype(dtype)
    found = original_parameter(gamma, places)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found[0], gamma[0])
    assert (np.diff(found[1]) >= 0).all()
    np.testing.assert_array_equal(found[1, -1], found[1, 0] + dtype(1))
    np.testing.assert_allclose(distinct_parameter(found, places), gamma, atol=1e-6 if dtype == np.float32 else 1e-12)


def test_a_sample_keeps_its_number():
    """Where a sample of the distinct curve is, its sample of the given curve is, however often it is repeated."""
    order = [0, 0, 1, 2, 3, 4, 4, 4, 5, 6, 7, 0]
    places = distinct(ellipse(8)[None][:, :, order])[1]
    for k in range(8):
        gamma = (k + np.linspace(0, 8, 17))[None] / 8
        at = original_parameter(gamma, places)[0, 0] % 1 * len(order)
        assert order[round(at) % len(order)] == k
        assert abs(at - round(at)) < 1e-9


def test_the_callers_warp_is_not_changed():
    gamma = warps(3, 1, 12).T
    kept = gamma.copy()
    for function in (original_parameter, distinct_parameter):
        function(gamma, {0: np.linspace(0, 1, 13) ** 2})
        np.testing.assert_array_equal(gamma, kept)
