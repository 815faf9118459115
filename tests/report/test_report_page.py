"""The page as data: numbers that come back as they were, names that stay text, and a size that is bounded."""

import base64
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curvematch_jax.report import Limits, report_page, write_report
from curvematch_jax.report._matrix import packed_matrix
from curvematch_jax.report._packed import packed, spread
from curvematch_jax.report._page import SCRIPTS, _text, embedded
from curvematch_jax.report._rankings import rankings
from curvematch_jax.retrieval import SavedMatrix, evaluate

HOSTILE = "</script><!--<script>alert(1)//$style\u2028'\"&lt;\udcff"


def decoded(text, kind):
    return np.frombuffer(base64.b64decode(text), f"<{kind}")


def data_of(page):
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


def matrix_of(count, seed=0):
    values = np.random.default_rng(seed).random((count, count))
    np.fill_diagonal(values, 0.0)
    return values


def saved_of(count, names=None):
    names = tuple(f"object{i}" for i in range(count)) if names is None else names
    return SavedMatrix(matrix_of(count), names, {"matching": {"scale": "<b>"}, "extraction": {}}, ("a note <i>",))


def test_a_page_without_anything_beside_the_matrix():
    page = report_page(saved_of(5))
    data = data_of(page)
    assert data["names"] == [f"object{i}" for i in range(5)]
    assert data["classes"] == []
    assert data["surfaces"] == data["explained"] == {}
    for sentence in ("No classes were given", "No parts were given", "No meshes were given", "a note &lt;i&gt;"):
        assert sentence in page
    assert "&lt;b&gt;" in page


def test_objects_come_class_by_class_and_measures_are_those_of_evaluate():
    saved, labels = saved_of(6), ["b", "a", "b", "a", "<a>", "<a>"]
    page = report_page(saved, labels)
    data = data_of(page)
    order = decoded(data["order"], "u4")
    assert [labels[k] for k in order] == sorted(labels)
    assert [data["classes"][k] for k in decoded(data["classOf"], "u4")] == labels
    scores = evaluate(saved.dissimilarity, labels)
    rows = re.findall(r'<th scope="row">([^<]*)</th>((?:<td>[\d.]+</td>)+)</tr>', page)
    shown = {name: re.findall(r">([\d.]+)<", cells) for name, cells in rows}
    measures = ("nn", "ft", "st", "e", "dcg", "map")
    assert shown["all queries"] == [f"{getattr(scores, measure):.3f}" for measure in measures]
    assert shown["&lt;a&gt;"] == [f"{scores.by_class()['<a>'][measure]:.3f}" for measure in measures]
    assert shown["0.5"] == [f"{scores.precision_11[5]:.3f}"]


def test_rankings_are_those_of_a_sort_without_the_query():
    matrix = np.round(matrix_of(40), 1)  # With many ties.
    found = rankings(matrix, np.arange(40)[::-1], Limits(queries=7, ranked=5, explained=3, pairs=2))
    assert len(found.queries) == 7
    for query, ranked, values in zip(found.queries, found.ranked, found.values, strict=True):
        expected = sorted((j for j in range(40) if j != query), key=lambda j: (matrix[query, j], j))[:5]
        assert ranked.tolist() == expected
        assert values.tolist() == matrix[query, expected].tolist()
        if int(query) in found.explained:
            assert found.explained[int(query)] == expected[:2]
    assert len(found.explained) == 3
    assert found.drawn(4)[:3] == list(found.explained)
    assert len(found.drawn(4)) == 4


@pytest.mark.parametrize("cells", [12, 5])
def test_the_matrix_is_the_mean_of_blocks_within_a_step(cells):
    matrix = matrix_of(12)
    found = packed_matrix(matrix, cells)
    bounds = found["bounds"]
    steps = decoded(found["values"], "u1").reshape(cells, cells)
    for i in range(cells):
        for j in range(cells):
            mean = matrix[bounds[i] : bounds[i + 1], bounds[j] : bounds[j + 1]].mean()
            mean = np.clip(mean, found["low"], found["high"])
            value = found["low"] + steps[i, j] / 255 * (found["high"] - found["low"])
            assert value == pytest.approx(mean, abs=0.51 / 255 * (found["high"] - found["low"]))


def test_equal_dissimilarities_are_drawn():
    assert set(decoded(packed_matrix(np.ones((3, 3)), 8)["values"], "u1")) == {0}


@given(st.integers(1, 200), st.integers(1, 200))
def test_spread_indices_ascend_and_keep_to_the_limit(count, limit):
    found = spread(count, limit)
    assert len(found) == min(count, limit)
    assert (np.diff(found) > 0).all()
    assert found[0] >= 0
    assert found[-1] < count


@given(st.lists(st.integers(0, 65535), max_size=20))
def test_packed_numbers_come_back(values):
    assert decoded(packed(np.array(values, int), "u2"), "u2").tolist() == values


@given(st.text() | st.just(HOSTILE))
def test_embedded_text_comes_back_and_holds_no_markup(name):
    text = embedded({name: [name]})
    assert json.loads(text) == {name: [name]}
    assert not set("<>&\u2028") & set(text)


def test_hostile_names_stay_text(tmp_path):
    names = (HOSTILE, HOSTILE + "2", "x", "y")
    page = report_page(saved_of(4, names), [HOSTILE, HOSTILE, "b", "b"], title=HOSTILE)
    assert data_of(page)["names"] == list(names)
    assert page.count("<script") == page.count("</script>") == 2
    assert "<!--" not in page
    write_report(page, tmp_path / "report.html")
    assert "</html>" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_the_page_names_no_other_file():
    page = report_page(saved_of(4), list("aabb"))
    assert re.findall(r"https?:|//[a-z]+\.|@import|url\(", page) == []
    addresses = re.findall(r'\b(?:src|href)="([^"]*)"', page)
    assert {address for address in addresses if not address.startswith("#")} == {"data:,"}
    assert "default-src 'none'" in page
    assert not any("</" in _text(name) or "<!--" in _text(name) for name in SCRIPTS)


def test_the_size_is_bounded_by_the_limits():
    limits = Limits(cells=16, queries=10, ranked=3)
    small, large = (report_page(saved_of(count), limits=limits) for count in (100, 400))
    per_object = (len(large) - len(small)) / 300
    assert per_object < 30  # A name, its class and its place.
    assert "drawn with 16 cells a side" in large
    assert "Rankings of 10 of 400 queries" in large


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"saved": saved_of(1)}, "of M > 1 objects"),
        ({"saved": saved_of(3), "labels": ["a", "b"]}, "3 objects, and labels of 2"),
        ({"saved": saved_of(3), "parts": []}, "3 objects, and parts of 0"),
        ({"saved": saved_of(3), "labels": ["a", "b", "c"]}, "no class has two members"),
        ({"saved": SavedMatrix(np.full((2, 2), np.nan), ("a", "b"), {})}, "finite dissimilarities"),
    ],
)
def test_what_does_not_fit_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        report_page(**arguments)


@pytest.mark.parametrize(("name", "value"), [("cells", 0), ("ranked", -1), ("vertices", 70000)])
def test_limits_are_checked(name, value):
    with pytest.raises(ValueError, match=name):
        Limits(**{name: value})


def test_a_folder_is_not_replaced(tmp_path):
    with pytest.raises(ValueError, match="a folder, and a report is one file"):
        write_report("page", tmp_path)


def test_lightness_alone_tells_cells_apart():
    anchors = _text("matrix.js").split("CIVIDIS = [")[1].split("]")[0].replace('"', "").split(", ")
    grey = [np.dot([int(text[k : k + 2], 16) for k in (1, 3, 5)], [0.2126, 0.7152, 0.0722]) for text in anchors]
    assert (np.diff(grey) > 5).all()
