"""What every benchmark's JSON says of where it was measured, and how it is written."""

import importlib.metadata
import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_PACKAGES = (
    "curvematch_jax",
    "jax",
    "jaxlib",
    "numpy",
    "scipy",
    "trimesh",
    "potpourri3d",
    "gpytoolbox",
    "manifold3d",
    "zarr",
)


def versions(*more: str) -> dict[str, str]:
    """Of Python, of what figures depend on, and of `more` packages: of those that are installed."""
    installed = {distribution.name for distribution in importlib.metadata.distributions()}
    found = {name: importlib.metadata.version(name) for name in (*_PACKAGES, *more) if name in installed}
    return {"python": platform.python_version(), **found}


def machine() -> dict[str, Any]:
    """Processor, and cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return {"processor": platform.processor() or platform.machine(), "cores": cores}


def write(path: Path, results: Mapping[str, Any]) -> None:
    """Write results as JSON; folders are made as needed, and what was there is kept until all is written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.new")
    temporary.write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    temporary.replace(path)
