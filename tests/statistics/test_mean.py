"""Means and medians: of copies, of two, in any order; falling sums; bad input."""

import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import FAST
from elastic.shapes import fourier, moved

from curvematch_jax import centre, distance_matrix, geodesic, length, resample
from curvematch_jax.datasets import leaves
from curvematch_jax.elastic._geodesic import path_length
from curvematch_jax.statistics import karcher_mean, karcher_median
from curvematch_jax.statistics._tangent import exp, log


def apart(a, b):
    return float(all_apart(a, b[None])[0])


def all_apart(a, b):
    """The distances of a curve and each of some: in the program that finds the medoid as well."""
    return distance_matrix(np.asarray(a, np.float32)[None], np.asarray(b, np.float32), FAST)[0]


def test_copies_of_different_size_have_the_curve_as_mean():
    curve = leaves(1, n=100, moved=False).curves[0]
    mean = karcher_mean([k * curve for k in 8 * (1, 2, 4)], aligner=FAST)
    assert apart(mean.curve, curve) < 2e-5
    assert bool(mean.converged)
    assert np.allclose(mean.scale * (8 * [1, 2, 4]), 2, rtol=1e-4)  # of the geometric mean of the lengths
    assert np.allclose(length(mean.curve), 2 * length(curve), rtol=1e-5)
    assert np.allclose(length(mean.aligned), 2 * length(curve), rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "most"), [(100, 0.02), (200, 0.008)])
def test_moved_copies_have_their_curve_as_mean(n, most):
    """By the default aligner: a fast one leaves some copies badly aligned."""
    copies = leaves(20, seed=1, n=n, deviations=(0.0, 0.0))
    mean = karcher_mean(copies.curves)
    assert apart(mean.curve, copies.mean) < most


def test_sums_fall_and_the_gradient_vanishes(mean):
    assert np.all(np.diff(mean.history, axis=0) <= 0)
    assert mean.gradient <= 1e-3
    assert mean.variance == pytest.approx(mean.history[-1], rel=1e-4)
    pull = np.tensordot(mean.weights, mean.tangents, axes=1)
    assert np.sqrt(np.mean(np.sum(pull**2, axis=0))) == pytest.approx(float(mean.gradient), abs=1e-6)


def test_the_mean_is_nearer_to_all_than_any_of_them(made, mean):
    squares = [np.mean(all_apart(a, made.curves) ** 2) for a in (mean.curve, *made.curves[8:12])]
    assert squares[0] == min(squares)


def test_order_does_not_matter_at_all(made, mean):
    order = np.random.default_rng(0).permutation(len(made.curves))
    again = karcher_mean(made.curves[order], aligner=FAST)
    assert np.array_equal(again.curve, mean.curve)
    assert np.array_equal(again.warp, mean.warp[order])


def test_start_rotation_and_parametrisation_matter_little(made, mean):
    unmoved = karcher_mean(leaves(24, seed=3, apart=0.2, moved=False).curves, aligner=FAST)
    assert apart(unmoved.curve, mean.curve) < 0.02
    assert unmoved.variance == pytest.approx(mean.variance, rel=0.05)


def test_aligned_curves_are_the_curves_where_the_warps_say(made, mean):
    n = made.curves.shape[2]
    places = mean.warp[:, : -1 : mean.warp.shape[1] // n]
    k = np.fft.rfftfreq(n, 1 / n)[: n // 2]
    for i in (0, 5):
        spectrum = np.fft.rfft(made.curves[i].astype(float))[:, : n // 2] / n
        waves = np.exp(2j * np.pi * np.outer(k, places[i]))
        points = 2 * np.real(spectrum[:, 1:] @ waves[1:])
        turned = mean.scale[i] * mean.rotation[i] @ points
        turned -= turned.mean(axis=1, keepdims=True)
        assert np.abs(turned - mean.aligned[i]).max() < 0.02 * np.abs(turned).max()


def test_the_mean_of_the_warps_is_the_identity(mean):
    times = np.mean(mean.warp - mean.warp[:, :1], axis=0)
    assert np.abs(times - np.linspace(0, 1, len(times))).max() < 1e-3


@pytest.mark.slow
def test_mean_of_two_is_the_midpoint_of_their_geodesic(made):
    """As fields with the same sides: curves that are sampled anew differ by ten times more."""
    mean = karcher_mean(made.curves[:2], aligner=FAST)
    way = geodesic(*made.curves[:2], aligner=FAST, samples=mean.srvf.shape[-1])
    middle = np.asarray(way.path[3], float)
    left, _, right = np.linalg.svd(mean.srvf @ middle.T)
    away = np.sqrt(np.mean(np.sum((left @ right @ middle - mean.srvf) ** 2, axis=0)))
    assert away < 1e-3 * float(way.length)
    assert np.allclose(mean.distances, way.length / 2, rtol=1e-3)


@pytest.mark.slow
def test_the_mean_of_noisy_ellipses_is_nearer_to_the_ellipse_than_any():
    times, random = 2 * np.pi * np.arange(150) / 150, np.random.default_rng(0)
    ellipse = np.stack([2 * np.cos(times), np.sin(times)])
    noisy = ellipse + 0.02 * random.normal(size=(10, 2, 150))
    mean = karcher_mean(noisy.astype(np.float32), aligner=FAST)
    assert mean.converged
    assert apart(mean.curve, ellipse) < 0.8 * all_apart(ellipse, noisy).min()


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_moved_copies_of_a_rough_curve_have_it_as_mean(d):
    shape, random = fourier(5, None, 4000, d), np.random.default_rng(1)
    even = np.arange(100) / 100
    copies = []
    for k in range(12):
        places = even + 0.03 * np.sin(2 * np.pi * (even + random.uniform())) + random.uniform()
        copies.append(moved(np.stack([np.interp(places, np.arange(4000) / 4000, row, period=1) for row in shape]), k))
    mean = karcher_mean(np.stack(copies).astype(np.float32), aligner=FAST)
    curve = shape[:, ::40]
    assert apart(mean.curve, curve) < 0.04
    assert apart(mean.curve, curve) < 0.9 * all_apart(curve, np.stack(copies)).mean()  # which sampling moved apart


@pytest.mark.slow
def test_groups_at_once_are_as_one_by_one(made):
    both = karcher_mean(made.curves.reshape(2, 12, *made.curves.shape[1:]))
    one = karcher_mean(made.curves[:12])
    assert both.curve.shape == (2, 2, 100)
    assert both.distances.shape == (2, 12)
    assert apart(both.curve[0], one.curve) < 0.01
    assert both.variance[0] == pytest.approx(one.variance, rel=0.02)


@pytest.mark.slow
def test_weights_move_the_mean(made):
    heavy = np.full(24, 1e-3)
    heavy[[0, 1]] = 1
    assert apart(karcher_mean(made.curves, heavy).curve, karcher_mean(made.curves[:2]).curve) < 0.05


@pytest.mark.slow
def test_outliers_move_the_median_less():
    made = leaves(12, seed=5)
    t = 2 * np.pi * np.arange(100) / 100
    with_others = np.concatenate([made.curves, [[3 * np.cos(t), np.sin(t)]] * 3]).astype(np.float32)
    moved = [apart(f(with_others).curve, f(made.curves).curve) for f in (karcher_mean, karcher_median)]
    assert moved[1] < moved[0] / 2


def test_log_is_the_inverse_of_exp(mean):
    base = jnp.broadcast_to(jnp.asarray(mean.srvf), mean.tangents.shape)
    q = exp(base, mean.tangents)
    v, length = log(base, q)
    assert np.abs(np.asarray(v) - mean.tangents).max() < 2e-4
    assert np.allclose(length, mean.distances, atol=2e-5)
    assert path_length(jnp.stack([base[0], q[0]])) <= length[0] + 1e-5


@pytest.mark.parametrize(
    ("curves", "said"),
    [
        (leaves(1).curves, "two curves or more"),
        (np.full((3, 2, 50), np.nan), "NaN"),
        ([np.ones((2, 30)), np.ones((3, 31))], "different dimensions"),
        (leaves(1).curves[0], "give a sample"),
        (np.zeros((3, 1, 30)), "d >= 2"),
    ],
)
def test_bad_curves_get_a_sentence(curves, said):
    with pytest.raises(ValueError, match=said):
        karcher_mean(curves)


def test_bad_weights_get_a_sentence(made):
    for weights, said in [(np.ones(3), "a number for each curve"), (-np.ones(24), "negative numbers")]:
        with pytest.raises(ValueError, match=said):
            karcher_mean(made.curves, weights)


@pytest.mark.slow
def test_lists_of_different_lengths_are_resampled(made):
    mixed = [np.asarray(resample(curve, n)) for curve, n in zip(made.curves[:4], (100, 80, 100, 90), strict=True)]
    mean = karcher_mean(mixed)
    assert mean.curve.shape == (2, 100)
    assert np.allclose(np.asarray(centre(mean.curve)), mean.curve, atol=1e-4)
