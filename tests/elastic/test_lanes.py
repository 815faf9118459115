"""Arithmetic with components on the leading axes, against numpy's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from curvematch_jax.elastic import _lanes as lanes


def random(*shape, seed=0):
    return np.random.default_rng(seed).normal(size=shape).astype(np.float32)


def test_products_follow_their_definitions():
    a, b = random(3, 5, 20), random(3, 5, 20, seed=1)
    np.testing.assert_allclose(lanes.dot(jnp.asarray(a), jnp.asarray(b)), np.sum(a * b, axis=0), atol=1e-5)
    m, other = random(3, 4, 7), random(3, 4, 7, seed=1)
    np.testing.assert_allclose(
        lanes.frobenius(jnp.asarray(m), jnp.asarray(other)), np.sum(m * other, axis=(0, 1)), atol=1e-5
    )


def test_fields_are_turned():
    turn, field = random(3, 3, 5), random(3, 5, 20, seed=1)
    found = lanes.rotate(jnp.asarray(turn)[..., None], jnp.asarray(field))
    np.testing.assert_allclose(found, np.einsum("ijl,jlk->ilk", turn, field), atol=1e-5)


@pytest.mark.parametrize("shape", [(2, 2, 2), (3, 3, 3), (4, 6, 2)])
def test_matrices_are_multiplied(shape):
    d, e, f = shape
    a, b = random(d, e, 9), random(e, f, 9, seed=1)
    found = lanes.multiply(jnp.asarray(a), jnp.asarray(b))
    np.testing.assert_allclose(found, np.einsum("del,efl->dfl", a, b), atol=1e-5)


@pytest.mark.parametrize("m", [1, 2, 3, 6])
def test_small_systems_are_solved(m):
    """Those whose symmetric part is positive definite: symmetric ones, and one minus an antisymmetric matrix."""
    root, right = random(m, m, 9), random(m, 2, 9, seed=1)
    symmetric = np.einsum("ikl,jkl->ijl", root, root) + np.eye(m, dtype=np.float32)[..., None]
    skew = np.eye(m, dtype=np.float32)[..., None] + root - np.swapaxes(root, 0, 1)
    for a in (symmetric, skew):
        found = np.asarray(lanes.solve(jnp.asarray(a), jnp.asarray(right)), float)
        np.testing.assert_allclose(np.einsum("ijl,jkl->ikl", a, found), right, atol=1e-4)


@pytest.mark.parametrize("n", [1, 7, 16, 24, 100, 512])
def test_running_sums_are_those_of_the_entries_before(n):
    x = random(2, 3, n)
    expected = np.cumsum(x.astype(float), axis=-1) - x
    np.testing.assert_allclose(lanes.running_sum(jnp.asarray(x)), expected, atol=2e-5 * max(n, 8) ** 0.5)


@pytest.mark.parametrize("back_ends", [("cpu",), ()], ids=["split", "plain"])
def test_what_is_kept_apart_is_the_same_as_what_is_not(back_ends, monkeypatch):
    """With the named switch on and off, and without a predicate; in reverse, and for whole batches."""
    monkeypatch.setattr(lanes, "SPLIT_FUSIONS", back_ends)
    x = jnp.asarray(random(4, 8))
    true = jnp.asarray(3) > 0
    compute = lambda x: (jnp.sin(x), {"sum": x.sum(axis=1)})  # noqa: E731
    plain = compute(x)
    for predicate in (true, None):
        kept = jax.jit(lambda p, x: lanes.fusion_barrier(compute, p, x))(predicate, x)
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-6), kept, plain)
        pulled = jax.grad(lambda x, p=predicate: lanes.fusion_barrier(compute, p, x)[0].sum())(x)
        np.testing.assert_allclose(pulled, np.cos(x), atol=1e-6)
        each = jax.vmap(lambda x, p=predicate: lanes.fusion_barrier(jnp.exp, p, x))(x)
        np.testing.assert_allclose(each, np.exp(x), rtol=1e-6)
