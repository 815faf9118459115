"""What is published: wheel and sdist hold the package, install, and work outside of the checkout."""

import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SMOKE = """
import numpy as np, curvematch_jax as cm
t = 2 * np.pi * np.arange(40) / 40
circle, ellipse = np.stack([np.cos(t), np.sin(t)]), np.stack([2 * np.cos(t), np.sin(t)])
distances = cm.distance_matrix(np.stack([circle, ellipse]), aligner=cm.Aligner.rigid())
assert 0.1 < distances[0, 1] < 1, distances
assert len(cm.extract_parts(cm.creature("snake").mesh).points) >= 2
print(cm.__file__)
"""


def run(command, folder, **environment):
    settings = {**os.environ, **environment}
    done = subprocess.run(command, cwd=folder, env=settings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def test_citation_has_the_version_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [project["version"]]
    assert re.findall(r"^license: (.+)$", citation, re.MULTILINE) == [project["license"]]
    assert f"name: {project['authors'][0]['name']}" in citation


@pytest.fixture(name="built", scope="module")
def fixture_built(tmp_path_factory):
    """The sdist of the checkout, and the wheel that is built from the sdist, as `build` does by default."""
    pytest.importorskip("build")
    folder = tmp_path_factory.mktemp("dist")
    run([sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)], folder)
    return folder


@pytest.mark.slow
def test_contents(built):
    (wheel,), (sdist,) = built.glob("*.whl"), built.glob("*.tar.gz")
    package = (ROOT / "curvematch_jax").rglob("*")
    files = {str(path.relative_to(ROOT)) for path in package if path.is_file() and path.suffix != ".pyc"}
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name for name in names if ".dist-info/" not in name} == files
    with tarfile.open(sdist) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    assert files | {"README.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "docs/conf.py"} <= held


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["*.whl", "*.tar.gz"])
def test_installs_and_works_outside_of_the_checkout(built, kind, tmp_path):
    """The dependencies are those of the tests' own environment."""
    pytest.importorskip("manifold3d")
    (archive,) = built.glob(kind)
    where = tmp_path / "installed"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(where), str(archive)]
    run(install, tmp_path)
    path = {"PYTHONPATH": str(where), "PYTHONWARNINGS": "error", "MPLBACKEND": "agg"}
    assert run([sys.executable, "-c", SMOKE], tmp_path, **path).strip().startswith(str(where))
    assert "demo" in run([str(where / "bin" / "curvematch"), "--help"], tmp_path, **path)
