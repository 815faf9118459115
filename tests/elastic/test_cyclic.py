"""Cyclic tridiagonal systems against dense ones."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import x64

from curvematch_jax.elastic._cyclic import solve_cyclic

LANES, SIDES = 5, 3


def system(m, seed=0, room=0.1):
    """Positive definite: every diagonal entry is larger than those beside it together."""
    generator = np.random.default_rng(seed)
    beside = generator.normal(size=(LANES, m))
    least = np.abs(beside) + np.abs(np.roll(beside, 1, axis=1))
    return least + generator.uniform(room, 1, size=(LANES, m)), beside, generator.normal(size=(SIDES, LANES, m))


def dense(diagonal, beside):
    m = len(diagonal)
    matrix = np.diag(diagonal)
    for k in range(m):
        matrix[k, (k + 1) % m] += beside[k]
        matrix[(k + 1) % m, k] += beside[k]
    return matrix


@pytest.mark.parametrize("m", [4, 8, 32, 128, 512])
def test_cyclic_systems_are_solved_as_dense_ones(m):
    diagonal, beside, right = system(m)
    with x64():
        found = np.asarray(jax.jit(solve_cyclic)(*(jnp.asarray(x) for x in (diagonal, beside, right))))
    for lane in range(LANES):
        expected = np.linalg.solve(dense(diagonal[lane], beside[lane]), right[:, lane].T).T
        np.testing.assert_allclose(found[:, lane], expected, rtol=1e-8, atol=1e-10)


def test_single_precision_is_as_good_as_its_system():
    diagonal, beside, right = (x.astype(np.float32) for x in system(64, seed=1))
    found = np.asarray(jax.jit(solve_cyclic)(diagonal, beside, right), float)
    for lane in range(LANES):
        back = found[:, lane] @ dense(diagonal[lane].astype(float), beside[lane].astype(float))
        np.testing.assert_allclose(back, right[:, lane], atol=1e-4)


def test_lanes_do_not_mix():
    """A lane that is NaN leaves the others as they are, the first one included."""
    diagonal, beside, right = system(16)
    plain = np.asarray(jax.jit(solve_cyclic)(diagonal, beside, right))
    for lane in (0, 3):
        broken = diagonal.copy()
        broken[lane, 5] = np.nan
        found = np.asarray(jax.jit(solve_cyclic)(broken, beside, right))
        others = np.arange(LANES) != lane
        np.testing.assert_array_equal(found[:, others], plain[:, others])
