"""Matrices on disk, as zarr groups, and the names of objects."""

from __future__ import annotations

import dataclasses
import os
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._files import replacing

MATRIX_FORMAT = 1


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
    with replacing(path) as temporary:
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
