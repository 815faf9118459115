"""The parts of many objects in one: what distances are computed from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..elastic import Tables
from ..surface import Parts
from ._matching import Unit
from ._settings import require_same_extraction

# In units of area or diameter: level sets that are shorter are as short as can be, so that ratios of them stay bounded.
_SHORTEST = 0.02


@dataclass(frozen=True, eq=False)
class Stack:
    """The parts of M objects in one, P in all, object by object.

    Attributes:
        curves: (C, 3, n) the curves that count, or tables of them.
        rows: (P, L) where in `curves` a part's level is, -1 where it is masked or beyond a gap.
        log_lengths: (P, L) in the unit that was asked for; 0 where there is no row.
        log_level_sets: (P, L)
        log_units: (P,) `log_lengths` less this are those in sizes of the surface; 0 for lengths in the mesh's unit,
            which are to be compared as they are.
        starts: (M + 1,) object j has the parts `starts[j]` to `starts[j + 1]`.
    """

    curves: np.ndarray | Tables
    rows: np.ndarray
    log_lengths: np.ndarray
    log_level_sets: np.ndarray
    log_units: np.ndarray
    starts: np.ndarray

    @property
    def objects(self) -> int:
        return len(self.starts) - 1

    @property
    def lacking(self) -> np.ndarray:
        """(M,) bool, True for an object without parts."""
        return np.diff(self.starts) == 0

    def taken(self, objects: np.ndarray) -> Stack:
        """The stack of some of the objects, (K,) indices."""
        parts, starts = self.parts_of(objects)
        rows = self.rows[parts]
        there = rows >= 0
        renumbered = np.full(rows.shape, -1)
        renumbered[there] = np.arange(there.sum())
        return Stack(
            curves=self.curves[rows[there]],
            rows=renumbered,
            log_lengths=self.log_lengths[parts],
            log_level_sets=self.log_level_sets[parts],
            log_units=self.log_units[parts],
            starts=starts,
        )

    def parts_of(self, objects: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The parts of some of the objects, (K,) indices, and where among them those of each begin, (K + 1,)."""
        sizes = np.diff(self.starts)[objects]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        return np.repeat(self.starts[:-1][objects] - starts[:-1], sizes) + np.arange(starts[-1]), starts


def stack(collection: Sequence[Parts], unit: Unit = "area") -> Stack:
    """Put the parts of a collection into one, lengths in the unit that `Matching` names.

    Raises:
        ValueError: when the collection is empty, or was extracted with different settings.
    """
    if not collection:
        raise ValueError("the collection is empty: at least one object is needed")
    require_same_extraction([(parts.name, parts.settings) for parts in collection])
    mask = unbroken(np.concatenate([parts.mask for parts in collection]))
    rows = np.full(mask.shape, -1)
    rows[mask] = np.arange(mask.sum())
    units = np.concatenate([np.full(len(parts.areas), _unit(parts, unit)) for parts in collection])[:, None]
    sizes = np.concatenate([np.full(len(parts.areas), parts.size / parts.diameter) for parts in collection])
    lengths = np.concatenate([parts.lengths for parts in collection]) * units
    level_sets = np.concatenate([parts.level_set_lengths for parts in collection]) * units
    return Stack(
        curves=np.concatenate([parts.curves for parts in collection])[mask],
        rows=rows,
        log_lengths=np.log(np.where(mask, lengths, 1.0)).astype(np.float32),
        log_level_sets=np.log(level_sets + _SHORTEST).astype(np.float32),
        log_units=np.log(units[:, 0] * sizes).astype(np.float32) * (unit != "mesh"),
        starts=np.cumsum([0, *(len(parts.areas) for parts in collection)]),
    )


def joined(stacks: Sequence[Stack]) -> Stack:
    """Stacks of several collections, their curves all of one form, as the stack of all objects."""
    before = np.cumsum([0, *(len(one.curves) for one in stacks)]).tolist()
    rows = [np.where(one.rows >= 0, one.rows + first, -1) for one, first in zip(stacks, before, strict=False)]
    tables = [one.curves for one in stacks if isinstance(one.curves, Tables)]
    arrays = [one.curves for one in stacks if isinstance(one.curves, np.ndarray)]
    return Stack(
        curves=Tables.joined(tables) if tables else np.concatenate(arrays),
        rows=np.concatenate(rows),
        log_lengths=np.concatenate([one.log_lengths for one in stacks]),
        log_level_sets=np.concatenate([one.log_level_sets for one in stacks]),
        log_units=np.concatenate([one.log_units for one in stacks]),
        starts=np.cumsum([0, *np.concatenate([np.diff(one.starts) for one in stacks]).tolist()]),
    )


def _unit(parts: Parts, unit: Unit) -> float:
    """What turns lengths in diameters into lengths in the unit."""
    return {"diameter": 1.0, "mesh": parts.diameter, "area": parts.diameter / np.sqrt(parts.area)}[unit]


def unbroken(mask: np.ndarray) -> np.ndarray:
    """The first run of levels of each part, (P, L) bool.

    Beyond a gap the level set has split and met again: all fingers of a hand go on as the same arm there, which says
    nothing about a finger. On both development collections parts are told apart better without those levels.
    """
    ended = np.logical_or.accumulate(mask, axis=1) & ~mask
    return mask & ~np.logical_or.accumulate(ended, axis=1)


def object_blocks(starts: np.ndarray, parts: int) -> list[slice]:
    """Runs of objects with at most `parts` parts each; an object with more is a run by itself."""
    blocks, begin = [], 0
    for end in range(1, len(starts)):
        if end + 1 == len(starts) or starts[end + 1] - starts[begin] > parts:
            blocks.append(slice(begin, end))
            begin = end
    return blocks
