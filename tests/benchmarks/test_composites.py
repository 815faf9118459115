import math

import numpy as np
import pytest

from benchmarks import _graded
from curvematch_jax.datasets import CREATURES


def test_grades_are_two_for_both_sources_and_one_for_their_relatives():
    related = {"human": frozenset({"ape"}), "ape": frozenset({"human"})}
    labels = ["human", "ape", "fish", "bird"]
    assert _graded.graded([("human", "fish"), ("bird", "fish"), ("ape", "human")], labels, related).tolist() == [
        [2, 1, 2, 0],
        [0, 0, 2, 2],
        [2, 2, 0, 0],
    ]


def test_measures_of_two_rankings():
    labels = ["human", "fish", "ape", "bird"]
    related = {"human": frozenset({"ape"})}
    found = _graded.judged(np.array([[1, 2, 3, 4], [4, 3, 2, 1]]), [("human", "fish")] * 2, labels, related)
    # Grades 0, 1, 2, 2 from the first to the last, where 2, 2, 1, 0 would be ideal.
    second = (0 + 1 + 2 / math.log2(3) + 2 / 2) / (2 + 2 + 1 / math.log2(3))
    assert found["nn"] == 0.5
    assert found["both_in_top_10"] == 2
    assert found["by_query"]["ndcg"][0] == found["by_query"]["adr"][0] == 1
    assert found["by_query"]["ndcg"][1] == pytest.approx(second)
    assert found["by_query"]["adr"][1] == pytest.approx((0 + 0 + 2 / 3) / 3)
    assert found["precision_11_sources"][0] == pytest.approx((1 + 0.5) / 2)
    assert found["precision_11_related"][0] == pytest.approx((1 + 3 / 4) / 2)


def test_both_classes_have_to_be_among_the_first_ten():
    labels = ["cat"] * 10 + ["dog"]
    found = _graded.judged(np.arange(11.0)[None], [("dog", "cat")], labels, {})
    assert found["both_in_top_10"] == 0
    assert _graded.judged(-np.arange(11.0)[None], [("dog", "cat")], labels, {})["both_in_top_10"] == 1


def test_table_of_related_classes():
    related = _graded.relatives()
    assert related["centaur"] >= {"horse", "human", "david"}
    assert "horse" not in related["human"]
    assert all(label in related[other] for label, near in related.items() for other in near)
    assert set(CREATURES) - related.keys() == {"snake", "hand"}
    assert not any(label in near for label, near in related.items())


def test_a_folder_may_name_its_own(tmp_path):
    (tmp_path / "related.csv").write_text("class,related\ncat,dog\ncat, lion\n")
    assert _graded.relatives(tmp_path) == {"cat": {"dog", "lion"}, "dog": {"cat"}, "lion": {"cat"}}
    (tmp_path / "related.csv").write_text("class,related\ncat,\n")
    with pytest.raises(ValueError, match=r"related\.csv: each row needs a class and a related one"):
        _graded.relatives(tmp_path)
    (tmp_path / "related.csv").write_text("cat,dog\n")
    with pytest.raises(ValueError, match="the first line must name the columns class,related"):
        _graded.relatives(tmp_path)
    assert "centaur" in _graded.relatives(tmp_path / "nowhere")
