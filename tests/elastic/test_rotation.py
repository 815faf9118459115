"""Best rotations against numpy's SVD, where it is easy and where it is not."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from elastic.shapes import kabsch, rotation, x64
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import _rotation as rotations

LANES = 24
best_rotation, rotation_gain = jax.jit(rotations.best_rotation), jax.jit(rotations.rotation_gain)


def random(seed, d):
    return np.random.default_rng(seed).normal(size=(LANES, d, d))


def with_spectrum(*values):
    """Matrices of given singular values, half of them with negative determinant."""
    d = len(values)
    turns = [(rotation(k, d), rotation(100 + k, d)) for k in range(LANES)]
    flips = [np.diag([1.0] * (d - 1) + [1.0 if k % 2 else -1.0]) for k in range(LANES)]
    return np.stack([u @ flip @ np.diag(values) @ v.T for (u, v), flip in zip(turns, flips, strict=True)])


CASES = {
    "random": lambda d: random(0, d),
    "tiny": lambda d: 1e-6 * random(1, d),
    "reflected": lambda d: with_spectrum(*np.linspace(2, 1, d)),
    "planar": lambda d: with_spectrum(*np.linspace(2, 1, d - 1), 0.0),
    "line": lambda d: with_spectrum(1.0, *[0.0] * (d - 1)),
    "equal": lambda d: with_spectrum(*[1.0] * d),
    "identity": lambda d: np.broadcast_to(np.eye(d), (LANES, d, d)),
    "half turn": lambda d: np.broadcast_to(np.diag([-1.0, -1.0] + [1.0] * (d - 2)), (LANES, d, d)),
    "zero": lambda d: np.zeros((LANES, d, d)),
}


def lanes_last(c):
    return jnp.asarray(np.moveaxis(c, 0, -1), jnp.float32)


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("case", CASES)
def test_best_rotation_reaches_the_gain_of_kabsch(case, d):
    c = CASES[case](d)
    size = max(np.abs(c).max(), 1e-6)
    found = np.moveaxis(np.asarray(best_rotation(lanes_last(c))), -1, 0)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.broadcast_to(np.eye(d), found.shape), atol=2e-6)
    np.testing.assert_allclose(np.linalg.det(found), 1, atol=2e-6)
    best = np.array([np.sum(kabsch(one) * one) if size > 1e-6 else 0 for one in c])
    np.testing.assert_allclose(np.sum(found * c, axis=(1, 2)), best, atol=1e-5 * size)


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("case", CASES)
def test_rotation_gain_is_that_of_the_best_rotation(case, d):
    """Where the best rotation is not unique, the largest root of the quartic is a multiple one, and for d = 3 Newton's
    method comes down to it slowly: the gain is then an upper bound, by at most a tenth.
    """
    c = CASES[case](d)
    size = max(np.abs(c).max(), 1e-6)
    best = np.array([np.sum(kabsch(one) * one) if size > 1e-6 else 0 for one in c])
    excess = (np.asarray(rotation_gain(lanes_last(c))) - best) / size
    assert excess.min() > -1e-5
    assert excess.max() < {"equal": 0.1, "line": 6e-3}.get(case, 1e-5)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 100_000), st.sampled_from([2, 3, 4]), st.floats(-3, 3))
def test_best_rotations_are_rotations_and_turn_with_the_curves(seed, d, exponent):
    c, turn = random(seed, d) * 10**exponent, rotation(seed, d)
    found = np.asarray(best_rotation(lanes_last(c)))
    turned = np.asarray(best_rotation(lanes_last(turn @ c)))
    gain = np.sum(np.moveaxis(turned, -1, 0) * (turn @ c), axis=(1, 2))
    np.testing.assert_allclose(np.linalg.det(np.moveaxis(found, -1, 0)), 1, atol=1e-5)
    np.testing.assert_allclose(gain, np.sum(np.moveaxis(found, -1, 0) * c, axis=(1, 2)), atol=2e-5 * 10**exponent)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_no_small_turn_away_is_better(d):
    c = random(5, d)
    found = np.moveaxis(np.asarray(best_rotation(lanes_last(c)), float), -1, 0)
    gain = np.sum(found * c, axis=(1, 2))
    for seed in range(5):
        skew = np.random.default_rng(seed).normal(size=(d, d)) * 0.02
        q, r = np.linalg.qr(np.eye(d) + skew - skew.T)
        assert (np.sum(found @ (q * np.sign(np.diag(r))) * c, axis=(1, 2)) <= gain + 1e-6).all()


def test_any_number_of_lane_axes():
    c = lanes_last(random(2, 3))
    found = best_rotation(c.reshape(3, 3, 4, 6))
    np.testing.assert_allclose(found.reshape(3, 3, LANES), best_rotation(c), atol=1e-6)
    np.testing.assert_allclose(rotation_gain(c.reshape(3, 3, 4, 6)).ravel(), rotation_gain(c), rtol=1e-5)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("case", ["random", "identity", "zero", "line"])
def test_derivatives_are_finite(case, d):
    c = lanes_last(CASES[case](d))
    gradient = jax.grad(lambda c: best_rotation(c).sum())(c)
    if case != "zero":
        assert np.isfinite(gradient).all()


def test_covariances_follow_their_definition():
    generator = np.random.default_rng(0)
    q1, q2 = (generator.normal(size=(d, 5, 20)).astype(np.float32) for d in (3, 3))
    found = rotations.covariance(jnp.asarray(q1), jnp.asarray(q2))
    np.testing.assert_allclose(found, np.einsum("ilk,jlk->ijl", q1, q2) / 20, atol=1e-6)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_generators_are_a_basis_of_the_antisymmetric_matrices(d):
    """One at a time, on a field: `E q`; on the identity: E itself."""
    basis = [np.asarray(e) for e in rotations.generators(jnp.eye(d))]
    assert len(basis) == d * (d - 1) // 2
    for e in basis:
        np.testing.assert_array_equal(e, -e.T)
    assert np.linalg.matrix_rank(np.stack([e.ravel() for e in basis])) == len(basis)
    field = np.random.default_rng(1).normal(size=(d, 6)).astype(np.float32)
    for e, turned in zip(basis, rotations.generators(jnp.asarray(field)), strict=True):
        np.testing.assert_allclose(turned, e @ field, atol=1e-6)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_products_with_generators_follow_from_covariances(d):
    p, q = np.random.default_rng(2).normal(size=(2, d, 1, 50))
    with x64():
        turned = [np.asarray(e) for e in rotations.generators(jnp.asarray(q))]
        of = lambda x, y: rotations.covariance(jnp.asarray(x), jnp.asarray(y))  # noqa: E731
        components, products = rotations.generator_components(of(p, q)), rotations.generator_products(of(q, q))
    np.testing.assert_allclose(components[:, 0], [np.mean((p * e).sum(axis=0)) for e in turned], atol=1e-12)
    expected = [[np.mean((e * f).sum(axis=0)) for f in turned] for e in turned]
    np.testing.assert_allclose(products[..., 0], expected, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_cayleys_rotations_are_exponentials_but_for_third_order(d):
    with x64():
        basis = np.stack([np.asarray(e) for e in rotations.generators(jnp.eye(d))])
        x = np.random.default_rng(2).normal(size=(len(basis), 6))
        errors = []
        for size in (1.0, 1e-1, 1e-2):
            found = np.moveaxis(np.asarray(rotations.cayley(jnp.asarray(size * x), d)), -1, 0)
            np.testing.assert_allclose(
                found @ found.swapaxes(1, 2), np.broadcast_to(np.eye(d), found.shape), atol=1e-12
            )
            np.testing.assert_allclose(np.linalg.det(found), 1, atol=1e-12)
            exact = scipy.linalg.expm(np.einsum("gl,gij->lij", size * x, basis))
            errors.append(np.abs(found - exact).max())
        assert errors[1] < 3e-3 * errors[0]
        assert errors[2] < 2e-3 * errors[1]
