"""Dissimilarity matrices on disk, as zarr groups: whole ones written, any read or asked how far they are."""

from __future__ import annotations

import dataclasses
import math
import os
import warnings
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from .._files import because, replacing, short, vacant, writing
from .._given import wrong_type
from ._blocks import Grid

MATRIX_FORMAT = 4

# Blocks that the rate is taken from: the last ones, so that a stop a week ago does not count.
_RECENT = 50
# What attributes there are, and of which kind; lists are of texts.
_KINDS: dict[str, type] = {"names": list, "settings": dict, "notes": list, "complete": bool}
_LARGEST_CHUNK = 1 << 24


@dataclasses.dataclass(frozen=True, eq=False)
class SavedMatrix:
    """A dissimilarity matrix with what is needed to read it.

    Attributes:
        dissimilarity: (M, M), rows are queries.
        names: of the M objects.
        settings: what the matrix was made with: `extraction` and `matching`, each a setting a name.
        notes: remarks on objects, such as those without feature points.
    """

    dissimilarity: np.ndarray
    names: tuple[str, ...]
    settings: Mapping[str, object]
    notes: tuple[str, ...] = ()


def refuse_saved(name: str, value: object) -> None:
    """`ValueError` for a saved matrix where its values are needed."""
    if isinstance(value, SavedMatrix):
        raise wrong_type(name, value, "give its values, saved.dissimilarity")


@dataclasses.dataclass(frozen=True)
class MatrixStatus:
    """How far a matrix has come that is filled block by block.

    Attributes:
        names: of the objects, in the matrix's order.
        notes: remarks on objects, such as those without feature points.
        done, left: pairs of blocks.
        complete: whether the matrix can be read.
        rate: pairs of blocks a second, of the last ones; None where there are too few to tell.
        seconds_left: at that rate.
    """

    names: tuple[str, ...]
    notes: tuple[str, ...]
    done: int
    left: int
    complete: bool
    rate: float | None

    @property
    def seconds_left(self) -> float | None:
        return self.left / self.rate if self.rate else None


def save_matrix(saved: SavedMatrix, path: str | os.PathLike[str]) -> None:
    """Write a matrix with its names and settings as a zarr group.

    Raises:
        ValueError: when `path` exists and is not a matrix of ours; a matrix of ours is replaced.
    """
    import zarr

    path = Path(path)
    if not vacant(path):
        matrix_attributes(path)
    attributes: Any = {
        "curvematch_matrix": MATRIX_FORMAT,
        "names": list(saved.names),
        "settings": dict(saved.settings),
        "notes": list(saved.notes),
        "complete": True,
    }
    with writing(path), replacing(path) as temporary:
        group = zarr.open_group(temporary, mode="w", attributes=attributes)
        group.create_array("dissimilarity", data=saved.dissimilarity.astype(np.float64, order="C"), fill_value=np.nan)


def load_matrix(path: str | os.PathLike[str]) -> SavedMatrix:
    """Read a finished matrix.

    Raises:
        FileNotFoundError: when there is nothing at `path`.
        ValueError: when it is something else, damaged, of another format, or not finished.
    """
    path = Path(path)
    attributes = matrix_attributes(path)
    if not attributes["complete"]:
        status = matrix_status(path)
        raise ValueError(
            f"{path}: the matrix is not finished, {status.done} of {status.done + status.left} blocks are done: "
            "run the command that made it again"
        )
    try:
        values = _values(path, len(attributes["names"]))
    except Exception as error:  # zarr's stores and codecs raise what they like
        raise ValueError(f"{path}: the matrix is damaged ({short(error)})") from error
    return SavedMatrix(values, tuple(attributes["names"]), attributes["settings"], tuple(attributes["notes"]))


def matrix_status(path: str | os.PathLike[str]) -> MatrixStatus:
    """How far a matrix has come, from the names and times of its files alone; it may be being filled.

    After objects have been added, a block that had room for some of them counts as done before they are in it.

    Raises:
        FileNotFoundError: when there is nothing at `path`.
        ValueError: when it is something else, or of another format.
    """
    attributes = matrix_attributes(Path(path))
    names, there = tuple(attributes["names"]), chunks(Path(path))
    pairs = Grid(len(names), attributes["block"]).pairs if "sizes" in attributes else []
    times = sorted(max(there[i, j], there[j, i]) for i, j in pairs if {(i, j), (j, i)} <= there.keys())
    recent = times[-_RECENT:]
    lasted = recent[-1] - recent[0] if recent else 0.0
    rate = (len(recent) - 1) / lasted if lasted > 0 else None
    left, complete = len(pairs) - len(times), bool(attributes["complete"])
    return MatrixStatus(names, tuple(attributes["notes"]), len(times), left, complete, rate)


def matrix_attributes(path: Path) -> dict[str, Any]:
    """The attributes of a matrix of ours.

    Raises:
        FileNotFoundError: when there is nothing at `path`.
        ValueError: when it is something else, or of another format.
    """
    import zarr

    if not path.exists():
        raise FileNotFoundError(f"{path}: no such matrix")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # About files that are not zarr's.
            attributes: dict[str, Any] = dict(zarr.open_group(path, mode="r").attrs)
    except Exception as error:  # zarr's stores raise what they like
        raise ValueError(f"{path}: not a curvematch matrix{because(error)}") from error
    if "curvematch_matrix" not in attributes:
        raise ValueError(f"{path}: not a curvematch matrix")
    if attributes["curvematch_matrix"] != MATRIX_FORMAT:
        raise ValueError(
            f"{path}: the matrix has format {attributes['curvematch_matrix']}, but this version reads format "
            f"{MATRIX_FORMAT}: compute it again"
        )
    for name, kind in _KINDS.items():
        value: Any = attributes.get(name)
        if not isinstance(value, kind) or (kind is list and not all(isinstance(each, str) for each in value)):
            raise ValueError(f"{path}: the matrix is damaged: its {name} are something else")
    return attributes


def chunks(path: Path) -> dict[tuple[int, int], float]:
    """The blocks of distances that have been written, and when."""
    found = {}
    for chunk in (path / "distances" / "c").glob("*/0/*"):
        if chunk.name.isdecimal():
            with suppress(FileNotFoundError):  # Being filled, or mended.
                found[int(chunk.parent.parent.name), int(chunk.name)] = chunk.stat().st_mtime
    return found


def _values(path: Path, count: int) -> np.ndarray:
    """The finished matrix of so many objects; raises whatever when it is damaged."""
    import zarr

    array: Any = zarr.open_group(path, mode="r")["dissimilarity"]
    # Before anything is read: a few bytes can claim to be any number of values.
    if tuple(array.shape) != (count, count) or np.dtype(array.dtype).kind != "f":
        raise ValueError(f"{count} names, values of shape {tuple(array.shape)} and type {array.dtype}")
    if not 0 < math.prod(array.chunks) <= _LARGEST_CHUNK:
        raise ValueError(f"its chunks have {array.chunks} values")
    lacking = array.nchunks - array.nchunks_initialized
    if lacking:
        raise ValueError(f"it lacks {lacking} of {array.nchunks} chunks")
    values = np.asarray(array)
    if not np.isfinite(values).all():
        raise ValueError("it holds values that are not finite")
    return values
