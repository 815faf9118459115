"""A collection made ready for queries."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from .._progress import Progress, reporter
from ..elastic import Aligner, bounded, signatures, tabulate
from ..surface import Parts
from ._cohort import LEAST, Cohort, chosen, object_distances, witness_distances
from ._distances import nearest_in
from ._matching import DEFAULT, Matching
from ._objects import Objects, each_of, own
from ._settings import require_same, require_same_extraction
from ._stack import Stack, joined, object_blocks, stack

# Objects that are held at once while a collection is made ready, and parts that are compared with a cohort at once.
_AT_ONCE = 64
_PARTS_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class Collection:
    """M objects prepared for many queries, by `Collection.of` or `Collection.open`.

    It holds what comparisons need and not the parts themselves: some 120 KB for an object of 7 parts.

    Attributes:
        objects: what the M objects go by, what tells them apart, and their descriptors.
        stack: the parts of all, their curves as tables of the aligner unless it warps them.
        signatures: (P, L, S) of the curves, which bound distances from below, 0 where there is none; None for an
            aligner that warps.
        matching: what it was made ready for.
        cohort: by which distances are made comparable; None where the matching asks for none.
        moments: (S, M, 2) of the objects' distances to the cohort.
    """

    objects: Objects
    stack: Stack
    signatures: np.ndarray | None
    matching: Matching
    cohort: Cohort | None = None
    moments: np.ndarray | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the M objects."""
        return self.objects.names

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
        objects, stacks, marks, left = [], [], [], each_of(parts)
        while some := list(islice(left, _AT_ONCE)):
            objects.append(Objects.of(some, matching))
            ready, signed = _ready(stack(some, matching.unit), matching.aligner)
            stacks.append(ready)
            marks.append(signed)
        known = Objects.joined(objects)
        return cls(known, joined(stacks), np.concatenate(marks) if bounded(matching.aligner) else None, matching)

    def added(self, parts: Iterable[Parts], progress: Progress = False) -> Collection:
        """The collection with objects behind those that are there.

        A cohort of 32 or more stays as it is, so that the order of the others never changes; a smaller one grows.

        Raises:
            ValueError: as `of`, and when the objects were extracted with other settings.
        """
        if self.cohort is not None and len(self.cohort.members) < LEAST:
            return self._joined(Collection.gathered(parts, self.matching))._judged(None, progress)
        return self._joined(self.judging(parts, progress))

    def judging(self, parts: Iterable[Parts], progress: Progress = False) -> Collection:
        """Other objects, compared with this collection's cohort; raises as `added`."""
        new = Collection.gathered(parts, self.matching)
        self.require(new, self.matching)
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
        return Collection(self.objects.taken(objects.tolist()), self.stack.taken(objects), None, self.matching)

    def distances_to(self, members: Collection, same: np.ndarray | None = None) -> np.ndarray:
        """Distances (S, M, C) of every source to the members of a cohort.

        Args:
            same: (M, C) bool, pairs that are not compared, NaN; by default those of an object with itself or a twin.
        """
        same = own(self.objects.fingerprints, members.objects.fingerprints) if same is None else same
        parts = nearest_in(self.stack, members.stack, ~same, self.matching).distance
        parts = np.where(np.isinf(parts), 0.0, parts)
        means = object_distances(parts, self.objects.areas, self.stack.starts, self.matching)
        means[:, members.stack.lacking] = np.nan
        witnesses = witness_distances(self.objects.descriptors, members.objects.descriptors, self.matching)
        return np.where(same, np.nan, np.stack([means, *witnesses]))

    def require(self, query: Collection, matching: Matching) -> None:
        """Refuse what the collection is not ready for.

        Raises:
            ValueError: when the query was extracted with other settings, or the matching is another one, as far as
                the collection depends on it.
        """
        extracted = [("the collection", self.objects.extraction), (query.names[0], query.objects.extraction)]
        require_same_extraction(extracted)
        plain = [asdict(each) for each in (self.matching, matching)]
        needed = plain[0] if matching.mutual else ("aligner", "unit")
        ready, asked = ({name: each[name] for name in needed} for each in plain)
        what = ("the collection was prepared", "and the query comes")
        require_same(ready, asked, what, "give Collection.of the matching of the queries")

    def lacking_notes(self, what: str) -> tuple[str, ...]:
        """A sentence on every object without parts."""
        return tuple(
            f"{what} {self.names[j] or j} has no feature point, so nothing is known about it"
            for j in np.flatnonzero(self.stack.lacking).tolist()
        )

    def _judged(self, judges: Collection | None, progress: Progress) -> Collection:
        """With moments of the distances to the cohort of another collection, or to one of its own."""
        members = self.taken(chosen(self.objects.fingerprints)) if judges is None else judges.members
        report, found = reporter(progress, "cohort", "objects"), []
        for block in object_blocks(self.stack.starts, parts=_PARTS_AT_ONCE):
            found.append(self.taken(np.arange(block.start, block.stop)).distances_to(members))
            report(block.stop, self.stack.objects)
        distances = np.concatenate(found, axis=1)
        if judges is None:
            picked = chosen(self.objects.fingerprints)
            cohort = Cohort.of(picked, distances[:, picked], self.matching)
        else:
            assert judges.cohort is not None
            cohort = judges.cohort
        return replace(self, cohort=cohort, moments=cohort.moments(distances))

    def _joined(self, other: Collection) -> Collection:
        return replace(
            self,
            objects=Objects.joined([self.objects, other.objects]),
            stack=joined([self.stack, other.stack]),
            signatures=_behind(self.signatures, other.signatures, axis=0),
            moments=_behind(self.moments, other.moments, axis=1),
        )


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
