"""A collection made ready for queries."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from .._progress import Progress, reporter
from ..elastic import Aligner, bounded, signatures, tabulate
from ..surface import Extraction, Parts
from ._cohort import LEAST, Cohort, chosen, object_distances, witness_distances
from ._distances import nearest_in
from ._matching import DEFAULT, Matching
from ._objects import Descriptors, Objects, own
from ._settings import first_difference
from ._stack import Stack, joined, object_blocks, stack

# Objects that are held at once while a collection is made ready, and parts that are compared with a cohort at once.
_AT_ONCE = 64
_PARTS_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class Collection:
    """M objects prepared for many queries, by `Collection.of` or `Collection.open`.

    It holds what comparisons need and not the parts themselves: some 120 KB for an object of 7 parts.

    Attributes:
        names: of the M objects.
        fingerprints: of the M objects.
        stack: the parts of all, their curves as tables of the aligner unless it warps them.
        areas: (P,) of the parts.
        signatures: (P, L, S) of the curves, which bound distances from below, 0 where there is none; None for an
            aligner that warps.
        descriptors: of the witnesses, (M, K) each.
        extraction: the settings of all parts.
        matching: what it was made ready for.
        cohort: by which distances are made comparable; None where the matching asks for none.
        moments: (S, M, 2) of the objects' distances to the cohort.
    """

    names: tuple[str, ...]
    fingerprints: tuple[str, ...]
    stack: Stack
    areas: np.ndarray
    signatures: np.ndarray | None
    descriptors: Descriptors
    extraction: Extraction
    matching: Matching
    cohort: Cohort | None = None
    moments: np.ndarray | None = None

    @classmethod
    def of(cls, parts: Iterable[Parts], matching: Matching = DEFAULT, progress: Progress = False) -> Collection:
        """Prepare objects for queries.

        With `fusion="cohort"` every object is compared with a cohort of at most 256 of them, and at least 32: of many
        thousands of objects that takes minutes, so that `save` is worth its while.

        Args:
            parts: at least one object, extracted with the same settings; taken one by one, so that a generator that
                loads files never has them all in memory.
            matching: that of the queries.
            progress: `True` for a bar on stderr, or a function of `(done, total)` objects compared with the cohort.

        Raises:
            ValueError: when there is no object, or settings of the extraction differ, naming the setting.
        """
        gathered = cls.gathered(parts, matching)
        return gathered._judged(None, progress) if matching.mutual else gathered

    @classmethod
    def gathered(cls, parts: Iterable[Parts], matching: Matching) -> Collection:
        """Without a cohort; raises as `of`."""
        objects, blocks = Objects(), []
        taken = objects.taking(parts, matching)
        while some := list(islice(taken, _AT_ONCE)):
            blocks.append(_ready(stack(some, matching.unit), matching.aligner))
        if objects.extraction is None:
            raise ValueError("the collection is empty: at least one object is needed")
        stacks, marks = zip(*blocks, strict=True)
        return cls(
            names=tuple(objects.names),
            fingerprints=tuple(objects.fingerprints),
            stack=joined(stacks),
            areas=np.concatenate(objects.areas),
            signatures=np.concatenate(marks) if bounded(matching.aligner) else None,
            descriptors=objects.descriptors,
            extraction=objects.extraction,
            matching=matching,
        )

    def added(self, parts: Iterable[Parts], progress: Progress = False) -> Collection:
        """The collection with objects behind those that are there.

        A cohort of 32 or more stays as it is, so that the order of the others never changes; a smaller one grows.

        Raises:
            ValueError: as `of`, and when the objects were extracted with other settings.
        """
        if self.cohort is not None and len(self.cohort.members) < LEAST:
            new = Collection.gathered(parts, self.matching)
            new.require_extraction(self.extraction)
            return self._joined(new)._judged(None, progress)
        return self._joined(self.judging(parts, progress))

    def judging(self, parts: Iterable[Parts], progress: Progress = False) -> Collection:
        """Other objects, compared with this collection's cohort; raises as `added`."""
        new = Collection.gathered(parts, self.matching)
        new.require_extraction(self.extraction)
        return new if self.cohort is None else new._judged(self, progress)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write an index that `open` maps into memory; one that is there is replaced.

        Raises:
            ValueError: when there is something else at `path`, or no room.
        """
        from ._index import write_index

        write_index(self, path)

    @classmethod
    def open(cls, path: str | os.PathLike[str], matching: Matching = DEFAULT) -> Collection:
        """An index that `save` has written, mapped into memory: what a query does not touch is never read.

        Raises:
            FileNotFoundError: when there is nothing at `path`.
            ValueError: when it is something else or damaged, or was made ready for another matching.
        """
        from ._index import read_index

        return read_index(path, matching)

    @cached_property
    def members(self) -> Collection:
        """The cohort as a collection."""
        assert self.cohort is not None
        return self.taken(self.cohort.members)

    def taken(self, objects: np.ndarray) -> Collection:
        """Some of the objects, (K,) indices, without a cohort."""
        parts = np.isin(np.repeat(np.arange(self.stack.objects), np.diff(self.stack.starts)), objects)
        return replace(
            self,
            names=tuple(self.names[k] for k in objects.tolist()),
            fingerprints=tuple(self.fingerprints[k] for k in objects.tolist()),
            stack=self.stack.taken(objects),
            areas=self.areas[parts],
            signatures=None,
            descriptors={name: table[objects] for name, table in self.descriptors.items()},
            cohort=None,
            moments=None,
        )

    def distances_to(self, members: Collection, same: np.ndarray | None = None) -> np.ndarray:
        """Distances (S, M, C) of every source to the members of a cohort.

        Args:
            same: (M, C) bool, pairs that are not compared, NaN; by default those of an object with itself or a twin.
        """
        same = own(self.fingerprints, members.fingerprints) if same is None else same
        parts = nearest_in(self.stack, members.stack, ~same, self.matching).distance
        means = object_distances(np.where(np.isinf(parts), 0.0, parts), self.areas, self.stack.starts, self.matching)
        means[:, members.stack.lacking] = np.nan
        sources = [means, *witness_distances(self.descriptors, members.descriptors, self.matching)]
        return np.where(same, np.nan, np.stack(sources))

    def require(self, query: Collection, matching: Matching) -> None:
        """Refuse what the collection is not ready for.

        Raises:
            ValueError: when the query was extracted with other settings, or the matching is another one, as far as
                the collection depends on it.
        """
        query.require_extraction(self.extraction)
        different = first_difference(self.matching, matching)
        if different and (matching.mutual or different.name in ("aligner", "unit")):
            raise ValueError(
                f"the collection was prepared for {different.name} = {different.one!r}, and the matching has "
                f"{different.name} = {different.other!r}: give Collection.of the matching of the queries"
            )

    def require_extraction(self, other: Extraction) -> None:
        """Raises `ValueError` when these parts were extracted with other settings."""
        different = first_difference(other, self.extraction)
        if different:
            raise ValueError(
                f"parts of {self.names[0] or 'an object'} were extracted with {different.name} = {different.other!r}, "
                f"those of the collection with {different.name} = {different.one!r}: extract both with the same "
                "settings"
            )

    def lacking_notes(self, what: str) -> tuple[str, ...]:
        """A sentence on every object without parts."""
        return tuple(
            f"{what} {self.names[j] or j} has no feature point, so nothing is known about it"
            for j in np.flatnonzero(self.stack.lacking).tolist()
        )

    def _judged(self, judges: Collection | None, progress: Progress) -> Collection:
        """With moments of the distances to the cohort of another collection, or to one of its own."""
        members = self.taken(chosen(self.fingerprints)) if judges is None else judges.members
        report, found = reporter(progress, "cohort", "objects"), []
        for block in object_blocks(self.stack.starts, parts=_PARTS_AT_ONCE):
            found.append(self.taken(np.arange(block.start, block.stop)).distances_to(members))
            report(block.stop, self.stack.objects)
        distances = np.concatenate(found, axis=1)
        if judges is None:
            picked = chosen(self.fingerprints)
            cohort = Cohort.of(picked, distances[:, picked], self.matching)
        else:
            assert judges.cohort is not None
            cohort = judges.cohort
        return replace(self, cohort=cohort, moments=cohort.moments(distances))

    def _joined(self, other: Collection) -> Collection:
        return replace(
            self,
            names=self.names + other.names,
            fingerprints=self.fingerprints + other.fingerprints,
            stack=joined([self.stack, other.stack]),
            areas=np.concatenate([self.areas, other.areas]),
            signatures=_behind(self.signatures, other.signatures, axis=0),
            descriptors=joined_tables(self.descriptors, other.descriptors),
            moments=_behind(self.moments, other.moments, axis=1),
        )


def joined_tables(one: Descriptors, other: Descriptors) -> Descriptors:
    """Descriptors of the objects of two collections; raises `ValueError` when they have different lengths."""
    tables = {}
    for name in one:
        widths = {table[name].shape[1] for table in (one, other)}
        wide = max(widths)
        if len(widths - {0}) > 1:
            raise ValueError(f"the {name} of the objects have {sorted(widths)} numbers: extract them again")
        padded = [np.pad(t[name], ((0, 0), (0, wide - t[name].shape[1])), constant_values=np.nan) for t in (one, other)]
        tables[name] = np.concatenate(padded)
    return tables


def _behind(one: np.ndarray | None, other: np.ndarray | None, axis: int) -> np.ndarray | None:
    return None if one is None or other is None else np.concatenate([one, other], axis)


def _ready(members: Stack, aligner: Aligner) -> tuple[Stack, np.ndarray | None]:
    """The stack with tables for curves, and signatures (P, L, S); as it is for an aligner without bounds.

    Its tables are ten times as large as the curves, and take much less time than the alignments.
    """
    if not bounded(aligner):
        return members, None
    tables = tabulate(np.asarray(members.curves), aligner)
    marks = signatures(tables)
    dense = np.zeros((*members.rows.shape, marks.shape[1]), marks.dtype)
    dense[members.rows >= 0] = marks
    return replace(members, curves=tables), dense
