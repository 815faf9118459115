"""The search: its paths, what they achieve, and that the first curve is no more than the second."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import LEAN
from elastic.shapes import fourier, rotation

from curvematch_jax.elastic import Round
from curvematch_jax.elastic._search import from_all_starts, search
from curvematch_jax.elastic._tables import tabulate

PAIRS = 4
find = jax.jit(search, static_argnames="rounds")
every = jax.jit(from_all_starts, static_argnames="round_")


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return tuple(tabulate(jnp.asarray(fourier(s, PAIRS), jnp.float32)) for s in (0, 100))


@pytest.fixture(name="found", scope="module")
def fixture_found(pair):
    return find(*pair, LEAN.rounds, pair[0].count[0] > 0)


def test_paths_are_paths(found):
    kept, nodes = LEAN.rounds[-1].paths, LEAN.rounds[-1].nodes
    assert found.warp1.shape == found.warp2.shape == (PAIRS, kept, nodes + 1)
    assert found.rotation.shape == (3, 3, PAIRS, kept)
    for warp in (found.warp1, found.warp2):
        assert np.diff(warp).min() >= -1e-6
        np.testing.assert_allclose(warp[..., -1], warp[..., 0] + 1, atol=1e-5)
    turns = np.moveaxis(np.asarray(found.rotation), (0, 1), (-2, -1))
    np.testing.assert_allclose(turns @ turns.swapaxes(-1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-5)


def test_the_best_come_first(found):
    best = found.best(1)
    np.testing.assert_array_equal(best.cosine[:, 0], np.max(found.cosine, axis=1))
    where = np.argmax(found.cosine, axis=1)
    np.testing.assert_array_equal(best.warp1[:, 0], np.asarray(found.warp1)[np.arange(PAIRS), where])
    np.testing.assert_array_equal(best.rotation[..., 0], np.asarray(found.rotation)[:, :, np.arange(PAIRS), where])
    assert found.best(LEAN.rounds[-1].paths) is found


def test_nothing_kept_apart_finds_the_same(pair, found):
    plain = find(*pair, LEAN.rounds, None)
    np.testing.assert_allclose(plain.cosine, found.cosine, atol=1e-4)


@pytest.mark.parametrize("count", [1, 4, 16, 64])
def test_starts_are_even_shifts_with_their_best_rotations(count):
    """Of a turned copy that begins a quarter of a turn later, that start has the rotation back."""
    curve = fourier(5, 1, n=128).astype(np.float32)
    copy = np.einsum("ij,bjn->bin", rotation(1), np.roll(curve, -32, axis=-1)).astype(np.float32)
    found = every(tabulate(jnp.asarray(curve)), tabulate(jnp.asarray(copy)), Round(count, 32, 6), None)
    assert found.warp2.shape == (1, count, 33)
    np.testing.assert_allclose(found.warp1[..., [0, -1]], np.broadcast_to([0.0, 1.0], (1, count, 2)))
    np.testing.assert_allclose(found.warp2[0, :, 0], np.arange(count) / count, atol=1e-6)
    np.testing.assert_allclose(found.warp2[..., -1], found.warp2[..., 0] + 1, atol=1e-6)
    assert found.cosine.shape == (1, count)
    if count > 1:
        np.testing.assert_allclose(found.rotation[..., 0, 3 * count // 4], rotation(1).T, atol=0.05)
        assert np.argmax(found.cosine[0]) == 3 * count // 4


@pytest.mark.parametrize("broken", [0, 2])
def test_a_pair_of_nan_leaves_the_others_as_they_are(pair, found, broken):
    first = jax.tree.map(lambda x: x.at[broken].set(jnp.nan) if x.dtype == jnp.float32 else x, pair[0])
    again = find(first, pair[1], LEAN.rounds, first.count[0] > 0)
    others = np.arange(PAIRS) != broken
    np.testing.assert_array_equal(again.cosine[others], found.cosine[others])
    np.testing.assert_array_equal(again.warp1[others], found.warp1[others])
