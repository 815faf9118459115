"""Retrieval on labelled folders of meshes: times, peak memory and every measure.

    python -m benchmarks retrieval DIR... [--preset generic] [--out FILE.json]

A DIR has `labels.csv` with the columns `file,class`. TOSCA (http://tosca.cs.technion.ac.il) and the watertight track of
SHREC'07 (http://watertight.ge.imati.cnr.it) are free for academic use and may not be redistributed.
Parts are made from the mesh files in worker processes; both times are from a cold start, compilation included.
Peak memory is that of the whole process tree, workers included (Linux only).
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from curvematch_jax.retrieval import Matching, Scores, dissimilarity_matrix, evaluate, rerank, run_settings
from curvematch_jax.surface import Extraction

from ._measure import peak_memory, say, timed, use_every_core
from ._models import extracted, jobs_option, name_of
from ._record import record

PRESETS = {
    "default": Matching,
    "articulated": Matching.articulated,
    "generic": Matching.generic,
    "paper": Matching.paper,
}
_MEASURES = ("nn", "ft", "st", "e", "dcg", "map")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    parser.add_argument("--preset", choices=tuple(PRESETS), default="default")
    jobs_option(parser)


def run(arguments: argparse.Namespace) -> None:
    use_every_core()
    matching = PRESETS[arguments.preset]()
    collections = [measured(folder, matching, arguments.jobs) for folder in arguments.folders]
    record(arguments, {"settings": run_settings(Extraction(), matching), "collections": collections})


def measured(folder: Path, matching: Matching, jobs: int) -> dict[str, object]:
    """Everything there is to say about one collection; prints it as it comes."""
    with peak_memory() as peak:
        (parts, labels, failed), extracting = timed(lambda: extracted(folder, Extraction(), jobs))
        matrix, comparing = timed(lambda: dissimilarity_matrix(parts, matching, progress=sys.stderr.isatty()))
    name = name_of(folder)
    measures = {}
    for kind, values in (("as it is", matrix), ("re-ranked", rerank(matrix))):
        scores = evaluate(values, labels) if repeated(labels) else None
        measures[kind] = scores.summary() if scores else None
        if scores:
            say(f"\n{name}, {kind}\n{table(scores)}")
    counts = np.array([len(p.areas) for p in parts])
    say(
        f"\n{name}: {len(parts)} of {len(parts) + len(failed)} objects, {counts.sum()} parts, "
        f"parts {extracting:.0f} s, matrix {comparing:.0f} s, peak {max(peak) / 2**30:.2f} GiB"
    )
    return {
        "collection": name,
        "objects": len(parts),
        "failed": [dataclasses.asdict(failure) for failure in failed],
        "parts": int(counts.sum()),
        "part_pairs": int(counts.sum() ** 2 - (counts**2).sum()) // 2,
        "seconds": {"parts": extracting, "matrix": comparing},
        "peak_bytes": max(peak),
        "measures": measures,
    }


def table(scores: Scores) -> str:
    """The measures of each class and of all queries."""
    rows = {**scores.by_class(), "all": {key: getattr(scores, key) for key in _MEASURES}}
    lines = [f"{'':20}" + "".join(f"{key.upper():>8}" for key in _MEASURES)]
    return "\n".join(
        lines + [f"{name:20}" + "".join(f"{row[key]:8.3f}" for key in _MEASURES) for name, row in rows.items()]
    )


def repeated(labels: Sequence[str]) -> bool:
    """Whether any class has two members."""
    return len(set(labels)) < len(labels)
