"""A dissimilarity matrix that is filled block by block: a zarr group, in memory or on disk.

`distances` (M, C, M) holds the distance of part c of object i to object j; there are at most C parts. A chunk is a
block of objects by a block of objects. zarr writes it beside its place and renames it, so that a chunk that exists is
whole. NaN stands for what has not been computed, 0 for parts that an object does not have. `dissimilarity` (M, M) is
made of it in the end.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._files import replacing, vacant, writing
from .._progress import Progress, reporter
from ._blocks import Block, Grid, compared
from ._cohort import LEAST, chosen
from ._matching import Matching
from ._matrix_file import MATRIX_FORMAT, chunks, matrix_attributes
from ._objects import Objects, places
from ._rows import row_maker
from ._settings import require_same, run_settings

_LEAST_PARTS = 64
_COLUMNS = 1024  # of a chunk of the finished matrix


def open_matrix(path: Path | None, objects: Objects, matching: Matching, block: int) -> tuple[MatrixStore, list[int]]:
    """The store of these objects, made or made larger as needed, and where in it each of the objects is.

    Args:
        path: None for a store in memory.

    Raises:
        ValueError: when it is something else, or was made with other objects, settings or blocks, naming the first
            difference.
    """
    from zarr.storage import MemoryStore

    settings = run_settings(objects.extraction, matching)
    if path is None:
        store = MatrixStore(_created(MemoryStore(), objects, settings, block), None)
    else:
        if vacant(path):
            with writing(path), replacing(path) as temporary:
                _created(temporary, objects, settings, block)
        store = _opened(path)
    there = store.attributes
    known = {**there["settings"], "blocks": {"block": there["block"]}}
    for kind, given in {**settings, "blocks": {"block": block}}.items():
        what = (f"{path}: was made", "and is asked for")
        require_same(known[kind], given, what, "use the same settings, or choose another place")
    order, added = places(path, there["names"], there["fingerprints"], objects)
    store.grow(objects.taken(added))
    return store, order


class MatrixStore:
    """All pairs of M objects: what is missing, and how blocks go in.

    Attributes:
        path: the folder; None in memory.
        attributes: of the group.
        counts: (M,) parts of each object.
        grid: the objects in blocks.
    """

    def __init__(self, group: Any, path: Path | None) -> None:
        self.path, self._group = path, group
        self._distances, self._dissimilarity = group["distances"], group["dissimilarity"]
        self._know(dict(group.attrs))

    def _know(self, attributes: dict[str, Any]) -> None:
        self.attributes, self.counts = attributes, np.array(attributes["parts"], np.int64)
        self.grid = Grid(len(self.counts), attributes["block"])

    @property
    def dissimilarity(self) -> np.ndarray:
        """(M, M), when all is there."""
        return np.asarray(self._dissimilarity)

    def grow(self, added: Objects) -> None:
        """Make room for objects behind those that are there. May be stopped at any point: the next call goes on."""
        room = self._distances.shape[1]
        if added.counts.max(initial=0) > room:
            raise ValueError(f"{self.path}: has room for {room} parts an object: make a new one")
        if added.names:
            self._note(_grown(self.attributes, added))
        count = self.grid.objects
        with writing(self.path):
            for array, shape in ((self._distances, (count, room, count)), (self._dissimilarity, (count, count))):
                if array.shape != shape:
                    array.resize(shape)

    def missing(self) -> list[tuple[int, int]]:
        """The pairs of blocks that have to be computed, in part or whole."""
        there, block = chunks(self.path) if self.path else {}, self.grid.block
        # Blocks that had fewer objects once: what was written then does not have them all.
        partial = {size // block for size in self.attributes["sizes"][:-1] if size % block}
        return [
            pair
            for pair in self.grid.pairs
            if not {pair, pair[::-1]} <= there.keys() or (partial & {*pair} and self.wanted(*pair).any())
        ]

    def wanted(self, one: int, other: int) -> np.ndarray:
        """Which objects of two blocks have still to be compared, bool."""
        rows, columns = self.grid.range(one), self.grid.range(other)
        forward, backward = self._cells(rows, columns)[:, 0], self._cells(columns, rows)[:, 0].T
        return compared(rows, columns) & (np.isnan(forward) | np.isnan(backward))

    def put(self, one: int, other: int, block: Block) -> None:
        """Keep what was computed of a pair of blocks."""
        rows, columns = self.grid.range(one), self.grid.range(other)
        forward, backward = self._padded(rows, block.forward), self._padded(columns, block.backward)
        if one == other:
            forward = np.where(np.isnan(forward), backward, forward)
            forward[np.arange(len(rows)), :, np.arange(len(rows))] = 0.0
            self._write(rows, rows, forward)
        else:
            self._write(rows, columns, forward)
            self._write(columns, rows, backward)

    def finish(self, objects: Objects, matching: Matching, progress: Progress = False) -> None:
        """Make the matrix of the distances, a block of rows at a time; a finished one is left as it is."""
        if self.attributes["complete"]:
            return
        report = reporter(progress, "rows", "objects")
        rows_of = row_maker(self._cells, objects, self.grid, self.attributes["cohort"], matching)
        for rows in self.grid.ranges:
            values = rows_of(rows)
            with writing(self.path):
                self._dissimilarity[rows.start : rows.stop] = values
            report(rows.stop, self.grid.objects)
        self._note({**self.attributes, "complete": True})

    def _note(self, attributes: dict[str, Any]) -> None:
        self._know(attributes)
        with writing(self.path):
            self._group.attrs.put(attributes)

    def _cells(self, rows: range, columns: range) -> np.ndarray:
        """Distances (B, C, M2)."""
        try:
            return np.asarray(self._distances[rows.start : rows.stop, :, columns.start : columns.stop])
        except (OSError, MemoryError):
            raise  # The chunk may be sound.
        except Exception as error:  # zarr's codecs raise what they like
            if self.path is None:
                raise
            one, other = rows.start // self.grid.block, columns.start // self.grid.block
            chunk = self.path / "distances" / "c" / str(one) / "0" / str(other)
            chunk.unlink(missing_ok=True)
            raise ValueError(
                f"{chunk} was damaged ({type(error).__name__}) and has been removed: run the same command again"
            ) from error

    def _write(self, rows: range, columns: range, cells: np.ndarray) -> None:
        """What is NaN leaves what is there."""
        cells = np.where(np.isnan(cells), self._cells(rows, columns), cells)
        with writing(self.path):
            self._distances[rows.start : rows.stop, :, columns.start : columns.stop] = cells

    def _padded(self, rows: range, distances: np.ndarray) -> np.ndarray:
        """Distances (P1, M2) of the parts of a block's objects as (B, C, M2)."""
        cells = np.zeros((len(rows), self._distances.shape[1], distances.shape[1]), np.float32)
        cells[np.arange(cells.shape[1]) < self.counts[rows.start : rows.stop, None]] = distances
        return cells


def _opened(path: Path) -> MatrixStore:
    import zarr

    if "sizes" not in matrix_attributes(path):
        raise ValueError(f"{path}: a matrix written by save_matrix cannot be extended: choose another place")
    for leftover in path.rglob("*.partial"):  # What zarr was writing when the process was killed.
        leftover.unlink()
    return MatrixStore(zarr.open_group(path, mode="r+"), path)


def _created(place: Any, objects: Objects, settings: Mapping[str, Any], block: int) -> Any:
    """The group of a matrix that has room for such objects, and has none yet."""
    import zarr

    room = max(_LEAST_PARTS, 1 << (int(objects.counts.max()) - 1).bit_length())
    attributes: Any = {"curvematch_matrix": MATRIX_FORMAT, "settings": dict(settings), "notes": [], "complete": False}
    attributes |= {"block": block, "names": [], "fingerprints": [], "parts": [], "sizes": [], "cohort": []}
    group = zarr.open_group(place, mode="w", attributes=attributes)
    cells: Any = {"shape": (0, room, 0), "chunks": (block, room, block), "dtype": "float32"}
    values: Any = {"shape": (0, 0), "chunks": (block, _COLUMNS), "dtype": "float64"}
    group.create_array("distances", **cells, fill_value=np.nan)
    group.create_array("dissimilarity", **values, fill_value=np.nan)
    return group


def _grown(known: Mapping[str, Any], added: Objects) -> dict[str, Any]:
    """The attributes with objects added. A cohort that is large enough stays as it is."""
    counts, fingerprints = added.counts.tolist(), [*known["fingerprints"], *added.fingerprints]
    lacking = [name for name, count in zip(added.names, counts, strict=True) if not count]
    return {
        **known,
        "names": [*known["names"], *added.names],
        "fingerprints": fingerprints,
        "parts": known["parts"] + counts,
        "notes": known["notes"] + [f"{name} has no feature point" for name in lacking],
        "sizes": [*known["sizes"], len(fingerprints)],
        "cohort": known["cohort"] if len(known["cohort"]) >= LEAST else chosen(fingerprints).tolist(),
        "complete": False,
    }
