"""SRVFs against closed forms and the definition; the way there and back."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, moved, rotation, srvf
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import to_curve, to_srvf


def test_srvf_of_a_circle_is_its_unit_tangent():
    t = 2 * np.pi * np.arange(32) / 32
    found = to_srvf(5 * np.stack([np.cos(t), np.sin(t)]) + 2)
    np.testing.assert_allclose(found, np.stack([-np.sin(t), np.cos(t)]), atol=1e-5)


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("n", [16, 101, 400])
def test_srvf_follows_the_definition_and_is_closed(n, d):
    curve = fourier(2, 2, n=n, d=d)
    found = np.asarray(to_srvf(curve))
    for one, q in zip(curve, found, strict=True):
        exact = srvf(one, np.arange(n) / n)
        np.testing.assert_allclose(q, exact / np.sqrt(np.mean(np.sum(exact**2, axis=0))), atol=2e-3)
    np.testing.assert_allclose(np.mean(np.sum(found**2, axis=1), axis=-1), 1, atol=1e-5)
    closure = np.mean(found * np.linalg.norm(found, axis=1, keepdims=True), axis=-1)
    np.testing.assert_allclose(closure, 0, atol=1e-6)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.sampled_from([2, 3, 4]), st.sampled_from([17, 32]))
def test_a_curve_comes_back_centred_and_of_unit_length(seed, d, n):
    curve = fourier(seed, n=n, d=d)
    back = np.asarray(to_curve(to_srvf(curve)))
    expected = curve - curve.mean(axis=-1, keepdims=True)
    if n % 2 == 0:
        alternating = (-1.0) ** np.arange(n)
        expected = expected - (expected @ alternating / n)[:, None] * alternating
    scale = np.sum(back * expected) / np.sum(expected**2)
    np.testing.assert_allclose(back, scale * expected, atol=1e-5)
    np.testing.assert_allclose(np.mean(back, axis=-1), 0, atol=1e-6)
    speed = np.linalg.norm(srvf(back.astype(float), np.arange(n) / n), axis=0) ** 2
    np.testing.assert_allclose(np.mean(speed), 1, rtol=1e-4)


@settings(max_examples=10, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.floats(0.01, 100), st.floats(-10, 10))
def test_position_and_scale_are_forgotten_and_rotations_carried_along(seed, scale, shift):
    curve = fourier(seed, n=32)
    found = to_srvf(moved(curve, seed, scale, scale * shift))
    np.testing.assert_allclose(found, rotation(seed) @ np.asarray(to_srvf(curve)), atol=5e-3)


def test_what_is_missing_to_closure_is_taken_out_evenly():
    q = jnp.asarray(np.random.default_rng(0).normal(size=(2, 3, 31)), jnp.float32)
    curve = np.asarray(to_curve(q))
    assert np.isfinite(curve).all()
    np.testing.assert_allclose(curve.mean(axis=-1), 0, atol=1e-6)


def test_where_the_curve_stops_the_srvf_is_zero_and_finite():
    assert np.isfinite(to_curve(jnp.zeros((3, 16)))).all()


@pytest.mark.parametrize("q", [np.zeros(9), np.zeros((1, 9)), np.zeros((3, 9), int)])
def test_what_is_no_srvf_is_refused(q):
    with pytest.raises(ValueError, match="q has shape"):
        to_curve(q)


def test_srvfs_of_repeated_samples_are_those_of_the_distinct_ones():
    curve = fourier(3, 4, n=40)
    found = np.asarray(to_srvf(np.repeat(curve, 2, axis=-1)))
    np.testing.assert_allclose(found[..., ::2], to_srvf(curve), atol=2e-3)
    once = curve[..., [*range(40), 0]]
    np.testing.assert_allclose(to_srvf(once), to_srvf(np.concatenate([curve, curve[..., :1]], axis=-1)), atol=1e-6)
    again = np.asarray(to_srvf(once))
    np.testing.assert_allclose(np.mean(again * np.linalg.norm(again, axis=1, keepdims=True), axis=-1), 0, atol=1e-6)


@pytest.mark.parametrize("size", [1e-20, 1e19, 1e25])
def test_size_plays_no_part(size):
    curve = fourier(5, 2, n=40).astype(np.float32)
    q = to_srvf(curve)
    np.testing.assert_allclose(to_srvf(curve * np.float32(size)), q, atol=1e-5)
    np.testing.assert_allclose(jax.jit(to_srvf)(curve * np.float32(size)), q, atol=1e-4)
    np.testing.assert_allclose(to_curve(q * np.float32(size)), to_curve(q), atol=1e-6)
    np.testing.assert_allclose(jax.jit(to_curve)(q * np.float32(size)), to_curve(q), atol=1e-6)


def test_derivatives_of_traced_srvfs_are_finite():
    curve = fourier(6, 2, n=33).astype(np.float32)
    assert jnp.isfinite(jax.jit(jax.grad(lambda c: jnp.sum(to_srvf(c) ** 3)))(curve)).all()
