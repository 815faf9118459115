"""A dissimilarity matrix on disk that is filled block by block: a zarr group.

`distances` (M, C, M) holds the distance of part c of object i to object j; there are at most C parts. A chunk is a
block of objects by a block of objects. zarr writes it beside its place and renames it, so that a chunk that exists is
whole. NaN stands for what has not been computed, 0 for parts that an object does not have. `dissimilarity` (M, M) is
made of it in the end.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._progress import Progress
from ._blocks import Grid, compared
from ._cohort import LEAST, chosen
from ._files import replacing, writing
from ._matching import Matching
from ._matrix_file import MATRIX_FORMAT, chunks, matrix_attributes, vacant
from ._matrix_table import MatrixTable
from ._objects import Objects, places
from ._settings import first_difference, run_settings

_LEAST_PARTS = 64
_COLUMNS = 1024  # of a chunk of the finished matrix


def open_matrix(
    path: str | os.PathLike[str], objects: Objects, matching: Matching, block: int
) -> tuple[MatrixStore, list[int]]:
    """The store of these objects, made or made larger as needed, and where in it each of the objects is.

    Raises:
        ValueError: when it is something else, or was made with other objects, settings or blocks, naming the first
            difference.
    """
    path = Path(path)
    assert objects.extraction is not None
    settings = run_settings(objects.extraction, matching)
    if vacant(path):
        _create(path, objects, settings, block)
    store = MatrixStore(path)  # Before anything is touched: `path` may be somebody's folder.
    for leftover in path.rglob("*.partial"):  # What zarr was writing when the process was killed.
        leftover.unlink()
    _require_settings(path, store.attributes, {**settings, "blocks": {"block": block}})
    order, added = places(path, store.attributes["names"], store.attributes["fingerprints"], objects)
    store.grow(objects.ordered(added))
    return store, order


class MatrixStore(MatrixTable):
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
            raise ValueError(f"{path}: a matrix written by save_matrix cannot be extended: choose another place")
        self._group = zarr.open_group(path, mode="r+")
        self._open()

    def _open(self) -> None:
        self.counts = np.array(self.attributes["parts"], np.int64)
        self.grid = Grid(len(self.counts), self.attributes["block"])
        self._members = self.attributes["cohort"]
        self._distances: Any = self._group["distances"]
        self._dissimilarity: Any = self._group["dissimilarity"]

    def grow(self, added: Objects) -> None:
        """Make room for objects behind those that are there. May be stopped at any point: the next call goes on."""
        objects = len(self.counts) + len(added.names)
        if added.names:
            if added.counts.max() > self._distances.shape[1]:
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
            for pair in self.grid.pairs
            if not {pair, pair[::-1]} <= there.keys() or (self._was_partial(*pair) and self.wanted(*pair).any())
        ]

    def wanted(self, one: int, other: int) -> np.ndarray:
        """Which objects of two blocks have still to be compared, bool."""
        rows, columns = self.ranges(one, other)
        if not self._was_partial(one, other):
            return compared(rows, columns)
        forward, backward = self._cells(rows, columns)[:, 0], self._cells(columns, rows)[:, 0].T
        return compared(rows, columns) & (np.isnan(forward) | np.isnan(backward))

    def finish(self, objects: Objects, matching: Matching, progress: Progress = False) -> None:
        """Make the matrix of the distances; a finished one is left as it is."""
        if self.attributes["complete"]:
            return
        super().finish(objects, matching, progress)
        self.attributes = {**self.attributes, "complete": True}
        with writing(self.path):
            self._group.attrs.put(self.attributes)

    def _cells(self, rows: range, columns: range) -> np.ndarray:
        try:
            return super()._cells(rows, columns)
        except (OSError, MemoryError):
            raise  # The chunk may be sound.
        except Exception as error:  # zarr's codecs raise what they like
            one, other = rows.start // self.grid.block, columns.start // self.grid.block
            chunk = self.path / "distances" / "c" / str(one) / "0" / str(other)
            chunk.unlink(missing_ok=True)
            raise ValueError(
                f"{chunk} was damaged ({type(error).__name__}) and has been removed: run the same command again"
            ) from error

    def _write(self, rows: range, columns: range, cells: np.ndarray) -> None:
        if self._was_partial(rows.start // self.grid.block, columns.start // self.grid.block):
            cells = np.where(np.isnan(cells), self._cells(rows, columns), cells)
        with writing(self.path):
            super()._write(rows, columns, cells)

    def _write_rows(self, rows: range, values: np.ndarray) -> None:
        with writing(self.path):
            super()._write_rows(rows, values)

    def _was_partial(self, *blocks: int) -> bool:
        """Whether one of the blocks had fewer objects once: what was written then does not have them all."""
        block = self.grid.block
        return any(size % block and size // block in blocks for size in self.attributes["sizes"][:-1])


def _create(path: Path, objects: Objects, settings: Mapping[str, object], block: int) -> None:
    import zarr

    room = max(_LEAST_PARTS, 1 << (int(objects.counts.max()) - 1).bit_length())
    empty = {"curvematch_matrix": MATRIX_FORMAT, "settings": dict(settings), "notes": [], "complete": False}
    empty |= {"block": block, "names": [], "fingerprints": [], "parts": [], "sizes": [], "cohort": []}
    count = len(objects.names)
    with writing(path), replacing(path) as temporary:
        group = zarr.open_group(temporary, mode="w", attributes=_attributes(empty, objects))
        group.create_array(
            "distances", shape=(count, room, count), chunks=(block, room, block), dtype="float32", fill_value=np.nan
        )
        group.create_array(
            "dissimilarity", shape=(count, count), chunks=(block, _COLUMNS), dtype="float64", fill_value=np.nan
        )


def _attributes(known: Mapping[str, Any], added: Objects) -> dict[str, Any]:
    """The attributes with objects added. A cohort that is large enough stays as it is."""
    counts, fingerprints = added.counts.tolist(), known["fingerprints"] + added.fingerprints
    lacking = [name for name, count in zip(added.names, counts, strict=True) if not count]
    return {
        **known,
        "names": known["names"] + added.names,
        "fingerprints": fingerprints,
        "parts": known["parts"] + counts,
        "notes": known["notes"] + [f"{name} has no feature point" for name in lacking],
        "sizes": [*known["sizes"], len(fingerprints)],
        "cohort": known["cohort"] if len(known["cohort"]) >= LEAST else chosen(fingerprints).tolist(),
        "complete": False,
    }


def _require_settings(path: Path, attributes: Mapping[str, Any], given: Mapping[str, Any]) -> None:
    there = {**attributes["settings"], "blocks": {"block": attributes["block"]}}
    for kind in given:
        different = first_difference(there[kind], given[kind])
        if different:
            name, one, other = different
            raise ValueError(
                f"{path}: was made with {name} = {one!r}, and {name} = {other!r} was asked for ({kind}): "
                "use the same settings, or choose another place"
            )
