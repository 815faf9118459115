"""Every benchmark runs on small input, from the command line to the file with its results."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import benchmarks
from benchmarks import NAMES
from benchmarks.__main__ import first_line, main
from benchmarks._record import rounded, write
from curvematch_jax.datasets import creature
from curvematch_jax.surface import Mesh, extract_parts

DOCS = Path(__file__).parents[2] / "docs"


def saved(mesh: Mesh, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.faces)} 0"]
    lines += [" ".join(map(repr, row)) for row in mesh.vertices.tolist()]
    path.write_text("\n".join(lines + [f"3 {a} {b} {c}" for a, b, c in mesh.faces.tolist()]) + "\n")


def meshes(folder: Path, poses: int = 2) -> str:
    """Two classes, a folder each."""
    for kind in ("human", "horse"):
        for pose in range(poses):
            saved(creature(kind, pose, vertices=1500).mesh, folder / "meshes" / kind / f"{pose}.off")
    return str(folder / "meshes")


def eight_meshes(folder: Path) -> str:
    """So many that the halves of a class have two members."""
    return meshes(folder, 4)


def landmarked(folder: Path) -> str:
    """A mesh whose landmarks are its feature points, of which the first two are exchanged by a symmetry."""
    mesh = creature("human", 0, vertices=1500).mesh
    saved(mesh, folder / "marked" / "1.off")
    (folder / "marked" / "labels.csv").write_text("file,class\n1.off,human\n")
    points = extract_parts(mesh).points
    (folder / "marked" / "landmarks").mkdir()
    (folder / "marked" / "landmarks" / "1.vts").write_text("".join(f"0 {x} {y} {z}\n" for x, y, z in points.tolist()))
    (folder / "marked" / "landmarks" / "1.sym.info").write_text(
        "0 1\n" + "".join(f"{k}\n" for k in range(2, len(points)))
    )
    return str(folder / "marked")


def ellipses(random: np.random.Generator, count: int) -> np.ndarray:
    angle = 2 * np.pi * np.arange(40) / 40
    axes = random.uniform(1, 3, (count, 2, 1))
    return (axes * np.stack([np.cos(angle), np.sin(angle)])).astype(np.float32)


def outlines(folder: Path) -> str:
    np.savez(folder / "mpeg7_half.npz", curves=ellipses(np.random.default_rng(0), 6), labels=np.repeat(["a", "b"], 3))
    return str(folder)


def specimens(folder: Path) -> str:
    """Two treatments of cells and two genera of wings, which differ in how long they are."""
    random, named = np.random.default_rng(0), np.repeat(["a", "b"], 8)
    for name, labels in (("cells", {"cell_line": np.full(16, "one"), "treatment": named}), ("wings", {"genus": named})):
        curves = ellipses(random, 16) * np.where(named == "a", 1, 2)[:, None, None] ** [[1], [0]]
        points = curves.astype(np.float32).transpose(0, 2, 1).reshape(-1, 2)
        np.savez(folder / f"{name}.npz", points=points, counts=np.full(16, curves.shape[2]), **labels)
    return str(folder)


def yardstick(folder: Path) -> str:
    curves, pairs = ellipses(np.random.default_rng(0), 3), np.array([[0, 1], [1, 2]])
    np.savez(folder / "yardstick.npz", level=curves, level_pairs=pairs, level_best=np.zeros(2))
    return str(folder / "yardstick.npz")


class Small(NamedTuple):
    """What a benchmark is given, and what its results must have."""

    given: Callable[[Path], str] | None
    options: str
    results: str
    slow: bool = True


SMALL: dict[str, Small] = {
    "engine": Small(None, "--quick", "speeds"),
    "tradeoff": Small(yardstick, "--settings fast --repeat 1", "settings"),
    "peers": Small(None, "--pairs 1 --batch 2 --samples 40", "curves"),
    "outlines": Small(outlines, "--presets rigid --samples 32", "presets", slow=False),
    "specimens": Small(specimens, "--samples 32", "groups"),
    "statistics": Small(None, "--curves 3 --many 4 --samples 32", "planar"),
    "retrieval": Small(meshes, "--jobs 1", "collections"),
    "ablation": Small(eight_meshes, "--jobs 1 --rows default", "collections"),
    "baselines": Small(meshes, "--jobs 1", "collections"),
    "composites": Small(meshes, "--jobs 1 --count 2", "methods"),
    "figures": Small(meshes, "--jobs 1 --per-class 1", "matrix"),
    "features": Small(landmarked, "", "classes", slow=False),
    "symmetry": Small(landmarked, "", "collections", slow=False),
    "shortcut": Small(None, "--poses 2 --classes human horse --widths 0.03 --fields geodesic", "fields"),
    "remeshing": Small(None, "--classes human hand", "creatures"),
    "scaling": Small(None, "--models 13 --indexed 13 --counts 50", "matrix"),
}


def test_every_benchmark_is_tried_and_has_a_line_of_its_own(capsys):
    assert set(SMALL) == set(NAMES)
    with pytest.raises(SystemExit):
        main(["--help"])
    told = capsys.readouterr().out
    assert all(f"{name} " in told and first_line(name) in told for name in NAMES)


def test_benchmarks_import_nothing_of_the_command_line():
    modules = list(Path(benchmarks.__file__).parent.rglob("*.py"))
    assert len(modules) > len(NAMES)
    assert [module.name for module in modules if "curvematch_jax.cli" in module.read_text(encoding="utf-8")] == []


@pytest.mark.parametrize("page", ["README.md", "CHANGELOG.md", *(f"docs/{path.name}" for path in DOCS.glob("*.md"))])
def test_documented_benchmarks_exist(page):
    text = (DOCS.parent / page).read_text(encoding="utf-8")
    assert set(re.findall(r"python -m benchmarks ([a-z]\w*)", text)) <= set(NAMES)
    assert not re.findall(r"python (?:benchmarks/|-m benchmarks\.)", text)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if small.slow else []) for name, small in SMALL.items()]
)
def test_a_benchmark_records_its_results_and_where_they_are_from(name, tmp_path):
    for needed in ("manifold3d", "matplotlib", "contourpy"):
        pytest.importorskip(needed)
    small, out = SMALL[name], tmp_path / "out" / "results.json"
    out = out.parent if name == "figures" else out
    given = [small.given(tmp_path)] if small.given else []
    assert main([name, *given, *small.options.split(), "--out", str(out)]) == 0
    found = json.loads((out / "matrix.json" if name == "figures" else out).read_text())
    assert found["benchmark"] == name
    assert {"arguments", "versions", "commit", "machine"} <= found.keys()
    assert str(tmp_path) not in json.dumps(found)
    assert found[small.results]


def test_without_a_file_results_are_printed(tmp_path, capsys):
    assert main(["outlines", outlines(tmp_path), "--presets", "rigid", "--samples", "32"]) == 0
    row = json.loads(capsys.readouterr().out)["presets"]["rigid"]["plain"]
    assert row["pairs_per_second"] * row["seconds"] == pytest.approx(15, rel=1e-3)


def test_what_cannot_be_measured_is_said_in_one_line(tmp_path, capsys):
    (tmp_path / "labels.csv").write_text("file,class\n1.off,snake\n")
    (tmp_path / "1.off").write_text("OFF\n")
    assert main(["features", str(tmp_path)]) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"python -m benchmarks features: {tmp_path} has no model with landmarks of a class with limbs"
    ]


def test_one_folder_cannot_be_compared_with_itself(capsys):
    assert main(["remeshing", "--raw", "meshes"]) == 2
    assert "give both or none" in capsys.readouterr().err


def test_results_are_rounded_and_appear_whole(tmp_path):
    assert rounded({"a": [1.23456789e-7, 3], "b": None}) == {"a": [1.2346e-7, 3], "b": None}
    write(tmp_path / "new" / "a.json", {"a": 1})
    with pytest.raises(ValueError, match="not JSON compliant"):
        write(tmp_path / "new" / "a.json", {"a": float("nan")})
    assert json.loads((tmp_path / "new" / "a.json").read_text()) == {"a": 1}
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.json"]
