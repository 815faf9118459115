"""How retrieval grows with the collection: one query in thousands of models, and matrices of up to ten thousand.

    python benchmarks/scaling.py [--full] [--out FILE.json]

JSON on stdout, progress on stderr, with `--out` also a picture beside it. The models are generated parts
(`_generated.py`). Every run has a process of its own, whose peak of memory is measured.

    query   default settings, 5,000 models of 4 to 10 parts with 23 levels of 100 samples: seconds to make the
            collection ready, and seconds of a query by stage, compiled already, for the best ten (classes of 50), for
            the best twenty where classes have ten members, and for the whole ranking
    index   as the first of these, from an index on disk that a process of its own opens: `--full` with 20,000 models
    matrix  models of one part with one level of 16 samples, so that as many pairs of objects as possible are compared:
            peak of memory and seconds a pair of objects, for 100 to 3,162 models; `--full`: to 10,000
"""

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from _generated import generated
from _measure import rounded, say
from _record import machine, versions, write
from _runs import resident_bytes

from curvematch_jax import Collection, Extraction, Matching, Parts, Rigid, StoredParts, build_matrix, rank, save_parts
from curvematch_jax._optional import require

_MODELS = 5000
_QUERIES = 12
_CASES = {"best_10": (100, 10), "best_20_classes_of_10": (500, 20), "whole_ranking": (100, None)}  # classes, top
_COUNTS = (100, 316, 1000, 3162, 10000)
_SMALL = Extraction(levels=1, samples=16)
_SMALL_ALIGNER = Rigid(grid=16, measured=False, chunk=2048)


def main() -> None:
    parser = argparse.ArgumentParser(description="How retrieval grows with the collection.")
    parser.add_argument("--full", action="store_true", help="a matrix of 10,000 models, an index of 20,000: hours")
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    parser.add_argument("--run", nargs=2, metavar=("WHAT", "CASE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        what, case = options.run
        print(json.dumps({"query": query, "index": opened, "matrix": matrix}[what](case)))
        return
    results = report(_COUNTS if options.full else _COUNTS[:-1], 20000 if options.full else _MODELS)
    facts: Any = rounded(results)
    print(json.dumps(facts, indent=1, allow_nan=False))
    if options.out:
        write(options.out, facts)
        picture(results["matrix"], options.out.with_suffix(".png"))


def report(counts: tuple[int, ...], indexed: int) -> dict:
    """Everything there is to say about scaling."""
    return {
        "versions": versions(),
        "machine": machine() | {"load_before": os.getloadavg()[0]},
        "query": {case: _elsewhere("query", case) for case in _CASES},
        "index": indexed_here(indexed),
        "matrix": [_elsewhere("matrix", str(count)) for count in counts],
    }


def query(case: str) -> dict:
    """Queries of one kind in this process. The parts are made and forgotten one by one."""
    classes, top = _CASES[case]
    started = time.perf_counter()
    ready = Collection.of(generated(_MODELS, classes=classes))
    seconds = time.perf_counter() - started
    queries = list(generated(_QUERIES + 1, classes=classes))
    rank(queries.pop(), ready, top=top)
    timed = [_timed(one, ready, top) for one in queries]
    return {
        "models": _MODELS,
        "classes": classes,
        "top": top,
        "curves": len(ready.stack.curves),
        "ready_seconds": seconds,
        "seconds_median": float(np.median([row["seconds"] for row in timed])),
        "cpu_seconds_median": float(np.median([row["cpu"] for row in timed])),
        "seconds_most": max(row["seconds"] for row in timed),
        "stages_median": {
            name: float(np.median([row["stages"][name] for row in timed])) for name in timed[0]["stages"]
        },
        "compared_by_shape_median": float(np.median([row["exact"] for row in timed])),
        "peak_bytes": resident_bytes("VmHWM"),
    }


def indexed_here(models: int) -> dict:
    """An index made here, opened and asked elsewhere."""
    with tempfile.TemporaryDirectory() as name:
        started = time.perf_counter()
        Collection.of(generated(models)).save(Path(name) / "I")
        seconds = time.perf_counter() - started
        stored = sum(path.stat().st_size for path in (Path(name) / "I").iterdir())
        return {"models": models, "made_seconds": seconds, "stored_bytes": stored, **_elsewhere("index", name)}


def opened(folder: str) -> dict:
    """Queries of an index for the best ten in this process, and whether they are those of the whole ranking."""
    started = time.perf_counter()
    ready = Collection.open(Path(folder) / "I")
    seconds = time.perf_counter() - started
    queries = list(generated(_QUERIES + 1))
    rank(queries[-1], ready, top=10)
    timed = [_timed(one, ready, 10) for one in queries[:-1]]
    peak = resident_bytes("VmHWM")
    whole, best = rank(queries[0], ready), rank(queries[0], ready, top=10)
    return {
        "opened_seconds": seconds,
        "seconds_median": float(np.median([row["seconds"] for row in timed])),
        "cpu_seconds_median": float(np.median([row["cpu"] for row in timed])),
        "peak_bytes": peak,
        "same_as_whole": bool((whole.order[:10] == best.order[:10]).all()),
    }


def _timed(one: Parts, ready: Collection, top: int | None) -> dict:
    started, worked = time.perf_counter(), time.process_time()
    ranking = rank(one, ready, top=top)
    return {
        "seconds": time.perf_counter() - started,
        "cpu": time.process_time() - worked,
        "stages": ranking.seconds,
        "exact": int(ranking.exact.sum()),
    }


def matrix(models: str) -> dict:
    """A matrix of small models on disk in this process, their parts read when they are needed."""
    count = int(models)
    matching = dataclasses.replace(Matching(), aligner=_SMALL_ALIGNER)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        told: list[tuple[float, float]] = [(0.0, 0.0)]
        paths = [folder / "parts" / f"{k}.npz" for k in range(count)]
        for path, parts in zip(paths, generated(count, parts=(1, 1), settings=_SMALL), strict=True):
            save_parts(parts, path)
        build_matrix(StoredParts(paths[:40]), folder / "warm.zarr", matching)
        before, started = resident_bytes("VmRSS"), time.perf_counter()

        def progress(done: int, total: int) -> None:
            told.append((time.perf_counter() - started, done / total))

        build_matrix(StoredParts(paths), folder / "D.zarr", matching, progress)
        seconds = time.perf_counter() - started
        stored = sum(path.stat().st_size for path in (folder / "D.zarr").rglob("*") if path.is_file())
    pairs = count * (count - 1) // 2
    return {
        "models": count,
        "pairs": pairs,
        "seconds": seconds,
        "microseconds_a_pair": seconds / pairs * 1e6,
        "predicted_over_needed": _predicted(told),
        "bytes_before": before,
        "peak_bytes": resident_bytes("VmHWM"),
        "stored_bytes": stored,
    }


def _predicted(told: list[tuple[float, float]]) -> float:
    """The time for the blocks that is left after the first tenth as it is shown then, over the one that it took."""
    blocks = [(seconds, share) for (seconds, share), (_, last) in zip(told[1:], told, strict=False) if share >= last]
    begun, end = blocks[0][0], next(seconds for seconds, share in blocks if share >= 1)
    seconds, share = next(row for row in blocks if row[1] >= 0.1)
    return (seconds - begun) / share * (1 - share) / max(end - seconds, 1e-9)


def _elsewhere(what: str, case: str) -> dict:
    """The same in a new process."""
    command = [sys.executable, __file__, "--run", what, case]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{what} {case} failed:\n{done.stderr}")
    found = json.loads(done.stdout)
    seconds = found.get("seconds_median", found.get("seconds"))
    say(f"{what} {case}: {seconds:.2f} s, {found['peak_bytes'] / 2**20:.0f} MiB")
    return found


def picture(rows: list[dict], path: Path) -> None:
    """Draw peak memory and the cost of a pair against the number of models."""
    figure = require("matplotlib.figure", "plot", "drawing a picture").Figure(figsize=(7.0, 3.2), layout="constrained")
    memory, cost = figure.subplots(1, 2)
    models = [row["models"] for row in rows]
    memory.loglog(models, [row["peak_bytes"] / 2**20 for row in rows], "o-", color="#2b6cb0", label="peak")
    memory.loglog(models, [row["stored_bytes"] / 2**20 for row in rows], "--", color="#999999", label="on disk")
    memory.loglog(models, [8 * count**2 / 2**20 for count in models], ":", color="#999999", label="the matrix alone")
    memory.set(xlabel="models", ylabel="memory of the process, MiB")
    memory.legend(frameon=False)
    cost.loglog(models, [row["microseconds_a_pair"] for row in rows], "o-", color="#2b6cb0")
    cost.set(xlabel="models", ylabel="microseconds a pair of models")
    for axes in (memory, cost):
        axes.grid(which="major", color="#dddddd", linewidth=0.6)
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    main()
