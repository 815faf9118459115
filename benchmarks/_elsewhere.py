"""Measurements in processes of their own, of this package or of the package as it was at another commit."""

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_PACKAGE = "curvematch_jax"
_ROOT = Path(__file__).parents[1]


@contextmanager
def checkout(commit: str) -> Iterator[Path]:
    """A temporary folder with the package of a commit, for `PYTHONPATH`."""
    command = ["git", "archive", commit, _PACKAGE]
    done = subprocess.run(command, cwd=_ROOT, capture_output=True, check=False)
    if done.returncode:
        raise RuntimeError(f"no package of {commit}: {done.stderr.decode().strip()}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
            archive.extractall(folder, filter="data")
        found = _run(["-P", "-c", f"import {_PACKAGE}; print({_PACKAGE}.__file__)"], folder, {})
        if not Path(found.strip()).is_relative_to(folder.resolve()):
            raise RuntimeError(f"{commit} is hidden by the package in {found.strip()}")
        yield folder


def output_of(module: str, arguments: Sequence[str], package: Path | None = None, **settings: str) -> Any:
    """What a module prints as JSON, run in a new process.

    Args:
        module: by its full name.
        package: a folder whose `curvematch_jax` is measured in place of this one's.
        settings: variables of the environment.
    """
    return json.loads(_run(["-P", "-m", module, *arguments], package, settings))


def _run(arguments: Sequence[str], package: Path | None, settings: dict[str, str]) -> str:
    paths = [str(package.resolve()) if package else "", os.environ.get("PYTHONPATH", ""), str(_ROOT)]
    environment = os.environ | settings | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    done = subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(arguments)} failed:\n{done.stderr}")
    return done.stdout
