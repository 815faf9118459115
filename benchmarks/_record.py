"""Results as JSON: what is said in each file of where they are from, and how the file is written."""

import argparse
import importlib.metadata
import json
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ._measure import cores, say

_PACKAGES = (
    "curvematch_jax",
    "jax",
    "jaxlib",
    "numpy",
    "scipy",
    "trimesh",
    "potpourri3d",
    "pymeshfix",
    "manifold3d",
    "fast-simplification",
    "zarr",
    "matplotlib",
    "fdasrsf",
    "geomstats",
    "lapy",
)


def record(arguments: argparse.Namespace, results: Mapping[str, Any]) -> None:
    """Write results and where they are from to `--out`, or print them when there is none."""
    facts = rounded({**provenance(arguments), **results})
    if arguments.out is None:
        print(json.dumps(facts, indent=1, allow_nan=False))
    else:
        write(arguments.out, facts)
        say(str(arguments.out))


def known(arguments: argparse.Namespace) -> dict[str, Any]:
    """What the file of `--out` holds already, for results that are added to; nothing if there is no file."""
    if arguments.out is not None and arguments.out.exists():
        return json.loads(arguments.out.read_text())
    return {}


def provenance(arguments: argparse.Namespace) -> dict[str, Any]:
    """The benchmark and its arguments, with names of files and folders in place of paths; and the surroundings."""
    given = {name: _plain(value) for name, value in vars(arguments).items() if name not in ("benchmark", "out")}
    return {"benchmark": arguments.benchmark, "arguments": given, **surroundings()}


def surroundings() -> dict[str, Any]:
    """What results may depend on besides: versions of packages, the commit, the machine."""
    machine = {"processor": platform.processor() or platform.machine(), "cores": cores()}
    return {"versions": versions(), "commit": commit(), "machine": machine}


def versions() -> dict[str, str]:
    """Of Python, and of those packages on which results depend that are installed."""
    installed = {distribution.name for distribution in importlib.metadata.distributions()}
    found = {name: importlib.metadata.version(name) for name in _PACKAGES if name in installed}
    return {"python": platform.python_version(), **found}


def commit() -> str | None:
    """The commit of this checkout, with `-dirty` where files differ from it; None where there is no repository."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def rounded(results: Any) -> Any:
    """Five digits are more than there is in a time, or in a mean over some hundred queries."""
    if isinstance(results, Mapping):
        return {key: rounded(value) for key, value in results.items()}
    if isinstance(results, list | tuple):
        return [rounded(value) for value in results]
    return float(f"{results:.5g}") if isinstance(results, float) else results


def write(path: Path, results: Mapping[str, Any]) -> None:
    """Write results as JSON; folders are made as needed, and what was there is kept until all is written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.new")
    temporary.write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    temporary.replace(path)


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return value.resolve().name
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value
