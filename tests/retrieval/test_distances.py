"""Part distances against the definition, curve by curve; the shortlist against all pairs."""

import dataclasses

import numpy as np
import pytest
from elastic.aligners import COARSE, LEAN

from curvematch_jax.elastic import Rigid, pair_distances
from curvematch_jax.retrieval import Matching
from curvematch_jax.retrieval import _distances as matching
from curvematch_jax.retrieval._stack import stack, unbroken

RIGID = Matching(candidates=0)


def masked(parts, *holes):
    """The same parts without some of their levels."""
    mask, curves, lengths = parts.mask.copy(), parts.curves.copy(), parts.lengths.copy()
    for hole in holes:
        mask[hole], curves[hole], lengths[hole] = False, 0, 0
    return dataclasses.replace(parts, mask=mask, curves=curves, lengths=lengths)


def by_definition(one, p, other, q, settings):
    """Equation D level by level, in plain Python."""
    levels, unequal, level_sets, weights, falling, every = [], [], [], [], [], []
    common = False
    runs = [unbroken(mask[None])[0] for mask in (one.mask[p], other.mask[q])]
    scale = (one.diameter / one.area**0.5) / (other.diameter / other.area**0.5)
    shift = [parts.area**0.5 / parts.diameter * 0.02 for parts in (one, other)]
    for k, (here, there) in enumerate(zip(*runs, strict=True)):
        ratio = (one.level_set_lengths[p, k] + shift[0]) / (other.level_set_lengths[q, k] + shift[1]) * scale
        level_sets.append(abs(np.log(ratio)))
        every.append((k + 1) ** -settings.decay)
        if not (here or there):
            continue
        weights.append(every[-1])
        falling.append((k + 1) ** -0.6)
        if here and there:
            common = True
            curves = one.curves[p, k][None], other.curves[q, k][None]
            shape = float(pair_distances(*curves, np.array([[0, 0]]), settings.aligner)[0])
            ratio = abs(np.log(one.lengths[p, k] / other.lengths[q, k] * scale))
            levels.append(shape + settings.length_weight * min(ratio, np.log(8)))
            unequal.append(min(abs(np.log(one.lengths[p, k] / other.lengths[q, k])), 0.2))
        else:
            levels.append(settings.missing)
            unequal.append(0.2)
    if not common:
        return settings.max_distance
    isometry = min(np.average(unequal, weights=falling), settings.isometry_limit)
    return (
        np.average(levels, weights=weights)
        + settings.level_set_weight * np.average(level_sets, weights=every)
        + settings.isometry_weight * isometry
    )


@pytest.fixture(name="pair")
def fixture_pair(make_parts):
    """Two objects of 3 and 4 parts; levels are missing here, there and in both."""
    one = masked(make_parts("one", seed=1), (0, 2), (1, slice(None)), (2, 1))
    other = masked(make_parts("other", seed=2, parts=4), (0, 2), (1, 0), (3, slice(None)))
    return one, other


@pytest.mark.parametrize(
    "settings",
    [
        RIGID,
        dataclasses.replace(RIGID, length_weight=0.0, level_set_weight=0.0, isometry_weight=0.0, decay=0.0),
        Matching(aligner=COARSE, candidates=0),
    ],
    ids=["sizes", "shapes", "warped"],
)
def test_part_distances_follow_the_definition(pair, settings):
    one, other = pair
    pairs = np.argwhere(np.ones((3, 4)))
    found = matching.part_distances(stack([one]), stack([other]), pairs, settings, settings.aligner)
    expected = [by_definition(one, p, other, q, settings) for p, q in pairs]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)
    assert found.max() <= settings.max_distance


def test_nearest_is_the_minimum_over_parts_both_ways(make_parts):
    objects = [make_parts(str(seed), seed=seed, parts=parts) for seed, parts in enumerate((2, 3, 0, 1))]
    first, second = stack(objects[:2]), stack(objects[2:])
    forward, backward = matching.nearest(first, second, np.ones((2, 2), bool), RIGID)
    assert forward.distance.shape == (5, 2)
    assert backward.distance.shape == (1, 2)
    pairs = np.argwhere(np.ones((5, 1)))
    expected = matching.part_distances(first, second, pairs, RIGID, RIGID.aligner)
    np.testing.assert_array_equal(forward.distance[:, 0], RIGID.max_distance)
    np.testing.assert_array_equal(forward.part, [[-1, 0]] * 5)
    np.testing.assert_allclose(forward.distance[:, 1], expected, atol=1e-5)
    np.testing.assert_allclose(backward.distance[0], [expected[:2].min(), expected[2:].min()], atol=1e-5)
    np.testing.assert_array_equal(backward.part[0], [expected[:2].argmin(), expected[2:].argmin()])


def test_pairs_not_to_compare_stay_infinite(make_parts):
    both = stack([make_parts("a", seed=1), make_parts("b", seed=2)])
    forward, backward = matching.nearest(both, both, np.array([[False, True], [False, False]]), Matching())
    np.testing.assert_array_equal(np.isfinite(forward.distance), [[False, True]] * 3 + [[False, False]] * 3)
    np.testing.assert_array_equal(np.isfinite(backward.distance), [[False, False]] * 3 + [[True, False]] * 3)


def test_shortlist_takes_the_nearest_of_each_object():
    distances = np.array([[3.0, 1.0, 2.0, 9.0, 8.0], [1.0, 2.0, 3.0, 7.0, 6.0]])
    short = matching.shortlist(distances, np.array([0, 3, 3, 5]), 2)
    np.testing.assert_array_equal(short, [[False, True, True, True, True], [True, True, False, True, True]])


@pytest.mark.parametrize(
    "settings",
    [dataclasses.replace(Matching.paper(), aligner=LEAN), pytest.param(Matching.elastic(), marks=pytest.mark.slow)],
    ids=["paper", "elastic"],
)
def test_candidates_only_ever_leave_out_nearer_parts(settings, make_parts):
    """With all parts as candidates nothing is left out; warps bring parts closer."""
    first = stack([make_parts(f"{seed}", seed=seed, parts=5) for seed in range(2)])
    second = stack([make_parts(f"{seed}", seed=seed, parts=6) for seed in range(2, 5)])
    apart = np.ones((2, 3), bool)
    found = {
        count: matching.nearest(first, second, apart, dataclasses.replace(settings, candidates=count))[0].distance
        for count in (0, 1, 6)
    }
    rigid = dataclasses.replace(settings, aligner=Rigid(measured=False), candidates=0)
    unwarped = matching.nearest(first, second, apart, rigid)[0].distance
    np.testing.assert_allclose(found[6], found[0], atol=1e-5)
    assert (found[0] <= found[1] + 1e-5).all()
    assert (found[0] <= unwarped + 1e-3).all()
    assert found[0].mean() < unwarped.mean() - 0.02
