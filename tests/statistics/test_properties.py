"""What holds for any sample: means and components forget order, start points and rotations; scores in both floats."""

import numpy as np
import pytest
from elastic.aligners import FAST, LEAN, RIGID
from elastic.shapes import rotation, x64
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax import elastic_distance
from curvematch_jax.datasets import leaves
from curvematch_jax.statistics import TangentPCA, karcher_mean
from curvematch_jax.statistics._tangent import exp

COUNT, N = 5, 64
seeds = st.integers(0, 100_000)
some = settings(max_examples=4, deadline=None, derandomize=True)


def sample(seed, d, moved=False):
    return leaves(COUNT, seed, N, d, moved=moved).curves


def apart(first, second):
    return float(elastic_distance(first, second, FAST))


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_order_does_not_matter_to_the_last_digit(d):
    @some
    @given(seeds, st.permutations(range(COUNT)))
    def check(seed, order):
        curves = sample(seed, d, moved=True)
        mean, again = karcher_mean(curves, aligner=LEAN), karcher_mean(curves[order], aligner=LEAN)
        assert np.array_equal(again.curve, mean.curve)
        assert np.array_equal(again.tangents, mean.tangents[order])

    check()


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_start_points_rotations_sizes_and_places_matter_little(d):
    @some
    @given(seeds)
    def check(seed):
        curves, random = sample(seed, d), np.random.default_rng(seed)
        others = np.stack(
            [
                random.uniform(0.5, 2) * rotation(seed + i, d) @ np.roll(curve, random.integers(N), axis=1) + i
                for i, curve in enumerate(curves)
            ]
        ).astype(np.float32)
        mean, again = karcher_mean(curves, aligner=FAST), karcher_mean(others, aligner=FAST)
        assert apart(mean.curve, again.curve) < 0.03
        assert again.variance == pytest.approx(mean.variance, rel=0.1)
        assert np.all(np.diff(again.history) <= 0)
        deviations = [TangentPCA.fit(each, 2).deviations for each in (mean, again)]
        assert np.allclose(*deviations, rtol=0.15)

    check()


@pytest.mark.slow
def test_how_curves_are_sampled_matters_little():
    @some
    @given(seeds)
    def check(seed):
        even, uneven = (leaves(COUNT, seed, N, moved=moved).curves for moved in (False, True))
        mean, again = karcher_mean(even, aligner=FAST), karcher_mean(uneven, aligner=FAST)
        assert apart(mean.curve, again.curve) < 0.05

    check()


@pytest.mark.slow
def test_scores_give_back_the_srvfs_and_any_scores_closed_curves_in_float64():
    """In float32 `test_components.py` has the same of planar curves."""
    with x64():
        mean = karcher_mean(sample(1, 3).astype(float), aligner=RIGID)
        components = TangentPCA.fit(mean)
        assert mean.srvf.dtype == float
        rebuilt = components.srvfs(components.scores(mean))
        aligned = np.asarray(exp(np.broadcast_to(mean.srvf, mean.tangents.shape), np.asarray(mean.tangents)))
        assert np.sqrt(np.mean(np.sum((rebuilt - aligned) ** 2, axis=1), axis=1)).max() < 1e-10
        found = components.srvfs(np.random.default_rng(0).normal(size=(4, len(components.deviations))))
        assert np.abs(np.mean(found * np.linalg.norm(found, axis=1, keepdims=True), axis=2)).max() < 1e-12
