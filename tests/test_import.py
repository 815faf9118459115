"""Importing the package is light: it loads no mesh library, no plotting, and touches no JAX setting."""

import json
import subprocess
import sys

HEAVY = [
    "fast_simplification",
    "gpytoolbox",
    "manifold3d",
    "matplotlib",
    "optimistix",
    "potpourri3d",
    "pymeshfix",
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
