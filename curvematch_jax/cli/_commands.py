"""The work of `curvematch parts` and `evaluate`, from checked arguments to its exit status."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path

from .._words import counted
from ..datasets import match_labels, read_labels
from ..extraction import Failure
from ..extraction._collection import extract_each
from ..extraction._kept import Store
from ..extraction._sources import find_sources, is_parts
from ..retrieval import evaluate, load_matrix, rerank
from ..surface import Extraction, Parts
from ._output import Output, scores_table

SOME_FAILED = 1


class NothingUsable(ValueError):
    """No input could be used; the failures have been reported one by one."""


def make_parts(
    meshes: Sequence[Path],
    out: Path,
    extraction: Extraction,
    jobs: int,
    time_limit: float,
    strict: bool,
    output: Output,
) -> int:
    """`curvematch parts`: each mesh's parts are written as soon as they are there, unless they are there already."""
    started = time.perf_counter()
    sources = find_sources(meshes, meshes_only=True)
    store = Store(out, extraction)
    written: dict[int, dict[str, object]] = {}
    failures: dict[int, Failure] = {}
    for index, result in extract_each(sources, extraction, jobs, output.progress, store, time_limit):
        if is_parts(sources[index].path):
            failures[index] = Failure(sources[index].name, f"{sources[index].path}: is a parts file: give meshes")
        elif isinstance(result, Failure):
            failures[index] = result
        else:
            written[index] = _entry(result, store)
    for note in store.notes:
        output.note(note)
    failed = [failures[index] for index in sorted(failures)]
    report_failures(failed, len(written), output)
    seconds = time.perf_counter() - started
    computed, present = len(written) - len(store.found), len(store.found)
    output.result(
        f"{len(written)} of {counted(len(sources), 'mesh', 'meshes')}: parts in {out}, {computed} computed and "
        f"{present} there already ({seconds:.1f} s)",
        {
            "out": str(out),
            "objects": [written[index] for index in sorted(written)],
            "computed": computed,
            "present": present,
            "failed": [dataclasses.asdict(failure) for failure in failed],
            "notes": store.notes,
            "settings": dataclasses.asdict(extraction),
            "seconds": seconds,
        },
    )
    return SOME_FAILED if failed and strict else 0


def run_evaluation(matrix: Path, labels: Path, reranked: bool, output: Output) -> int:
    """`curvematch evaluate`: the measures of a saved matrix, as it is or re-ranked."""
    saved = load_matrix(matrix)
    values = rerank(saved.dissimilarity) if reranked else saved.dissimilarity
    scores = evaluate(values, match_labels(saved.names, read_labels(labels), labels))
    for note in saved.notes:
        output.note(note)
    summary = scores.summary()
    output.result(
        scores_table(scores), {**summary, "reranked": reranked, "notes": list(saved.notes), "settings": saved.settings}
    )
    return 0


def report_failures(failed: Sequence[Failure], usable: int, output: Output) -> None:
    """Say which inputs had to be left out, and go no further when nothing is left."""
    output.failures(failed)
    if not usable:
        raise NothingUsable("none of the inputs could be used")


def _entry(parts: Parts, store: Store) -> dict[str, object]:
    """What the result says of one object."""
    return {
        "name": parts.name,
        "file": str(store.path(parts.name)),
        "parts": len(parts.areas),
        "computed": parts.name not in store.found,
        "notes": list(parts.notes),
    }
