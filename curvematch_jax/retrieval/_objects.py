"""What is kept in memory of every object of a collection, besides its parts."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..surface import Extraction, Parts
from ._matching import Matching
from ._parts_file import fingerprint
from ._settings import require_same_extraction

# Descriptors (M, K) of M objects, by the witness's name; NaN for an object that was not described.
Descriptors = Mapping[str, np.ndarray]


@dataclass
class Objects:
    """M objects: what they go by, what tells them apart, and their descriptors.

    Attributes:
        extraction: the settings of all; None while there is no object.
        areas: (P,) shares of the surface, of each.
        vectors: descriptors of each, by name; empty for one that was not described.
    """

    extraction: Extraction | None = None
    names: list[str] = field(default_factory=list)
    fingerprints: list[str] = field(default_factory=list)
    areas: list[np.ndarray] = field(default_factory=list)
    vectors: dict[str, list[np.ndarray]] = field(default_factory=dict)

    @classmethod
    def of(cls, parts: Iterable[Parts], matching: Matching) -> Objects:
        """One pass over the objects.

        Raises:
            ValueError: when there are none, or they were made with different settings.
        """
        found = cls()
        for _ in found.taking(parts, matching):
            pass
        if found.extraction is None:
            raise ValueError("the collection is empty: at least one object is needed")
        return found

    def taking(self, parts: Iterable[Parts], matching: Matching) -> Iterator[Parts]:
        """The objects one by one, each taken into account before it is handed on."""
        first = None
        for each in parts:
            first = first or each
            require_same_extraction([first, each])
            self.extraction = first.settings
            self.names.append(each.name)
            self.fingerprints.append(fingerprint(each))
            self.areas.append(each.areas)
            for witness in matching.witnesses:
                self.vectors.setdefault(witness.name, []).append(getattr(each, witness.name))
            yield each

    def ordered(self, order: Sequence[int]) -> Objects:
        """The objects in another order."""
        return Objects(
            self.extraction,
            [self.names[k] for k in order],
            [self.fingerprints[k] for k in order],
            [self.areas[k] for k in order],
            {name: [rows[k] for k in order] for name, rows in self.vectors.items()},
        )

    @property
    def counts(self) -> np.ndarray:
        """(M,) parts of each."""
        return np.array([len(areas) for areas in self.areas], np.int64)

    @property
    def descriptors(self) -> Descriptors:
        """Tables of the vectors.

        Raises:
            ValueError: when those of one name have different lengths.
        """
        return {name: _table(name, rows) for name, rows in self.vectors.items()}


def places(
    path: Path, names: Sequence[str], fingerprints: Sequence[str], objects: Objects
) -> tuple[list[int], list[int]]:
    """Where each object is among those at a path, or will be once the new ones have been added; and which are new.

    Raises:
        ValueError: when one that is there is not among the objects, or has changed.
    """
    free: defaultdict[tuple[str, str], deque[int]] = defaultdict(deque)
    for place, key in enumerate(zip(names, fingerprints, strict=True)):
        free[key].append(place)
    order, added = [], []
    for k, key in enumerate(zip(objects.names, objects.fingerprints, strict=True)):
        order.append(free[key].popleft() if free[key] else len(names) + len(added))
        added += [k] if order[-1] >= len(names) else []
    left = [name for (name, _), rest in free.items() for _ in rest]
    if left:
        changed = left[0] in {objects.names[k] for k in added}
        raise ValueError(
            f"{path}: was made with other objects: "
            + (f"the parts of {left[0]} have changed" if changed else f"{left[0]} is not among those given")
            + ": give all objects that it was made with, and new ones if there are any, or choose another place"
        )
    return order, added


def own(fingerprints: Sequence[str], others: Sequence[str]) -> np.ndarray:
    """Which of the objects are the same, (M1, M2) bool."""
    return np.array(fingerprints)[:, None] == np.array(others)


def _table(name: str, rows: Sequence[np.ndarray]) -> np.ndarray:
    lengths = {len(row) for row in rows} - {0}
    if len(lengths) > 1:
        raise ValueError(f"the {name} of the objects have {sorted(lengths)} numbers: extract them again")
    table = np.full((len(rows), max(lengths, default=0)), np.nan, np.float32)
    for place, row in zip(table, rows, strict=True):
        place[:] = row if len(row) else np.nan
    return table
