"""Part distances against the definition, curve by curve; the shortlist against all pairs."""

import dataclasses

import numpy as np
import pytest

from curvematch_jax.elastic import Aligner, pair_distances
from curvematch_jax.retrieval import Matching
from curvematch_jax.retrieval import _matching as matching

RIGID = Matching(aligner=Aligner.rigid(), candidates=0)


def masked(parts, *holes):
    """The same parts without some of their levels."""
    mask, curves, lengths = parts.mask.copy(), parts.curves.copy(), parts.lengths.copy()
    for hole in holes:
        mask[hole], curves[hole], lengths[hole] = False, 0, 0
    return dataclasses.replace(parts, mask=mask, curves=curves, lengths=lengths)


def by_definition(one, p, other, q, settings):
    """Equation D level by level, in plain Python."""
    total = weights = 0.0
    common = False
    runs = [matching.unbroken(mask[None])[0] for mask in (one.mask[p], other.mask[q])]
    for k, (here, there) in enumerate(zip(*runs, strict=True)):
        weight = (k + 1) ** -settings.decay
        if here and there:
            common = True
            curves = one.curves[p, k][None], other.curves[q, k][None]
            shape = float(pair_distances(*curves, np.array([[0, 0]]), settings.aligner)[0])
            ratio = abs(np.log(one.lengths[p, k] / other.lengths[q, k]))
            total += weight * (shape + settings.length_weight * min(ratio, np.log(8)))
        elif here or there:
            total += weight * settings.missing
        weights += weight * (here or there)
    if not common:
        return settings.max_distance
    return total / weights + settings.area_weight * min(abs(np.log(one.areas[p] / other.areas[q])), np.log(8))


@pytest.fixture(name="pair")
def fixture_pair(make_parts):
    """Two objects of 3 and 4 parts; levels are missing here, there and in both."""
    one = masked(make_parts("one", seed=1), (0, 2), (1, slice(None)), (2, 1))
    other = masked(make_parts("other", seed=2, parts=4), (0, 2), (1, 0), (3, slice(None)))
    return one, other


@pytest.mark.parametrize(
    "settings",
    [RIGID, dataclasses.replace(RIGID, length_weight=0.0, area_weight=0.0, decay=0.0), Matching(candidates=0)],
    ids=["sizes", "shapes", "warped"],
)
def test_part_distances_follow_the_definition(pair, settings):
    one, other = pair
    pairs = np.argwhere(np.ones((3, 4)))
    found = matching.part_distances(matching.stack([one]), matching.stack([other]), pairs, settings, settings.aligner)
    expected = [by_definition(one, p, other, q, settings) for p, q in pairs]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)
    assert found.max() <= settings.max_distance


def test_levels_beyond_a_gap_do_not_count():
    mask = np.array([[1, 1, 0, 1, 1], [0, 0, 1, 1, 0], [1, 1, 1, 1, 1], [0, 0, 0, 0, 0], [0, 1, 0, 1, 0]], bool)
    found = matching.unbroken(mask).astype(int)
    expected = [[1, 1, 0, 0, 0], [0, 0, 1, 1, 0], [1, 1, 1, 1, 1], [0, 0, 0, 0, 0], [0, 1, 0, 0, 0]]
    np.testing.assert_array_equal(found, expected)


def test_nearest_is_the_minimum_over_parts_both_ways(make_parts):
    objects = [make_parts(str(seed), seed=seed, parts=parts) for seed, parts in enumerate((2, 3, 0, 1))]
    first, second = matching.stack(objects[:2]), matching.stack(objects[2:])
    forward, backward = matching.nearest(first, second, np.ones((2, 2), bool), RIGID)
    assert forward.shape == (5, 2)
    assert backward.shape == (1, 2)
    pairs = np.argwhere(np.ones((5, 1)))
    expected = matching.part_distances(first, second, pairs, RIGID, RIGID.aligner)
    np.testing.assert_array_equal(forward[:, 0], RIGID.max_distance)
    np.testing.assert_allclose(forward[:, 1], expected, atol=1e-5)
    np.testing.assert_allclose(backward[0], [expected[:2].min(), expected[2:].min()], atol=1e-5)


def test_pairs_not_to_compare_stay_infinite(make_parts):
    both = matching.stack([make_parts("a", seed=1), make_parts("b", seed=2)])
    forward, backward = matching.nearest(both, both, np.array([[False, True], [False, False]]), Matching())
    np.testing.assert_array_equal(np.isfinite(forward), [[False, True]] * 3 + [[False, False]] * 3)
    np.testing.assert_array_equal(np.isfinite(backward), [[False, False]] * 3 + [[True, False]] * 3)


def test_shortlist_takes_the_nearest_of_each_object():
    distances = np.array([[3.0, 1.0, 2.0, 9.0, 8.0], [1.0, 2.0, 3.0, 7.0, 6.0]])
    short = matching.shortlist(distances, np.array([0, 3, 3, 5]), 2)
    np.testing.assert_array_equal(short, [[False, True, True, True, True], [True, True, False, True, True]])


def test_warps_only_ever_bring_parts_closer(make_parts):
    """The shortlisted distance lies between that of all pairs and that without warps."""
    first = matching.stack([make_parts(f"{seed}", seed=seed, parts=5) for seed in range(2)])
    second = matching.stack([make_parts(f"{seed}", seed=seed, parts=6) for seed in range(2, 5)])
    apart = np.ones((2, 3), bool)
    rigid, _ = matching.nearest(first, second, apart, RIGID)
    short, _ = matching.nearest(first, second, apart, Matching(candidates=1))
    exact, _ = matching.nearest(first, second, apart, Matching(candidates=0))
    whole, _ = matching.nearest(first, second, apart, Matching(candidates=6))
    assert (exact <= short + 1e-5).all()
    assert (short <= rigid + 1e-3).all()
    assert short.mean() < rigid.mean() - 0.02
    np.testing.assert_allclose(whole, exact, atol=1e-5)


def test_slices_of_a_stack_are_stacks_of_slices(make_parts):
    objects = [masked(make_parts(f"{n}", seed=n, parts=n), (slice(0, 1), 1)) for n in (2, 0, 3, 1)]
    found, expected = matching.stack(objects)[slice(1, 3)], matching.stack(objects[1:3])
    for name in ("curves", "rows", "log_lengths", "log_areas", "starts"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)


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
    assert [(block.start, block.stop) for block in matching.object_blocks(starts, parts=4)] == blocks


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"candidates": -1}, "candidates must be a whole number"),
        ({"length_weight": -0.1}, "length_weight must be 0 or more"),
        ({"decay": float("nan")}, "decay must be 0 or more"),
        ({"missing": float("inf")}, "missing must be 0 or more"),
        ({"scale": 0.0}, "scale must be more than 0"),
    ],
)
def test_settings_out_of_range_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Matching(**changes)


def test_unknown_fusion_is_refused():
    # A TypeError comes from the annotations, which are executed in tests.
    with pytest.raises((ValueError, TypeError), match="fusion"):
        Matching(fusion="median")  # type: ignore[arg-type]


def test_normalised_distances_lie_in_the_unit_interval():
    for settings in (Matching(), Matching.paper()):
        values = settings.normalised(np.array([0.0, 0.1, settings.max_distance]))
        assert values[0] == 0
        assert values[0] < values[1] < values[2] <= 1
    assert Matching.paper().normalised(np.array([Matching.paper().max_distance]))[0] == 1
