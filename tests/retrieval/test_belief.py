"""The closed form against the sum over all subsets, against pyds, and by its properties."""

import numpy as np
import pyds
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from curvematch_jax.retrieval import _belief as belief


def brute_force(singletons, frame):
    """Masses of all focal subsets after the unnormalised combination, subset by subset."""
    whole = frozenset(range(singletons.shape[1]))
    combined = {whole: 1.0}
    for row, rest in zip(singletons, frame, strict=True):
        focal = {frozenset([j]): mass for j, mass in enumerate(row)} | {whole: rest}
        after: dict[frozenset, float] = {}
        for subset, mass in combined.items():
            for other, more in focal.items():
                after[subset & other] = after.get(subset & other, 0.0) + mass * more
        combined = after
    return combined, whole


def random_masses(parts, objects, seed, sure=False):
    rng = np.random.default_rng(seed)
    significance = rng.uniform(0.4, 1.0, size=parts)
    if sure:
        significance[parts // 2] = 1.0
    return belief.masses(rng.uniform(size=(parts, objects)), significance)


@pytest.mark.parametrize("sure", [False, True])
@pytest.mark.parametrize(("parts", "objects"), [(1, 2), (2, 3), (5, 4), (8, 6)])
def test_agrees_with_brute_force(parts, objects, sure):
    singletons, frame = random_masses(parts, objects, seed=parts, sure=sure)
    combined, whole = brute_force(singletons, frame)
    conflict = combined.get(frozenset(), 0.0)
    pignistic = [
        (combined.get(frozenset([j]), 0.0) + combined[whole] / objects) / (1 - conflict) for j in range(objects)
    ]
    found = belief.combine(singletons, frame)
    np.testing.assert_allclose(found.probability, pignistic, rtol=1e-12)
    assert found.conflict == pytest.approx(conflict, abs=1e-14)
    assert found.ignorance == pytest.approx(combined[whole], abs=1e-15)


@pytest.mark.parametrize("sure", [False, True])
def test_agrees_with_pyds(sure):
    singletons, frame = random_masses(4, 40, seed=1, sure=sure)
    objects = [f"o{j}" for j in range(40)]
    sources = []
    for row, rest in zip(singletons, frame, strict=True):
        mass = {(name,): float(value) for name, value in zip(objects, row, strict=True)}
        sources.append(pyds.MassFunction(mass | {tuple(objects): float(rest)}))
    combined = sources[0].combine_conjunctive(sources[1:], normalization=False)
    pignistic = combined.pignistic()
    found = belief.combine(singletons, frame)
    np.testing.assert_allclose(found.probability, [pignistic[(name,)] for name in objects], rtol=1e-10)
    assert found.conflict == pytest.approx(combined[()], rel=1e-10)


def test_masses_by_hand():
    singletons, frame = belief.masses(np.array([[0.0, 0.5, 1.0], [1.0, 1.0, 1.0]]), np.array([0.6, 0.9]))
    np.testing.assert_allclose(singletons, [[0.4, 0.2, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(frame, [0.4, 1.0])


distances = hnp.arrays(
    np.float64,
    st.tuples(st.integers(1, 12), st.integers(1, 9)),
    elements=st.floats(0, 1),
)


@settings(max_examples=200, deadline=None)
@given(distances, st.data())
def test_is_a_belief(distance, data):
    shape = len(distance)
    significance = data.draw(hnp.arrays(np.float64, shape, elements=st.floats(0, 1)))
    singletons, frame = belief.masses(distance, significance)
    np.testing.assert_allclose(singletons.sum(axis=1) + frame, 1.0, rtol=1e-12)
    found = belief.combine(singletons, frame)
    assert found.probability.sum() == pytest.approx(1.0)
    assert 0 <= found.conflict <= 1
    assert 0 <= found.ignorance <= 1
    assert not np.isnan(found.log_probability).any()


@settings(max_examples=100, deadline=None)
@given(distances, st.randoms(use_true_random=False))
def test_order_of_parts_is_no_matter(distance, random):
    significance = np.linspace(0.3, 0.9, len(distance))
    shuffled = list(range(len(distance)))
    random.shuffle(shuffled)
    one = belief.combine(*belief.masses(distance, significance))
    other = belief.combine(*belief.masses(distance[shuffled], significance[shuffled]))
    np.testing.assert_allclose(one.probability, other.probability, rtol=1e-9)
    assert one.conflict == pytest.approx(other.conflict, abs=1e-12)


def test_closer_in_every_part_is_more_probable():
    distance = np.array([[0.2, 0.3, 0.9], [0.4, 0.5, 0.6]])
    probability = belief.combine(*belief.masses(distance, np.array([0.5, 0.8]))).probability
    assert probability[0] > probability[1] > probability[2]


def test_no_part_leaves_everything_unknown():
    found = belief.combine(np.zeros((0, 4)), np.zeros(0))
    np.testing.assert_allclose(found.probability, 0.25)
    assert (found.conflict, found.ignorance) == (0, 1)


def test_parts_that_say_nothing_leave_everything_unknown():
    found = belief.combine(*belief.masses(np.ones((3, 5)), np.full(3, 0.7)))
    np.testing.assert_allclose(found.probability, 0.2)
    assert (found.conflict, found.ignorance) == (0, 1)


def test_complete_contradiction():
    found = belief.combine(np.eye(2), np.zeros(2))
    np.testing.assert_allclose(found.probability, 0.5)
    assert (found.conflict, found.ignorance) == (1, 0)


def test_many_sure_parts_do_not_overflow():
    singletons, frame = belief.masses(np.tile([0.0, 0.999], (4000, 1)), np.full(4000, 0.999999))
    found = belief.combine(singletons, frame)
    assert found.probability[0] == pytest.approx(1.0)
    assert np.isfinite(found.log_probability).all()
    assert found.log_probability[1] < -1000


def test_near_ties_of_large_collections_stay_apart():
    distance = np.linspace(0.5, 0.5 + 1e-9, 100_000)[None]
    found = belief.combine(*belief.masses(distance, np.array([0.5])))
    assert len(np.unique(found.log_probability)) > 99_000


def test_weighted_evidence_ranks_as_the_combination_for_small_masses():
    from scipy.stats import kendalltau

    rng = np.random.default_rng(0)
    singletons, frame = belief.masses(rng.uniform(size=(8, 300)), rng.uniform(0.4, 0.6, size=8))
    one, other = belief.combine(singletons, frame).log_probability, belief.weighted_evidence(singletons, frame)
    assert kendalltau(one, other).statistic > 0.99


@pytest.mark.parametrize(
    ("distance", "significance", "message"),
    [
        (np.array([[0.5, 1.5]]), np.array([0.5]), "distance must lie"),
        (np.array([[0.5, np.nan]]), np.array([0.5]), "distance must lie"),
        (np.array([[0.5, 0.5]]), np.array([1.5]), "significance must lie"),
        (np.array([[0.5, 0.5]]), np.array([0.5, 0.5]), "do not fit"),
    ],
)
def test_refuses(distance, significance, message):
    with pytest.raises(ValueError, match=message):
        belief.masses(distance, significance)


def test_odds_make_evidence_a_sum_that_no_other_object_enters():
    exponents = np.array([[0.0, 0.5, 3.0], [1.0, 0.2, 40.0], [0.0, 0.0, 0.0]])
    singletons, frame = belief.odds_masses(exponents)
    np.testing.assert_allclose(singletons.sum(axis=1) + frame, 1)
    np.testing.assert_allclose(np.log1p(singletons / frame[:, None]), exponents, atol=1e-9)
    assert frame[2] == 1
    fewer, others = belief.odds_masses(exponents[:, :2])
    np.testing.assert_allclose(fewer / others[:, None], (singletons / frame[:, None])[:, :2])
    with pytest.raises(ValueError, match="0 or more"):
        belief.odds_masses(-exponents)


def test_parts_that_leave_next_to_nothing_on_the_frame_combine():
    """So sure that the odds are more than a float holds."""
    sure = np.array([[735.0, 1.0, 0.0], [0.0, 3.0, 2.0]])
    found = belief.combine(*belief.odds_masses(sure))
    np.testing.assert_allclose(found.log_probability[0], 0, atol=1e-12)
    np.testing.assert_allclose(found.log_probability[1] - found.log_probability[0], 4 - 735, atol=0.5)
