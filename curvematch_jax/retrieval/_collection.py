"""A collection made ready for queries."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ..elastic import Aligner, bounded, signatures, tabulate
from ..surface import Parts
from ._matching import BEST, Matching, Unit
from ._parts_file import require_same_settings
from ._stack import Stack, joined, stack

# Objects that are held at once while a collection is made ready.
_AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class Collection:
    """M objects made ready for many queries, by `Collection.of`.

    It holds what comparisons need and not the parts themselves: some 120 KB for an object of 7 parts.

    Attributes:
        names: of the M objects.
        stack: the parts of all, their curves as tables of the aligner unless it warps them.
        signatures: (P, L, S) of the curves, which bound distances from below, 0 where there is none; None for an
            aligner that warps.
        sample: one of the objects, for its settings.
        aligner: the alignment of two curves that it was made ready for.
        unit: what lengths are measured in.
    """

    names: tuple[str, ...]
    stack: Stack
    signatures: np.ndarray | None
    sample: Parts
    aligner: Aligner
    unit: Unit

    @classmethod
    def of(cls, parts: Iterable[Parts], matching: Matching = BEST) -> Collection:
        """Make objects ready for queries.

        Arguments:
            parts: at least one object, extracted with the same settings; taken one by one, so that a generator that
                loads files never has them all in memory.
            matching: its aligner and unit are those of the queries.

        Raises:
            ValueError: when there is no object, or settings of the extraction differ, naming the setting.
        """
        parts, names, blocks, sample = iter(parts), [], [], None
        while some := list(islice(parts, _AT_ONCE)):
            sample = sample or some[0]
            require_same_settings([sample, *some])
            names += [one.name for one in some]
            blocks.append(_ready(stack(some, matching.unit), matching.aligner))
        if sample is None:
            raise ValueError("the collection is empty: at least one object is needed")
        stacks, marks = zip(*blocks, strict=True)
        return cls(
            names=tuple(names),
            stack=joined(stacks),
            signatures=np.concatenate(marks) if bounded(matching.aligner) else None,
            sample=sample,
            aligner=matching.aligner,
            unit=matching.unit,
        )

    def require(self, query: Parts, matching: Matching) -> None:
        """Refuse what the collection is not ready for.

        Raises:
            ValueError: when the query was extracted with other settings, or the matching has another aligner or unit.
        """
        require_same_settings([self.sample, query])
        for name in ("aligner", "unit"):
            ready, asked = getattr(self, name), getattr(matching, name)
            if ready != asked:
                raise ValueError(
                    f"the collection was made ready for {name} = {ready!r}, and the matching has {name} = {asked!r}: "
                    "give Collection.of the matching of the queries"
                )

    def lacking_notes(self, what: str) -> tuple[str, ...]:
        """A sentence on every object without parts."""
        return tuple(
            f"{what} {self.names[j] or j} has no feature point, so nothing is known about it"
            for j in np.flatnonzero(self.stack.lacking).tolist()
        )


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
