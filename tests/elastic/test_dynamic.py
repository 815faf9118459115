"""The best path on a grid against every path there is."""

import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, x64

from curvematch_jax.elastic import _dynamic as dynamic

N = 7
best_path = jax.jit(dynamic.best_path, static_argnames=("band", "largest"))


def fields(seed, n=N, d=3, lanes=4):
    generator = np.random.default_rng(seed)
    return generator.normal(size=(2, d, n, lanes))


def step_score(products, n, row, column, a, b):
    """Trapezoidal rule of `<q1, q2> sqrt(slope)` over one step."""
    ends = products[row % n, column % n] + products[(row + a) % n, (column + b) % n]
    return math.sqrt(a * b) / (2 * n) * ends


def every_path(products, n, band, largest, row=0, column=0):
    """The scores of all paths to (n, n), by recursion."""
    if row == n and column == n:
        yield 0.0
        return
    for a in range(1, largest + 1):
        for b in range(1, largest + 1):
            r, c = row + a, column + b
            if math.gcd(a, b) == 1 and r <= n and c <= n and abs(c - r) <= band:
                here = step_score(products, n, row, column, a, b)
                yield from (here + rest for rest in every_path(products, n, band, largest, r, c))


def path_score(products, n, gamma):
    """The score of a path from its warp: its nodes are where the warp meets the grid."""
    rows = [k for k in range(n + 1) if abs(gamma[k] - round(gamma[k])) < 1e-3]
    columns = [round(float(gamma[k])) for k in rows]
    nodes = list(zip(rows, columns, strict=True))
    return sum(step_score(products, n, r, c, s - r, e - c) for (r, c), (s, e) in itertools.pairwise(nodes)), nodes


@pytest.mark.parametrize("largest", [1, 2, 3])
@pytest.mark.parametrize("band", [1, 2, 6])
def test_the_path_is_the_best_of_all(band, largest):
    q1, q2 = fields(band + 10 * largest)
    gamma = np.asarray(best_path(jnp.asarray(q1), jnp.asarray(q2), band=band, largest=largest))
    for lane in range(q1.shape[-1]):
        products = q1[..., lane].T @ q2[..., lane]
        score, nodes = path_score(products, N, gamma[:, lane])
        assert score == pytest.approx(max(every_path(products, N, band, largest)), abs=1e-5)
        assert nodes[0] == (0, 0)
        assert nodes[-1] == (N, N)
        assert all(abs(c - r) <= band for r, c in nodes)


@pytest.mark.parametrize(("largest", "count"), [(1, 1), (2, 3), (3, 7), (4, 11), (5, 19), (6, 23)])
def test_steps_are_coprime(largest, count):
    steps = dynamic.steps_up_to(largest)
    assert len(steps) == len(set(steps)) == count
    assert all(math.gcd(a, b) == 1 for a, b in steps)


def test_paths_increase_from_end_to_end():
    q1, q2 = fields(5, n=40, lanes=6)
    gamma = np.asarray(best_path(jnp.asarray(q1), jnp.asarray(q2), band=10, largest=4))
    assert gamma.shape == (41, 6)
    slopes = np.diff(gamma, axis=0)
    assert slopes.min() >= 1 / 4 - 1e-4
    assert slopes.max() <= 4 + 1e-4
    np.testing.assert_allclose(gamma[0], 0, atol=1e-4)
    np.testing.assert_allclose(gamma[-1], 40, atol=1e-4)


def test_a_curve_is_laid_onto_itself_by_the_identity():
    q = fourier(1, 3, n=32).transpose(1, 2, 0)
    q = q / np.linalg.norm(q, axis=0)
    gamma = best_path(jnp.asarray(q), jnp.asarray(q), band=8, largest=3)
    np.testing.assert_allclose(gamma, np.broadcast_to(np.arange(33)[:, None], (33, 3)), atol=1e-4)


def test_lanes_do_not_mix():
    q1, q2 = fields(9, n=20, lanes=3)
    together = best_path(jnp.asarray(q1), jnp.asarray(q2), band=5, largest=3)
    alone = best_path(jnp.asarray(q1[..., 1:2]), jnp.asarray(q2[..., 1:2]), band=5, largest=3)
    np.testing.assert_allclose(together[:, 1:2], alone, atol=1e-4)


@pytest.mark.parametrize("largest", [2, 3, 6])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_number_of_a_step_is_kept_in_its_total(dtype, largest):
    """It comes back whole, and changes the total, of either sign, by a few units in the last place."""
    with x64():
        count = len(dynamic.steps_up_to(largest))
        total = jnp.asarray(np.random.default_rng(0).normal(size=(50, 4)), dtype)
        for number in range(count):
            marked = dynamic._marked(total, number, count)
            bits = np.asarray(marked).view(np.int32 if dtype == np.float32 else np.int64)
            assert set((bits & dynamic._mask(count)).ravel().tolist()) == {number}
            np.testing.assert_allclose(marked, total, rtol=count * 2 * np.finfo(dtype).eps, atol=0)


def test_the_path_is_the_best_in_float64_too():
    q1, q2 = fields(3)
    with x64():
        gamma = np.asarray(dynamic.best_path(jnp.asarray(q1), jnp.asarray(q2), band=6, largest=3))
    assert gamma.dtype == np.float64
    for lane in range(q1.shape[-1]):
        products = q1[..., lane].T @ q2[..., lane]
        score, _ = path_score(products, N, gamma[:, lane])
        assert score == pytest.approx(max(every_path(products, N, 6, 3)), abs=1e-12)
