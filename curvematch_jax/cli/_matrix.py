"""The work of `curvematch matrix` and `index`, from checked arguments to its exit status."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from .._files import vacant
from .._words import counted
from ..extraction import Failure
from ..extraction._collection import extract_each
from ..extraction._kept import Store
from ..extraction._sources import Source, find_sources, is_parts
from ..retrieval import Matching, StoredParts, build_index, build_matrix, matrix_status, run_settings
from ..retrieval._executors import connect
from ..surface import Extraction
from ._commands import SOME_FAILED, report_failures
from ._output import Output


def make_matrix(
    inputs: Sequence[Path],
    out: Path,
    extraction: Extraction,
    matching: Matching,
    jobs: int,
    scheduler: str | None,
    strict: bool,
    output: Output,
) -> int:
    """Meshes or parts to a dissimilarity matrix, or what is missing of it; parts of meshes are kept beside it."""
    started = time.perf_counter()
    present = 0 if vacant(out) else matrix_status(out).done  # Asked before long work: something else may be there.
    sources = find_sources(inputs)
    paths, failed = _stored(sources, out.with_suffix(".parts"), extraction, jobs, output)
    report_failures(failed, len(paths), output)
    parts = StoredParts(list(paths.values()), [sources[index].name for index in paths])
    extracted = time.perf_counter()
    with ExitStack() as stack:
        client = stack.enter_context(connect(scheduler)) if scheduler else None
        build_matrix(parts, out, matching, output.progress, client)
    seconds = {"parts": extracted - started, "matrix": time.perf_counter() - extracted}
    status = matrix_status(out)
    for note in status.notes:
        output.note(f"{note} and comes last in every ranking")
    blocks = {"computed": status.done - present, "present": present}
    output.result(
        f"{counted(len(parts), 'object')}: matrix in {out}, {counted(blocks['computed'], 'block')} computed and "
        f"{present} there already "
        f"(parts {seconds['parts']:.1f} s, matrix {seconds['matrix']:.1f} s)",
        {
            "out": str(out),
            "objects": list(status.names),
            "without_parts": [note.removesuffix(" has no feature point") for note in status.notes],
            "blocks": blocks,
            "failed": [dataclasses.asdict(failure) for failure in failed],
            "settings": run_settings(parts[0].settings, matching),
            "seconds": seconds,
        },
    )
    return SOME_FAILED if failed and strict else 0


def make_index(
    inputs: Sequence[Path],
    out: Path,
    extraction: Extraction,
    matching: Matching,
    jobs: int,
    strict: bool,
    output: Output,
) -> int:
    """Meshes or parts to an index, or what is new into it; parts of meshes are kept beside it."""
    started = time.perf_counter()
    sources = find_sources(inputs)
    paths, failed = _stored(sources, out.with_suffix(".parts"), extraction, jobs, output)
    report_failures(failed, len(paths), output)
    parts = StoredParts(list(paths.values()), [sources[index].name for index in paths])
    added = build_index(parts, out, matching, output.progress)
    seconds = time.perf_counter() - started
    output.result(
        f"{counted(len(parts), 'object')}: index in {out}, {added} of them new ({seconds:.1f} s)",
        {
            "out": str(out),
            "objects": len(parts),
            "added": added,
            "failed": [dataclasses.asdict(failure) for failure in failed],
            "settings": run_settings(parts[0].settings, matching),
            "seconds": seconds,
        },
    )
    return SOME_FAILED if failed and strict else 0


def show_status(out: Path, output: Output) -> int:
    """How far a matrix has come; another process may be at work on it."""
    status = matrix_status(out)
    blocks = counted(status.done + status.left, "block")
    text = f"{counted(len(status.names), 'object')}: {status.done} of {blocks} done"
    if status.rate:
        text += f", {status.rate:.3g} a second"
    if status.seconds_left is not None and status.left:
        text += f", {_duration(status.seconds_left)} left at that rate"
    if not status.left:
        text += ", finished" if status.complete else ", the matrix is still to be made of them"
    output.result(
        text,
        {
            "out": str(out),
            "objects": len(status.names),
            "done": status.done,
            "left": status.left,
            "complete": status.complete,
            "blocks_per_second": status.rate,
            "seconds_left": status.seconds_left,
        },
    )
    return 0


def _stored(
    sources: Sequence[Source], folder: Path, extraction: Extraction, jobs: int, output: Output
) -> tuple[dict[int, Path], list[Failure]]:
    """The parts file of each source, made where there was a mesh, and which sources have none."""
    store = None if all(is_parts(source.path) for source in sources) else Store(folder, extraction)
    paths: dict[int, Path] = {}
    failures: dict[int, Failure] = {}
    for index, result in extract_each(sources, extraction, jobs, output.progress, store):
        if isinstance(result, Failure):
            failures[index] = result
        elif store is None or is_parts(sources[index].path):
            paths[index] = sources[index].path
        else:
            paths[index] = store.path(result.name)
    for note in store.notes if store else ():
        output.note(note)
    return {k: paths[k] for k in sorted(paths)}, [failures[k] for k in sorted(failures)]


def _duration(seconds: float) -> str:
    minutes, hours = seconds / 60, seconds / 3600
    return f"{seconds:.0f} s" if minutes < 2 else f"{minutes:.0f} min" if hours < 2 else f"{hours:.1f} h"
