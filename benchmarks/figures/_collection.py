"""The collection that the figures are of, and what is computed from it once for them all."""

from __future__ import annotations

import functools as ft
import sys
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from curvematch_jax.retrieval import Matching, dissimilarity_matrix
from curvematch_jax.surface import Extraction, Mesh, Parts, clean, extract_parts

from .._measure import say
from .._models import Model, in_order, models_in, name_of

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
        return cls(name_of(folder), models_in(folder), jobs)

    def each(self, function: Callable[[Any], Any], tasks: Sequence[Any], what: str) -> list[Any]:
        """The function's results in the order of the tasks, from worker processes; None where it failed.

        Args:
            function: importable by name; a task is a model, or begins with one.
        """
        outcomes = in_order(function, tasks, self.jobs, what)
        for task, outcome in zip(tasks, outcomes, strict=True):
            if outcome.failure is not None:
                name = (task if isinstance(task, Model) else task[0]).name
                self.failed[name] = outcome.failure
                say(f"{name}: {outcome.failure}")
        return [outcome.result for outcome in outcomes]

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
    mesh, _ = clean(model.mesh(), vertices=Extraction().vertices)
    return Described(model.name, model.label, mesh, extract_parts(mesh))
