"""Parts survive the disk; damaged, hostile, foreign and unlike files are refused by name, at no great cost."""

import dataclasses
import io
import json
import os
import subprocess
import sys
import tracemalloc
import zipfile

import numpy as np
import pytest

from curvematch_jax import _files
from curvematch_jax.retrieval import (
    _parts_file,
    fingerprint,
    load_collection,
    load_parts,
    save_parts,
    source_key,
    stored_source,
)
from curvematch_jax.retrieval._parts_file import PARTS_FORMAT
from curvematch_jax.surface import Extraction

KEY = "0123456789abcdef" * 4


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
    """A parts file with a valid checksum but other entries; None drops one."""
    with np.load(source) as file:
        entries = {name: file[name] for name in file.files}
    fields = {name: np.asarray(value) for name, value in (entries | changes).items() if value is not None}
    target.write_bytes(_parts_file._encoded(fields, ""))


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
    np.savez(path, format=PARTS_FORMAT, name=np.array([print], dtype=object))
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


def test_missing_file_folder_and_pipe(make_parts, tmp_path):
    with pytest.raises(FileNotFoundError):
        load_parts(tmp_path / "none.npz")
    with pytest.raises(ValueError, match="a folder"):
        load_parts(tmp_path)
    with pytest.raises(ValueError, match="a folder"):
        save_parts(make_parts(), tmp_path)
    os.mkfifo(tmp_path / "pipe.npz")
    with pytest.raises(ValueError, match="not a regular file"):
        load_parts(tmp_path / "pipe.npz")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 99}, "format 99"),
        ({"format": 2}, f"format 2, and this version reads format {PARTS_FORMAT}: extract them again"),
        ({"format": None}, "no format number"),
        ({"curves": None, "mask": None}, "lacks curves, mask"),
        ({"lengths": np.zeros((3, 4))}, r"lengths has shape \(3, 4\)"),
        ({"areas": np.array([0.1, np.nan, 0.1])}, "areas holds values that are not finite"),
        ({"area": np.inf}, "area holds values that are not finite"),
        ({"area": -1.0}, "area is -1.0, and has to be more than 0"),
        ({"areas": np.array([0.1, -0.1, 0.1])}, "areas holds negative values"),
        ({"lengths": np.zeros((3, 3), "f4")}, "lengths and mask disagree about which level curves there are"),
        ({"curves": np.zeros((3, 3, 3, 32), "f4")}, "curves and mask disagree about which level curves there are"),
        ({"mask": np.ones((3, 3))}, "type <f8 where parts have another"),
        ({"curves": np.zeros((3, 3, 3, 32), ">f4").T}, "damaged"),
        ({"name": ["a", "b"]}, "name has shape"),
        ({"name": np.array([0xFFFFFFFF], "<u4").view("<U1")[0:1].reshape(())}, "b.npz: not a"),
        ({"notes": "17"}, "notes are not a list of texts"),
        ({"settings": "[" * 5000}, "not a sound parts file"),
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


def test_same_parts_same_bytes(make_parts, tmp_path, monkeypatch):
    save_parts(make_parts("a", notes=("note",)), tmp_path / "a.npz", KEY)
    monkeypatch.setattr("time.time", lambda: 2e9)
    save_parts(make_parts("a", notes=("note",)), tmp_path / "b.npz", KEY)
    # Nor does the layout in memory matter.
    by_columns = np.asfortranarray(make_parts("a").curves).astype(">f4")
    save_parts(make_parts("a", notes=("note",), curves=by_columns), tmp_path / "c.npz", KEY)
    first = (tmp_path / "a.npz").read_bytes()
    assert (tmp_path / "b.npz").read_bytes() == first
    assert (tmp_path / "c.npz").read_bytes() == first
    save_parts(make_parts("a", notes=("note",)), tmp_path / "d.npz")
    assert (tmp_path / "d.npz").read_bytes() != first
    with np.load(tmp_path / "a.npz") as file:
        np.testing.assert_array_equal(file["curves"], make_parts("a").curves)


def test_fingerprint_is_of_what_is_compared(make_parts, tmp_path):
    parts = make_parts("a")
    save_parts(parts, tmp_path / "a.npz")
    same = [load_parts(tmp_path / "a.npz"), dataclasses.replace(parts, name="b", notes=("note",))]
    assert {fingerprint(other) for other in same} == {fingerprint(parts)}
    curves = parts.curves.copy()
    curves[-1, -1, -1, -1] = np.nextafter(curves[-1, -1, -1, -1], np.float32(1))
    others = [
        dataclasses.replace(parts, curves=curves),
        dataclasses.replace(parts, lengths=parts.level_set_lengths, level_set_lengths=parts.lengths),
        dataclasses.replace(parts, area=2.0, diameter=1.5),
        dataclasses.replace(parts, area=1.6),
        dataclasses.replace(parts, settings=dataclasses.replace(parts.settings, radius=0.7)),
        make_parts("a", parts=0),
    ]
    assert len({fingerprint(other) for other in [parts, *others]}) == 1 + len(others)


def test_source_is_kept(make_parts, tmp_path):
    save_parts(make_parts(), tmp_path / "a.npz", KEY)
    save_parts(make_parts(), tmp_path / "b.npz")
    np.savez(tmp_path / "c.npz", format=2)
    (tmp_path / "d.npz").write_bytes(b"")
    assert [stored_source(tmp_path / f"{name}.npz") for name in "abcd"] == [KEY, "", "", ""]
    with pytest.raises(ValueError, match="64 hex digits, found 'me'"):
        save_parts(make_parts(), tmp_path / "e.npz", "me")
    assert not (tmp_path / "e.npz").exists()


def test_source_key_is_of_content_format_and_settings(tmp_path):
    for name, content in (("a.off", b"OFF"), ("b.OFF", b"OFF"), ("a.obj", b"OFF"), ("c.off", b"OFF ")):
        (tmp_path / name).write_bytes(content)
    keys = [source_key(tmp_path / name, Extraction()) for name in ("a.off", "b.OFF", "a.obj", "c.off")]
    keys.append(source_key(tmp_path / "a.off", Extraction(radius=0.7)))
    assert keys[0] == keys[1]
    assert len(set(keys)) == 4


def test_any_flipped_bit_is_found(make_parts, tmp_path):
    path = tmp_path / "a.npz"
    save_parts(make_parts(parts=1, notes=("note",)), path, KEY)
    good = path.read_bytes()
    places = {*range(0, 1200, 31), *range(len(good) - 1800, len(good), 11), *range(0, len(good), 211)}
    for place in places:
        bad = bytearray(good)
        bad[place] ^= 1 << place % 8
        path.write_bytes(bad)
        with pytest.raises(ValueError, match=r"a\.npz: "):
            load_parts(path)


def zipped(*members, compression=zipfile.ZIP_STORED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in members:
            archive.writestr(f"{name}.npy", content)
    return buffer.getvalue()


def npy(shape, content=b"", dtype="<f4"):
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": dtype, "fortran_order": False, "shape": shape})
    return buffer.getvalue() + content


def claiming_sizes(data, size):
    """An archive whose directory claims sizes that its members do not have."""
    place = data.rindex(b"PK\x01\x02")
    return data[: place + 20] + 2 * size.to_bytes(4, "little") + data[place + 28 :]


FORMAT = ("format", npy((), PARTS_FORMAT.to_bytes(8, "little"), "<i8"))
HOSTILE = {
    "bomb": zipped(FORMAT, ("curves", npy((10**8, 3), bytes(1 << 28))), compression=zipfile.ZIP_DEFLATED),
    "shape": zipped(FORMAT, ("curves", npy((10**9, 23, 3, 100)))),
    "negative": zipped(FORMAT, ("curves", npy((-1, 3)))),
    "overflow": zipped(FORMAT, ("curves", npy((2**32, 2**32)))),
    "objects": zipped(FORMAT, ("curves", npy((1,), bytes(8), "|O"))),
    "text": zipped(FORMAT, ("name", npy((), b"", "<U1000000000"))),
    "members": claiming_sizes(zipped(FORMAT, ("curves", npy((1,), bytes(4)))), (1 << 32) - 2),
    "header": zipped(FORMAT, ("curves", npy((1, 2)).replace(b"(1, 2)", b"(1, 2("))),
    "format": zipped(("format", npy((10**9,), bytes(8), "<i8"))),
}


@pytest.mark.parametrize("kind", list(HOSTILE))
def test_hostile_file_costs_no_memory(tmp_path, kind):
    path = tmp_path / "a.npz"
    path.write_bytes(HOSTILE[kind])
    assert path.stat().st_size < 1 << 20
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=r"a\.npz: not a parts file, or a damaged one"):
            load_parts(path)
        assert tracemalloc.get_traced_memory()[1] < 1 << 23
    finally:
        tracemalloc.stop()


# How `save_parts` writes, in a process that has not to load the whole package.
WRITE_OFTEN = """
import pathlib, runpy, sys
replacing = runpy.run_path(sys.argv[1])["replacing"]
data = pathlib.Path(sys.argv[2]).read_bytes()
for _ in range(200):
    for name in sys.argv[3:]:
        with replacing(pathlib.Path(name)) as temporary:
            temporary.write_bytes(data)
"""


def test_writers_of_one_file_never_break_a_reader(make_parts, tmp_path):
    made = [make_parts(seed=seed, parts=40) for seed in range(3)]
    for seed, parts in enumerate(made):
        save_parts(parts, tmp_path / f"{seed}.npz")
    read = [tmp_path / "out" / name for name in ("a.npz", "b.npz")]
    for path in read:
        save_parts(made[0], path)
    command = [sys.executable, "-c", WRITE_OFTEN, _files.__file__]
    writers = [subprocess.Popen([*command, tmp_path / f"{seed}.npz", *read]) for seed in (1, 2)]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        seen |= {fingerprint(load_parts(path)) for path in read}
    assert [writer.returncode for writer in writers] == [0, 0]
    assert seen <= {fingerprint(parts) for parts in made}
    assert len(seen) > 1
    assert sorted(read[0].parent.iterdir()) == read


def test_leftovers_of_dead_processes_are_removed(tmp_path):
    writer = subprocess.Popen([sys.executable, "-c", ""])
    writer.wait()
    dead, other_host = writer.pid, "0" * 8
    names = {
        f".curvematch-{_files._host()}-{dead}-abc": False,
        f".curvematch-{_files._host()}-{os.getpid()}-abc": True,
        f".curvematch-{other_host}-{dead}-old": False,
        f".curvematch-{other_host}-{dead}-new": True,
        ".curvematch-notes": True,
        "cat.npz": True,
    }
    for name in names:
        (tmp_path / "deep" / name).mkdir(parents=True)
        (tmp_path / "deep" / name / "new").write_bytes(b"half")
    os.utime(tmp_path / "deep" / f".curvematch-{other_host}-{dead}-old", (0, 0))
    _files.remove_leftovers(tmp_path)
    assert {path.name for path in (tmp_path / "deep").iterdir()} == {name for name, stays in names.items() if stays}
    _files.remove_leftovers(tmp_path / "none")
