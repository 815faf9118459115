"""Repeated samples: the same curve without them, and warps carried back to where the samples were."""

import numpy as np
from elastic.shapes import ellipse, fourier, warps

from curvematch_jax.elastic._distinct import distinct, original_warp


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


def test_warps_of_curves_without_repetition_stay():
    gamma = warps(0, 2, 16).T
    np.testing.assert_array_equal(original_warp(gamma, {}, {}), gamma)


def test_a_warp_is_carried_back_through_both_curves():
    """As functions: sample k of the first curve lies at `place1`, and `place2` is undone."""
    n = 12
    gamma = warps(3, 1, n).T
    grid = np.arange(n + 1) / n
    place1, place2 = (np.sort(np.random.default_rng(s).uniform(0, 1, n)) for s in (1, 2))
    place1, place2 = (np.append(p, p[0] + 1) for p in (place1, place2))
    found = original_warp(gamma, {0: place1}, {0: place2})[0]

    def lift(x, nodes, values):
        turns = np.floor(x - nodes[0])
        return np.interp(x - turns, nodes, values) + turns

    expected = lift(lift(place1, grid, gamma[0]), place2, grid)
    np.testing.assert_allclose(found[:-1], expected[:-1], atol=1e-12)
    np.testing.assert_allclose(found[-1], found[0] + 1)
    assert (np.diff(found) > 0).all()


def test_the_callers_warp_is_not_changed():
    gamma = warps(3, 1, 12).T
    kept = gamma.copy()
    original_warp(gamma, {0: np.linspace(0.1, 1.1, 13)}, {})
    np.testing.assert_array_equal(gamma, kept)
