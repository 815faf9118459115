"""What an alignment says: matched points, the aligned curve, one warp for two."""

import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import LEAN, RIGID
from elastic.shapes import fourier, lifts, moved, rotation, spectral, srvf

from curvematch_jax.elastic import Alignment, align, aligned_curve, alignment_distance, matched_points, warp_onto
from curvematch_jax.elastic._matched import srvfs_along

N = 100


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return tuple(fourier(s, 8, n=N, modes=3).astype(np.float32) for s in (0, 100))


@pytest.fixture(name="found", scope="module")
def fixture_found(pair):
    return align(*pair, LEAN)


def path(seed, m, d=3, count=8):
    turns = np.stack([rotation(k, d) for k in range(count)])
    warp1, warp2 = lifts(seed, count, m)
    return Alignment(*(jnp.asarray(x, jnp.float32) for x in (turns, warp1, warp2, np.zeros(count))))


def test_matched_points_lie_on_the_curves(pair, found):
    points = matched_points(*pair, found)
    for curves, warps, side in zip(pair, (found.warp1, found.warp2), points, strict=True):
        assert side.shape == (8, 3, warps.shape[1] - 1)
        for curve, warp, some in zip(curves, np.asarray(warps), side, strict=True):
            np.testing.assert_allclose(some, spectral(curve.astype(float), warp[:-1]), atol=2e-3)


def test_matched_points_of_a_moved_copy_are_each_others_images(pair):
    copies = moved(pair[0], 3, scale=2.0, shift=1.0).astype(np.float32)
    one, other = matched_points(pair[0], copies, align(pair[0], copies, LEAN))
    np.testing.assert_allclose(moved(np.asarray(one), 3, scale=2.0, shift=1.0), other, atol=0.02)


def test_batches_of_points_broadcast(pair):
    found = align(pair[0][0], pair[1], RIGID)
    one, other = matched_points(pair[0][0], pair[1], found)
    assert one.shape == other.shape == (8, 3, found.warp1.shape[-1] - 1)
    single = matched_points(pair[0][0], pair[1][2], Alignment(*(x[2] for x in found)))
    np.testing.assert_allclose(single[0], one[2], atol=1e-5)
    assert aligned_curve(pair[0][0], pair[1], found).shape == (8, 3, N)


@pytest.mark.parametrize("n", [16, 100, 333])
def test_one_warp_for_two_is_lifted_and_monotone(found, n):
    warp = np.asarray(warp_onto(found, n))
    assert warp.shape == (8, n + 1)
    assert np.diff(warp).min() >= -1e-6
    np.testing.assert_allclose(warp[:, -1], warp[:, 0] + 1, atol=1e-6)


def test_one_warp_joins_the_two():
    """`gamma(warp1) = warp2`, wherever curve1 moves: at the samples, between the path's own."""
    some = path(5, 64)
    warp = np.asarray(warp_onto(some, 40), float)
    for gamma, warp1, warp2 in zip(warp, np.asarray(some.warp1, float), np.asarray(some.warp2, float), strict=True):
        place = np.arange(41) / 40
        turns = np.floor(place - warp1[0])
        expected = np.interp(place - turns, warp1, warp2) + turns
        np.testing.assert_allclose(gamma, expected, atol=1e-4)


def test_the_warp_of_a_curve_with_itself_is_the_identity(pair):
    warp = np.asarray(warp_onto(align(pair[0], pair[0], LEAN), N), float)
    apart = warp - np.arange(N + 1) / N
    np.testing.assert_allclose(apart - np.round(apart[:, :1]), 0, atol=1e-4)


def test_the_inverse_warp_is_that_of_exchanged_curves(pair, found):
    back = align(pair[1], pair[0], LEAN)
    fine = 2000
    there, again = (np.asarray(warp_onto(x, fine), float) for x in (found, back))
    for one, other in zip(there, again, strict=True):
        turns = np.floor(one)
        trip = np.interp(one - turns, np.arange(fine + 1) / fine, other) + turns - np.arange(fine + 1) / fine
        assert np.median(np.abs(trip - np.round(trip))) < 5e-3


def test_a_copy_is_laid_back_onto_its_curve(pair):
    """Turned, scaled, moved and begun elsewhere: it lies where the curve does, in its own size."""
    copies = np.roll(moved(pair[0], 4, scale=1.0), 20, axis=-1).astype(np.float32)
    found = align(pair[0], copies, LEAN)
    np.testing.assert_allclose(aligned_curve(pair[0], copies, found), pair[0], atol=0.02)


def test_an_aligned_curve_keeps_its_size_and_takes_the_place_of_the_other(pair, found):
    laid = np.asarray(aligned_curve(pair[0], 5 * pair[1] + 3, found))
    np.testing.assert_allclose(laid.mean(axis=-1), pair[0].mean(axis=-1), atol=1e-4)
    plain = np.asarray(aligned_curve(*pair, found))
    centred = lambda c: c - c.mean(axis=-1, keepdims=True)  # noqa: E731
    np.testing.assert_allclose(centred(laid), 5 * centred(plain), atol=1e-3)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_srvfs_along_a_path_are_as_defined(d):
    """On a fine grid: `q1(gamma1) sqrt(gamma1')` and `R q2(gamma2) sqrt(gamma2')`, closed, of unit norm."""
    m = 64
    curves, others = (fourier(s, 2, n=N, d=d, modes=2).astype(np.float32) for s in (0, 1))
    time = np.arange(m + 1) / m
    bent = np.stack([time + 0.05 * np.sin(2 * np.pi * time) + shift for shift in (0.1, 0.4)])
    turns = np.stack([rotation(k, d) for k in range(2)])
    some = Alignment(*(jnp.asarray(x, jnp.float32) for x in (turns, bent, 2 * time - bent, np.zeros(2))))
    q1, q2 = srvfs_along(jnp.asarray(curves), jnp.asarray(others), some, 512)
    for q, sides, warps, spin in (
        (q1, curves, some.warp1, np.tile(np.eye(d), (2, 1, 1))),
        (q2, others, some.warp2, turns),
    ):
        np.testing.assert_allclose(np.mean(np.sum(np.asarray(q) ** 2, axis=1), axis=1), 1, atol=1e-4)
        for k in range(2):
            middle = np.interp((np.arange(512) + 0.5) / 512, time, np.asarray(warps[k], float))
            slope = np.repeat(np.diff(np.asarray(warps[k], float)) * m, 512 // m)
            expected = spin[k] @ srvf(sides[k].astype(float), middle) * np.sqrt(slope)
            expected /= np.sqrt(np.mean(np.sum(expected**2, axis=0)))
            assert np.sqrt(np.mean((np.asarray(q[k]) - expected) ** 2)) < 0.03


def test_what_is_no_pair_is_refused(pair, found):
    for function in (matched_points, aligned_curve):
        with pytest.raises(ValueError, match=r"\(3, 100\) and \(3, 99\)"):
            function(pair[0], pair[1][..., 1:], found)
    with pytest.raises(ValueError, match="curve1, curve2, rotation, warp1 and warp2"):
        alignment_distance(pair[0], pair[1], found.rotation[:3], found.warp1, found.warp2)
    with pytest.raises(ValueError, match="the two warps of one path"):
        alignment_distance(*pair, found.rotation, found.warp1[:, 1:], found.warp2)
    with pytest.raises(ValueError, match=r"for curves of d = 3 give"):
        alignment_distance(*pair, found.rotation[:, :2, :2], found.warp1, found.warp2)
