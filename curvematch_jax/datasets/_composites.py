"""Composites: half of one model joined to half of another of a different class, the same for the same seed."""

import itertools as it
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..surface import Mesh, clean
from ._halves import Half, halves, join

# How often two classes are tried with other models: first cut across their longest axes, then across any.
_ALONG, _ANYHOW = 4, 2


@dataclass(frozen=True, eq=False)
class Composite:
    """A closed connected mesh, the names of the two models that it was made of, and their classes."""

    mesh: Mesh
    sources: tuple[str, str]
    labels: tuple[str, str]


def composites(models: Sequence[tuple[Mesh, str]], count: int = 30, seed: int = 0) -> Iterator[Composite]:
    """Composites of labelled models, made one after the other as they are asked for.

    Two models of different classes are each cut in two by a plane, by preference across its longest principal axis,
    where one closed loop bounds between about a third and two thirds of the surface and some of the tips of its
    limbs. A half of one is joined to a half of the other cut on cut, at a common scale (models of equal area, up to a
    factor of 1.4 that makes the cuts fit), by boolean union. The classes, drawn at random, take part about equally
    often; so do the models of a class. A composite may come twice where there are few models.

    Args:
        models: meshes, cleaned where they need it, and their classes.
        count: how many composites.
        seed: another seed, other composites.

    Raises:
        ValueError: a count below 1, a negative seed or fewer than two classes, at once; or, while they are made, no
            two classes are left whose models can be cut and joined.
        MeshError: a model that cannot be cleaned, while they are made.
        ImportError: without manifold3d (the extra `prep`).
    """
    if count < 1 or seed < 0:
        raise ValueError(f"count {count} and seed {seed} must be 1 and 0 or more")
    classes = sorted({label for _, label in models})
    if len(classes) < 2:
        raise ValueError(f"composites are of two classes, and the {len(models)} models have {len(classes)}")
    return _made(_Workshop(models, np.random.default_rng(seed)), classes, count)


def _made(workshop: "_Workshop", classes: Sequence[str], count: int) -> Iterator[Composite]:
    pairs = list(it.combinations(classes, 2))
    uses: Counter[object] = Counter()
    done = 0
    while done < count:
        if not pairs:
            raise ValueError(
                f"only {done} of {count} composites could be made: no models of two classes are left that a plane "
                "cuts in one loop and that can be joined there"
            )
        pair = workshop.rarest(pairs, uses)
        composite = workshop.composite(pair)
        if composite is None:
            pairs.remove(pair)
            continue
        uses.update([pair, *pair])
        done += 1
        yield composite


class _Workshop:
    """The models, whose turn it is, and the halves that have been cut from them."""

    def __init__(self, models: Sequence[tuple[Mesh, str]], rng: np.random.Generator):
        self._models, self._rng = models, rng
        self._halves: dict[int, list[Half]] = {}
        self._turn: dict[str, deque[int]] = {}
        for index in rng.permutation(len(models)).tolist():
            self._turn.setdefault(models[index][1], deque()).append(index)

    def rarest(self, pairs: Sequence[tuple[str, str]], uses: Counter[object]) -> tuple[str, str]:
        """A pair of classes that took part least often, together and then apart; which of several, at random."""
        drawn = [pairs[k] for k in self._rng.permutation(len(pairs))]
        return min(drawn, key=lambda pair: (uses[pair], uses[pair[0]] + uses[pair[1]]))

    def composite(self, labels: tuple[str, str]) -> Composite | None:
        """Of the next models of two classes that can be joined; None when several tries have failed."""
        labels = labels if self._rng.random() < 0.5 else (labels[1], labels[0])
        for attempt in range(_ALONG + _ANYHOW):
            first, second = self._next(labels[0]), self._next(labels[1])
            mesh = self._joined(first, second, any_axis=attempt >= _ALONG)
            if mesh is not None:
                names = self._models[first][0].name, self._models[second][0].name
                return Composite(Mesh(mesh.vertices, mesh.faces, "+".join(names)), names, labels)
        return None

    def _joined(self, first: int, second: int, any_axis: bool) -> Mesh | None:
        """The first of the halves that fit, in random order but for their axes."""
        lower, upper = (self._shuffled(self._cut(index), any_axis) for index in (first, second))
        order = sorted(it.product(lower, upper), key=lambda pair: pair[0].axis + pair[1].axis)
        return next((mesh for pair in order if (mesh := join(*pair)) is not None), None)

    def _shuffled(self, found: Sequence[Half], any_axis: bool) -> list[Half]:
        return [found[k] for k in self._rng.permutation(len(found)) if any_axis or found[k].axis == 0]

    def _cut(self, index: int) -> list[Half]:
        if index not in self._halves:
            self._halves[index] = halves(clean(self._models[index][0])[0])
        return self._halves[index]

    def _next(self, label: str) -> int:
        self._turn[label].rotate(-1)
        return self._turn[label][-1]
