"""Retrieval on labelled folders of meshes: times, peak memory and every measure.

    python benchmarks/retrieval.py DIR... [--out FILE.json]

A DIR has `labels.csv` with the columns `file,class`. TOSCA (http://tosca.cs.technion.ac.il) and the watertight track of
SHREC'07 (http://watertight.ge.imati.cnr.it) are free for academic use and may not be redistributed.
Parts are made from the mesh files in worker processes; both times are from a cold start, compilation included.
Peak memory is that of the whole process tree, workers included (Linux only).
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from _record import machine, versions, write

from curvematch_jax.cli._jax import configure_jax
from curvematch_jax.cli._output import scores_table
from curvematch_jax.datasets import labelled_folder
from curvematch_jax.extraction import extract_collection
from curvematch_jax.extraction._workers import cores
from curvematch_jax.retrieval import Matching, dissimilarity_matrix, evaluate, rerank, run_settings
from curvematch_jax.surface import Extraction

_SAMPLING_SECONDS = 0.2


def main() -> None:
    parser = argparse.ArgumentParser(description="Times, peak memory and measures of labelled folders of meshes.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    parser.add_argument("--jobs", type=int, default=cores())
    presets = ("default", "articulated", "generic", "paper")
    parser.add_argument("--preset", choices=presets, default="default")
    arguments = parser.parse_args()
    configure_jax(cache=False)
    matching = Matching() if arguments.preset == "default" else getattr(Matching, arguments.preset)()
    results = {
        "versions": versions(),
        "machine": machine(),
        "settings": run_settings(Extraction(), matching),
        "collections": [measured(folder, matching, arguments.jobs) for folder in arguments.folders],
    }
    if arguments.out:
        write(arguments.out, results)


def measured(folder: Path, matching: Matching, jobs: int) -> dict[str, object]:
    """Everything there is to say about one collection; prints it as it comes."""
    labelled = labelled_folder(folder)
    with peak_memory() as peak:
        started = time.perf_counter()
        made = extract_collection([path for path, _ in labelled], jobs=jobs, progress=True)
        parts, failed = list(made.parts), made.failures
        extracted = time.perf_counter()
        matrix = dissimilarity_matrix(parts, matching, progress=True)
        seconds = {"parts": extracted - started, "matrix": time.perf_counter() - extracted}
    classes = {path.name: label for path, label in labelled}
    labels = [classes[p.name] for p in parts]
    measures = {}
    for name, values in (("as it is", matrix), ("re-ranked", rerank(matrix))):
        scores = evaluate(values, labels) if repeated(labels) else None
        measures[name] = scores.summary() if scores else None
        if scores:
            print(f"\n{folder.name}, {name}\n{scores_table(scores)}")
    counts = np.array([len(p.areas) for p in parts])
    print(
        f"\n{folder.name}: {len(parts)} of {len(labelled)} objects, {counts.sum()} parts, "
        f"parts {seconds['parts']:.0f} s, matrix {seconds['matrix']:.0f} s, peak {max(peak) / 2**30:.2f} GiB"
    )
    return {
        "collection": folder.name,
        "objects": len(parts),
        "failed": [dataclasses.asdict(failure) for failure in failed],
        "parts": int(counts.sum()),
        "part_pairs": int(counts.sum() ** 2 - (counts**2).sum()) // 2,
        "seconds": seconds,
        "peak_bytes": max(peak),
        "measures": measures,
    }


def repeated(labels: Sequence[str]) -> bool:
    """Whether any class has two members."""
    return len(set(labels)) < len(labels)


@contextmanager
def peak_memory() -> Iterator[list[int]]:
    """Fills a list with the resident bytes of this process and all below it, sampled while the block runs."""
    samples, done = [0], threading.Event()

    def sample() -> None:
        while not done.wait(_SAMPLING_SECONDS):
            samples.append(tree_bytes(os.getpid()))

    thread = threading.Thread(target=sample, daemon=True)
    thread.start()
    try:
        yield samples
    finally:
        done.set()
        thread.join()


def tree_bytes(root: int) -> int:
    """Resident bytes of a process and its descendants, now."""
    resident: dict[int, int] = {}
    parent: dict[int, int] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines() if ":" in line)
        except OSError:
            continue
        pid = int(folder.name)
        resident[pid] = 1024 * int(status.get("VmRSS", "0").split()[0])
        parent[pid] = int(status["PPid"])
    family = {root}
    while grown := {pid for pid, above in parent.items() if above in family} - family:
        family |= grown
    return sum(resident.get(pid, 0) for pid in family)


if __name__ == "__main__":
    main()
