"""Tables on the circle against linear interpolation in numpy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import lift, warps, x64

from curvematch_jax.elastic import _lookup as lookup

PAIRS, CAPACITY = 3, 64
periodic, nearest, lifted = (jax.jit(f) for f in (lookup.periodic, lookup.nearest, lookup.lifted))
COUNTS = np.array([40, 64, 17], np.int32)


def places(count=200, low=-3.0, high=3.0):
    return np.random.default_rng(0).uniform(low, high, size=(PAIRS, count))


def fields(d=3, seed=1):
    """Tables whose entries behind `COUNTS` are never to be read."""
    field = np.random.default_rng(seed).normal(size=(PAIRS, d, CAPACITY))
    for row, count in zip(field, COUNTS, strict=True):
        row[:, count:] = np.nan
    return field


def interpolated(field, x):
    """Of one pair."""
    count = field.shape[1]
    position = (x % 1) * count
    index = np.floor(position).astype(int) % count
    left, right = field[:, index], field[:, (index + 1) % count]
    return left + (right - left) * (position - np.floor(position))


@pytest.mark.parametrize("d", [2, 3, 4])
def test_values_are_those_of_linear_interpolation(d):
    field, x = fields(d), places()
    with x64():
        found = periodic(jnp.asarray(field), jnp.asarray(COUNTS), jnp.asarray(x))
    assert found.shape == (d, PAIRS, x.shape[1])
    for pair, count in enumerate(COUNTS):
        np.testing.assert_allclose(found[:, pair], interpolated(field[pair, :, :count], x[pair]), atol=1e-12)


def test_integrals_are_read_with_their_field_at_any_real():
    """The integral of a field that is constant on the pieces of its table, over any number of turns."""
    field, x = np.nan_to_num(fields()), places()
    table = np.concatenate([np.zeros((PAIRS, 3, 1)), np.cumsum(field, axis=-1)], axis=-1) / COUNTS[:, None, None]
    with x64():
        found, value = lookup.summed(jnp.asarray(table), jnp.asarray(COUNTS), jnp.asarray(x))
    for pair, count in enumerate(COUNTS):
        here, turns = field[pair, :, :count], np.floor(x[pair])
        index = np.floor((x[pair] - turns) * count).astype(int) % count
        before = np.concatenate([np.zeros((3, 1)), np.cumsum(here, axis=-1)], axis=-1)[:, index] / count
        inside = here[:, index] * ((x[pair] - turns) - index / count)
        np.testing.assert_allclose(value[:, pair], here[:, index], atol=1e-9)
        np.testing.assert_allclose(
            found[:, pair], before + inside + turns * here.sum(axis=-1)[:, None] / count, atol=1e-9
        )


def test_the_nearest_entry_is_read():
    field, x = fields(), places()
    found = np.asarray(nearest(field.astype(np.float32), COUNTS, x.astype(np.float32)))
    for pair, count in enumerate(COUNTS):
        index = np.round((x[pair] % 1) * count).astype(int) % count
        clear = np.abs((x[pair] * count) % 1 - 0.5) > 1e-3
        np.testing.assert_allclose(found[:, pair, clear], field[pair][:, index[clear]], rtol=1e-6)


def test_warps_are_read_at_any_real():
    table, x = warps(2, PAIRS, 32).T, places()
    with x64():
        found, slope = lifted(jnp.asarray(table), jnp.asarray(x))
    grid = np.linspace(0, 1, 33)
    for pair in range(PAIRS):
        np.testing.assert_allclose(found[pair], lift(x[pair], grid, table[pair]), atol=1e-12)
        index = np.floor((x[pair] % 1) * 32).astype(int)
        np.testing.assert_allclose(slope[pair], 32 * np.diff(table[pair])[index], atol=1e-9)


@pytest.mark.parametrize("x", [-1e-20, 1 - 2.0**-24, 1.0, -1.0, 0.0])
def test_the_seam_is_read_as_any_place(x):
    """`x - floor(x)` of a tiny negative number rounds to 1."""
    field = fields().astype(np.float32)
    where = np.full((PAIRS, 1), x, np.float32)
    for found in (periodic(field, COUNTS, where), nearest(field, COUNTS, where)):
        np.testing.assert_allclose(found[:, :, 0].T, field[:, :, 0], atol=1e-4)
    table = warps(3, PAIRS, 32).T.astype(np.float32)
    np.testing.assert_allclose(lifted(table, where)[0][:, 0], table[:, 0] + round(x), atol=1e-5)


@pytest.mark.parametrize("broken", range(PAIRS))
def test_a_pair_of_nan_leaves_the_others_as_they_are(broken):
    field, table, x = np.nan_to_num(fields()), warps(3, PAIRS, 32).T, places()
    others = np.arange(PAIRS) != broken
    plain = periodic(field, COUNTS, x), nearest(field, COUNTS, x), lifted(table, x)[0][None]
    field[broken], table[broken] = np.nan, np.nan
    again = periodic(field, COUNTS, x), nearest(field, COUNTS, x), lifted(table, x)[0][None]
    for before, after in zip(plain, again, strict=True):
        np.testing.assert_array_equal(after[:, others], before[:, others])
