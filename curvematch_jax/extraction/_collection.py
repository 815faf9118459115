"""Many files to parts: meshes are extracted in worker processes and kept in a folder, parts are read."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from .._given import wrong_type
from .._progress import Progress, reporter
from ..retrieval import load_parts
from ..surface import Extraction, Parts, extract_parts, load_mesh
from ._kept import Store, mesh_key
from ._sources import Source, find_sources, is_parts
from ._workers import TIME_LIMIT, cores, in_processes, one_line

_DEFAULT = Extraction()


@dataclasses.dataclass(frozen=True)
class Failure:
    """An input that gave no parts, and why."""

    name: str
    reason: str


@dataclasses.dataclass(frozen=True)
class Extracted:
    """The parts of a collection of files, and the files that gave none.

    Attributes:
        parts: of every file that gave any, in the order of the files.
        failures: the files that gave none, and why.
        computed: how many were made now; the others were in the cache, or parts already.
        notes: which files of the cache could not be used, and why.
    """

    parts: tuple[Parts, ...]
    failures: tuple[Failure, ...]
    computed: int
    notes: tuple[str, ...]


def extract_collection(
    paths: Sequence[str | os.PathLike[str]],
    extraction: Extraction = _DEFAULT,
    *,
    jobs: int | None = None,
    cache: str | os.PathLike[str] | None = None,
    progress: Progress = False,
    time_limit: float = TIME_LIMIT,
) -> Extracted:
    """Extract the parts of many meshes in worker processes. A mesh that fails is reported; the others are not affected.

    The workers are started anew (never forked), so a script that calls this does so below `if __name__ == "__main__":`.

    Args:
        paths: mesh files, parts files, and folders of either. An object is named after its file, with as much of the
            path as tells it from others.
        jobs: worker processes; by default one for each core. On Linux each has its share of the memory.
        cache: a folder of parts, one file per mesh, identified by the content of the mesh: a mesh whose parts are there
            is not processed again, even under another name. `None` keeps nothing.
        progress: `True` for a bar on stderr, or a function of `(done, total)`.
        time_limit: seconds that one mesh may take.

    Raises:
        ValueError: `paths` is a single path, a folder holds neither meshes nor parts, the cache holds parts made with
            other settings, or `jobs` or `time_limit` is not positive.
    """
    if isinstance(paths, str | os.PathLike):
        raise wrong_type("paths", paths, "give a list of files and folders, e.g. [path]")
    if jobs is not None and jobs < 1:
        raise ValueError(f"jobs must be at least 1, found {jobs}")
    if not time_limit > 0:
        raise ValueError(f"time_limit must be more than 0 seconds, found {time_limit}")
    sources = find_sources([Path(path) for path in paths])
    store = None if cache is None else Store(Path(cache), extraction)
    results = dict(extract_each(sources, extraction, jobs or cores(), progress, store, time_limit))
    in_order = [results[index] for index in sorted(results)]
    parts = tuple(result for result in in_order if isinstance(result, Parts))
    read = sum(is_parts(sources[index].path) for index, result in results.items() if isinstance(result, Parts))
    return Extracted(
        parts,
        tuple(result for result in in_order if isinstance(result, Failure)),
        len(parts) - read - (len(store.found) if store else 0),
        tuple(store.notes) if store else (),
    )


def extract_each(
    sources: Sequence[Source],
    extraction: Extraction,
    jobs: int,
    progress: Progress = False,
    store: Store | None = None,
    seconds: float = TIME_LIMIT,
) -> Iterator[tuple[int, Parts | Failure]]:
    """Parts of every source with its index, or why there are none, in the order in which they are ready.

    Args:
        store: where parts of meshes are looked for, and kept as soon as they are made; made with `extraction`.
        seconds: how long the extraction of one mesh may take.
    """
    report = reporter(progress, "parts", "meshes")
    report(0, len(sources))
    ready = _each(sources, extraction, jobs, store, seconds)
    for done, (index, result) in enumerate(ready, start=1):
        report(done, len(sources))
        yield index, result if isinstance(result, Parts) else Failure(sources[index].name, result)


def _each(
    sources: Sequence[Source], extraction: Extraction, jobs: int, store: Store | None, seconds: float
) -> Iterator[tuple[int, Parts | str]]:
    missing = []
    for index, source in enumerate(sources):
        if is_parts(source.path):
            yield index, _read(source)
        elif store is not None and (parts := store.find(source.path, source.name)) is not None:
            yield index, parts
        else:
            missing.append(index)
    for outcome in in_processes(_extract, [(sources[i], extraction) for i in missing], jobs, seconds):
        if outcome.failure is not None:
            yield missing[outcome.task], outcome.failure
            continue
        parts, key = outcome.result
        if store is not None:
            store.keep(parts, key)
        yield missing[outcome.task], parts


def _read(source: Source) -> Parts | str:
    try:
        return dataclasses.replace(load_parts(source.path), name=source.name)
    except (OSError, ValueError) as error:
        return one_line(error)


def _extract(task: tuple[Source, Extraction]) -> tuple[Parts, str]:
    """Parts, and the key of the mesh file."""
    source, extraction = task
    key = mesh_key(source.path, extraction)
    mesh = load_mesh(source.path, source.name)
    if mesh_key(source.path, extraction) != key:
        raise ValueError(f"{source.path}: the file was changed while it was read: run the command again")
    return extract_parts(mesh, extraction), key
