"""Rankings and matrices: the same distances, stable orders, objects without parts, and refusals."""

import dataclasses

import numpy as np
import pytest
from elastic.aligners import COARSE

from curvematch_jax.retrieval import Matching, dissimilarity_matrix, rank
from curvematch_jax.retrieval import _distances as distances_module
from curvematch_jax.retrieval._stack import stack
from curvematch_jax.surface import Extraction

FAST = Matching(candidates=0, fusion="mean")
PAPER = dataclasses.replace(Matching.paper(), aligner=COARSE)
FUSIONS = ("mean", "belief", "weighted")


@pytest.fixture(name="collection", scope="module")
def fixture_collection(make_parts):
    """Three classes of three, of 2, 3 and 4 parts; members differ by noise."""
    return [make_parts(f"{kind}{k}", seed=kind, parts=kind + 2, noise=0.1) for kind in range(3) for k in range(3)]


@pytest.mark.parametrize("fusion", FUSIONS)
def test_rows_of_the_matrix_are_rankings(collection, fusion):
    settings = dataclasses.replace(Matching(), fusion=fusion)
    matrix = dissimilarity_matrix(collection, settings)
    assert (np.diag(matrix) == 0).all()
    for i in (0, 4, 8):
        others = [j for j in range(9) if j != i]
        ranking = rank(collection[i], [collection[j] for j in others], settings)
        np.testing.assert_allclose(matrix[i, others], ranking.dissimilarity, rtol=1e-4, atol=1e-5)
        assert (matrix[i, others] > 0).all()


@pytest.mark.parametrize("fusion", FUSIONS)
def test_classes_are_found(collection, fusion):
    ranking = rank(collection[4], collection, dataclasses.replace(FAST, fusion=fusion))
    assert ranking.order[0] == 4
    assert set(ranking.order[:3].tolist()) == {3, 4, 5}
    assert ranking.names == tuple(parts.name for parts in collection)
    assert ranking.probability.sum() == pytest.approx(1)
    assert ranking.probability.argmax() == 4
    assert 0 <= ranking.ignorance <= 1
    assert 0 <= ranking.conflict <= 1
    assert ranking.notes == ()


def test_belief_orders_by_probability(collection):
    ranking = rank(collection[1], collection, dataclasses.replace(FAST, fusion="belief"))
    assert (np.diff(ranking.probability[ranking.order]) <= 0).all()


@pytest.mark.parametrize("fusion", [*FUSIONS, "cohort"])
@pytest.mark.parametrize("masses", ["odds", "shares"])
def test_a_query_that_is_excluded_is_left_out_of_the_beliefs(collection, fusion, masses):
    settings = dataclasses.replace(Matching(), fusion=fusion, masses=masses)
    found = rank(collection[4], collection, settings, exclude_self=True)
    others = np.delete(np.arange(9), 4)
    assert sorted(found.order) == others.tolist()
    assert found.probability[found.order].sum() == pytest.approx(1)
    assert found.probability[4] == found.dissimilarity[4] == 0
    if fusion != "cohort":
        without = rank(collection[4], [collection[i] for i in others], settings)
        for values, expected in ((found.probability, without.probability), (found.masses, without.masses)):
            np.testing.assert_allclose(values[..., others], expected, rtol=1e-4, atol=1e-9)
        assert found.conflict == pytest.approx(without.conflict, rel=1e-6)
    with pytest.raises(ValueError, match="nothing but the query itself"):
        rank(collection[4], [collection[4]], settings, exclude_self=True)


@pytest.mark.parametrize("settings", [FAST, Matching()], ids=["mean", "odds"])
def test_order_does_not_depend_on_who_else_is_there(collection, settings):
    whole = rank(collection[0], collection, settings)
    some = [1, 3, 4, 6, 8]
    part = rank(collection[0], [collection[i] for i in some], settings)
    np.testing.assert_allclose(part.distances, whole.distances[:, some], rtol=1e-5)
    assert [some[i] for i in part.order] == [i for i in whole.order.tolist() if i in some]


@pytest.mark.parametrize("settings", [Matching(), PAPER], ids=["default", "paper"])
def test_explanations_name_the_matched_parts_and_can_be_recomputed(collection, settings):
    ranking = rank(collection[4], collection, settings)
    itself = ranking.explain(4)
    assert [match.part for match in itself] == [match.other for match in itself]
    assert sorted(match.part for match in itself) == [0, 1, 2]
    for j in (4, 7):
        matches = ranking.explain(j)
        assert [match.distance for match in matches] == sorted(match.distance for match in matches)
        pairs = np.array([[match.part, match.other] for match in matches])
        first, second = stack([collection[4]], settings.unit), stack([collection[j]], settings.unit)
        again = distances_module.part_distances(first, second, pairs, settings, settings.aligner)
        np.testing.assert_allclose([match.distance for match in matches], again, atol=1e-5)
        np.testing.assert_allclose([match.mass for match in matches], [ranking.masses[m.part, j] for m in matches])
    assert (ranking.masses.sum(axis=1) <= 1 + 1e-12).all()


def test_explanation_of_what_is_not_there(collection, make_parts):
    ranking = rank(collection[0], [collection[1], make_parts("sphere", parts=0)], FAST)
    assert ranking.explain(1) == ()
    with pytest.raises(IndexError, match="object 2 does not exist"):
        ranking.explain(2)


def test_times_of_the_stages_are_told(collection):
    seconds = rank(collection[0], collection, FAST).seconds
    assert set(seconds) == {"stack", "bounds", "distances"}
    assert min(seconds.values()) >= 0


@pytest.mark.parametrize("settings", [FAST, Matching()], ids=["mean", "default"])
def test_matrix_does_not_depend_on_blocks(collection, settings):
    whole = dissimilarity_matrix(collection, settings)
    np.testing.assert_allclose(dissimilarity_matrix(collection, settings, block=2), whole, atol=1e-5)


def test_matrix_follows_the_order_of_the_objects(collection):
    shuffled = [7, 2, 5, 0, 1, 8, 3, 6, 4]
    whole = dissimilarity_matrix(collection, FAST)
    found = dissimilarity_matrix([collection[i] for i in shuffled], FAST)
    np.testing.assert_allclose(found, whole[np.ix_(shuffled, shuffled)], atol=1e-4)


def test_every_pair_of_parts_is_compared_once(collection, monkeypatch):
    compared: list[tuple[int, int]] = []
    ids = {curve.tobytes(): number for number, curve in enumerate(stack(collection).curves)}

    def counting(first, second, pairs, aligner):
        numbers = [(ids[first[i].tobytes()], ids[second[j].tobytes()]) for i, j in pairs]
        compared.extend((min(pair), max(pair)) for pair in numbers)
        return np.zeros(len(pairs))

    monkeypatch.setattr(distances_module, "pair_distances", counting)
    dissimilarity_matrix(collection, FAST)
    counts = [len(parts.areas) for parts in collection]
    levels = collection[0].mask.shape[1]
    assert len(compared) == len(set(compared)) == levels * (sum(counts) ** 2 - sum(c * c for c in counts)) // 2


@pytest.mark.parametrize("fusion", FUSIONS)
def test_object_without_parts_is_last_and_reported(collection, make_parts, fusion):
    settings = dataclasses.replace(FAST, fusion=fusion)
    sphere = make_parts("sphere", parts=0)
    members = [collection[0], sphere, *collection[1:]]
    ranking = rank(collection[0], members, settings)
    assert ranking.order[-1] == 1
    assert len(ranking.notes) == 1
    assert "sphere has no feature point" in ranking.notes[0]
    matrix = dissimilarity_matrix(members, settings)
    for i in range(len(members)):
        if i != 1:
            assert matrix[i].argmax() == 1
    assert len(np.unique(matrix[1, [0, 2, 3]])) == 1


def test_query_without_parts_knows_nothing_and_says_so(collection, make_parts):
    ranking = rank(make_parts("sphere", parts=0), collection, FAST)
    assert ranking.order.tolist() == list(range(9))
    np.testing.assert_allclose(ranking.probability, 1 / 9)
    assert (ranking.ignorance, ranking.conflict) == (1, 0)
    assert "the query sphere has no feature point" in ranking.notes[0]


def test_nothing_but_objects_without_parts(make_parts):
    empty = [make_parts("a", parts=0), make_parts("b", parts=0)]
    matrix = dissimilarity_matrix(empty)
    assert np.isfinite(matrix).all()
    assert rank(empty[0], empty).order.tolist() == [0, 1]


def test_collection_of_one(collection):
    for other in (collection[0], collection[8]):
        ranking = rank(collection[0], [other], FAST)
        assert ranking.order.tolist() == [0]
        assert ranking.probability.tolist() == pytest.approx([1.0])
    np.testing.assert_array_equal(dissimilarity_matrix([collection[0]]), [[0.0]])


def test_the_same_object_twice(collection):
    ranking = rank(collection[4], [collection[0], collection[4], collection[4]], FAST)
    assert ranking.order.tolist() == [1, 2, 0]
    assert ranking.dissimilarity[1] == ranking.dissimilarity[2]


def test_empty_collection_is_refused(collection):
    with pytest.raises(ValueError, match="collection is empty"):
        rank(collection[0], [])
    with pytest.raises(ValueError, match="collection is empty"):
        dissimilarity_matrix([])


def test_other_settings_are_refused_by_name(collection, make_parts):
    other = make_parts("other", settings=Extraction(levels=3, samples=32, epsilon=0.07))
    for call in (lambda: rank(other, collection), lambda: dissimilarity_matrix([*collection, other])):
        with pytest.raises(ValueError, match=r"epsilon = 0\.0[57].*epsilon = 0\.0[57]"):
            call()


def test_progress_is_reported_to_the_end(collection):
    calls: list[tuple[int, int]] = []
    dissimilarity_matrix(collection, FAST, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1][0] == calls[-1][1] > 0
    calls.clear()
    rank(collection[0], collection, FAST, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1][0] == calls[-1][1] > 0


def test_paper_settings_rank_by_shape_alone(collection):
    bigger = dataclasses.replace(collection[0], lengths=collection[0].lengths * 2)
    ranking = rank(collection[0], [collection[3], bigger, collection[6]], PAPER)
    assert ranking.order[0] == 1
    assert rank(collection[0], [bigger], PAPER).dissimilarity[0] == pytest.approx(0, abs=1e-9)
    with_sizes = rank(collection[0], [collection[0], bigger], FAST)
    assert with_sizes.dissimilarity[1] > with_sizes.dissimilarity[0] + 0.1
