"""`curvematch report` as other programs call it."""

import json

import numpy as np
import pytest

from curvematch_jax.cli._app import run
from curvematch_jax.datasets import creature
from curvematch_jax.retrieval import Matching, SavedMatrix, run_settings, save_matrix, save_parts
from curvematch_jax.surface import Extraction, extract_parts

EXTRACTION = Extraction(samples=16, levels=6)


@pytest.fixture(name="folder", scope="module")
def fixture_folder(tmp_path_factory):
    """A matrix of two objects with their parts, meshes, of which one is broken, and classes."""
    folder = tmp_path_factory.mktemp("collection")
    (folder / "meshes").mkdir()
    names = ("snake0.obj", "snake1.obj")
    for pose, name in enumerate(names):
        mesh = creature("snake", pose, vertices=300).mesh
        save_parts(extract_parts(mesh, EXTRACTION), folder / "parts" / f"{name}.npz")
        lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
        (folder / "meshes" / name).write_text("\n".join(lines) if pose == 0 else "f 1 2 3")
    (folder / "labels.csv").write_text("file,class\nsnake0.obj,snake\nsnake1.obj,snake\n")
    values = np.array([[0.0, 0.25], [0.25, 0.0]])
    save_matrix(SavedMatrix(values, names, run_settings(EXTRACTION, Matching())), folder / "D.zarr")
    partial = Matching(scale=0.3)
    save_matrix(SavedMatrix(values, names, run_settings(EXTRACTION, partial)), folder / "other.zarr")
    return folder


def error(capsys, *arguments):
    capsys.readouterr()
    assert run([*map(str, arguments)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_a_broken_mesh_costs_its_surface_alone(folder, tmp_path, capsys):
    out = tmp_path / "new" / "report.html"
    given = ["--parts", folder / "parts", "--meshes", folder / "meshes", "--labels", folder / "labels.csv"]
    assert run([*map(str, ["report", folder / "D.zarr", *given, "--out", out, "--json"])]) == 0
    said = capsys.readouterr()
    found = json.loads(said.out)
    assert found["objects"] == 2
    assert found["bytes"] == out.stat().st_size
    assert [failure["name"] for failure in found["failed"]] == ["snake1.obj"]
    assert "snake1.obj" in said.err
    page = out.read_text(encoding="utf-8")
    assert "2 of 2 objects are drawn" in page
    assert "1 of those drawn have no mesh here" in page
    assert list(out.parent.iterdir()) == [out]


def test_the_matrix_alone_is_enough(folder, tmp_path, capsys):
    out = tmp_path / "report.html"
    assert run([*map(str, ["report", folder / "other.zarr", "--out", out])]) == 0
    assert f"report in {out}" in capsys.readouterr().out
    assert "No parts were given" in out.read_text(encoding="utf-8")


def test_errors_are_one_sentence(folder, tmp_path, capsys):
    out, matrix = tmp_path / "report.html", folder / "D.zarr"
    assert "no such matrix" in error(capsys, "report", tmp_path / "none.zarr", "--out", out)
    assert "settings of no preset" in error(
        capsys, "report", folder / "other.zarr", "--parts", folder / "parts", "--out", out
    )
    assert "no parts of 2 of 2" in error(capsys, "report", matrix, "--parts", folder / "meshes", "--out", out)
    assert "not a folder" in error(capsys, "report", matrix, "--meshes", folder / "labels.csv", "--out", out)
    assert "cannot read the label file" in error(capsys, "report", matrix, "--labels", folder / "none", "--out", out)
    assert "a folder, and a report is one file" in error(capsys, "report", matrix, "--out", folder)
    assert not out.exists()
