"""What the figures share: the collection, what is computed from it once, and the files that are written.

A figure is a module with `FIGURE`; `command(FIGURE)` makes it a script, and `all.py` runs every one of them.
"""

from __future__ import annotations

import argparse
import functools as ft
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks._record import versions, write
from benchmarks.baselines._run import Model, generated, models_in
from curvematch_jax._progress import reporter
from curvematch_jax.cli._jax import configure_jax
from curvematch_jax.extraction._workers import cores, in_processes
from curvematch_jax.retrieval import Matching, dissimilarity_matrix, run_settings
from curvematch_jax.surface import Extraction, Mesh, Parts, clean, extract_parts

MATCHINGS: Mapping[str, Callable[[], Matching]] = {"default": Matching, "paper": Matching.paper}

Numbers = dict[str, Any]


class Described(NamedTuple):
    """A model as the figures need it."""

    name: str
    label: str
    mesh: Mesh  # cleaned
    parts: Parts


@dataclass(eq=False)
class Collection:
    """Labelled models; what is costly is computed when it is first asked for, and kept for the next figure."""

    name: str
    models: Sequence[Model]
    jobs: int = 1
    failed: dict[str, str] = field(default_factory=dict)
    """Models that are left out, and why."""
    _matrices: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, folder: Path | None, jobs: int = 1) -> Collection:
        """The models of a labelled folder, or the built-in creatures."""
        if folder is None:
            return cls("creatures", generated(), jobs)
        return cls(folder.resolve().name, models_in(folder), jobs)

    def each(self, function: Callable[[Any], Any], tasks: Sequence[Any], what: str) -> list[Any]:
        """The function's results in the order of the tasks, from worker processes; None where it failed.

        Args:
            function: importable by name; a task is a model, or begins with one.
        """
        report, results = reporter(sys.stderr.isatty(), what, "models"), [None] * len(tasks)
        for done, outcome in enumerate(in_processes(function, tasks, self.jobs), start=1):
            results[outcome.task] = outcome.result
            if outcome.failure is not None:
                task = tasks[outcome.task]
                name = (task if isinstance(task, Model) else task[0]).name
                self.failed[name] = outcome.failure
                say(f"{name}: {outcome.failure}")
            report(done, len(tasks))
        return results

    @ft.cached_property
    def described(self) -> list[Described]:
        """The models that could be cut into parts."""
        return [found for found in self.each(described, self.models, "parts") if found is not None]

    @property
    def parts(self) -> list[Parts]:
        return [model.parts for model in self.described]

    @property
    def labels(self) -> list[str]:
        return [model.label for model in self.described]

    def matrix(self, method: str = "default") -> np.ndarray:
        """Dissimilarities of all pairs."""
        if method not in self._matrices:
            self._matrices[method] = dissimilarity_matrix(self.parts, MATCHINGS[method](), sys.stderr.isatty())
        return self._matrices[method]

    def members(self, label: str | None = None) -> list[int]:
        """The models of a class; without one, of the class that has the most, the first such in the alphabet."""
        if label is None:
            label = max(sorted(set(self.labels)), key=self.labels.count)
        found = [k for k, own in enumerate(self.labels) if own == label]
        if not found:
            raise ValueError(f"there is no class {label}; there are {', '.join(sorted(set(self.labels)))}")
        return found

    def first_of_each_class(self, count: int | None = None) -> list[int]:
        """The first few members of every class, all by default, in the order of the collection."""
        seen: defaultdict[str, int] = defaultdict(int)
        chosen = []
        for k, label in enumerate(self.labels):
            seen[label] += 1
            chosen += [k] if count is None or seen[label] <= count else []
        return chosen

    def named(self, names: Sequence[str]) -> list[int]:
        """The models of these names.

        Raises:
            ValueError: there is no such model.
        """
        places = {model.name: k for k, model in enumerate(self.described)}
        for name in names:
            if name not in places:
                raise ValueError(f"{self.name} has no model {name}; it has {', '.join(list(places)[:5])}, ...")
        return [places[name] for name in names]

    def model(self, k: int) -> Model:
        """Where a described model comes from."""
        return next(m for m in self.models if m.name == self.described[k].name)


def described(model: Model) -> Described:
    """One model, cleaned and cut into parts."""
    mesh, _ = clean(model.load(*model.source), vertices=Extraction().vertices)
    return Described(model.name, model.label, mesh, extract_parts(mesh))


@dataclass(frozen=True)
class Figure:
    """An experiment: its name, what it shows, and how it is made.

    Attributes:
        run: of the collection, the PNG to write and the arguments; returns the numbers for the JSON.
        options: adds arguments of its own to the parser.
    """

    name: str
    about: str | None
    run: Callable[[Collection, Path, argparse.Namespace], Numbers]
    options: Callable[[argparse.ArgumentParser], object] = lambda parser: None


def command(figure: Figure, argv: Sequence[str] | None = None) -> None:
    """The work of one figure's script."""
    arguments = parser_of(figure.about, figure.options).parse_args(argv)
    configure_jax()
    perform(figure, Collection.of(arguments.folder, arguments.jobs), arguments)


def parser_of(about: str | None, options: Callable[[argparse.ArgumentParser], object]) -> argparse.ArgumentParser:
    """What all figures take, and the options that one takes besides."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help="by default the built-in creatures")
    parser.add_argument("--out", type=Path, metavar="DIR", default=Path("figures"), help="default: figures")
    parser.add_argument("--jobs", type=int, default=cores(), help="worker processes")
    options(parser)
    return parser


def perform(figure: Figure, collection: Collection, arguments: argparse.Namespace) -> list[Path]:
    """Make a figure and write its picture and its numbers; says which files these are."""
    started = time.perf_counter()
    arguments.out.mkdir(parents=True, exist_ok=True)
    picture, numbers = arguments.out / f"{figure.name}.png", arguments.out / f"{figure.name}.json"
    found = figure.run(collection, picture, arguments)
    facts = {
        "collection": collection.name,
        "objects": len(collection.models),
        "failed": collection.failed,
        "versions": versions("matplotlib"),
        "settings": {name: run_settings(Extraction(), matching()) for name, matching in MATCHINGS.items()},
        "options": {name: told for name, told in vars(arguments).items() if not isinstance(told, Path)},
        "seconds": round(time.perf_counter() - started, 1),
    }
    write(numbers, {**facts, figure.name: found})
    print(f"{picture}\n{numbers}", flush=True)
    return [picture, numbers]


def say(text: str) -> None:
    """Progress and results in words, where they do not mix with the names of the files."""
    print(text, file=sys.stderr, flush=True)
