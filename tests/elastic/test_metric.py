"""The three distances of closed curves: their order, their agreement with other ways to get them, their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import COARSE, LEAN, RIGID
from elastic.shapes import fourier, lifts, rotation, x64

from curvematch_jax.elastic import (
    Alignment,
    align,
    alignment_distance,
    distance_matrix,
    elastic_distance,
    pair_distances,
)
from curvematch_jax.elastic import _metric as metrics
from curvematch_jax.elastic import _preshape as preshape

N = 32


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return fourier(0, 3, n=N).astype(np.float32), fourier(1, 3, n=N).astype(np.float32)


def test_longer_by_little_on_closed_curves(pair):
    arc, projected, straight = (
        np.asarray(elastic_distance(pair[0], pair[1], RIGID, metric=k)) for k in metrics.METRICS
    )
    assert (projected >= straight - 1e-6).all()
    assert (projected - straight < 1e-3 * straight).all()
    assert (straight > arc - 0.01).all()
    assert (straight < 1.02 * arc).all()
    q1, q2 = metrics._ends(*(jnp.asarray(c) for c in pair), align(pair[0], pair[1], RIGID))
    assert (preshape.sphere_distance(q1, q2) <= straight + 1e-5).all()  # an order to rounding on the same polygons


def test_matrices_and_pairs_hold_the_same_numbers(pair):
    for metric in ("projected", "straightened"):
        alone = np.asarray(elastic_distance(pair[0][:, None], pair[1], RIGID, metric=metric))
        np.testing.assert_allclose(distance_matrix(pair[0], pair[1], RIGID, metric=metric), alone, atol=1e-5)
        diagonal = pair_distances(pair[0], pair[1], np.array([[0, 0], [1, 1]]), RIGID, metric=metric)
        np.testing.assert_allclose(diagonal, np.diag(alone)[:2], atol=1e-5)


def path(seed, m=8 * N, dtype=np.float32, rough=0.5):
    warp1, warp2 = (w[0] for w in lifts(seed, 1, m, rough=rough))
    return Alignment(*(jnp.asarray(x, dtype) for x in (rotation(seed), warp1, warp2, 0.0)))


def test_the_ends_of_a_path_are_as_far_apart_as_the_alignment_says(pair):
    """Polygons through matched points; the other way, sums of waves, is the judge."""
    found = align(pair[0], pair[1], LEAN)
    q1, q2 = metrics._ends(*(jnp.asarray(c) for c in pair), found)
    np.testing.assert_allclose(preshape.sphere_distance(q1, q2), alignment_distance(*pair, *found[:3]), atol=0.02)
    np.testing.assert_allclose(preshape.closure(q1), 0, atol=1e-6)
    np.testing.assert_allclose(preshape.closure(q2), 0, atol=1e-6)
    np.testing.assert_allclose(preshape.inner(q1, q1), 1, atol=1e-5)


@pytest.mark.parametrize("metric", ["projected", "straightened"])
def test_the_derivative_is_that_of_the_length_with_the_alignment_held(metric):
    with x64():
        curve1, curve2, direction = (jnp.asarray(fourier(s, n=N)) for s in (5, 6, 7))
        some = path(8, dtype=np.float64, rough=0.0)
        length = jax.jit(lambda c: metrics.length_between(c, curve2, some, metric))
        way = metrics.path_between(curve1, curve2, some, "straightened")
        slope = jax.jvp(lambda c: metrics.length_to_ends(way, c, curve2, some), (curve1,), (direction,))[1]
        difference = (length(curve1 + 1e-5 * direction) - length(curve1 - 1e-5 * direction)) / 2e-5
        np.testing.assert_allclose(slope, difference, rtol=2e-4 if metric == "straightened" else 5e-3)


def test_gradients_of_the_distance_are_finite(pair):
    value = jax.jit(jax.grad(lambda a: elastic_distance(a, pair[1], COARSE, metric="straightened").sum()))
    assert np.isfinite(value(pair[0])).all()


def test_another_metric_is_refused(pair):
    with pytest.raises(ValueError, match="metric = 'chord': it is one of arc, projected, straightened"):
        elastic_distance(pair[0], pair[1], RIGID, metric="chord")
    with pytest.raises(ValueError, match="metric = 'chord'"):
        distance_matrix(pair[0], pair[1], RIGID, metric="chord")
