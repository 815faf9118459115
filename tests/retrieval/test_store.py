"""Parts and matrices survive the disk; damaged, foreign and unlike files are refused by name."""

import dataclasses
import json
import zipfile

import numpy as np
import pytest

from curvematch_jax.retrieval import (
    SavedMatrix,
    distinct_names,
    load_collection,
    load_matrix,
    load_parts,
    save_matrix,
    save_parts,
)
from curvematch_jax.surface import Extraction


def assert_same_parts(one, other):
    for field in dataclasses.fields(one):
        left, right = getattr(one, field.name), getattr(other, field.name)
        if isinstance(left, np.ndarray):
            assert left.dtype == right.dtype, field.name
            np.testing.assert_array_equal(left, right, err_msg=field.name)
        else:
            assert left == right, field.name


@pytest.mark.parametrize("count", [0, 1, 5])
def test_parts_come_back(make_parts, tmp_path, count):
    parts = make_parts("größe/猫.off", parts=count, notes=("a note", "another"))
    save_parts(parts, tmp_path / "deep" / "cat.off.npz")
    assert_same_parts(load_parts(tmp_path / "deep" / "cat.off.npz"), parts)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["cat.off.npz"]


def test_suffix_is_kept_as_given(make_parts, tmp_path):
    save_parts(make_parts("a"), tmp_path / "cat.parts")
    assert load_parts(tmp_path / "cat.parts").name == "a"


def test_nothing_is_left_of_a_failed_write(make_parts, tmp_path):
    save_parts(make_parts("before"), tmp_path / "a.npz")
    with pytest.raises(TypeError):
        save_parts(make_parts("after", notes=(object(),)), tmp_path / "a.npz")
    assert load_parts(tmp_path / "a.npz").name == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]


def edited(source, target, **changes):
    """A copy of a parts file with other entries; None drops one."""
    with np.load(source) as file:
        entries = {name: file[name] for name in file.files}
    np.savez(target, **{name: value for name, value in (entries | changes).items() if value is not None})


def damaged(path, kind):
    good = path.read_bytes()
    contents = {
        "empty": b"",
        "garbage": b"\x00\xff" * 500,
        "truncated": good[: len(good) // 2],
        "text": b"OFF\n3 1 0\n",
    }
    flipped = bytearray(good)
    flipped[len(good) // 3] ^= 0xFF
    path.write_bytes(contents.get(kind, bytes(flipped)))


@pytest.mark.parametrize("kind", ["empty", "garbage", "truncated", "text", "flipped"])
def test_damaged_file_is_refused(make_parts, tmp_path, kind):
    path = tmp_path / "a.npz"
    save_parts(make_parts(), path)
    damaged(path, kind)
    with pytest.raises(ValueError, match=r"a\.npz: not a parts file, or a damaged one"):
        load_parts(path)


def test_pickle_is_never_run(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, format=1, name=np.array([print], dtype=object))
    with pytest.raises(ValueError, match="damaged"):
        load_parts(path)


def test_single_array_and_other_archives_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros(3))
    np.savez(tmp_path / "b.npz", x=np.zeros(3))
    with zipfile.ZipFile(tmp_path / "c.npz", "w") as archive:
        archive.writestr("x.txt", "not an array")
    for name in ("a.npy", "b.npz", "c.npz"):
        with pytest.raises(ValueError, match=name):
            load_parts(tmp_path / name)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_parts(tmp_path / "none.npz")
    with pytest.raises(ValueError, match="a folder"):
        load_parts(tmp_path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 99}, "format 99"),
        ({"format": None}, "no format number"),
        ({"curves": None, "mask": None}, "lacks curves, mask"),
        ({"lengths": np.zeros((3, 4))}, r"lengths has shape \(3, 4\)"),
        ({"areas": np.array([0.1, np.nan, 0.1])}, "areas holds values that are not finite"),
        ({"settings": json.dumps({"epsilon": 0.05, "colour": "red"})}, "colour"),
        ({"settings": "not json"}, "not a sound parts file"),
    ],
)
def test_unsound_parts_are_refused(make_parts, tmp_path, changes, message):
    save_parts(make_parts(), tmp_path / "a.npz")
    edited(tmp_path / "a.npz", tmp_path / "b.npz", **changes)
    with pytest.raises(ValueError, match=message):
        load_parts(tmp_path / "b.npz")


def test_collection_of_other_settings_is_refused(make_parts, tmp_path):
    save_parts(make_parts("cat"), tmp_path / "cat.npz")
    save_parts(make_parts("dog", settings=Extraction(levels=3, samples=32, radius=0.3)), tmp_path / "dog.npz")
    with pytest.raises(ValueError, match=r"dog were extracted with radius = 0.3, those of cat with radius = "):
        load_collection([tmp_path / "cat.npz", tmp_path / "dog.npz"])
    assert len(load_collection([tmp_path / "cat.npz"])) == 1


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
    with pytest.raises(ValueError, match="damaged: 1 names"):
        load_matrix(tmp_path / "D.zarr")


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["m/cat.off", "m/dog.off"], ["cat.off", "dog.off"]),
        (["m/cat.off", "n/cat.off", "n/dog.off"], ["m/cat.off", "n/cat.off", "dog.off"]),
        (["m/x/cat.off", "n/x/cat.off", "n/y/cat.off"], ["m/x/cat.off", "n/x/cat.off", "y/cat.off"]),
        (["m/cat.off", "m/../m/cat.off", "m/cat.off"], ["cat.off", "cat.off#2", "cat.off#3"]),
        (["m/cat.off", "m/cat.obj"], ["cat.off", "cat.obj"]),
        ([], []),
    ],
)
def test_names_tell_files_apart(paths, names):
    assert distinct_names(paths) == names
