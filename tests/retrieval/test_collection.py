"""Collections made ready for queries, and rankings of their best objects alone."""

import dataclasses

import numpy as np
import pytest
from elastic.aligners import COARSE

from curvematch_jax.elastic import Rigid
from curvematch_jax.retrieval import Collection, Matching, rank
from curvematch_jax.retrieval import _ranking as ranking_module
from curvematch_jax.retrieval._search import Search
from curvematch_jax.surface import Extraction

WARPS = Matching(aligner=COARSE)
SETTINGS = {
    "default": Matching(),
    "belief": Matching(fusion="belief"),
    "parts alone": Matching(witnesses=()),
    "all parts": Matching(candidates=0),
    "mean": Matching(fusion="mean"),
    "weighted": Matching(fusion="weighted"),
    "mean beside shares": Matching(fusion="mean", masses="shares"),
    "by area": Matching(significance="area", decay=1.0),
    "shapes alone": Matching(length_weight=0, level_set_weight=0, isometry_weight=0),
    "coarse": Matching(aligner=Rigid(grid=32, measured=False)),
}


@pytest.fixture(name="objects", scope="module")
def fixture_objects(make_parts):
    """Twenty classes of three, of 2 to 4 parts, some without a level or two, and one object without parts."""
    made = [
        make_parts(f"{kind}-{k}", seed=kind, parts=2 + kind % 3, noise=0.1 + 0.1 * k)
        for kind in range(20)
        for k in range(3)
    ]
    for j in range(0, 60, 7):
        made[j].mask[0, 1 + j % 2 :] = False
    return [*made[:30], make_parts("sphere", parts=0), *made[30:]]


@pytest.fixture(name="few_at_once")
def fixture_few_at_once(monkeypatch):
    monkeypatch.setattr(ranking_module, "_AT_ONCE", 1)


@pytest.mark.usefixtures("few_at_once")
@pytest.mark.parametrize("i", [pytest.param(4, marks=pytest.mark.slow), 31, pytest.param(50, marks=pytest.mark.slow)])
@pytest.mark.parametrize("matching", SETTINGS.values(), ids=SETTINGS.keys())
def test_the_best_are_those_of_the_whole_ranking(objects, matching, i):
    ready = Collection.of(objects, matching)
    whole = rank(objects[i], ready, matching)
    assert whole.exact.all()
    for top in (1, 3, 10):
        found = rank(objects[i], ready, matching, top=top)
        best = found.order[:top]
        np.testing.assert_array_equal(best, whole.order[:top])
        assert found.exact[best].all()
        known = found.exact
        np.testing.assert_allclose(found.distances[:, known], whole.distances[:, known], atol=1e-6)
        np.testing.assert_array_equal(found.matched[:, known], whole.matched[:, known])
        assert (found.distances <= whole.distances + 1e-6).all()
        assert sorted(found.order.tolist()) == list(range(61))


@pytest.mark.usefixtures("few_at_once")
def test_most_objects_are_not_compared_by_shape(objects):
    found = rank(objects[31], objects, top=3)
    assert found.exact.sum() < 20
    assert found.probability.sum() == pytest.approx(1)
    assert found.order[-1] == 30
    whole = rank(objects[31], objects)
    assert (found.probability[found.order[:3]] <= whole.probability[found.order[:3]] + 1e-9).all()
    assert found.ignorance <= whole.ignorance + 1e-9


def test_bounds_are_no_more_than_distances(objects):
    for matching in (Matching(), WARPS, dataclasses.replace(Matching.paper(), aligner=WARPS.aligner)):
        few = objects[25:33]
        query, ready = (Collection.of(some, matching) for some in ([objects[3]], few))
        search = Search.begin(query, ready, matching)
        bounds = search.nearest.distance
        while not search.exact.all():
            search.settle(np.flatnonzero(~search.exact), few=2)
        assert (bounds <= search.nearest.distance).all()
        assert (bounds > 0).any()


def test_shares_need_every_distance(objects):
    matching = Matching(fusion="belief", masses="shares")
    few = objects[:9]
    found, whole = rank(few[4], few, matching, top=1), rank(few[4], few, matching)
    assert found.exact.all()
    np.testing.assert_allclose(found.probability, whole.probability, rtol=1e-6)


def test_ready_or_not_is_the_same(objects):
    for matching in (Matching(), Matching(unit="mesh")):
        ready = rank(objects[4], Collection.of(iter(objects), matching), matching)
        plain = rank(objects[4], objects, matching)
        np.testing.assert_array_equal(ready.order, plain.order)
        np.testing.assert_array_equal(ready.dissimilarity, plain.dissimilarity)
        assert (ready.names, ready.notes) == (plain.names, plain.notes)


def test_blocks_of_any_size_join_to_the_same(objects, monkeypatch):
    whole = Collection.of(objects)
    monkeypatch.setattr("curvematch_jax.retrieval._collection._AT_ONCE", 7)
    found = Collection.of(objects)
    for name in ("rows", "log_lengths", "log_level_sets", "log_units", "starts"):
        np.testing.assert_array_equal(getattr(found.stack, name), getattr(whole.stack, name), err_msg=name)
    np.testing.assert_array_equal(found.stack.curves.curves.tangents, whole.stack.curves.curves.tangents)
    np.testing.assert_array_equal(found.signatures, whole.signatures)


def test_an_object_that_was_only_bounded_is_not_explained(objects):
    found = rank(objects[31], Collection.of(objects), top=1)
    assert found.explain(int(found.order[0]))
    with pytest.raises(ValueError, match="rank with a larger top"):
        found.explain(int(np.flatnonzero(~found.exact)[0]))


def test_what_a_collection_is_not_ready_for_is_refused(objects, make_parts):
    ready = Collection.of(objects[:2])
    with pytest.raises(ValueError, match="with unit = 'area', and the query comes with unit = 'diameter'"):
        rank(objects[0], ready, Matching(unit="diameter"))
    with pytest.raises(ValueError, match="with the preset default, and the query comes with the preset elastic"):
        rank(objects[0], ready, Matching.elastic())
    one_way, other = Matching(fusion="belief"), Matching(fusion="belief", candidates=0, unit="diameter")
    with pytest.raises(ValueError, match="with unit = 'area'"):
        rank(objects[0], Collection.of(objects[:2], one_way), other)
    other = make_parts("other", settings=Extraction(levels=3, samples=32, epsilon=0.07))
    with pytest.raises(ValueError, match=r"epsilon = 0\.07"):
        rank(other, ready)
    with pytest.raises(ValueError, match=r"epsilon = 0\.07"):
        Collection.of([*objects[:2], other])
    with pytest.raises(ValueError, match="collection is empty"):
        Collection.of(iter([]))
    with pytest.raises(ValueError, match="top must be 1 or more"):
        rank(objects[0], ready, top=0)


def test_other_weights_can_be_asked_of_one_collection_without_a_cohort(objects):
    matching = Matching(fusion="belief", level_set_weight=0.0, scale=0.2)
    found = rank(objects[4], Collection.of(objects, Matching(fusion="belief")), matching)
    np.testing.assert_array_equal(found.order, rank(objects[4], objects, matching).order)


def test_top_beyond_the_collection_and_a_query_without_parts(objects, make_parts):
    assert rank(objects[4], objects[:3], top=99).exact.all()
    found = rank(make_parts("nothing", parts=0), objects[:3], top=1)
    assert found.order.tolist() == [0, 1, 2]
    assert found.exact.all()
