"""Parts that a symmetry exchanges: made parts whose symmetry is known, and generated creatures."""

import dataclasses
import functools as ft

import numpy as np
import pytest

from curvematch_jax.datasets import creature
from curvematch_jax.retrieval import Matching, symmetric_parts
from curvematch_jax.retrieval._symmetry import mirrored, self_distances
from curvematch_jax.surface import Extraction, extract_parts

_PER_PART = ("curves", "mask", "lengths", "level_set_lengths", "centres", "areas", "points")


def taken(parts, index):
    """The parts in another order; an index may come twice."""
    fields = {name: getattr(parts, name)[index] for name in _PER_PART}
    return dataclasses.replace(parts, **fields, feature_distances=parts.feature_distances[np.ix_(index, index)])


def from_places(parts, places):
    """The same parts with feature points at these places, as far apart as in space."""
    places = np.asarray(places, np.float32)
    between = np.linalg.norm(places[:, None] - places, axis=-1).astype(np.float32)
    return dataclasses.replace(parts, points=places, feature_distances=between / between.max())


@pytest.fixture(name="make_parts")
def fixture_make_parts(make_parts):
    """With as many samples as the creature's parts have, so that one compilation does for all."""
    return ft.partial(make_parts, settings=Extraction(levels=3))


@pytest.fixture(name="animal")
def fixture_animal(make_parts):
    """Head, left and right hand, left and right foot: the right ones are the mirror images of the left ones."""
    parts = make_parts(seed=3)
    parts = taken(parts, [0, 1, 1, 2, 2])
    curves = parts.curves.copy()
    curves[[2, 4]] = mirrored(parts).curves[[2, 4]]
    places = [[0, 2, 0], [-1.5, 1, 0], [1.5, 1, 0], [-0.5, -2, 0], [0.5, -2, 0]]
    return from_places(dataclasses.replace(parts, curves=curves), places)


def test_mirrored_pairs_are_groups_and_the_rest_stays_alone(animal):
    assert symmetric_parts(animal) == ((0,), (1, 2), (3, 4))


def test_parts_are_compared_with_mirror_images(animal):
    distances = self_distances(animal, Matching())
    np.testing.assert_allclose(distances, distances.T)
    assert distances[1, 2] < 1e-3
    assert distances[1, 3] > 0.3
    np.testing.assert_array_equal(mirrored(mirrored(animal)).curves, animal.curves)


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_parts_does_not_matter(animal, seed):
    order = np.random.default_rng(seed).permutation(5)
    groups = {frozenset(order[list(group)].tolist()) for group in symmetric_parts(taken(animal, order))}
    assert groups == {frozenset({0}), frozenset({1, 2}), frozenset({3, 4})}


def test_like_parts_that_the_distances_tell_apart_are_not_exchanged(animal):
    """One hand next to the head, the other between the feet."""
    places = animal.points.copy()
    places[1:3] = [[0.0, 1.8, 0.0], [0.0, -2.2, 0.0]]
    assert symmetric_parts(from_places(animal, places)) == ((0,), (1,), (2,), (3, 4))


def test_a_part_without_counterpart_does_not_hide_the_symmetry(animal):
    assert symmetric_parts(taken(animal, [0, 1, 2, 3])) == ((0,), (1, 2), (3,))


def test_what_several_symmetries_exchange_is_one_group(make_parts):
    table = taken(make_parts(seed=1), [0, 0, 0, 0])
    places = [[-2, -1, 0], [2, -1, 0], [-2, 1, 0], [2, 1, 0]]
    assert symmetric_parts(from_places(table, places)) == ((0, 1, 2, 3),)


def test_a_shape_without_symmetry_has_single_parts(make_parts):
    parts = make_parts(parts=6, seed=5)
    assert symmetric_parts(from_places(parts, parts.points)) == tuple((k,) for k in range(6))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_parts(make_parts, count):
    assert symmetric_parts(make_parts(parts=count)) == tuple((k,) for k in range(count))


def test_two_like_parts_are_exchanged(make_parts):
    assert symmetric_parts(taken(make_parts(), [0, 0])) == ((0, 1),)


@pytest.mark.parametrize("limit", [0.0, -1.0, np.inf, np.nan])
def test_the_limit_is_a_positive_number(make_parts, limit):
    with pytest.raises(ValueError, match="limit must be a positive number"):
        symmetric_parts(make_parts(), limit=limit)


def test_left_and_right_limbs_of_a_human_pair_up():
    """Feature points at rest mirror each other in x: hands with hands, feet with feet."""
    pytest.importorskip("manifold3d")
    parts = extract_parts(creature("human").mesh)
    sides = [group for group in symmetric_parts(parts) if len(group) > 1]
    assert len(sides) >= 2
    for group in sides:
        left, right = parts.points[group[0]], parts.points[group[-1]] * [-1, 1, 1]
        assert len(group) == 2
        assert np.linalg.norm(left - right) < 0.1 * parts.diameter
