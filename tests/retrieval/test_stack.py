"""Stacks of parts: slices, gaps, units, blocks."""

import dataclasses

import numpy as np
import pytest

from curvematch_jax.retrieval._stack import object_blocks, stack, unbroken


@pytest.mark.parametrize("taken", [[1, 2], [0, 3], [2], [1]])
def test_some_objects_of_a_stack_are_the_stack_of_some(make_parts, taken):
    objects = [make_parts(f"{n}", seed=n, parts=n) for n in (2, 0, 3, 1)]
    objects[2].mask[1, 1:] = False
    found, expected = stack(objects).taken(np.array(taken)), stack([objects[k] for k in taken])
    for name in ("curves", "rows", "log_lengths", "log_level_sets", "log_units", "starts"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)


def test_levels_beyond_a_gap_do_not_count():
    mask = np.array([[1, 1, 0, 1, 1], [0, 0, 1, 1, 0], [1, 1, 1, 1, 1], [0, 0, 0, 0, 0], [0, 1, 0, 1, 0]], bool)
    found = unbroken(mask).astype(int)
    expected = [[1, 1, 0, 0, 0], [0, 0, 1, 1, 0], [1, 1, 1, 1, 1], [0, 0, 0, 0, 0], [0, 1, 0, 0, 0]]
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("counts", "blocks"),
    [
        ([2, 2, 2], [(0, 2), (2, 3)]),
        ([9, 1, 1], [(0, 1), (1, 3)]),
        ([0, 0], [(0, 2)]),
        ([4], [(0, 1)]),
        ([1, 9, 1], [(0, 1), (1, 2), (2, 3)]),
    ],
)
def test_blocks_hold_every_object_once(counts, blocks):
    starts = np.cumsum([0, *counts])
    assert [(block.start, block.stop) for block in object_blocks(starts, parts=4)] == blocks


def test_lengths_are_in_the_unit_that_is_asked_for(make_parts):
    small = make_parts("small", parts=1)
    large = dataclasses.replace(small, area=small.area * 4, diameter=small.diameter * 2)
    for unit in ("area", "diameter"):
        both = stack([small, large], unit)
        np.testing.assert_allclose(both.log_lengths[0], both.log_lengths[1], rtol=1e-6)
    both = stack([small, large], "mesh")
    np.testing.assert_allclose(both.log_lengths[1] - both.log_lengths[0], np.log(2), rtol=1e-5)
    np.testing.assert_allclose(both.log_lengths[0], np.log(small.lengths[0] * small.diameter), rtol=1e-5)
