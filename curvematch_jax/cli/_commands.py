"""The work of `curvematch parts`, `matrix` and `evaluate`, from checked arguments to its exit status."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..datasets import match_labels, read_labels
from ..retrieval import (
    Matching,
    SavedMatrix,
    dissimilarity_matrix,
    evaluate,
    load_matrix,
    load_parts,
    require_place_for_matrix,
    save_matrix,
    save_parts,
)
from ..surface import Extraction, Parts
from ._inputs import PARTS_SUFFIX, Failure, find_sources, gather, gather_all
from ._output import Output, scores_table

SOME_FAILED = 1


class NothingUsable(ValueError):
    """No input could be used; the failures have been reported one by one."""


def make_parts(
    meshes: Sequence[Path], out: Path, extraction: Extraction, jobs: int, strict: bool, output: Output
) -> int:
    """`curvematch parts`: each mesh's parts are written as soon as they are there."""
    started = time.perf_counter()
    _require_settings(out, extraction)
    sources = find_sources(meshes)
    written: dict[int, dict[str, object]] = {}
    failures: dict[int, Failure] = {}
    for index, result in gather(sources, extraction, jobs, output.progress):
        outcome = _write(result, out) if isinstance(result, Parts) else result
        if isinstance(outcome, Failure):
            failures[index] = outcome
        else:
            written[index] = outcome
    failed = [failures[index] for index in sorted(failures)]
    report_failures(failed, len(written), output)
    seconds = time.perf_counter() - started
    output.result(
        f"{len(written)} of {len(sources)} meshes: parts in {out} ({seconds:.1f} s)",
        {
            "out": str(out),
            "objects": [written[index] for index in sorted(written)],
            "failed": [dataclasses.asdict(failure) for failure in failed],
            "settings": dataclasses.asdict(extraction),
            "seconds": seconds,
        },
    )
    return SOME_FAILED if failed and strict else 0


def make_matrix(
    inputs: Sequence[Path],
    out: Path,
    extraction: Extraction,
    matching: Matching,
    jobs: int,
    strict: bool,
    output: Output,
) -> int:
    """`curvematch matrix`: meshes or parts to a saved dissimilarity matrix."""
    require_place_for_matrix(out)
    started = time.perf_counter()
    parts, failed = gather_all(find_sources(inputs), extraction, jobs, output.progress)
    report_failures(failed, len(parts), output)
    extracted = time.perf_counter()
    values = dissimilarity_matrix(parts, matching, output.progress)
    seconds = {"parts": extracted - started, "matrix": time.perf_counter() - extracted}
    lacking = tuple(p.name for p in parts if not len(p.areas))
    for name in lacking:
        output.note(f"{name} has no feature point and comes last in every ranking")
    saved = SavedMatrix(
        dissimilarity=values,
        names=tuple(p.name for p in parts),
        settings=run_settings(parts[0].settings, matching),
        notes=tuple(f"{name} has no feature point" for name in lacking),
    )
    save_matrix(saved, out)
    output.result(
        f"{len(parts)} objects: matrix in {out} (parts {seconds['parts']:.1f} s, matrix {seconds['matrix']:.1f} s)",
        {
            "out": str(out),
            "objects": list(saved.names),
            "without_parts": list(lacking),
            "failed": [dataclasses.asdict(failure) for failure in failed],
            "settings": saved.settings,
            "seconds": seconds,
        },
    )
    return SOME_FAILED if failed and strict else 0


def run_evaluation(matrix: Path, labels: Path, output: Output) -> int:
    """`curvematch evaluate`: the measures of a saved matrix."""
    saved = load_matrix(matrix)
    scores = evaluate(saved.dissimilarity, match_labels(saved.names, read_labels(labels), labels))
    for note in saved.notes:
        output.note(note)
    summary = scores.summary()
    output.result(scores_table(scores), {**summary, "notes": list(saved.notes), "settings": saved.settings})
    return 0


def run_settings(extraction: Extraction, matching: Matching) -> dict[str, object]:
    """Everything that a result depends on."""
    return {"extraction": dataclasses.asdict(extraction), "matching": dataclasses.asdict(matching)}


def report_failures(failed: Sequence[Failure], usable: int, output: Output) -> None:
    """Say which inputs had to be left out, and go no further when nothing is left."""
    output.failures(failed)
    if not usable:
        raise NothingUsable("none of the inputs could be used")


def _require_settings(folder: Path, extraction: Extraction) -> None:
    """Refuse to put parts beside those of other settings."""
    paths = sorted(folder.rglob(f"*{PARTS_SUFFIX}")) if folder.is_dir() else []
    present = next((parts for path in paths if (parts := _existing(path))), None)
    if present is None:
        return
    there = dataclasses.asdict(present.settings)
    for name, value in dataclasses.asdict(extraction).items():
        if there[name] != value:
            raise ValueError(
                f"{folder} holds parts made with {name} = {there[name]!r}, and {name} = {value!r} was asked for: "
                "use another --out, or the same settings"
            )


def _write(parts: Parts, out: Path) -> dict[str, object] | Failure:
    """Save parts under their object's name, unless another object's are there."""
    path = out / f"{parts.name}{PARTS_SUFFIX}"
    present = _existing(path)
    if present is not None and not _same_object(present, parts):
        return Failure(parts.name, f"{path} holds the parts of another mesh: remove it, or use another --out")
    save_parts(parts, path)
    return {"name": parts.name, "file": str(path), "parts": len(parts.areas), "notes": list(parts.notes)}


def _existing(path: Path) -> Parts | None:
    """The parts at `path`; None when there are none that can be read, so that nothing is lost by writing there."""
    try:
        return load_parts(path)
    except (OSError, ValueError):
        return None


def _same_object(one: Parts, other: Parts) -> bool:
    """Extraction is deterministic: the same mesh has the same feature points."""
    return one.points.shape == other.points.shape and bool(np.array_equal(one.points, other.points))
