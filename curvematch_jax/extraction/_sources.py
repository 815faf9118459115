"""What the user names, files and folders, to the files that are read, each with the name of its object."""

from __future__ import annotations

import dataclasses
import os
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..datasets import MESH_SUFFIXES
from ._kept import PARTS_SUFFIX, is_from


@dataclasses.dataclass(frozen=True)
class Source:
    """A file to get parts from, and the name that its object goes by."""

    path: Path
    name: str


def is_parts(path: Path) -> bool:
    """Whether a file holds parts, and not a mesh."""
    return path.suffix.lower() == PARTS_SUFFIX


def find_sources(inputs: Sequence[Path], meshes_only: bool = False) -> list[Source]:
    """The files that the inputs stand for: folders opened, in the order given, sorted within a folder.

    A folder that holds parts is a parts folder, whatever else is in it, unless meshes alone are looked for. A file in
    a folder goes by its path in it, with more of the path where two would go by the same name. A mesh is left out where
    its parts are given under its name, unless meshes alone are looked for.

    Raises:
        ValueError: when a folder holds nothing of what is looked for.
    """
    opened = [(path, given) for given in inputs for path in _opened(given, meshes_only)]
    opened = opened if meshes_only else _once(opened)
    paths = [path for path, _ in opened]
    depths = [max(len(path.relative_to(given).parts), 1) for path, given in opened]
    names = distinct_names([_object_path(path) for path in paths], depths)
    return [Source(path, name) for path, name in zip(paths, names, strict=True)]


def distinct_names(paths: Sequence[str | os.PathLike[str]], pieces: int | Sequence[int] = 1) -> list[str]:
    """The shortest end of each path that tells it from the others.

    A file's own name if no other file has it; with as many of its folders as it takes if another does. The same file
    given again gets `#2`, `#3`.

    Args:
        pieces: how many pieces of the path a name has at least, for all or for each.
    """
    whole = [Path(path).resolve().parts for path in paths]
    namesakes: defaultdict[str, set[tuple[str, ...]]] = defaultdict(set)
    for parts in whole:
        namesakes[parts[-1]].add(parts)
    seen: Counter[tuple[str, ...]] = Counter()
    names = []
    for parts, shortest in zip(whole, np.broadcast_to(pieces, len(whole)).tolist(), strict=True):
        others = namesakes[parts[-1]] - {parts}
        length = next(n for n in range(shortest, len(parts) + 1) if all(other[-n:] != parts[-n:] for other in others))
        seen[parts] += 1
        names.append("/".join(parts[-length:]) + (f"#{seen[parts]}" if seen[parts] > 1 else ""))
    return names


def find_meshes(folder: Path, names: Sequence[str]) -> dict[str, Path]:
    """The mesh files in a folder by the names of the objects, for those names that one file there fits.

    A file fits a name that is the end of its path, with or without its suffix.

    Raises:
        ValueError: when there is no such folder, or no file in it fits any name.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder} is not a folder of meshes")
    fitting: defaultdict[str, list[Path]] = defaultdict(list)
    for path in _files(folder, MESH_SUFFIXES):
        parts = path.relative_to(folder).parts
        for k in range(len(parts)):
            end = Path(*parts[k:])
            for name in (end, end.with_suffix("")):
                fitting[name.as_posix()].append(path)
    found = {name: fitting[name][0] for name in names if len(fitting[name]) == 1}
    if not found:
        raise ValueError(f"{folder}: no mesh in this folder has the name of an object, such as {names[0]}")
    return found


def _opened(given: Path, meshes_only: bool) -> list[Path]:
    """The parts in a folder and its folders, or else the meshes there; hidden ones are passed over. Or the file."""
    if not given.is_dir():
        return [given]
    suffixes = ", ".join(MESH_SUFFIXES)
    if meshes_only:
        wanted, files = f"no meshes ({suffixes})", _files(given, MESH_SUFFIXES)
    else:
        wanted = f"neither meshes ({suffixes}) nor parts"
        files = _files(given, [PARTS_SUFFIX]) or _files(given, MESH_SUFFIXES)
    if not files:
        raise ValueError(f"{given}: {wanted} in this folder")
    return files


def _once(opened: Sequence[tuple[Path, Path]]) -> list[tuple[Path, Path]]:
    """Without the meshes whose parts are there, too."""
    parts: defaultdict[str, list[Path]] = defaultdict(list)
    for path, _ in opened:
        if is_parts(path):
            parts[_object_path(path).name].append(path)
    return [
        (path, given)
        for path, given in opened
        if is_parts(path) or not any(is_from(own, path) for own in parts.get(path.name, ()))
    ]


def _files(folder: Path, suffixes: Sequence[str]) -> list[Path]:
    inside = sorted(path for path in folder.rglob("*") if not _hidden(path.relative_to(folder)))
    return [path for path in inside if path.suffix.lower() in suffixes and path.is_file()]


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _object_path(path: Path) -> Path:
    """The path that names the object: parts of `cat.off` are in `cat.off.npz`."""
    return path.with_suffix("") if is_parts(path) else path
