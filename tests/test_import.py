"""Importing the package is light: it loads no mesh library, no plotting, and touches no JAX setting."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = [
    "fast_simplification",
    "gpytoolbox",
    "manifold3d",
    "matplotlib",
    "optimistix",
    "pandas",
    "PIL",
    "potpourri3d",
    "pymeshfix",
    "skimage",
    "sklearn",
    "tqdm",
    "trimesh",
    "typer",
    "zarr",
]

PROBE = """
import json, sys
import jax

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"trimesh", "potpourri3d"}:
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Block())
before = dict(jax.config.values)
loaded = set(sys.modules)
import curvematch_jax
print(json.dumps({
    "flags": sorted(k for k, v in jax.config.values.items() if before.get(k, v) != v),
    "modules": sorted({m.partition(".")[0] for m in set(sys.modules) - loaded}),
    "missing": [name for name in curvematch_jax.__all__ if not hasattr(curvematch_jax, name)],
}))
"""


def _probe() -> dict[str, list[str]]:
    done = subprocess.run([sys.executable, "-W", "error", "-c", PROBE], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_import_without_mesh_libraries_is_light_and_sets_no_flag():
    seen = _probe()
    assert seen["flags"] == []
    assert not set(seen["modules"]) & set(HEAVY)
    assert seen["missing"] == []
    assert "curvematch_jax" in seen["modules"]


PACKAGE = Path(__file__).parents[1] / "curvematch_jax"

# What each part of the package never imports (docs/architecture.md), wherever in its files.
ROOMS = {
    "elastic",
    "surface",
    "retrieval",
    "extraction",
    "statistics",
    "outlines",
    "datasets",
    "cli",
    "pictures",
    "report",
}
MESHES = {"trimesh", "potpourri3d"}
NEVER = {
    "elastic": ROOMS - {"elastic"} | MESHES,
    "surface": ROOMS - {"surface"} | {"jax", "optimistix"},
    "statistics": ROOMS - {"statistics", "elastic"} | MESHES,
    "outlines": ROOMS - {"outlines", "elastic"} | MESHES,
    "datasets": ROOMS - {"datasets", "surface"} | {"jax"},
    "retrieval": ROOMS - {"retrieval", "elastic", "surface"},
    "extraction": {"elastic", "statistics", "outlines", "pictures", "report", "cli", "jax"},
    "report": ROOMS - {"report", "surface", "retrieval", "pictures"} | MESHES | {"jax"},
}


def _imported(module: Path) -> set[str]:
    """Names of the package's parts and of the other packages that a module imports."""
    names = set()
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            dotted = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            dotted = [node.module or "", *(f"{node.module or ''}.{alias.name}" for alias in node.names)]
            dotted = [name.removeprefix(".") for name in dotted] if node.level > 1 or not node.level else []
        else:
            continue
        names |= {name.removeprefix("curvematch_jax.").partition(".")[0] for name in dotted}
    return names


@pytest.mark.parametrize("part", NEVER)
def test_packages_import_only_what_the_architecture_allows(part):
    modules = list((PACKAGE / part).rglob("*.py"))
    assert modules
    broken = {module.name: sorted(_imported(module) & NEVER[part]) for module in modules}
    assert {name: found for name, found in broken.items() if found} == {}
