"""From what the user names on the command line to parts: meshes are extracted in worker processes, parts are read."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

from .._progress import Progress, reporter
from ..datasets import MESH_SUFFIXES
from ..retrieval import distinct_names, load_parts
from ..surface import Extraction, Parts, extract_parts, load_mesh
from ._workers import in_processes, one_line

PARTS_SUFFIX = ".npz"


@dataclasses.dataclass(frozen=True)
class Source:
    """A file to get parts from, and the name that its object goes by."""

    path: Path
    name: str


@dataclasses.dataclass(frozen=True)
class Failure:
    """An input that gave no parts, and why."""

    name: str
    reason: str


def find_sources(inputs: Sequence[Path]) -> list[Source]:
    """The files that the inputs stand for: folders opened, in the order given, sorted within a folder.

    A folder that holds parts is a parts folder, whatever else is in it. A file in a folder goes by its path in it,
    with more of the path where two would go by the same name.

    Raises:
        ValueError: when a folder holds neither parts nor meshes.
    """
    opened = [(path, given) for given in inputs for path in (_opened(given) if given.is_dir() else [given])]
    paths = [path for path, _ in opened]
    depths = [max(len(path.relative_to(given).parts), 1) for path, given in opened]
    names = distinct_names([_object_path(path) for path in paths], depths)
    return [Source(path, name) for path, name in zip(paths, names, strict=True)]


def gather(
    sources: Sequence[Source], extraction: Extraction, jobs: int, progress: Progress = False
) -> Iterator[tuple[int, Parts | Failure]]:
    """Parts of every source with its index, or why there are none, in the order in which they are ready."""
    report = reporter(progress, "parts", "meshes")
    report(0, len(sources))
    ready = _each(sources, extraction, jobs)
    for done, (index, result) in enumerate(ready, start=1):
        report(done, len(sources))
        yield index, result if isinstance(result, Parts) else Failure(sources[index].name, result)


def gather_all(
    sources: Sequence[Source], extraction: Extraction, jobs: int, progress: Progress = False
) -> tuple[list[Parts], list[Failure]]:
    """As `gather`: all the parts and all the failures, each in the order of the sources."""
    results = dict(gather(sources, extraction, jobs, progress))
    in_order = [results[index] for index in sorted(results)]
    return [r for r in in_order if isinstance(r, Parts)], [r for r in in_order if isinstance(r, Failure)]


def _each(sources: Sequence[Source], extraction: Extraction, jobs: int) -> Iterator[tuple[int, Parts | str]]:
    is_parts = [source.path.suffix == PARTS_SUFFIX for source in sources]
    for index in (i for i, stored in enumerate(is_parts) if stored):
        yield index, _read(sources[index])
    meshes = [i for i, stored in enumerate(is_parts) if not stored]
    for outcome in in_processes(_extract, [(sources[i], extraction) for i in meshes], jobs):
        yield meshes[outcome.task], outcome.result if outcome.failure is None else outcome.failure


def _read(source: Source) -> Parts | str:
    try:
        return dataclasses.replace(load_parts(source.path), name=source.name)
    except (OSError, ValueError) as error:
        return one_line(error)


def _extract(task: tuple[Source, Extraction]) -> Parts:
    source, extraction = task
    return extract_parts(load_mesh(source.path, source.name), extraction)


def _opened(folder: Path) -> list[Path]:
    """The parts in a folder and its folders, or else the meshes there; hidden ones are passed over."""
    inside = sorted(path for path in folder.rglob("*") if not _hidden(path.relative_to(folder)))
    files = [path for path in inside if path.suffix == PARTS_SUFFIX]
    files = files or [path for path in inside if path.suffix.lower() in MESH_SUFFIXES and path.is_file()]
    if not files:
        raise ValueError(f"{folder}: neither meshes ({', '.join(MESH_SUFFIXES)}) nor parts in this folder")
    return files


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _object_path(path: Path) -> Path:
    """The path that names the object: parts of `cat.off` are in `cat.off.npz`."""
    return path.with_suffix("") if path.suffix == PARTS_SUFFIX else path
