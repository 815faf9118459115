"""Chances in a cohort: symmetric, comparable, indifferent to newcomers; witnesses and their weights."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import norm

from curvematch_jax.retrieval import Collection, Matching, Witness, dissimilarity_matrix, fingerprint, rank
from curvematch_jax.retrieval._blocks import Task, block_distances
from curvematch_jax.retrieval._cohort import Cohort, chosen

ALONE = Matching(candidates=0, witnesses=())


@pytest.fixture(name="objects", scope="module")
def fixture_objects(make_parts):
    """Ten classes of four, of 2 to 4 parts, and one object without parts."""
    made = [
        make_parts(f"{kind}-{k}", seed=kind, parts=2 + kind % 3, noise=0.15) for kind in range(10) for k in range(4)
    ]
    return [*made[:20], make_parts("sphere", parts=0), *made[20:]]


def test_matrix_is_symmetric_not_negative_and_bounded(objects):
    for matching in (Matching(), ALONE, Matching.generic(), Matching.articulated()):
        matrix = dissimilarity_matrix(objects[:25], matching)
        np.testing.assert_array_equal(matrix, matrix.T)
        assert (matrix >= 0).all()
        assert (matrix <= 1).all()
        assert (np.diag(matrix) == 0).all()
        assert (np.delete(matrix[20], 20) == 1).all()


def test_matrix_is_what_the_formulas_say(objects):
    """The parts alone, from distances of parts to objects, by loops and scipy's normal distribution."""
    few = objects[:12]
    block = block_distances(Task(few, few, ~np.eye(12, dtype=bool), ALONE))
    ends = np.cumsum([len(each.areas) for each in few])
    means = np.array([rows.mean(axis=0) for rows in np.split(block.forward.astype(np.float64), ends[:-1])])
    floor = 0.01 * np.nanmean(means)
    logs = np.log(means + floor)
    centre, spread = np.nanmean(logs), np.nanmean((logs - np.nanmean(logs)) ** 2)
    chance = np.zeros((12, 12))
    for i in range(12):
        own = np.delete(logs[i], i)
        mean = (own.sum() + 2 * centre) / (len(own) + 2)
        deviation = np.sqrt((((own - mean) ** 2).sum() + 2 * spread) / (len(own) + 2))
        chance[i] = norm.logcdf((logs[i] - mean) / deviation)
    expected = np.exp((chance + chance.T) / 2)
    np.fill_diagonal(expected, 0.0)
    np.testing.assert_allclose(dissimilarity_matrix(few, ALONE), expected, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("matching", [Matching(), ALONE], ids=["default", "parts alone"])
def test_rankings_are_rows_of_the_matrix(objects, matching):
    matrix = dissimilarity_matrix(objects, matching)
    ready = Collection.of(objects, matching)
    for i in (0, 17, 40):
        found = rank(objects[i], ready, matching, exclude_self=True)
        assert i not in found.order
        assert sorted([*found.order.tolist(), i]) == list(range(41))
        others = np.delete(np.arange(41), i)
        np.testing.assert_allclose(found.dissimilarity[others], matrix[i, others], rtol=1e-3, atol=1e-7)
        said = sum(found.evidence.values())
        assert ready.cohort is not None
        expected = np.exp(-said / ready.cohort.weight.sum())
        others = np.delete(np.arange(41), [i, 20])
        np.testing.assert_allclose(found.dissimilarity[others], expected[others], rtol=1e-9)


def test_newcomers_change_nothing_among_the_others(objects, make_parts):
    ready = Collection.of(objects)
    new = [make_parts(f"new{k}", seed=100 + k, noise=0.2) for k in range(5)]
    grown = ready.added(new)
    assert grown.names[-5:] == tuple(each.name for each in new)
    before, after = rank(objects[3], ready), rank(objects[3], grown)
    np.testing.assert_array_equal(after.dissimilarity[:41], before.dissimilarity)
    assert [j for j in after.order.tolist() if j < 41] == before.order.tolist()


def test_a_small_cohort_grows(objects):
    grown = Collection.of(objects[:5]).added(objects[5:12])
    whole = Collection.of(objects[:12])
    assert grown.cohort is not None
    assert grown.cohort.members.tolist() == list(range(12))
    np.testing.assert_allclose(grown.moments, whole.moments, rtol=1e-5)


def test_cohort_does_not_depend_on_the_order(make_parts):
    prints = [fingerprint(make_parts(f"{k}", seed=k, parts=1)) for k in range(50)] * 50
    prints = [f"{k}{each}" for k, each in enumerate(prints)]
    members = chosen(prints)
    assert len(members) == 32
    assert {prints[k] for k in members} == set(sorted(prints)[:32])
    assert len(chosen(prints[:300])) == 218
    assert len(chosen(prints[:100])) == 100


def test_twins_are_nearest_and_nan_nowhere(objects):
    twin = dataclasses.replace(objects[4], name="twin")
    matrix = dissimilarity_matrix([*objects[:10], twin])
    assert np.isfinite(matrix).all()
    assert matrix[4].argsort(kind="stable")[:2].tolist() == [4, 10]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_objects(objects, count):
    matrix = dissimilarity_matrix(objects[:count])
    assert matrix.shape == (count, count)
    assert np.isfinite(matrix).all()
    assert rank(objects[0], objects[:count]).order.tolist()[0] == 0


def test_a_witness_counts_as_far_as_the_parts_confirm_it():
    rng = np.random.default_rng(0)
    places = rng.normal(size=(40, 6))
    distance = np.linalg.norm(places[:, None] - places, axis=2)
    noise = rng.uniform(0.5, 1.5, size=(40, 40))
    sources = np.stack([distance, 3 * distance, distance * (noise + noise.T), noise + noise.T])
    sources[:, np.arange(40), np.arange(40)] = np.nan
    matching = Matching(witnesses=())
    object.__setattr__(matching, "witnesses", (Witness("spectrum"), Witness("views"), Witness("views")))
    weight = Cohort.of(np.arange(40), sources, matching).weight
    assert weight[0] == 1
    assert weight[1] == pytest.approx(1)
    assert 0.05 < weight[2] < 1
    assert weight[3] < 0.05


def test_who_is_not_described_is_judged_by_parts(objects):
    nothing = np.zeros(0, np.float32)
    bare = [dataclasses.replace(each, spectrum=nothing, views=nothing) for each in objects[:9]]
    np.testing.assert_array_equal(dissimilarity_matrix(bare), dissimilarity_matrix(bare, Matching(witnesses=())))
    mixed = dissimilarity_matrix([*bare[:4], *objects[4:9]])
    assert np.isfinite(mixed).all()
    assert (rank(bare[0], objects[:9]).evidence["views"] == 0).all()


def test_descriptors_that_do_not_fit_are_one_sentence(objects):
    other = dataclasses.replace(objects[1], views=np.zeros(7, np.float32))
    for call in (
        lambda: dissimilarity_matrix([objects[0], other]),
        lambda: rank(other, objects[2:4]),
        lambda: Collection.of([objects[0], other]),
    ):
        with pytest.raises(ValueError, match=r"views of .*numbers: extract them again"):
            call()


def test_wrong_witnesses_are_refused():
    # A TypeError comes from the annotations, which are executed in tests.
    with pytest.raises((ValueError, TypeError), match="smell"):
        Witness("smell")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="0 or more, found -1"):
        Witness("views", -1.0)
    with pytest.raises(ValueError, match="named twice"):
        Matching(witnesses=(Witness("views"), Witness("views", 0.5)))
