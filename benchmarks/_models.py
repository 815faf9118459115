"""Labelled models: where their meshes come from, and work on all of them in worker processes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from curvematch_jax.datasets import CREATURES, creature, labelled_folder
from curvematch_jax.extraction import Failure, extract_collection
from curvematch_jax.extraction._sources import distinct_names
from curvematch_jax.extraction._workers import Outcome, in_processes
from curvematch_jax.surface import Extraction, Mesh, Parts, load_mesh

from ._measure import cores

POSES = 5


@dataclass(frozen=True)
class Model:
    """Where a mesh comes from, without the mesh: `load(*source)` in the process that needs it."""

    name: str
    label: str
    load: Callable[..., Mesh]
    source: tuple

    def mesh(self) -> Mesh:
        """Load it."""
        return self.load(*self.source)


def models_in(folder: Path | None) -> list[Model]:
    """The models of a labelled folder, or without one the creatures that `curvematch demo` uses."""
    if folder is None:
        return [Model(f"{kind}{pose}", kind, _creature, (kind, pose)) for kind in CREATURES for pose in range(POSES)]
    paths, labels = zip(*labelled_folder(folder), strict=True)
    names = distinct_names(paths)
    return [Model(name, label, load_mesh, (path, name)) for path, name, label in zip(paths, names, labels, strict=True)]


def extracted(folder: Path, extraction: Extraction, jobs: int) -> tuple[list[Parts], list[str], tuple[Failure, ...]]:
    """The parts of a labelled folder, their classes, and the models that gave none."""
    paths, labels = zip(*labelled_folder(folder), strict=True)
    made = extract_collection(paths, extraction, jobs=jobs, progress=sys.stderr.isatty())
    classes = dict(zip(distinct_names(paths), labels, strict=True))
    return list(made.parts), [classes[parts.name] for parts in made.parts], made.failures


def _creature(kind: str, pose: int) -> Mesh:
    return creature(kind, pose).mesh


def name_of(folder: Path | None) -> str:
    """What a collection is called in results."""
    return folder.resolve().name if folder else "creatures"


def in_order(function: Callable[[Any], Any], tasks: Sequence[Any], jobs: int, what: str) -> list[Outcome]:
    """The outcome of each task, from worker processes; a task that fails costs itself alone.

    Args:
        function: importable by name.
        what: said beside the bar.
    """
    found = tqdm(in_processes(function, tasks, jobs), total=len(tasks), desc=what, unit="models", disable=None)
    return sorted(found, key=lambda outcome: outcome.task)


def jobs_option(parser: argparse.ArgumentParser) -> None:
    """How many worker processes."""
    parser.add_argument("--jobs", type=int, default=cores(), metavar="N", help="worker processes; default: the cores")
