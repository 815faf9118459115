"""A dissimilarity matrix on disk that is filled block by block: a zarr group.

`distances` (M, C, M) holds the distance of part c of object i to object j; there are at most C parts. A chunk is a
block of objects by a block of objects. zarr writes it beside its place and renames it, so that a chunk that exists is
whole. NaN stands for what has not been computed, 0 for parts that an object does not have. `dissimilarity` (M, M) is
made of it in the end.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._progress import Progress, reporter
from ..surface import Extraction, Parts
from ._blocks import BLOCK, Block, all_blocks, block_pairs, block_ranges, compared, fused_row
from ._files import replacing, writing
from ._matching import Matching
from ._matrix_file import MATRIX_FORMAT, chunks, matrix_attributes, vacant
from ._parts_file import fingerprint, require_same_settings

_LEAST_PARTS = 64
_COLUMNS = 1024  # of a chunk of the finished matrix


class Described(NamedTuple):
    """What a store has to know of an object."""

    name: str
    fingerprint: str
    areas: np.ndarray  # (P,)
    settings: Extraction


def describe(parts: Sequence[Parts]) -> list[Described]:
    """One pass over the objects.

    Raises:
        ValueError: when there are none, or they were made with different settings.
    """
    first, objects = None, []
    for each in parts:
        first = first or each
        require_same_settings([first, each])
        objects.append(Described(each.name, fingerprint(each), each.areas, each.settings))
    if not objects:
        raise ValueError("the collection is empty: at least one object is needed")
    return objects


def run_settings(extraction: Extraction, matching: Matching) -> dict[str, object]:
    """Everything that a result depends on."""
    return {"extraction": dataclasses.asdict(extraction), "matching": dataclasses.asdict(matching)}


def open_matrix(
    path: str | os.PathLike[str], objects: Sequence[Described], matching: Matching
) -> tuple[MatrixStore, list[int]]:
    """The store of these objects, made or made larger as needed, and where in it each of the objects is.

    Raises:
        ValueError: when it is something else, or was made with other objects or settings, naming the first difference.
    """
    path, settings = Path(path), run_settings(objects[0].settings, matching)
    if vacant(path):
        _create(path, objects, settings)
    store = MatrixStore(path)  # Before anything is touched: `path` may be somebody's folder.
    for leftover in path.rglob("*.partial"):  # What zarr was writing when the process was killed.
        leftover.unlink()
    _require_settings(path, store.attributes["settings"], json.loads(json.dumps(settings)))
    order, added = _places(path, store.attributes, objects)
    store.grow(added)
    return store, order


class MatrixStore:
    """The zarr group of a matrix: what is missing in it, and how blocks go in.

    Attributes:
        path: the folder.
        attributes: of the group.
    """

    def __init__(self, path: Path) -> None:
        import zarr

        self.path = path
        self.attributes = matrix_attributes(path)
        if "sizes" not in self.attributes:
            raise ValueError(f"{path}: a matrix that was saved whole can't be gone on with: choose another place")
        self._group = zarr.open_group(path, mode="r+")
        self._open()

    def _open(self) -> None:
        self.counts = np.array(self.attributes["parts"], np.int64)
        self._distances: Any = self._group["distances"]
        self._dissimilarity: Any = self._group["dissimilarity"]

    @property
    def dissimilarity(self) -> np.ndarray:
        """(M, M), when all is there."""
        return np.asarray(self._dissimilarity)

    def grow(self, added: Sequence[Described]) -> None:
        """Make room for objects behind those that are there. May be stopped at any point: the next call goes on."""
        objects = len(self.counts) + len(added)
        if added:
            if max(len(each.areas) for each in added) > self._distances.shape[1]:
                raise ValueError(
                    f"{self.path}: has room for {self._distances.shape[1]} parts an object: make a new one"
                )
            self.attributes = _attributes(self.attributes, added)
            with writing(self.path):
                self._group.attrs.put(self.attributes)
        with writing(self.path):
            if self._distances.shape[0] < objects:
                self._distances.resize((objects, self._distances.shape[1], objects))
            if self._dissimilarity.shape[0] < objects:
                self._dissimilarity.resize((objects, objects))
        self._open()

    def missing(self) -> list[tuple[int, int]]:
        """The pairs of blocks that have to be computed, in part or whole."""
        there = chunks(self.path)
        return [
            pair
            for pair in block_pairs(len(self.counts))
            if not {pair, pair[::-1]} <= there.keys() or (self._was_partial(*pair) and self.wanted(*pair).any())
        ]

    def wanted(self, one: int, other: int) -> np.ndarray:
        """Which objects of two blocks have still to be compared, bool."""
        rows, columns = self._ranges(one, other)
        if not self._was_partial(one, other):
            return compared(rows, columns)
        forward, backward = self._cells(rows, columns)[:, 0], self._cells(columns, rows)[:, 0].T
        return compared(rows, columns) & (np.isnan(forward) | np.isnan(backward))

    def put(self, one: int, other: int, block: Block) -> None:
        """Write what was computed of a pair of blocks."""
        rows, columns = self._ranges(one, other)
        forward, backward = self._padded(rows, block.forward), self._padded(columns, block.backward)
        if one == other:
            forward = np.where(np.isnan(forward), backward, forward)
            forward[np.arange(len(rows)), :, np.arange(len(rows))] = 0.0
            self._write(rows, rows, forward)
        else:
            self._write(rows, columns, forward)
            self._write(columns, rows, backward)

    def finish(self, areas: Sequence[np.ndarray], matching: Matching, progress: Progress = False) -> None:
        """Make the matrix of the distances, row by row; a finished one is left as it is."""
        if self.attributes["complete"]:
            return
        objects, present = len(self.counts), self.counts > 0
        report = reporter(progress, "rows", "objects")
        for rows in all_blocks(objects):
            distances = self._row(rows)
            fused = [
                fused_row(distances[k, : self.counts[i]], areas[i], i, present, matching) for k, i in enumerate(rows)
            ]
            with writing(self.path):
                self._dissimilarity[rows.start : rows.stop] = np.stack(fused)
            report(rows.stop, objects)
        self.attributes = {**self.attributes, "complete": True}
        with writing(self.path):
            self._group.attrs.put(self.attributes)

    def _row(self, rows: range) -> np.ndarray:
        """Distances (B, C', M) of a block of objects, as many parts as there are at most."""
        most, blocks = int(self.counts.max(initial=1)), all_blocks(len(self.counts))
        # Copies, as a view of a few parts would hold the memory of all that there is room for.
        return np.concatenate([self._cells(rows, columns)[:, :most].copy() for columns in blocks], axis=2)

    def _cells(self, rows: range, columns: range) -> np.ndarray:
        try:
            return np.asarray(self._distances[rows.start : rows.stop, :, columns.start : columns.stop])
        except (OSError, MemoryError):
            raise  # The chunk may be sound.
        except Exception as error:  # zarr's codecs raise what they like
            one, other = rows.start // BLOCK, columns.start // BLOCK
            chunk = self.path / "distances" / "c" / str(one) / "0" / str(other)
            chunk.unlink(missing_ok=True)
            raise ValueError(
                f"{chunk} was damaged ({type(error).__name__}) and has been removed: run the same command again"
            ) from error

    def _write(self, rows: range, columns: range, cells: np.ndarray) -> None:
        if self._was_partial(rows.start // BLOCK, columns.start // BLOCK):
            cells = np.where(np.isnan(cells), self._cells(rows, columns), cells)
        with writing(self.path):
            self._distances[rows.start : rows.stop, :, columns.start : columns.stop] = cells

    def _padded(self, rows: range, distances: np.ndarray) -> np.ndarray:
        """Distances (P1, M2) of the parts of a block's objects as (B, C, M2)."""
        cells = np.zeros((len(rows), self._distances.shape[1], distances.shape[1]), np.float32)
        counts = self.counts[rows.start : rows.stop]
        cells[np.arange(cells.shape[1]) < counts[:, None]] = distances
        return cells

    def _ranges(self, one: int, other: int) -> tuple[range, range]:
        return block_ranges(one, other, len(self.counts))

    def _was_partial(self, *blocks: int) -> bool:
        """Whether one of the blocks had fewer objects once: what was written then does not have them all."""
        return any(size % BLOCK and size // BLOCK in blocks for size in self.attributes["sizes"][:-1])


def _create(path: Path, objects: Sequence[Described], settings: Mapping[str, object]) -> None:
    import zarr

    most = max(len(each.areas) for each in objects)
    room = max(_LEAST_PARTS, 1 << (most - 1).bit_length())
    empty = {"curvematch_matrix": MATRIX_FORMAT, "settings": dict(settings), "notes": [], "complete": False}
    empty |= {"names": [], "fingerprints": [], "parts": [], "sizes": []}
    count = len(objects)
    with writing(path), replacing(path) as temporary:
        group = zarr.open_group(temporary, mode="w", attributes=_attributes(empty, objects))
        group.create_array(
            "distances", shape=(count, room, count), chunks=(BLOCK, room, BLOCK), dtype="float32", fill_value=np.nan
        )
        group.create_array(
            "dissimilarity", shape=(count, count), chunks=(BLOCK, _COLUMNS), dtype="float64", fill_value=np.nan
        )


def _attributes(known: Mapping[str, Any], added: Sequence[Described]) -> dict[str, Any]:
    """The attributes with objects added."""
    names = [each.name for each in added]
    return {
        **known,
        "names": known["names"] + names,
        "fingerprints": known["fingerprints"] + [each.fingerprint for each in added],
        "parts": known["parts"] + [len(each.areas) for each in added],
        "notes": known["notes"] + [f"{each.name} has no feature point" for each in added if not len(each.areas)],
        "sizes": [*known["sizes"], len(known["names"]) + len(names)],
        "complete": False,
    }


def _places(
    path: Path, attributes: Mapping[str, Any], objects: Sequence[Described]
) -> tuple[list[int], list[Described]]:
    """Where in the store each object is, or will be once those that are new have been added behind; and these."""
    free: defaultdict[tuple[str, str], deque[int]] = defaultdict(deque)
    for place, key in enumerate(zip(attributes["names"], attributes["fingerprints"], strict=True)):
        free[key].append(place)
    order, added = [], []
    for each in objects:
        places = free[each.name, each.fingerprint]
        order.append(places.popleft() if places else len(attributes["names"]) + len(added))
        added += [each] if order[-1] >= len(attributes["names"]) else []
    left = [name for (name, _), places in free.items() for _ in places]
    if left:
        changed = left[0] in {each.name for each in added}
        raise ValueError(
            f"{path}: was made with other objects: "
            + (f"the parts of {left[0]} have changed" if changed else f"{left[0]} is not among those given")
            + ": give what it was made with, and more if you like, or choose another place"
        )
    return order, added


def _require_settings(path: Path, there: Mapping[str, Any], given: Mapping[str, Any]) -> None:
    for kind in given:
        for name in {**there[kind], **given[kind]}:
            one, other = there[kind].get(name), given[kind].get(name)
            if one != other:
                raise ValueError(
                    f"{path}: was made with {name} = {one!r}, and {name} = {other!r} was asked for ({kind}): "
                    "use the same settings, or choose another place"
                )
