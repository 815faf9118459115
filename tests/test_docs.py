"""The documentation is true: its Python runs, its commands run, its links lead somewhere."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.main import get_command

from curvematch_jax.cli._app import app

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
COMPILED = {"engine.md", "statistics.md"}  # pages whose snippets compile for minutes


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def run(command, folder):
    """As a user would, in a process of its own; warnings are errors there too."""
    settings = {"PYTHONWARNINGS": "error", "MPLBACKEND": "agg", "XDG_CACHE_HOME": str(folder / "cache")}
    environment = {**os.environ, **settings}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.name, marks=[pytest.mark.slow] if page.name in COMPILED else [])
        for page in PAGES
        if blocks(page, "python")
    ],
)
def test_snippets_run_one_after_the_other(page, tmp_path):
    pytest.importorskip("manifold3d")
    script = tmp_path / "snippets.py"
    script.write_text("\n".join(blocks(page, "python")), encoding="utf-8")
    run([sys.executable, str(script)], tmp_path)


def readme_commands():
    text = "".join(blocks(ROOT / "README.md", "console"))
    return [shlex.split(line[2:], comments=True) for line in text.splitlines() if line.startswith("$ ")]


def test_readme_commands_have_these_arguments():
    """As the command line reads them, which refuses what it does not know."""
    known = get_command(app).commands
    for program, name, *arguments in readme_commands():
        assert program == "curvematch"
        known[name].make_context(name, arguments)


@pytest.mark.slow
def test_readme_commands_run(tmp_path):
    pytest.importorskip("manifold3d")
    _write_meshes(tmp_path / "meshes")
    _write_masks(tmp_path / "masks")
    commands = readme_commands()
    assert [name for _, name, *_ in commands] == ["parts", "matrix", "evaluate", "query", "outlines", "mean"]
    main = "import sys; from curvematch_jax.cli import main; sys.exit(main())"
    outputs = [run([sys.executable, "-c", main, *rest], tmp_path) for _, *rest in commands]
    assert "horse1" in outputs[3]
    assert "the mean of 6 curves" in outputs[5]


def _write_meshes(folder):
    from curvematch_jax.datasets import creatures

    folder.mkdir()
    rows = ["file,class"]
    for made in creatures(["horse", "snake"], poses=2):
        file = folder / f"{made.mesh.name}.obj"
        vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in made.mesh.vertices)
        faces = "".join(f"f {a} {b} {c}\n" for a, b, c in made.mesh.faces + 1)
        file.write_text(vertices + faces)
        rows.append(f"{file.name},{made.label}")
    (folder / "labels.csv").write_text("\n".join(rows) + "\n")


def _write_masks(folder):
    """Disks and ellipses, three of each."""
    folder.mkdir()
    y, x = np.mgrid[-40:41, -40:41]
    rows = ["file,class"]
    for k in range(6):
        mask = (x / (1 + k // 3)) ** 2 + (y + k % 3 * x / 20) ** 2 < 300
        Image.fromarray(np.uint8(255 * mask)).save(folder / f"mask{k}.png")
        rows.append(f"mask{k}.png,{'disk' if k < 3 else 'ellipse'}")
    (folder / "labels.csv").write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    targets = [target.split("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text)]
    local = [target for target in targets if target and "://" not in target]
    assert [target for target in local if not (page.parent / target).exists()] == []


def test_architecture_shows_every_module_and_no_other():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    package = text.partition("\nbenchmarks/")[0]
    shown = re.findall(r"^ +(_?[a-z]\w*\.py) ", package, re.MULTILINE)
    modules = [p.name for p in (ROOT / "curvematch_jax").rglob("*.py") if not p.name.startswith("__")]
    assert sorted(shown) == sorted(modules)


def test_method_names_modules_that_exist():
    named = set(re.findall(r"`(_\w+\.py)`", (ROOT / "docs" / "method.md").read_text(encoding="utf-8")))
    assert len(named) > 10
    assert named <= {p.name for p in (ROOT / "curvematch_jax").rglob("*.py")}


def test_licence_note_says_what_is_optional():
    assert re.search(r"pymeshfix.*GPL", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    core = (ROOT / "pyproject.toml").read_text(encoding="utf-8").partition("dependencies = [")[2].partition("]")[0]
    assert "pymeshfix" not in core
