"""What is known of the objects of a collection besides their level curves."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._given import require_type, wrong_type
from ..surface import Extraction, Parts
from ._matching import Matching
from ._parts_file import fingerprint
from ._settings import require_same_extraction

# Descriptors (M, K) of M objects, by the witness's name; NaN for an object that was not described.
Descriptors = Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Objects:
    """M objects of P parts in all: what they go by, what tells them apart, and their descriptors.

    Attributes:
        extraction: the settings of all.
        areas: (P,) shares of the surface, object by object.
        counts: (M,) parts of each.
    """

    extraction: Extraction
    names: tuple[str, ...]
    fingerprints: tuple[str, ...]
    areas: np.ndarray
    counts: np.ndarray
    descriptors: Descriptors

    @classmethod
    def of(cls, parts: Iterable[Parts], matching: Matching) -> Objects:
        """One pass over the objects.

        Raises:
            ValueError: when there are none, something is of another type, they were extracted with different settings,
                or have descriptors of different lengths.
        """
        require_type("matching", matching, Matching, "give a Matching, e.g. Matching.elastic()")
        return cls.joined([_one(each, matching) for each in each_of(parts)])

    @classmethod
    def joined(cls, several: Sequence[Objects]) -> Objects:
        """The objects of several collections; raises as `of`."""
        if not several:
            raise ValueError("the collection is empty: at least one object is needed")
        require_same_extraction([(each.names[0], each.extraction) for each in several])
        return cls(
            several[0].extraction,
            tuple(name for each in several for name in each.names),
            tuple(key for each in several for key in each.fingerprints),
            np.concatenate([each.areas for each in several]),
            np.concatenate([each.counts for each in several]),
            {name: _table(name, [each.descriptors[name] for each in several]) for name in several[0].descriptors},
        )

    def taken(self, objects: Sequence[int]) -> Objects:
        """Some of the objects, in the order in which they are given."""
        chosen, ends = np.array(objects, np.int64), np.cumsum(self.counts)
        areas = [self.areas[end - count : end] for end, count in zip(ends[chosen], self.counts[chosen], strict=True)]
        return Objects(
            self.extraction,
            tuple(self.names[k] for k in chosen),
            tuple(self.fingerprints[k] for k in chosen),
            np.concatenate([self.areas[:0], *areas]),
            self.counts[chosen],
            {name: table[chosen] for name, table in self.descriptors.items()},
        )


def each_of(parts: Iterable[Parts]) -> Iterator[Parts]:
    """The objects one by one; `ValueError` for what is no collection of them."""
    remedy = "give a list of Parts, e.g. extract_collection(paths).parts"
    if isinstance(parts, str) or not isinstance(parts, Iterable):
        raise wrong_type("the collection", parts, remedy)
    for each in parts:
        require_type("an object of the collection", each, Parts, remedy)
        yield each


def places(
    path: Path | None, names: Sequence[str], fingerprints: Sequence[str], objects: Objects
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


def _one(parts: Parts, matching: Matching) -> Objects:
    described = {witness.name: getattr(parts, witness.name)[None] for witness in matching.witnesses}
    counts = np.array([len(parts.areas)], np.int64)
    return Objects(parts.settings, (parts.name,), (fingerprint(parts),), parts.areas, counts, described)


def _table(name: str, tables: Sequence[np.ndarray]) -> np.ndarray:
    """The rows of all tables in one; a table without columns is of objects that were not described."""
    lengths = {table.shape[1] for table in tables} - {0}
    if len(lengths) > 1:
        raise ValueError(f"the {name} of the objects have {sorted(lengths)} numbers: extract them again")
    width = max(lengths, default=0)
    return np.concatenate(
        [table if table.shape[1] else np.full((len(table), width), np.nan, np.float32) for table in tables]
    )
