"""What holds for any curves: invariance, symmetry, identity, the triangle inequality; of near-duplicates, in floats.

Few shapes, each compiled once. Curves that are near have one best alignment, which a lean search finds as well.
"""

import numpy as np
import pytest
from elastic.aligners import LEAN, RIGID
from elastic.shapes import fourier, moved, sample
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import align, alignment_distance

NEAR = 0.1  # share of another curve in a near-duplicate
seeds = st.integers(0, 100_000)
some = settings(max_examples=12, deadline=None, derandomize=True)


@pytest.fixture(
    name="shape",
    params=[(2, 16), (3, 100), pytest.param((4, 400), marks=pytest.mark.slow)],
    ids=lambda s: f"d={s[0]}, n={s[1]}",
)
def fixture_shape(request):
    return request.param


def curve(seed, shape):
    """An ellipse with two more waves, without sharp turns: what so few settings can hold."""
    d, n = shape
    cos, sin = 0.1 * np.random.default_rng(seed).normal(size=(2, d, 3)) / np.arange(1, 4)
    cos[0, 0] += 1
    sin[1, 0] += 0.6
    return sample(cos, sin, n)


def near(seed, shape, count):
    """A curve, and `count` curves near it and each other."""
    base = curve(seed, shape)
    return [base] + [base + NEAR * moved(curve(seed + 100_001 * k, shape), seed, 1.0) for k in range(1, count + 1)]


def run(pairs, aligner=LEAN):
    first, second = (np.stack(side).astype(np.float32) for side in zip(*pairs, strict=True))
    return align(first, second, aligner), first, second


def test_distances_of_near_curves_forget_what_they_should(shape):
    """Rotation, scale, position and start point: to rounding mostly, and to .02 where two alignments tie."""

    @some
    @given(seeds, st.floats(0.1, 10), st.integers(1, shape[1] - 1))
    def check(seed, scale, shift):
        one, other = near(seed, shape, 1)
        turned, rolled = moved(other, seed, scale, scale), np.roll(other, shift, axis=-1)
        plain, first, second = np.asarray(run([(one, other), (one, turned), (one, rolled)])[0].distance)
        assert abs(first - plain) < 2e-3
        assert abs(second - plain) < 0.02

    check()


def test_both_orders_give_one_distance_and_its_certificates(shape):
    """Of near curves and of others."""

    @some
    @given(seeds)
    def check(seed):
        one, other = near(seed, shape, 1)
        far = curve(seed + 7, shape)
        found, first, second = run([(one, other), (other, one), (one, far), (far, one)])
        distance = np.asarray(found.distance)
        np.testing.assert_allclose(distance[::2], distance[1::2], atol=1e-6)
        np.testing.assert_allclose(found.warp1[::2], found.warp2[1::2], atol=1e-5)
        np.testing.assert_allclose(found.rotation[::2], np.swapaxes(found.rotation, 1, 2)[1::2], atol=1e-5)
        assert ((distance > 0) & (distance < np.pi)).all()
        error = np.abs(np.asarray(alignment_distance(first, second, *found[:3])) - distance)
        assert error.max() < 8e-3
        for warp in (found.warp1, found.warp2):
            assert np.diff(warp).min() >= 0
            np.testing.assert_allclose(warp[:, -1], warp[:, 0] + 1, atol=1e-6)
        np.testing.assert_allclose(np.linalg.det(found.rotation), 1, atol=1e-5)

    check()


def test_a_curve_is_at_distance_zero_from_itself_however_it_lies(shape):
    """Exactly as it is, and moved."""

    @some
    @given(seeds, st.floats(0.1, 10))
    def check(seed, scale):
        one = curve(seed, shape)
        same, lying = np.asarray(run([(one, one), (one, moved(one, seed, scale, scale))])[0].distance)
        assert same < 1e-3
        assert lying < 3e-3

    check()


def test_the_triangle_inequality_among_near_duplicates(shape):
    """A distance that is found is no less than the true one, so a little slack is needed."""

    @some
    @given(seeds)
    def check(seed):
        a, b, c = near(seed, shape, 2)
        ab, bc, ac = np.asarray(run([(a, b), (b, c), (a, c)])[0].distance)
        assert ac <= ab + bc + 2e-3
        assert ab <= ac + bc + 2e-3
        assert bc <= ab + ac + 2e-3

    check()


def test_rigid_distances_forget_rotation_and_start_point():
    @some
    @given(seeds, st.integers(0, 99), st.floats(0.1, 10))
    def check(seed, shift, scale):
        one, other = fourier(seed, 2, n=100, modes=2)
        turned = np.roll(moved(other, seed, scale), shift, axis=-1)
        plain, found = np.asarray(run([(one, other), (one, turned)], RIGID)[0].distance)
        assert abs(plain - found) < 0.025

    check()
