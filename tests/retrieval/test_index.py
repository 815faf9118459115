"""Indices on disk: the same rankings, growth, stops, damage, refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from elastic.aligners import COARSE

from curvematch_jax._files import locked
from curvematch_jax.retrieval import Collection, Matching, build_index, is_index, rank
from curvematch_jax.retrieval import _index as index_module

WARPS = Matching(aligner=COARSE)


@pytest.fixture(name="objects", scope="module")
def fixture_objects(make_parts):
    kinds = [(kind, k) for kind in range(12) for k in range(4)]
    made = [make_parts(f"{kind}-{k}", seed=kind, parts=2 + kind % 3, noise=0.15) for kind, k in kinds]
    made[7].mask[0, 1:] = False
    return [*made[:20], make_parts("sphere", parts=0), *made[20:]]


def same(one, other):
    np.testing.assert_array_equal(one.order, other.order)
    np.testing.assert_array_equal(one.dissimilarity, other.dissimilarity)
    np.testing.assert_array_equal(one.matched, other.matched)
    assert one.names == other.names


@pytest.mark.parametrize("matching", [Matching(), Matching.partial(), WARPS], ids=["default", "partial", "warps"])
def test_what_is_opened_ranks_as_what_was_saved(objects, tmp_path, matching):
    few = objects[15:25]
    ready = Collection.of(few, matching)
    ready.save(tmp_path / "I")
    opened = Collection.open(tmp_path / "I", matching)
    for i in (16, 20):
        same(rank(objects[i], opened, matching, top=3), rank(objects[i], ready, matching, top=3))


def test_it_grows_by_what_is_new(objects, tmp_path):
    path = tmp_path / "I"
    assert build_index(objects[:40], path) == 40
    before = {file.name: file.read_bytes() for file in path.glob("*.bin")}
    assert build_index(objects[:40], path) == 0
    assert build_index([*objects[40:], *objects[:40]], path) == 9
    for name, content in before.items():
        assert (path / name).read_bytes()[: len(content)] == content
    expected = Collection.of(objects[:40]).added(objects[40:])
    same(rank(objects[45], Collection.open(path)), rank(objects[45], expected))


def test_a_small_one_grows_with_its_cohort(objects, tmp_path):
    build_index(objects[:6], tmp_path / "I")
    build_index(objects[:12], tmp_path / "I")
    opened, whole = Collection.open(tmp_path / "I"), Collection.of(objects[:12])
    assert opened.cohort is not None
    assert len(opened.cohort.members) == 12
    np.testing.assert_allclose(rank(objects[0], opened).dissimilarity, rank(objects[0], whole).dissimilarity, rtol=1e-4)


def test_what_a_stopped_addition_left_does_not_count(objects, tmp_path, monkeypatch):
    path = tmp_path / "I"
    build_index(objects[:40], path)
    with monkeypatch.context() as patch:
        patch.setattr(index_module.json, "dumps", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            build_index(objects, path)
    assert len(Collection.open(path).names) == 40
    build_index(objects, path)
    same(rank(objects[45], Collection.open(path)), rank(objects[45], Collection.of(objects[:40]).added(objects[40:])))


def test_other_objects_and_settings_are_refused_by_name(objects, make_parts, tmp_path):
    path = tmp_path / "I"
    build_index(objects[:5], path)
    with pytest.raises(ValueError, match="1-0 is not among those given"):
        build_index(objects[:4], path)
    changed = [*objects[:3], make_parts("0-3", seed=99), objects[4]]
    with pytest.raises(ValueError, match="the parts of 0-3 have changed"):
        build_index(changed, path)
    with pytest.raises(ValueError, match="made with the preset default, and is asked for with the preset generic"):
        Collection.open(path, Matching.generic())
    assert is_index(path)


def test_damage_is_one_sentence(objects, tmp_path):
    path = tmp_path / "I"

    def refused(message):
        with pytest.raises(ValueError, match=message) as caught:
            Collection.open(path)
        assert "\n" not in str(caught.value)

    with pytest.raises(FileNotFoundError, match="no such index"):
        Collection.open(path)
    path.mkdir()
    refused("not a curvematch index")
    build_index(objects[:5], path)
    table = json.loads((path / "index.json").read_text())
    for change, message in (
        ({"curvematch_index": 99}, "of format 99"),
        ({"names": "all"}, "its names are something else"),
        ({"names": ["one"]}, "not as many names"),
        ({"cohort": {}}, "damaged"),
        ({"arrays": {**table["arrays"], "rows": {**table["arrays"]["rows"], "count": 10**9}}}, "rows is not what"),
        ({"arrays": {**table["arrays"], "rows": {**table["arrays"]["rows"], "count": 3}}}, "do not fit"),
        ({"arrays": {**table["arrays"], "rows": {**table["arrays"]["rows"], "dtype": "|O"}}}, "rows is not what"),
        ({"arrays": {}}, "damaged"),
        ({"settings": {"matching": table["settings"]["matching"], "extraction": {"levels": -1}}}, "damaged"),
    ):
        (path / "index.json").write_text(json.dumps({**table, **change}))
        refused(message)
    (path / "index.json").write_text("{")
    refused("not a curvematch index")
    (path / "index.json").write_text(json.dumps(table))
    (path / "signatures.bin").write_bytes(b"")
    refused("signatures is not what the index says")


def test_somebody_s_folder_is_left_as_it_is(objects, tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter").write_text("dear")
    with pytest.raises(ValueError, match="is not an index"):
        build_index(objects[:3], tmp_path / "thesis")
    assert Path(tmp_path / "thesis" / "chapter").read_text() == "dear"


def test_one_process_at_a_time(objects, tmp_path):
    with locked(tmp_path / "I"), pytest.raises(ValueError, match="another process is using it"):
        build_index(objects[:3], tmp_path / "I")
