"""The distance of a path, from tables, against its definition."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import certified, fourier, lifts, rotation, x64

from curvematch_jax.elastic import alignment_distance
from curvematch_jax.elastic._certify import path_distance
from curvematch_jax.elastic._tables import tabulate

LANES, N = 3, 100
measured = jax.jit(path_distance, static_argnames="nodes")


def pair(d=3):
    curves, others = (fourier(s, LANES, n=N, d=d, modes=2) for s in (0, 1))
    return curves, others, np.stack([rotation(s, d) for s in range(LANES)])


def distance(curves, others, turns, warp1, warp2, dtype=np.float64, nodes=8):
    tables = [tabulate(jnp.asarray(c, dtype)) for c in (curves, others)]
    turns = jnp.moveaxis(jnp.asarray(turns, dtype), 0, -1)
    return np.asarray(measured(*tables, turns, jnp.asarray(warp1, dtype), jnp.asarray(warp2, dtype), nodes=nodes))


@pytest.mark.parametrize("d", [2, 3, 4])
def test_it_follows_the_definition(d):
    curves, others, turns = pair(d)
    warp1, warp2 = lifts(2, LANES, 128, rough=0.2)
    with x64():
        found = distance(curves, others, turns, warp1, warp2)
    expected = [certified(*case, nodes=16) for case in zip(curves, others, turns, warp1, warp2, strict=True)]
    np.testing.assert_allclose(found, expected, atol=1e-3)


def test_it_is_precise_near_zero():
    """A curve and itself along one path: rounding alone."""
    curves, _, _ = pair()
    warp, _ = lifts(3, LANES, 128)
    one = np.broadcast_to(np.eye(3), (LANES, 3, 3))
    with x64():
        assert distance(curves, curves, one, warp, warp).max() < 1e-12
        assert distance(curves, curves, one, warp, warp, np.float32).max() < 1e-6
        near = distance(curves, curves, one, warp, warp + 1e-7)
        half = distance(curves, curves, one, warp, warp + 5e-8)
        np.testing.assert_allclose(near, 2 * half, rtol=1e-3)


def test_where_a_curve_stands_still_it_is_finite():
    """Curve1 passes a quarter of itself while curve2 waits, and curve2 then."""
    curves, others, turns = pair()
    steps1, steps2 = np.repeat([2.0, 1, 0, 1], 32), np.repeat([0.0, 1, 2, 1], 32)
    warps = [np.tile(np.append(0, np.cumsum(s) / s.sum()), (LANES, 1)) for s in (steps1, steps2)]
    found = distance(curves, others, turns, *warps, np.float32)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(
        found, alignment_distance(*(x.astype(np.float32) for x in (curves, others, turns, *warps))), atol=2e-3
    )


def test_pairs_do_not_mix():
    curves, others, turns = pair()
    warp1, warp2 = lifts(4, LANES, 128)
    plain = distance(curves, others, turns, warp1, warp2, np.float32)
    curves[0] = np.nan
    broken = distance(curves, others, turns, warp1, warp2, np.float32)
    np.testing.assert_array_equal(broken[1:], plain[1:])
