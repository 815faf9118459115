"""Start points against a plain loop over the shifts."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, kabsch, rotation

from curvematch_jax.elastic import _start as starts

best_start, shift_covariances = jax.jit(starts.best_start), jax.jit(starts.shift_covariances)


def tangents(seed, count, n, d=3, **move):
    curve = fourier(seed, count, n=n, d=d, **move)
    step = np.roll(curve, -1, axis=-1) - np.roll(curve, 1, axis=-1)
    return step / np.linalg.norm(step, axis=1, keepdims=True)


def brute_force(t1, t2):
    n = t1.shape[-1]
    return np.stack([np.einsum("bik,bjk->ijb", t1, np.roll(t2, -s, axis=-1)) / n for s in range(n)], axis=2)


@pytest.mark.parametrize("n", [16, 34])
@pytest.mark.parametrize("d", [2, 3, 4])
def test_covariances_of_all_shifts(n, d):
    t1, t2 = tangents(0, 3, n, d), tangents(1, 3, n, d)
    found = shift_covariances(jnp.asarray(t1), jnp.asarray(t2))
    np.testing.assert_allclose(found, brute_force(t1, t2), atol=1e-6)


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.4003, 0.99])
def test_the_peak_between_samples_is_found(shift):
    """A copy that starts `shift` later is laid back by `-shift`, to within a twentieth of a sample."""
    n = 64
    t1 = tangents(4, 2, n, modes=2)
    t2 = np.einsum("ij,bjn->bin", rotation(1), tangents(4, 2, n, modes=2, shift=shift))
    peak = best_start(shift_covariances(jnp.asarray(t1), jnp.asarray(t2)))
    error = (np.asarray(peak.shift) / n + shift + 0.5) % 1 - 0.5
    np.testing.assert_allclose(error * n, 0, atol=0.06)
    for lane in range(2):
        turn = kabsch(np.asarray(peak.covariance[..., lane], float))
        np.testing.assert_allclose(turn, rotation(1).T, atol=0.02)
    np.testing.assert_allclose(sum(peak.weights), 1, atol=1e-6)
    assert (np.abs(np.asarray(peak.shift) - np.asarray(peak.nearest)) <= 0.5).all()


def test_the_peak_of_a_constant_gain_is_finite():
    t = 2 * np.pi * np.arange(16) / 16
    circle = jnp.asarray(np.stack([np.cos(t), np.sin(t)])[None])
    peak = best_start(shift_covariances(circle, circle))
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(peak))
