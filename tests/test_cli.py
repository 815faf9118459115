"""The command line as other programs call it: arguments, JSON, exit statuses, one-line errors, one bad file in many."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from curvematch_jax.cli._app import Preset, run
from curvematch_jax.datasets import creature
from curvematch_jax.extraction._sources import find_meshes, find_sources
from curvematch_jax.extraction._workers import one_line
from curvematch_jax.retrieval import load_matrix, load_parts
from curvematch_jax.retrieval._matching import presets


def write_mesh(path: Path, kind: str, pose: int = 0) -> Path:
    mesh = creature(kind, pose, vertices=400).mesh
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="off"))
    return path


@pytest.fixture(name="meshes", scope="module")
def fixture_meshes(tmp_path_factory):
    """Two classes of two, with their labels."""
    folder = tmp_path_factory.mktemp("meshes")
    for kind in ("hand", "snake"):
        for pose in (0, 1):
            write_mesh(folder / f"{kind}{pose}.off", kind, pose)
    rows = [f"{kind}{pose}.off,{kind}\n" for kind in ("hand", "snake") for pose in (0, 1)]
    (folder / "labels.csv").write_text("file,class\n" + "".join(rows))
    return folder


@pytest.fixture(name="parts_dir", scope="module")
def fixture_parts_dir(meshes, tmp_path_factory):
    out = tmp_path_factory.mktemp("collection") / "parts"
    assert run(["parts", str(meshes), "--out", str(out), "--quiet"]) == 0
    return out


@pytest.fixture(name="matrix", scope="module")
def fixture_matrix(parts_dir):
    path = parts_dir.parent / "D.zarr"
    assert run(["matrix", str(parts_dir), "--out", str(path), "--quiet"]) == 0
    return path


def result(capsys, *arguments, status=0):
    """The JSON object that a command prints; nothing else may be on stdout."""
    capsys.readouterr()
    assert run([*map(str, arguments), "--json"]) == status
    return json.loads(capsys.readouterr().out)


def error(capsys, *arguments):
    """The one line that a command of status 2 leaves on stderr."""
    capsys.readouterr()
    assert run(list(map(str, arguments))) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    return err.splitlines()[-1]


def test_parts_of_a_folder(meshes, parts_dir):
    names = sorted(path.name for path in meshes.glob("*.off"))
    assert sorted(path.name for path in parts_dir.iterdir()) == [f"{name}.npz" for name in names]
    for name in names:
        assert load_parts(parts_dir / f"{name}.npz").name == name


def test_matrix_of_parts(matrix, meshes):
    saved = load_matrix(matrix)
    assert saved.names == tuple(sorted(path.name for path in meshes.glob("*.off")))
    assert saved.dissimilarity.shape == (4, 4)
    assert set(saved.settings) == {"extraction", "matching"}


def test_matrix_of_meshes_is_that_of_their_parts(meshes, matrix, tmp_path, capsys):
    files = sorted(meshes.glob("*.off"))
    found = result(capsys, "matrix", *files, "--out", tmp_path / "D.zarr")
    assert found["objects"] == [path.name for path in files]
    assert found["failed"] == []
    np.testing.assert_allclose(
        load_matrix(tmp_path / "D.zarr").dissimilarity, load_matrix(matrix).dissimilarity, atol=1e-5
    )


def test_evaluate(matrix, meshes, capsys):
    found = result(capsys, "evaluate", matrix, "--labels", meshes / "labels.csv")
    assert found["nn"] == 1
    assert set(found) >= {"nn", "ft", "st", "e", "dcg", "map", "map_macro", "precision_11", "classes", "settings"}
    assert run(["evaluate", str(matrix), "--labels", str(meshes / "labels.csv")]) == 0
    out = capsys.readouterr().out
    assert "NN" in out
    assert "snake" in out


def test_query_of_a_member_mesh(meshes, parts_dir, capsys):
    found = result(capsys, "query", meshes / "snake1.off", "--in", parts_dir, "--top", 3)
    assert [row["rank"] for row in found["results"]] == [1, 2, 3]
    assert [row["name"] for row in found["results"]][:2] == ["snake1.off", "snake0.off"]
    assert found["objects"] == 4
    by_parts = result(capsys, "query", parts_dir / "snake1.off.npz", "--in", parts_dir, "--top", 3)
    for one, other in zip(by_parts["results"], found["results"], strict=True):
        assert one == pytest.approx(other)


def test_text_goes_to_stdout_and_notes_to_stderr(meshes, parts_dir, capsys):
    assert run(["query", str(meshes / "hand0.off"), "--in", str(parts_dir)]) == 0
    out, err = capsys.readouterr()
    assert "hand1.off" in out
    assert "conflict" in out
    assert re.fullmatch(r"curvematch: collection .* s, query .* s, stack .* s, bounds .* s, distances .* s\n", err)
    assert run(["query", str(meshes / "hand0.off"), "--in", str(parts_dir), "--quiet"]) == 0
    assert capsys.readouterr().err == ""


def test_explained_query(meshes, parts_dir, tmp_path, capsys):
    arguments = ["query", meshes / "snake1.off", "--in", parts_dir, "--top", 2]
    result(capsys, *arguments, "--explain", tmp_path / "new" / "why.png")
    assert (tmp_path / "new" / "why.png").exists()
    arguments += ["--explain", tmp_path / "why.png"]
    found = result(capsys, *arguments)
    assert list(found["seconds"]) == ["collection", "query", "stack", "bounds", "distances", "picture"]
    assert found["picture"] == str(tmp_path / "why.png")
    parts = len(load_parts(parts_dir / "snake1.off.npz").areas)
    for row in found["results"]:
        assert sorted(match["part"] for match in row["matches"]) == list(range(parts))
        assert set(row["matches"][0]) == {"part", "other", "distance", "mass"}
    assert all(match["part"] == match["other"] for match in found["results"][0]["matches"])
    by_curves = (tmp_path / "why.png").read_bytes()
    assert by_curves.startswith(b"\x89PNG")
    assert run(list(map(str, [*arguments, "--meshes", meshes]))) == 0
    out = capsys.readouterr().out
    assert out.count(" -> ") == 1 + 2 * 3
    assert (tmp_path / "why.png").read_bytes() != by_curves
    assert "matches" not in result(capsys, *arguments[:-2])["results"][0]


def test_explanations_that_cannot_be_drawn(meshes, parts_dir, tmp_path, capsys):
    query = ["query", meshes / "snake1.off", "--in", parts_dir]
    (tmp_path / "other.off").write_text("")
    assert "is not a picture format" in error(capsys, *query, "--explain", tmp_path / "why.mesh")
    assert "(none)" in error(capsys, *query, "--explain", tmp_path / "why")
    assert "is not a writable folder" in error(capsys, *query, "--explain", tmp_path / "other.off" / "why.png")
    explained = [*query, "--explain", tmp_path / "why.png"]
    assert "name of an object, such as hand0.off" in error(capsys, *explained, "--meshes", tmp_path)
    assert "not a folder" in error(capsys, *explained, "--meshes", tmp_path / "none")
    assert "--explain" in error(capsys, *query, "--meshes", meshes)
    # One bad mesh costs its own surface alone.
    (tmp_path / "hand0.off").write_text("")
    assert run(list(map(str, [*explained, "--meshes", tmp_path]))) == 0
    assert "drawn without its surface" in capsys.readouterr().err


def test_meshes_are_found_by_the_names_of_objects(tmp_path):
    for name in ("a/x.off", "b/x.off", "b/y.off", "b/z.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    found = find_meshes(tmp_path, ["a/x.off", "x.off", "y", "z.txt", "w.off"])
    assert found == {"a/x.off": tmp_path / "a" / "x.off", "y": tmp_path / "b" / "y.off"}


@pytest.fixture(name="with_bad_files")
def fixture_with_bad_files(meshes, tmp_path):
    """Good meshes among every kind of bad file."""
    for path in meshes.glob("hand*.off"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    good = (meshes / "hand0.off").read_bytes()
    (tmp_path / "empty.off").write_bytes(b"")
    (tmp_path / "garbage.ply").write_bytes(bytes(range(256)) * 4)
    (tmp_path / "huge.stl").write_bytes(b"\0" * 80 + (4_000_000_000).to_bytes(4, "little") + b"\0" * 50)
    (tmp_path / "truncated.off").write_bytes(good[: len(good) // 3])
    return tmp_path


def test_bad_files_cost_themselves_alone(with_bad_files, tmp_path, capsys):
    bad = {"empty.off", "garbage.ply", "huge.stl", "truncated.off"}
    found = result(capsys, "parts", with_bad_files, "--out", tmp_path / "out" / "parts")
    assert [entry["name"] for entry in found["objects"]] == ["hand0.off", "hand1.off"]
    assert {entry["name"] for entry in found["failed"]} == bad
    assert all(entry["reason"] and "\n" not in entry["reason"] for entry in found["failed"])
    missing = with_bad_files / "missing.off"
    arguments = ["matrix", with_bad_files / "hand0.off", missing, "--out", tmp_path / "out" / "D.zarr"]
    assert result(capsys, *arguments, "--strict", status=1)["objects"] == ["hand0.off"]
    assert run(list(map(str, [*arguments, "--quiet"]))) == 0
    _, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert "missing.off" in err


def test_nothing_usable(with_bad_files, tmp_path, capsys):
    bad = [with_bad_files / "empty.off", with_bad_files / "garbage.ply"]
    assert "none of the inputs" in error(capsys, "parts", *bad, "--out", tmp_path / "parts")
    assert "none of the inputs" in error(capsys, "matrix", *bad, "--out", tmp_path / "D.zarr")
    assert not (tmp_path / "D.zarr").exists()


def test_usage_errors(meshes, matrix, parts_dir, tmp_path, capsys):
    (tmp_path / "nothing").mkdir()
    (tmp_path / "short.csv").write_text("file,class\nhand0.off,hand\nother.off,hand\n")
    (tmp_path / "no.csv").write_text("name,kind\n")
    cases = [
        ([], "command"),
        (["frobnicate"], "frobnicate"),
        (["parts"], "MESHES"),
        (["parts", meshes], "--out"),
        (["parts", meshes, "--out", tmp_path / "p", "--frob"], "--frob"),
        (["parts", meshes, "--out", tmp_path / "p", "--levels", "many"], "--levels"),
        (["parts", meshes, "--out", tmp_path / "p", "--radius", "7"], "radius"),
        (["parts", tmp_path / "nothing", "--out", tmp_path / "p"], "no meshes"),
        (["matrix", meshes, "--out", meshes / "labels.csv"], "not a curvematch matrix"),
        (["query", meshes / "hand0.off", "--in", tmp_path / "nothing"], "neither meshes"),
        (["query", meshes / "hand0.off", "--in", parts_dir, "--top", "0"], "--top"),
        (["query", meshes / "hand0.off", "--in", parts_dir, "--preset", "worst"], "worst"),
        (["evaluate", tmp_path / "none.zarr", "--labels", meshes / "labels.csv"], "none.zarr"),
        (["evaluate", meshes, "--labels", meshes / "labels.csv"], "not a curvematch matrix"),
        (["evaluate", matrix, "--labels", tmp_path / "none.csv"], "none.csv"),
        (["evaluate", matrix, "--labels", tmp_path / "no.csv"], "no.csv"),
    ]
    for arguments, word in cases:
        assert word.lower() in error(capsys, *arguments).lower(), arguments
    message = error(capsys, "evaluate", matrix, "--labels", tmp_path / "short.csv")
    assert "hand1.off" in message
    assert "other.off" in message


def test_usage_errors_are_plain_sentences(meshes, parts_dir, capsys):
    query = ["query", meshes / "hand0.off", "--in", parts_dir]
    see = r" \(see curvematch --help\)"
    for arguments, said in (
        (
            ["--top", "0"],
            r"Invalid value for '--top': (should be greater than or equal to 1|0 is not in the range x>=1)",
        ),
        (["--top", "two"], r"Invalid value for '--top': (should be|'two' is not) a valid integer( range)?"),
        (["--preset", "fancy"], r"Invalid value for '--preset': 'fancy' is not one of 'default', .* 'paper'"),
    ):
        assert re.fullmatch(f"curvematch: {said}{see}", error(capsys, *query, *arguments))


def test_version(capsys):
    assert run(["--version"]) == 0
    assert re.fullmatch(r"curvematch \d+\.\d+\.\d+\S*\n", capsys.readouterr().out)


def test_presets_have_the_names_of_the_library():
    assert [preset.value for preset in Preset] == list(presets())


def test_images_where_curves_are_needed(tmp_path, capsys):
    assert run(["outlines", "nope", "--out", str(tmp_path / "c.npz")]) == 2
    assert capsys.readouterr().err.splitlines()[0] == "curvematch: nope: no such file or folder."
    (tmp_path / "images").mkdir()
    assert "images: is a folder: give one file of curves" in error(
        capsys, "mean", tmp_path / "images", "--out", tmp_path / "m"
    )


def test_collection_of_other_settings_is_refused(meshes, parts_dir, tmp_path, capsys):
    snake = meshes / "snake0.off"
    assert "radius" in error(capsys, "parts", snake, "--out", parts_dir, "--radius", "0.3")
    assert run(["parts", str(snake), "--out", str(tmp_path / "other"), "--radius", "0.3", "--quiet"]) == 0
    other = tmp_path / "other" / "snake0.off.npz"
    assert "radius" in error(capsys, "query", other, "--in", parts_dir)
    assert "radius" in error(capsys, "matrix", parts_dir, other, "--out", tmp_path / "D.zarr")
    # A mesh, unlike parts, is cut with the collection's settings.
    found = result(capsys, "query", meshes / "hand0.off", "--in", tmp_path / "other")
    assert found["settings"]["extraction"]["radius"] == 0.3


def test_files_of_one_name_are_told_apart(meshes, tmp_path, capsys):
    for folder, source in (("a", "hand0.off"), ("b", "snake0.off")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "x.off").write_bytes((meshes / source).read_bytes())
    out = tmp_path / "parts"
    found = result(capsys, "parts", tmp_path / "a", tmp_path / "b", "--out", out)
    assert [entry["name"] for entry in found["objects"]] == ["a/x.off", "b/x.off"]
    assert len(load_parts(out / "a" / "x.off.npz").areas) != len(load_parts(out / "b" / "x.off.npz").areas)
    assert [source.name for source in find_sources([out])] == ["a/x.off", "b/x.off"]
    # One after the other they get the same name: the second takes the place of the first.
    alone = tmp_path / "alone"
    for folder in ("a", "b"):
        result(capsys, "parts", tmp_path / folder / "x.off", "--out", alone)
        assert len(load_parts(alone / "x.off.npz").areas) == len(load_parts(out / folder / "x.off.npz").areas)


def test_the_same_mesh_twice(meshes, tmp_path, capsys):
    found = result(capsys, "matrix", meshes / "hand0.off", meshes / "hand0.off", "--out", tmp_path / "D.zarr")
    assert found["objects"] == ["hand0.off", "hand0.off#2"]
    np.testing.assert_allclose(load_matrix(tmp_path / "D.zarr").dissimilarity, 0, atol=1e-2)


def test_names_follow_folders(meshes, tmp_path):
    for name in ("a/x.off", "b/x.off", "b/.hidden/y.off", "b/deep/z.off", "b/labels.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    names = [source.name for source in find_sources([tmp_path / "a", tmp_path / "b"])]
    assert names == ["a/x.off", "deep/z.off", "b/x.off"]
    assert [source.name for source in find_sources([tmp_path])] == ["a/x.off", "b/deep/z.off", "b/x.off"]
    assert [source.name for source in find_sources([tmp_path / "a" / "x.off"])] == ["x.off"]


def test_errors_are_one_line():
    assert one_line(ValueError("a\n  b")) == "a b"
    assert one_line(KeyError("a")) == "KeyError: 'a'"
    assert one_line(MemoryError()) == "MemoryError: MemoryError"


def program(*arguments, **environment):
    command = [sys.executable, "-m", "curvematch_jax.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | environment)


def test_program(matrix, meshes, tmp_path):
    """In a process of its own: status, streams, and the compile cache where the environment says."""
    done = program("evaluate", matrix, "--labels", meshes / "labels.csv", "--json", XDG_CACHE_HOME=str(tmp_path))
    assert done.returncode == 0
    assert json.loads(done.stdout)["nn"] == 1
    assert done.stderr == ""
    failed = program("matrix", tmp_path / "none.off", "--out", tmp_path / "D.zarr")
    assert failed.returncode == 2
    assert len(failed.stderr.splitlines()) == 2
    assert "Traceback" not in failed.stderr


@pytest.mark.slow
def test_demo(tmp_path, monkeypatch):
    monkeypatch.delenv("JAX_COMPILATION_CACHE_DIR", raising=False)
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > "{tmp_path}/opened"\n')
    browser.chmod(0o755)
    settings = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "BROWSER": f"{browser} %s"}
    done = program("demo", "--out", tmp_path / "demo", "--json", "--open", **settings)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["sources_first"]
    assert found["query_settings"]["matching"]["fusion"] == "belief"
    assert set(found["class_order"][:2]) == {"horse", "human"}
    assert sum(row["probability"] for row in found["results"]) <= 1
    assert found["measures"]["nn"] >= 0.95
    for name in ("D.zarr", "labels.csv", "matrix.png", "ranked.png", "parts", "report.html"):
        assert (tmp_path / "demo" / name).exists()
    assert (tmp_path / "opened").read_text() == (tmp_path / "demo" / "report.html").resolve().as_uri()
    assert any((tmp_path / "cache" / "curvematch_jax").iterdir())


def test_index_answers_as_the_folder_does(meshes, parts_dir, tmp_path, capsys):
    index = tmp_path / "I.index"
    assert result(capsys, "index", parts_dir, "--out", index)["added"] == 4
    assert result(capsys, "index", parts_dir, "--out", index)["added"] == 0
    queries = [meshes / "snake1.off", parts_dir / "hand0.off.npz"]
    both = result(capsys, "query", *queries, "--in", index, "--exclude-self", "--top", 2)
    assert [each["query"] for each in both["queries"]] == ["snake1.off", "hand0.off"]
    assert [each["results"][0]["name"] for each in both["queries"]] == ["snake0.off", "hand1.off"]
    one = result(capsys, "query", queries[0], "--in", parts_dir, "--exclude-self", "--top", 2)
    assert one["results"] == both["queries"][0]["results"]
    again = result(capsys, "query", queries[0], "--in", index, "--rerank")
    assert again["reranked"]
    assert {row["name"] for row in again["results"][:2]} == {"snake0.off", "snake1.off"}
    said = "made with the preset default, and is asked for with the preset articulated: use"
    assert said in error(capsys, "query", queries[0], "--in", index, "--preset", "articulated")
    assert "no surfaces to draw" in error(capsys, "query", queries[0], "--in", index, "--explain", tmp_path / "a.png")
    assert "several meshes" in error(capsys, "query", *queries, "--in", index, "--explain", tmp_path / "a.png")
    assert "symmetric" in error(capsys, "query", queries[0], "--in", parts_dir, "--preset", "partial", "--rerank")
