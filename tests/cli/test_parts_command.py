"""`curvematch parts` again and again: what is there stays, what is missing or unsound is made, to the same bytes."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import trimesh

from curvematch_jax import _files
from curvematch_jax.cli._app import run
from curvematch_jax.datasets import creature
from curvematch_jax.extraction import extract_collection
from curvematch_jax.extraction._kept import Store
from curvematch_jax.surface import Extraction

SETTINGS = Extraction(levels=3, samples=32, vertices=300)
OPTIONS = ["--levels", "3", "--samples", "32", "--vertices", "300"]


@pytest.fixture(name="meshes")
def fixture_meshes(tmp_path, solids):
    for name, content in solids.items():
        (tmp_path / "meshes" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "meshes" / name).write_text(content)
    return tmp_path / "meshes"


@pytest.fixture(name="solids", scope="module")
def fixture_solids():
    """Files of meshes by name."""
    made = {"a.off": creature("hand", 0, vertices=400).mesh, "deep/b.off": creature("snake", 0, vertices=400).mesh}
    return {
        name: trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="off")
        for name, mesh in made.items()
    }


@pytest.fixture(name="fresh", scope="module")
def fixture_fresh(solids, tmp_path_factory):
    """The bytes of the parts files of an uninterrupted run, by path."""
    folder = tmp_path_factory.mktemp("fresh")
    for name, content in solids.items():
        (folder / "meshes" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "meshes" / name).write_text(content)
    assert run(["parts", str(folder / "meshes"), "--out", str(folder / "out"), *OPTIONS, "--quiet"]) == 0
    return contents(folder / "out")


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def fill(folder, files):
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def parts(capsys, meshes, out, *options, status=0):
    """The JSON result of a run, and what it says on stderr."""
    capsys.readouterr()
    assert run(["parts", str(meshes), "--out", str(out), *OPTIONS, *options, "--json"]) == status
    printed = capsys.readouterr()
    return json.loads(printed.out), printed.err


@pytest.fixture(name="unneeded")
def fixture_unneeded(monkeypatch):
    """Nothing may be extracted."""

    def fail(function, tasks, *limits):
        assert not tasks
        return iter(())

    monkeypatch.setattr("curvematch_jax.extraction._collection.in_processes", fail)


@pytest.mark.usefixtures("unneeded")
def test_unchanged_meshes_are_left_alone(meshes, fresh, tmp_path, capsys):
    # Parts among the meshes are not taken for the input.
    out = fill(meshes / "out", fresh)
    written = {path: path.stat().st_mtime_ns for path in out.rglob("*.npz")}
    found, said = parts(capsys, meshes, out)
    assert (found["computed"], found["present"], found["notes"]) == (0, 2, [])
    assert [(entry["name"], entry["computed"]) for entry in found["objects"]] == [
        ("a.off", False),
        ("deep/b.off", False),
    ]
    assert said == ""
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.npz")} == written
    assert run(["parts", str(meshes), "--out", str(out), *OPTIONS]) == 0
    assert "2 of 2 meshes" in (text := capsys.readouterr().out)
    assert "0 computed and 2 there already" in text


@pytest.mark.usefixtures("unneeded")
def test_renamed_mesh_is_found_by_its_content(meshes, fresh, tmp_path, capsys):
    out = fill(tmp_path / "out", fresh)
    (meshes / "a.off").rename(meshes / "c.off")
    found, _ = parts(capsys, meshes, out)
    assert found["present"] == 2
    assert [entry["name"] for entry in found["objects"]] == ["c.off", "deep/b.off"]
    (out / "a.off.npz").unlink()
    # As if it had been made under this name: a file renamed by hand becomes one too.
    by_name = contents(out)
    shutil.copy(fill(tmp_path / "again", fresh) / "a.off.npz", out / "c.off.npz")
    parts(capsys, meshes, out)
    assert contents(out) == by_name
    assert by_name["c.off.npz"] != fresh["a.off.npz"]


def flipped(data):
    return data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 1]) + data[len(data) // 2 + 1 :]


def test_only_what_is_missing_changed_or_damaged_is_made(meshes, fresh, tmp_path, capsys):
    old, damaged, missing, foreign = (tmp_path / name for name in ("old", "damaged", "missing", "foreign"))
    name, other = fresh
    for out in (old, damaged, missing, foreign):
        fill(out, {other: fresh[other]})
    np.savez(old / name, format=2)
    (damaged / name).write_bytes(flipped(fresh[name]))
    (foreign / name).write_bytes(b"")
    # What a killed process was writing.
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    fill(missing / f".curvematch-{_files._host()}-{process.pid}-x", {"new": fresh[name][:100]})
    reasons = {old: "format 2, and this version", damaged: "a.off.npz: ", missing: None, foreign: "not a parts file"}
    for out, reason in reasons.items():
        found, said = parts(capsys, meshes, out)
        assert (found["computed"], found["present"]) == (1, 1)
        assert len(found["notes"]) == (reason is not None)
        assert (reason or "") in said
        assert contents(out) == fresh
    # A mesh that has changed takes the place of what it was.
    shutil.copy(meshes / "deep" / "b.off", meshes / "a.off")
    with (meshes / "a.off").open("a") as file:
        file.write("# changed\n")
    found, said = parts(capsys, meshes, old)
    assert (found["computed"], found["present"], said) == (1, 1, "")
    assert contents(old).keys() == fresh.keys()
    assert contents(old)[name] != fresh[name]


@pytest.mark.slow
def test_killed_run_is_continued_to_the_same_bytes(meshes, fresh, tmp_path, capsys):
    command = [sys.executable, "-m", "curvematch_jax.cli", "parts", meshes, "--out", tmp_path / "out", *OPTIONS]
    process = subprocess.Popen([*command, "--jobs", "1"], env=os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")})
    while process.poll() is None and not list((tmp_path / "out").rglob("*.npz")):
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    found, _ = parts(capsys, meshes, tmp_path / "out")
    assert found["present"] >= 1
    assert contents(tmp_path / "out") == fresh


def test_a_mesh_that_takes_too_long_does_not_affect_the_others(meshes, fresh, tmp_path, capsys):
    os.mkfifo(meshes / "z.off")  # Reading it would wait for a writer forever.
    out = fill(tmp_path / "out", fresh)
    arguments = ["parts", meshes / "a.off", meshes / "deep", meshes / "z.off", "--out", out, "--time-limit", "1"]
    assert run([*map(str, arguments), *OPTIONS, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in found["objects"]] == ["a.off", "b.off"]
    assert found["failed"] == [{"name": "z.off", "reason": "took longer than 1 s"}]


@pytest.mark.usefixtures("unneeded")
def test_parts_are_no_meshes(meshes, fresh, tmp_path, capsys):
    out = fill(tmp_path / "out", fresh)
    capsys.readouterr()
    assert run(["parts", str(out / "a.off.npz"), str(meshes / "a.off"), "--out", str(out), *OPTIONS, "--json"]) == 0
    failed = json.loads(capsys.readouterr().out)["failed"]
    assert [(entry["name"], "give meshes" in entry["reason"]) for entry in failed] == [("out/a.off", True)]
    assert run(["parts", str(out), "--out", str(tmp_path / "copy"), *OPTIONS]) == 2
    assert "no meshes" in capsys.readouterr().err
    (tmp_path / "file").write_text("")
    assert run(["parts", str(meshes), "--out", str(tmp_path / "file"), *OPTIONS]) == 2
    assert "give a folder for the parts" in capsys.readouterr().err


@pytest.mark.usefixtures("unneeded")
def test_old_and_damaged_files_are_failures_elsewhere(meshes, fresh, tmp_path, capsys):
    out = fill(tmp_path / "out", fresh)
    np.savez(out / "old.npz", format=2)
    (out / "damaged.npz").write_bytes(flipped(fresh["a.off.npz"]))
    found = extract_collection([out], SETTINGS, jobs=1)
    assert [p.name for p in found.parts] == ["a.off", "deep/b.off"]
    assert {failure.name for failure in found.failures} == {"damaged", "old"}


@pytest.mark.usefixtures("unneeded")
def test_what_the_command_has_made_is_a_cache(meshes, fresh, tmp_path):
    found = extract_collection([meshes], SETTINGS, jobs=1, cache=fill(tmp_path / "out", fresh))
    assert [p.name for p in found.parts] == ["a.off", "deep/b.off"]
    assert (found.failures, found.computed, found.notes) == ((), 0, ())


def test_other_settings_are_refused(fresh, tmp_path):
    out = fill(tmp_path / "out", fresh)
    with pytest.raises(ValueError, match=r"holds parts made with levels = 3, and parts are asked for with levels = 23"):
        Store(out, Extraction(samples=32, vertices=300))
