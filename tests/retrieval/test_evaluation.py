"""Measures by hand on tiny rankings, and against pytrec-eval and ranx on random ones."""

import json

import numpy as np
import pytest

from curvematch_jax.retrieval import _measures as measures
from curvematch_jax.retrieval import evaluate, evaluate_graded


def matrix_of_rankings(order: list[list[int]]) -> np.ndarray:
    """A dissimilarity matrix whose row q ranks the objects as `order[q]` does; the diagonal is worst, as a trap."""
    matrix = np.full((len(order), len(order)), 99.0)
    for query, others in enumerate(order):
        matrix[query, others] = np.arange(len(others))
    return matrix


@pytest.fixture(name="by_hand")
def fixture_by_hand():
    # Classes a = {0, 1, 2}, b = {3, 4}, c = {5}.
    order = [[1, 3, 2, 4, 5], [3, 4, 0, 5, 2], [5, 4, 3, 0, 1], [4, 0, 1, 2, 5], [0, 1, 2, 5, 3], [0, 1, 2, 3, 4]]
    return evaluate(matrix_of_rankings(order), list("aaabbc"))


def test_queries_and_left_out(by_hand):
    assert by_hand.queries.tolist() == [0, 1, 2, 3, 4]
    assert by_hand.left_out == ("c",)
    assert by_hand.labels == tuple("aaabbc")


def test_measures_by_hand(by_hand):
    # Hits of the five queries at ranks (1, 3), (3, 5), (4, 5), (1), (5), among 5.
    expected = {
        "nn": [1, 0, 0, 1, 0],
        "ft": [0.5, 0, 0, 1, 0],
        "st": [1, 0.5, 0.5, 1, 0],
        "e": [4 / 7, 4 / 7, 4 / 7, 2 / 6, 2 / 6],
        "map": [(1 + 2 / 3) / 2, (1 / 3 + 2 / 5) / 2, (1 / 4 + 2 / 5) / 2, 1, 1 / 5],
        "dcg": [
            (1 + 1 / np.log2(3)) / 2,
            (1 / np.log2(3) + 1 / np.log2(5)) / 2,
            (1 / 2 + 1 / np.log2(5)) / 2,
            1,
            1 / np.log2(5),
        ],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(by_hand.by_query[name], values, rtol=1e-12, err_msg=name)
        assert getattr(by_hand, name) == pytest.approx(np.mean(values)), name


def test_macro_average_weighs_classes_equally(by_hand):
    a, b = by_hand.by_query["map"][:3].mean(), by_hand.by_query["map"][3:].mean()
    assert by_hand.map_macro == pytest.approx((a + b) / 2)
    assert by_hand.map != pytest.approx(by_hand.map_macro)
    assert by_hand.by_class()["b"]["nn"] == 0.5


def test_ties_by_lower_index():
    labels = ["a", "b", "a", "b", "a"]
    scores = evaluate(np.zeros((5, 5)), labels)
    # Query 0 sees b a b a, query 1 a a b a, query 2 a b b a, query 3 a b a a, query 4 a b a b.
    np.testing.assert_array_equal(scores.by_query["nn"], [0, 0, 1, 0, 1])
    np.testing.assert_allclose(scores.by_query["map"], [1 / 2, 1 / 3, 3 / 4, 1 / 2, 5 / 6])


def test_second_tier_beyond_the_collection():
    scores = evaluate(matrix_of_rankings([[1, 2], [0, 2], [0, 1]]), ["a", "a", "a"])
    assert scores.st == scores.ft == scores.map == scores.dcg == 1


def test_e_measure_ceiling_of_classes_of_twenty():
    relevant = np.arange(399) < 19
    assert measures.e_measure(relevant) == pytest.approx(0.745, abs=5e-4)


def test_twenty_bins_by_hand():
    # Precisions 1, 2/4 at recalls .5, 1: nothing is known below .5, linear above.
    values = measures.twenty_bin_precision(np.array([True, False, False, True]))
    assert np.isnan(values[:9]).all()
    np.testing.assert_allclose(values[9:], np.linspace(1, 0.5, 11))


def test_twenty_bins_leave_unknown_queries_out():
    labels = ["a"] * 21 + ["b"] * 2
    rng = np.random.default_rng(0)
    scores = evaluate(rng.uniform(size=(23, 23)), labels)
    assert np.isfinite(scores.precision_20).all()
    only_pairs = evaluate(rng.uniform(size=(4, 4)), list("aabb"))
    assert np.isnan(only_pairs.precision_20[:-1]).all()
    assert only_pairs.precision_20[-1] == pytest.approx(only_pairs.map)
    assert json.loads(json.dumps(only_pairs.summary(), allow_nan=False))["precision_20"][0] is None


def test_summary_is_json(by_hand):
    summary = json.loads(json.dumps(by_hand.summary(), allow_nan=False))
    assert summary["nn"] == pytest.approx(0.4)
    assert set(summary["classes"]) == {"a", "b"}


@pytest.fixture(name="random_case", scope="module")
def fixture_random_case():
    rng = np.random.default_rng(3)
    labels = rng.integers(0, 6, size=60)
    values = rng.permutation(60 * 60).reshape(60, 60).astype(float)  # no ties
    values[labels[:, None] == labels[None]] *= 0.5
    values += rng.uniform(size=values.shape) * 1e-3
    return values, labels


def test_agrees_with_trec_eval(random_case):
    import pytrec_eval

    values, labels = random_case
    scores = evaluate(values, labels)
    relevance, run = judged(values, labels)
    names = {"P.1", "Rprec", "map", "iprec_at_recall"}
    result = pytrec_eval.RelevanceEvaluator(relevance, names).evaluate(run)
    for oracle, ours in (("P_1", "nn"), ("Rprec", "ft"), ("map", "map")):
        np.testing.assert_allclose(
            [result[f"q{q}"][oracle] for q in scores.queries], scores.by_query[ours], rtol=1e-9, err_msg=ours
        )
    points = [np.mean([r[f"iprec_at_recall_{level:.2f}"] for r in result.values()]) for level in np.arange(11) / 10]
    np.testing.assert_allclose(scores.precision_11, points, rtol=1e-9)


@pytest.mark.slow  # ranx compiles for half a minute
@pytest.mark.filterwarnings("ignore::Warning")
def test_agrees_with_ranx(random_case):
    ranx = pytest.importorskip("ranx")
    values, labels = random_case
    scores = evaluate(values, labels)
    relevance, run = judged(values, labels)
    f1 = ranx.evaluate(ranx.Qrels(relevance), ranx.Run(run), "f1@32", return_mean=False)
    np.testing.assert_allclose(np.sort(f1), np.sort(scores.by_query["e"]), rtol=1e-9)


def judged(values, labels):
    """The same case as nested dictionaries, the query left out."""
    ids = range(len(labels))
    relevance = {f"q{q}": {f"d{j}": int(labels[q] == labels[j]) for j in ids if j != q} for q in ids}
    run = {f"q{q}": {f"d{j}": -float(values[q, j]) for j in ids if j != q} for q in ids}
    return relevance, run


def test_graded_by_hand():
    # Ranked grades 1, 2, 0, 2; ideal 2, 2, 1, 0.
    scores = evaluate_graded(np.array([[0.0, 1.0, 2.0, 3.0]]), np.array([[1, 2, 0, 2]]))
    gain, ideal = 1 + 2 + 0 + 2 / 2, 2 + 2 + 1 / np.log2(3)
    assert scores.ndcg == pytest.approx(gain / ideal)
    np.testing.assert_allclose(scores.ndcg_at, [1 / 2, 3 / 4, 3 / ideal, gain / ideal])
    # First 1: none of grade 2; first 2: one of grade 2; first 3: two of grade 1 or more.
    assert scores.adr == pytest.approx((0 + 1 / 2 + 2 / 3) / 3)


def test_perfect_graded_ranking():
    grades = np.array([[2, 2, 1, 0, 0], [0, 0, 1, 2, 1]])
    scores = evaluate_graded(-grades.astype(float), grades)
    assert scores.ndcg == scores.adr == 1
    np.testing.assert_array_equal(scores.ndcg_at, 1)


@pytest.mark.parametrize(
    ("matrix", "labels", "message"),
    [
        (np.zeros((3, 4)), "aab", "square"),
        (np.zeros(9), "aab", "matrix"),
        (np.zeros((0, 0)), "", "matrix"),
        (np.zeros((3, 3)), "aa", "2 labels were given for the 3 objects"),
        (np.where(np.eye(3, k=1), np.nan, 0), "aab", r"2 NaN, the first at \(0, 1\)"),
        (np.zeros((3, 3)), "abc", "no class has two members"),
        (np.array([["x"] * 3] * 3), "aab", "numbers"),
    ],
)
def test_refuses(matrix, labels, message):
    with pytest.raises(ValueError, match=message):
        evaluate(matrix, list(labels))


@pytest.mark.parametrize(
    ("matrix", "grades", "message"),
    [
        (np.zeros((1, 3)), np.ones((1, 2)), "must be equal"),
        (np.zeros((1, 3)), -np.ones((1, 3)), "not negative"),
        (np.zeros((2, 3)), np.array([[1, 0, 0], [0, 0, 0]]), "query 1 has no relevant"),
        (np.full((1, 3), np.nan), np.ones((1, 3)), "3 NaN"),
    ],
)
def test_graded_refuses(matrix, grades, message):
    with pytest.raises(ValueError, match=message):
        evaluate_graded(matrix, grades)


def test_infinite_dissimilarity_ranks_last():
    matrix = matrix_of_rankings([[1, 2], [0, 2], [1, 0]])
    matrix[0, 2] = matrix[1, 2] = np.inf
    assert evaluate(matrix, list("aab")).nn == 1
