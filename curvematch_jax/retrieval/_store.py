"""Parts and matrices on disk.

Parts are `.npz` files that hold plain arrays only: reading one never runs code. A matrix is a zarr group. Both are
written beside their place under a temporary name and then renamed, so that a file that exists is a whole one.
"""

from __future__ import annotations

import dataclasses
import json
import os
import tempfile
import zipfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..surface import Extraction, Parts

PARTS_FORMAT = 2
MATRIX_FORMAT = 1

_ARRAYS = ("curves", "mask", "lengths", "fronts", "centres", "areas", "points", "between")
_FIELDS = (*_ARRAYS, "name", "area", "diameter", "settings", "notes")


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


def save_parts(parts: Parts, path: str | os.PathLike[str]) -> None:
    """Write parts to a `.npz` file, replacing what is there; folders are made as needed."""
    fields: dict[str, Any] = {name: getattr(parts, name) for name in _ARRAYS}
    fields |= {
        "format": PARTS_FORMAT,
        "name": parts.name,
        "area": parts.area,
        "diameter": parts.diameter,
        "settings": json.dumps(dataclasses.asdict(parts.settings)),
        "notes": json.dumps(parts.notes),
    }
    with _replacing(Path(path)) as temporary, temporary.open("wb") as file:
        np.savez(file, **fields)


def load_parts(path: str | os.PathLike[str]) -> Parts:
    """Read parts that `save_parts` has written.

    Raises:
        FileNotFoundError: when there is no such file.
        ValueError: when the file is damaged, is something else, or was written in another format.
    """
    path = Path(path)
    fields = _read_npz(path)
    if "format" not in fields or fields["format"].size != 1:
        raise ValueError(f"{path}: not a parts file: it has no format number")
    if int(fields["format"]) != PARTS_FORMAT:
        raise ValueError(
            f"{path}: parts of format {int(fields['format'])}, and this version reads format {PARTS_FORMAT}: "
            "extract them again"
        )
    missing = [name for name in _FIELDS if name not in fields]
    if missing:
        raise ValueError(f"{path}: not a whole parts file: it lacks {', '.join(missing)}")
    try:
        return _parts_from(fields)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: not a sound parts file: {error}") from error


def load_collection(paths: Iterable[str | os.PathLike[str]]) -> list[Parts]:
    """Read several parts files that were made with the same settings.

    Raises:
        ValueError: as `load_parts`, and when two files were made with different settings, naming the setting.
    """
    collection = [load_parts(path) for path in paths]
    require_same_settings(collection)
    return collection


def require_same_settings(collection: Sequence[Parts]) -> None:
    """Refuse parts that can't be compared.

    Raises:
        ValueError: when two were extracted with different settings, naming the first setting that differs.
    """
    for parts in collection[1:]:
        first, other = (dataclasses.asdict(p.settings) for p in (collection[0], parts))
        for name, value in first.items():
            if other[name] != value:
                raise ValueError(
                    f"parts of {parts.name or 'an object'} were extracted with {name} = {other[name]!r}, those of "
                    f"{collection[0].name or 'the first'} with {name} = {value!r}: extract both with the same settings"
                )


def save_matrix(saved: SavedMatrix, path: str | os.PathLike[str]) -> None:
    """Write a matrix with its names and settings as a zarr group.

    Raises:
        ValueError: when `path` exists and is not a matrix of ours; a matrix of ours is replaced.
    """
    import zarr

    path = Path(path)
    require_place_for_matrix(path)
    attributes: Any = {
        "curvematch_matrix": MATRIX_FORMAT,
        "names": list(saved.names),
        "settings": dict(saved.settings),
        "notes": list(saved.notes),
    }
    with _replacing(path) as temporary:
        group = zarr.open_group(temporary, mode="w", attributes=attributes)
        group.create_array("dissimilarity", data=np.ascontiguousarray(saved.dissimilarity))


def require_place_for_matrix(path: str | os.PathLike[str]) -> None:
    """Refuse a path where a matrix would take the place of something else: `ValueError`. Ask before long work."""
    if Path(path).exists():
        _matrix_attributes(Path(path))


def load_matrix(path: str | os.PathLike[str]) -> SavedMatrix:
    """Read a matrix that `save_matrix` has written.

    Raises:
        FileNotFoundError: when there is nothing at `path`.
        ValueError: when it is something else, damaged, or of another format.
    """
    import zarr

    path = Path(path)
    attributes = _matrix_attributes(path)
    if attributes["curvematch_matrix"] != MATRIX_FORMAT:
        raise ValueError(
            f"{path}: a matrix of format {attributes['curvematch_matrix']}, and this version reads {MATRIX_FORMAT}"
        )
    try:
        values = np.asarray(zarr.open_group(path, mode="r")["dissimilarity"])
    except Exception as error:  # zarr's stores and codecs raise what they like
        raise ValueError(f"{path}: the matrix is damaged: {error}") from error
    names = tuple(attributes["names"])
    if values.shape != (len(names), len(names)):
        raise ValueError(f"{path}: the matrix is damaged: {len(names)} names, values of shape {values.shape}")
    return SavedMatrix(values, names, attributes["settings"], tuple(attributes["notes"]))


def distinct_names(paths: Sequence[str | os.PathLike[str]], least: int | Sequence[int] = 1) -> list[str]:
    """The shortest end of each path that tells it from the others.

    A file's own name if no other file has it; with as many of its folders as it takes if another does. The same file
    given again gets `#2`, `#3`.

    Arguments:
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


def _read_npz(path: Path) -> dict[str, np.ndarray]:
    if path.is_dir():
        raise ValueError(f"{path}: a folder, and one parts file is needed")
    try:
        # Opened here: numpy forgets to close a file that turns out to be no archive.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return {name: np.asarray(archive[name]) for name in archive.files}
    except FileNotFoundError:
        raise
    except (OSError, ValueError, EOFError, TypeError, AttributeError, MemoryError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path}: not a parts file, or a damaged one ({type(error).__name__}: {error})") from error


def _parts_from(fields: Mapping[str, np.ndarray]) -> Parts:
    arrays = {name: fields[name] for name in _ARRAYS}
    settings = Extraction(**json.loads(str(fields["settings"])))
    _check_arrays(arrays, settings)
    return Parts(
        name=str(fields["name"]),
        **arrays,
        area=float(fields["area"]),
        diameter=float(fields["diameter"]),
        settings=settings,
        notes=tuple(json.loads(str(fields["notes"]))),
    )


def _check_arrays(arrays: Mapping[str, np.ndarray], settings: Extraction) -> None:
    count, levels = len(arrays["areas"]), settings.levels
    shapes = {
        "curves": (count, levels, 3, settings.samples),
        "mask": (count, levels),
        "lengths": (count, levels),
        "fronts": (count, levels),
        "centres": (count, levels, 3),
        "areas": (count,),
        "points": (count, 3),
        "between": (count, count),
    }
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise ValueError(f"{name} has shape {arrays[name].shape}, and {shape} was expected")
        if not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} holds values that are not finite")


def _matrix_attributes(path: Path) -> dict:
    """The attributes of a matrix of ours; `ValueError` when it is something else."""
    import zarr

    if not path.exists():
        raise FileNotFoundError(f"{path}: no such matrix")
    try:
        attributes = dict(zarr.open_group(path, mode="r").attrs)
    except Exception as error:  # zarr's stores raise what they like
        raise ValueError(f"{path}: not a curvematch matrix ({type(error).__name__})") from error
    missing = {"curvematch_matrix", "names", "settings", "notes"} - attributes.keys()
    if missing:
        raise ValueError(f"{path}: not a curvematch matrix: it lacks {', '.join(sorted(missing))}")
    return attributes


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A path to write to, a file or a folder, that takes the place of `path` if all goes well and vanishes if not."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
        temporary = Path(folder) / "new"
        yield temporary
        if path.is_dir():
            # A folder can't be renamed onto one that is not empty.
            path.rename(Path(folder) / "old")
        os.replace(temporary, path)
