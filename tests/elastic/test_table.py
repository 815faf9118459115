"""Packed tables against plain linear interpolation in numpy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import unit_tangents, x64

from curvematch_jax.elastic import _table as table

T, LANES = 40, 3
BOUND = {np.float32: 3e-5, np.float64: 5e-10}  # half of the bits each: what a component is resolved to
pack, value_at, look_up = jax.jit(table.pack), jax.jit(table.value_at), jax.jit(table.look_up)


def places(dtype, low=-3.0, high=3.0, count=200):
    return jnp.asarray(np.random.default_rng(0).uniform(low, high, size=(count, LANES)), dtype)


def interpolated(values, x):
    """Periodic linear interpolation of `(d, t, l)` and its derivative, by numpy."""
    t = values.shape[1]
    position = (np.asarray(x, float) % 1) * t
    index = np.floor(position).astype(int) % t
    lane = np.arange(x.shape[1])
    left, right = values[:, index, lane], values[:, (index + 1) % t, lane]
    return left + (right - left) * (position - np.floor(position)), (right - left) * t


@pytest.fixture(name="dtype", params=[np.float32, np.float64], ids=["float32", "float64"])
def fixture_dtype(request):
    with x64():
        yield request.param


@pytest.mark.parametrize("d", [2, 3, 4])
def test_values_and_derivatives_are_those_of_linear_interpolation(dtype, d):
    """To the packing's rounding: half a unit of the value, and one of the rise, which is twice as coarse."""
    values = unit_tangents(0, LANES, T, d)
    x = places(dtype)
    packed = pack(jnp.asarray(values, dtype))
    found, derivative = look_up(x, packed)
    expected, slope = interpolated(values, x)
    assert found.dtype == derivative.dtype == dtype
    np.testing.assert_allclose(found, expected, atol=1.5 * BOUND[dtype])
    np.testing.assert_allclose(derivative, slope, atol=1.1 * T * BOUND[dtype])
    np.testing.assert_array_equal(value_at(x, packed), found)


def test_nodes_are_resolved_to_half_of_the_bits(dtype):
    values = unit_tangents(1, LANES, T)
    nodes = jnp.asarray(np.broadcast_to(np.arange(T)[:, None] / T, (T, LANES)), dtype)
    found = value_at(nodes, pack(jnp.asarray(values, dtype)))
    assert np.abs(np.asarray(found) - values).max() < 0.6 * BOUND[dtype] + 1e-6 * (dtype == np.float32)


def test_the_largest_components_and_rises_fit(dtype):
    """From -1 to 1 in one step, on every sample."""
    values = np.where(np.arange(T)[None, :, None] % 2, 1.0, -1.0) * np.ones((2, 1, LANES))
    found, derivative = look_up(places(dtype), pack(jnp.asarray(values, dtype)))
    expected, slope = interpolated(values, places(dtype))
    np.testing.assert_allclose(found, expected, atol=2e-4 if dtype == np.float32 else 2 * BOUND[dtype])
    np.testing.assert_allclose(derivative, slope, atol=2 * T * BOUND[dtype])


def test_tables_are_periodic(dtype):
    packed = pack(jnp.asarray(unit_tangents(2, LANES, T), dtype))
    x = jnp.asarray(np.arange(64)[:, None] / 64 + np.zeros(LANES), dtype)  # dyadic: whole turns change no bit
    for turns in (-2, 1, 5):
        np.testing.assert_array_equal(value_at(x + turns, packed), value_at(x, packed))


def test_just_below_a_whole_turn_lies_at_the_seam(dtype):
    """`x - floor(x)` of a tiny negative number rounds to 1."""
    packed = pack(jnp.asarray(unit_tangents(3, LANES, T), dtype))
    seam = jnp.full((2, LANES), -1e-20, dtype)
    np.testing.assert_allclose(value_at(seam, packed), value_at(0 * seam, packed), atol=3 * BOUND[dtype])


def test_the_derivative_is_that_of_the_value(dtype):
    """Within a cell, by the difference of its two ends."""
    packed = pack(jnp.asarray(unit_tangents(4, LANES, T), dtype))
    middle = jnp.asarray((np.arange(T)[:, None] + 0.5) / T + np.zeros(LANES), dtype)
    reach = 0.4 / T
    difference = (value_at(middle + reach, packed) - value_at(middle - reach, packed)) / (2 * reach)
    np.testing.assert_allclose(look_up(middle, packed)[1], difference, atol=1e-3 if dtype == np.float32 else 1e-10)


def test_positions_are_the_integral_of_the_tangents(dtype):
    """Of a circle of length 1, whose positions are known; started at the origin, and the same after a turn."""
    t = 400
    angle = 2 * np.pi * np.arange(t) / t
    tangents = np.stack([-np.sin(angle), np.cos(angle)])[..., None] * np.ones(LANES)
    lanes = jnp.asarray(tangents, dtype)
    packed, nodes = pack(lanes), table.positions(lanes)
    x = places(dtype)
    turn = 2 * np.pi * np.asarray(x, float)
    expected = np.stack([np.cos(turn) - 1, np.sin(turn)]) / (2 * np.pi)
    np.testing.assert_allclose(table.position_at(x, packed, nodes), expected, atol=1e-5)
