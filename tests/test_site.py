"""The site: every public name is in the reference, once, and the site builds without a warning."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
ROOMS = ["elastic", "surface", "extraction", "retrieval", "statistics", "outlines", "datasets", "pictures", "report"]


def documented():
    """The dotted names under which the reference describes something, in its order."""
    names = []
    for page in sorted((DOCS / "reference").glob("*.md")):
        module = None
        for directive, argument in re.findall(r"^\.\. (\w+):: (\S+)$", page.read_text(encoding="utf-8"), re.MULTILINE):
            if directive == "currentmodule":
                module = argument
            elif directive.startswith("auto"):
                names.append(f"{module}.{argument}")
    return names


def value(dotted):
    module, _, name = dotted.rpartition(".")
    return getattr(importlib.import_module(module), name)


def test_reference_has_every_public_name_once():
    pytest.importorskip("sklearn")
    names = documented()
    assert len(names) == len(set(names))
    described = {id(value(name)): name for name in names}
    assert len(described) == len(names), "one thing is described under two names"
    for room in ["", *ROOMS]:
        path = f"curvematch_jax.{room}".rstrip(".")
        public = importlib.import_module(path).__all__
        missing = [name for name in public if id(value(f"{path}.{name}")) not in described]
        assert missing == [], f"not in docs/reference: {path}"


def test_reference_names_only_what_is_public():
    for dotted in documented():
        module, _, name = dotted.rpartition(".")
        assert name in importlib.import_module(module).__all__


def test_every_page_and_example_is_reached():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    pages = {page.stem for page in DOCS.glob("*.md")} - {"index"}
    assert pages <= set(re.findall(r"^\w+$", index, re.MULTILINE))
    examples = list((DOCS / "gallery").glob("*.py"))
    assert len(examples) >= 10
    assert all(example.name.startswith("plot_") for example in examples), "sphinx-gallery executes plot_*.py only"


@pytest.mark.slow
def test_site_builds_without_a_warning_and_executes_every_example(tmp_path):
    pytest.importorskip("sphinx_gallery")
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-d", tmp_path / "doctrees", DOCS, tmp_path / "site"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    for example in (DOCS / "gallery").glob("*.py"):
        page = tmp_path / "site" / "examples" / f"{example.stem}.html"
        assert "sphx_glr_" + example.stem in page.read_text(encoding="utf-8"), "no picture"
