"""Matrices survive the disk; damaged and foreign ones are refused by name."""

import dataclasses
import json

import numpy as np
import pytest

from curvematch_jax.retrieval import (
    SavedMatrix,
    load_matrix,
    save_matrix,
)
from curvematch_jax.retrieval._matrix_file import MATRIX_FORMAT


@pytest.fixture(name="saved")
def fixture_saved():
    settings = {"matching": {"fusion": "mean", "aligner": {"slopes": 7}}, "extraction": {"radius": 0.4}}
    return SavedMatrix(
        np.random.default_rng(0).uniform(size=(3, 3)), ("a.off", "b.off", "x/b.off"), settings, ("note",)
    )


def test_matrix_comes_back(saved, tmp_path):
    save_matrix(saved, tmp_path / "D.zarr")
    found = load_matrix(tmp_path / "D.zarr")
    np.testing.assert_array_equal(found.dissimilarity, saved.dissimilarity)
    assert found.names == saved.names
    assert found.settings == saved.settings
    assert found.notes == saved.notes
    assert [path.name for path in tmp_path.iterdir()] == ["D.zarr"]


def test_matrix_replaces_a_matrix_and_nothing_else(saved, tmp_path):
    save_matrix(saved, tmp_path / "D.zarr")
    save_matrix(dataclasses.replace(saved, notes=()), tmp_path / "D.zarr")
    assert load_matrix(tmp_path / "D.zarr").notes == ()
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("dear")
    (tmp_path / "file").write_text("dear")
    for name in ("thesis", "file"):
        with pytest.raises(ValueError, match=f"{name}: not a curvematch matrix"):
            save_matrix(saved, tmp_path / name)
    assert (tmp_path / "thesis" / "chapter.tex").read_text() == "dear"


def test_what_is_no_matrix_is_refused(saved, tmp_path):
    import zarr

    with pytest.raises(FileNotFoundError):
        load_matrix(tmp_path / "none.zarr")
    zarr.open_group(tmp_path / "other.zarr", mode="w")
    with pytest.raises(ValueError, match="not a curvematch matrix"):
        load_matrix(tmp_path / "other.zarr")
    save_matrix(saved, tmp_path / "D.zarr")
    zarr.open_group(tmp_path / "D.zarr").attrs["names"] = ["a.off"]
    with pytest.raises(ValueError, match=r"damaged .*1 names"):
        load_matrix(tmp_path / "D.zarr")


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"names": [1, 2, 3]}, "its names are something else"),
        ({"notes": 5}, "its notes are something else"),
        ({"settings": []}, "its settings are something else"),
        ({"complete": "yes"}, "its complete are something else"),
        ({"curvematch_matrix": 1}, f"has format 1, but this version reads format {MATRIX_FORMAT}"),
        ({"names": ["a"] * 60000}, r"60000 names, values of shape \(3, 3\)"),
    ],
)
def test_damaged_attributes_are_refused(saved, tmp_path, attributes, message):
    import zarr

    save_matrix(saved, tmp_path / "D.zarr")
    zarr.open_group(tmp_path / "D.zarr").attrs.update(attributes)
    with pytest.raises(ValueError, match=message):
        load_matrix(tmp_path / "D.zarr")


def test_values_that_are_lost_or_no_numbers_are_refused(saved, tmp_path):
    save_matrix(dataclasses.replace(saved, dissimilarity=np.full((3, 3), np.inf)), tmp_path / "D.zarr")
    with pytest.raises(ValueError, match="not finite"):
        load_matrix(tmp_path / "D.zarr")
    (chunk,) = (tmp_path / "D.zarr" / "dissimilarity" / "c").glob("*/*")
    chunk.unlink()
    with pytest.raises(ValueError, match="lacks 1 of 1 chunks"):
        load_matrix(tmp_path / "D.zarr")


@pytest.mark.parametrize(
    ("shape", "chunk"),
    [((60000, 60000), 1), ((1 << 62, 1 << 62), 3), ((3,), 3), ((0, 0), 3), ((3, 3), 0), ((3, 3), 1 << 40)],
)
def test_claimed_sizes_are_refused_before_anything_is_counted(saved, tmp_path, shape, chunk):
    save_matrix(saved, tmp_path / "D.zarr")
    file = tmp_path / "D.zarr" / "dissimilarity" / "zarr.json"
    facts = json.loads(file.read_text())
    facts["shape"] = shape
    facts["chunk_grid"]["configuration"]["chunk_shape"] = [chunk] * len(shape)
    file.write_text(json.dumps(facts))
    with pytest.raises(ValueError, match="the matrix is damaged"):
        load_matrix(tmp_path / "D.zarr")
