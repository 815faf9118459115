"""Dissimilarity matrices on disk, as zarr groups: whole ones written, any read; and the names of objects."""

from __future__ import annotations

import dataclasses
import math
import os
import warnings
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ._blocks import Grid
from ._files import replacing, writing

MATRIX_FORMAT = 3

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
        values = np.ascontiguousarray(saved.dissimilarity, np.float64)
        group.create_array("dissimilarity", data=values, fill_value=np.nan)


def load_matrix(path: str | os.PathLike[str]) -> SavedMatrix:
    """Read a finished matrix.

    Raises:
        FileNotFoundError: when there is nothing at `path`.
        ValueError: when it is something else, damaged, of another format, or not finished.
    """
    import zarr

    path = Path(path)
    attributes = matrix_attributes(path)
    if not attributes["complete"]:
        status = matrix_status(path)
        raise ValueError(
            f"{path}: the matrix is not finished, {status.done} of {status.done + status.left} blocks are done: "
            "run the command that made it again"
        )
    names = tuple(attributes["names"])
    try:
        array: Any = zarr.open_group(path, mode="r")["dissimilarity"]
        shape, kind = tuple(array.shape), np.dtype(array.dtype).kind
    except Exception as error:  # zarr's stores and codecs raise what they like
        raise ValueError(f"{path}: the matrix is damaged ({type(error).__name__})") from error
    # Before anything is read: a few bytes can claim to be any number of values.
    if shape != (len(names), len(names)) or kind != "f":
        raise ValueError(f"{path}: the matrix is damaged: {len(names)} names, values of shape {shape} and kind {kind}")
    if not 0 < math.prod(array.chunks) <= _LARGEST_CHUNK:
        raise ValueError(f"{path}: the matrix is damaged: its chunks have {array.chunks} values")
    lacking = array.nchunks - array.nchunks_initialized
    if lacking:
        raise ValueError(f"{path}: the matrix is damaged: it lacks {lacking} of {array.nchunks} chunks")
    try:
        values = np.asarray(array)
    except Exception as error:
        raise ValueError(f"{path}: the matrix is damaged ({type(error).__name__})") from error
    if not np.isfinite(values).all():
        raise ValueError(f"{path}: the matrix is damaged: it holds values that are not finite")
    return SavedMatrix(values, names, attributes["settings"], tuple(attributes["notes"]))


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
    both = [((i, j), (j, i)) for i, j in pairs]
    times = sorted(max(there[one], there[other]) for one, other in both if one in there and other in there)
    recent = times[-_RECENT:]
    lasted = recent[-1] - recent[0] if recent else 0.0
    rate = (len(recent) - 1) / lasted if lasted > 0 else None
    left, complete = len(pairs) - len(times), bool(attributes["complete"])
    return MatrixStatus(names, tuple(attributes["notes"]), len(times), left, complete, rate)


def distinct_names(paths: Sequence[str | os.PathLike[str]], least: int | Sequence[int] = 1) -> list[str]:
    """The shortest end of each path that tells it from the others.

    A file's own name if no other file has it; with as many of its folders as it takes if another does. The same file
    given again gets `#2`, `#3`.

    Args:
        least: how many pieces of the path a name has at least, for all or for each.
    """
    whole = [Path(path).resolve().parts for path in paths]
    namesakes: defaultdict[str, set[tuple[str, ...]]] = defaultdict(set)
    for parts in whole:
        namesakes[parts[-1]].add(parts)
    seen: Counter[tuple[str, ...]] = Counter()
    names = []
    for parts, shortest in zip(whole, np.broadcast_to(least, len(whole)).tolist(), strict=True):
        others = namesakes[parts[-1]] - {parts}
        length = next(n for n in range(shortest, len(parts) + 1) if all(other[-n:] != parts[-n:] for other in others))
        seen[parts] += 1
        names.append("/".join(parts[-length:]) + (f"#{seen[parts]}" if seen[parts] > 1 else ""))
    return names


def vacant(path: Path) -> bool:
    """Whether there is nothing at a path, or an empty folder: a matrix may be made there."""
    return not path.exists() or (path.is_dir() and not any(path.iterdir()))


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
        raise ValueError(f"{path}: not a curvematch matrix ({type(error).__name__})") from error
    if "curvematch_matrix" not in attributes:
        raise ValueError(f"{path}: not a curvematch matrix")
    if attributes["curvematch_matrix"] != MATRIX_FORMAT:
        raise ValueError(
            f"{path}: the matrix has format {attributes['curvematch_matrix']}, but this version reads format "
            f"{MATRIX_FORMAT}: compute it again"
        )
    missing = _KINDS.keys() - attributes.keys()
    if missing:
        raise ValueError(f"{path}: an incomplete curvematch matrix: it lacks {', '.join(sorted(missing))}")
    for name, kind in _KINDS.items():
        value = attributes[name]
        texts = value if kind is list else []
        if not isinstance(value, kind) or not all(isinstance(each, str) for each in texts):
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
