"""The best path in a strip against every path there is."""

import functools as ft
import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, x64

from curvematch_jax.elastic import _dynamic as dynamic

best_path = jax.jit(dynamic.best_path, static_argnames=("width", "slopes"))


def fields(seed, f, d=3, lanes=4):
    return np.random.default_rng(seed).normal(size=(2, d, f, lanes))


def score(q1, q2, v, slopes):
    """`integral <q1(tau - v), q2(tau + v)> sqrt(1 - v'^2)` of one lane, by the trapezoidal rule; v in units of 1/f."""
    f, n = q1.shape[1], len(v) - 1
    row = slopes * np.arange(n + 1)
    product = np.sum(q1[:, (row - v) % f] * q2[:, (row + v) % f], axis=0)
    weight = np.sqrt(np.maximum(1 - (np.diff(v) / slopes) ** 2, 0))
    return float(np.sum(weight * (product[1:] + product[:-1])) / (2 * n))


def every_path(n, width, slopes):
    for steps in itertools.product(range(-slopes, slopes + 1), repeat=n):
        v = np.concatenate([[0], np.cumsum(steps)])
        if v[-1] == 0 and np.abs(v).max() <= width:
            yield v


def best_total(q1, q2, width, slopes):
    """The same in numpy, node by node, of one lane."""
    f = q1.shape[1]
    n = f // slopes
    at = lambda k, j: float(q1[:, (slopes * k - j) % f] @ q2[:, (slopes * k + j) % f])  # noqa: E731
    total = {0: 0.0}
    for k in range(1, n + 1):
        reached = {}
        for j in range(-width, width + 1):
            for step in range(-slopes, slopes + 1):
                if j - step in total:
                    weight = math.sqrt(1 - (step / slopes) ** 2) / (2 * n)
                    value = total[j - step] + weight * (at(k - 1, j - step) + at(k, j))
                    reached[j] = max(reached.get(j, -np.inf), value)
        total = reached
    return total[0]


def checked(q1, q2, v, total, width, slopes, atol=1e-5):
    """v is a path of the strip, and what is said of it holds: every step is the one that was taken."""
    v = np.asarray(v)
    assert (v[0] == 0).all()
    assert (v[-1] == 0).all()
    assert np.abs(v).max() <= width
    assert np.abs(np.diff(v, axis=0)).max() <= slopes
    own = [score(q1[..., lane], q2[..., lane], v[:, lane], slopes) for lane in range(v.shape[1])]
    np.testing.assert_allclose(total, own, atol=atol)


@pytest.mark.parametrize("slopes", [1, 2, 3])
@pytest.mark.parametrize("width", [1, 2])
def test_the_path_is_the_best_of_all(width, slopes):
    n = 5
    q1, q2 = fields(width + 10 * slopes, n * slopes)
    v, total = best_path(jnp.asarray(q1), jnp.asarray(q2), width=width, slopes=slopes)
    checked(q1, q2, v, total, width, slopes)
    for lane in range(q1.shape[-1]):
        best = max(score(q1[..., lane], q2[..., lane], path, slopes) for path in every_path(n, width, slopes))
        assert float(total[lane]) == pytest.approx(best, abs=1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("n", "width", "slopes"), [(24, 8, 2), (32, 6, 3), (20, 10, 5)])
def test_on_larger_grids_it_is_as_good_as_numpys(n, width, slopes, dtype):
    q1, q2 = fields(n, n * slopes, lanes=2)
    with x64():
        v, total = best_path(jnp.asarray(q1, dtype), jnp.asarray(q2, dtype), width=width, slopes=slopes)
        assert total.dtype == dtype
    atol = 1e-4 if dtype == np.float32 else 1e-12
    checked(q1, q2, v, total, width, slopes, atol)
    expected = [best_total(q1[..., lane], q2[..., lane], width, slopes) for lane in range(2)]
    np.testing.assert_allclose(total, expected, atol=atol)


@pytest.mark.parametrize("slopes", [1, 2, 3])
def test_more_slopes_and_wider_strips_are_never_worse(slopes):
    """With twice the slopes on the same rows, every step of before is still there; so it is in a wider strip."""
    n, width = 16, 4
    q1, q2 = fields(slopes, 2 * n * slopes, lanes=32)
    run = ft.partial(best_path, slopes=slopes)
    coarse = [jnp.asarray(q[:, ::2]) for q in (q1, q2)]
    before = np.asarray(run(*coarse, width=width)[1])
    finer = np.asarray(best_path(jnp.asarray(q1), jnp.asarray(q2), width=2 * width, slopes=2 * slopes)[1])
    wider = np.asarray(run(*coarse, width=width + 3)[1])
    assert (finer >= before - 1e-5).all()
    assert (finer > before + 1e-3).any()
    assert (wider >= before - 1e-5).all()


@pytest.mark.parametrize("slopes", [1, 2, 4])
def test_steps_that_weigh_nothing_are_followed_back(slopes):
    """Fields that are opposite everywhere: the best is to move on one curve alone, then on the other, for nothing."""
    n, width = 12, 2 * slopes
    q1 = np.abs(fields(slopes, n * slopes)[0]) + 0.1
    v, total = best_path(jnp.asarray(q1), jnp.asarray(-q1), width=width, slopes=slopes)
    checked(q1, -q1, v, total, width, slopes)
    np.testing.assert_allclose(total, 0, atol=1e-5)
    np.testing.assert_array_equal(np.abs(np.diff(v, axis=0)), slopes)


def test_exchanged_curves_take_the_mirrored_path():
    q1, q2 = (jnp.asarray(q) for q in fields(5, 40))
    (v, total), (back, again) = (best_path(*pair, width=8, slopes=2) for pair in ((q1, q2), (q2, q1)))
    np.testing.assert_array_equal(v, -back)
    np.testing.assert_allclose(total, again, atol=1e-5)


def test_a_curve_is_laid_onto_itself_without_a_warp():
    q = fourier(1, 3, n=32).transpose(1, 2, 0)
    q = jnp.asarray(q / np.linalg.norm(q, axis=0))
    v, total = best_path(q, q, width=8, slopes=2)
    np.testing.assert_array_equal(v, 0)
    np.testing.assert_allclose(total, 1, atol=1e-5)


def test_a_warped_copy_is_followed():
    """Fields of one curve at `tau - v` and `tau + v` are the same along the path v."""
    f, slopes = 128, 4
    tau = np.arange(f) / f
    v = 0.04 * np.sin(2 * np.pi * tau) ** 2

    def curve(x):
        angle = 2 * np.pi * x + np.sin(6 * np.pi * x)
        return np.stack([np.cos(angle), np.sin(angle)])

    inverse = lambda sign: np.interp(tau, np.append(tau, 1) + sign * np.append(v, 0), np.append(tau, 1))  # noqa: E731
    q1, q2 = (jnp.asarray(curve(inverse(sign))[..., None]) for sign in (-1, 1))
    found, _ = best_path(q1, q2, width=12, slopes=slopes)
    np.testing.assert_allclose(np.asarray(found)[:, 0] / f, np.append(v, 0)[::slopes], atol=2.5 / f)


def test_lanes_do_not_mix():
    """Nor does one that is NaN."""
    q1, q2 = fields(9, 40, lanes=3)
    together, totals = best_path(jnp.asarray(q1), jnp.asarray(q2), width=5, slopes=2)
    q1[..., 0] = np.nan
    beside, others = best_path(jnp.asarray(q1), jnp.asarray(q2), width=5, slopes=2)
    np.testing.assert_array_equal(together[:, 1:], beside[:, 1:])
    np.testing.assert_array_equal(totals[1:], others[1:])
    alone, total = best_path(jnp.asarray(q1[..., 1:2]), jnp.asarray(q2[..., 1:2]), width=5, slopes=2)
    np.testing.assert_array_equal(together[:, 1:2], alone)
    np.testing.assert_allclose(totals[1:2], total, atol=1e-5)
