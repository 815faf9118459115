"""How retrieval grows with the collection: queries of thousands of models, and matrices.

    python -m benchmarks scaling [--models 5000] [--indexed 5000] [--counts 100 316 1000 3162] [--out FILE.json]

With `--out` a picture of the matrices is drawn beside the file. The models are generated parts (`_generated.py`). Every
run has a process of its own, whose peak of memory is measured.

    query   default settings, models of 4 to 10 parts with 23 levels of 100 samples: seconds to make the
            collection ready, and seconds of a query by stage, compiled already, for the best ten (classes of 50), for
            the best twenty where classes have ten members, and for the whole ranking
    index   as the first of these, from an index on disk that a process of its own opens
    matrix  models of one part with one level of 16 samples, so that as many pairs of objects as possible are compared:
            peak of memory and seconds a pair of objects

`--indexed 20000 --counts 10000` takes hours.
"""

import argparse
import dataclasses
import json
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from curvematch_jax import Collection, Extraction, Matching, Parts, Rigid, StoredParts, build_matrix, rank, save_parts

from ._elsewhere import output_of
from ._generated import generated
from ._measure import resident_bytes, say, timed
from ._record import record

_MODELS = 5000
_QUERIES = 12
_CASES = {"best_10": (100, 10), "best_20_classes_of_10": (500, 20), "whole_ranking": (100, None)}  # classes, top
_COUNTS = (100, 316, 1000, 3162)
_SMALL = Extraction(levels=1, samples=16)
_SMALL_ALIGNER = Rigid(grid=16, measured=False, chunk=2048)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--models", type=int, default=_MODELS, metavar="N", help="in the collection that is queried")
    parser.add_argument("--indexed", type=int, default=_MODELS, metavar="N", help="in the index on disk")
    parser.add_argument("--counts", type=int, nargs="+", default=_COUNTS, metavar="N", help="models of the matrices")


def run(arguments: argparse.Namespace) -> None:
    results = report(arguments.models, arguments.indexed, arguments.counts)
    record(arguments, results)
    if arguments.out:
        picture(results["matrix"], arguments.out.with_suffix(".png"))


def report(models: int, indexed: int, counts: Sequence[int]) -> dict:
    """Everything there is to say about scaling."""
    return {
        "load_before": os.getloadavg()[0],
        "query": {case: _elsewhere("query", case, str(models)) for case in _CASES},
        "index": indexed_here(indexed),
        "matrix": [_elsewhere("matrix", str(count)) for count in counts],
    }


def query(case: str, models: str) -> dict:
    """Queries of one kind in this process. The parts are made and forgotten one by one."""
    classes, top = _CASES[case]
    ready, seconds = timed(lambda: Collection.of(generated(int(models), classes=classes)))
    queries = list(generated(_QUERIES + 1, classes=classes))
    rank(queries.pop(), ready, top=top)
    asked = [_asked(one, ready, top) for one in queries]
    return {
        "models": int(models),
        "classes": classes,
        "top": top,
        "curves": len(ready.stack.curves),
        "ready_seconds": seconds,
        "seconds_median": float(np.median([row["seconds"] for row in asked])),
        "cpu_seconds_median": float(np.median([row["cpu"] for row in asked])),
        "seconds_most": max(row["seconds"] for row in asked),
        "stages_median": {
            name: float(np.median([row["stages"][name] for row in asked])) for name in asked[0]["stages"]
        },
        "compared_by_shape_median": float(np.median([row["exact"] for row in asked])),
        "peak_bytes": resident_bytes("VmHWM"),
    }


def indexed_here(models: int) -> dict:
    """An index made here, opened and asked elsewhere."""
    with tempfile.TemporaryDirectory() as name:
        _, seconds = timed(lambda: Collection.of(generated(models)).save(Path(name) / "I"))
        stored = sum(path.stat().st_size for path in (Path(name) / "I").iterdir())
        return {"models": models, "made_seconds": seconds, "stored_bytes": stored, **_elsewhere("index", name)}


def opened(folder: str) -> dict:
    """Queries of an index for the best ten in this process, and whether they are those of the whole ranking."""
    ready, seconds = timed(lambda: Collection.open(Path(folder) / "I"))
    queries = list(generated(_QUERIES + 1))
    rank(queries[-1], ready, top=10)
    asked = [_asked(one, ready, 10) for one in queries[:-1]]
    peak = resident_bytes("VmHWM")
    whole, best = rank(queries[0], ready), rank(queries[0], ready, top=10)
    return {
        "opened_seconds": seconds,
        "seconds_median": float(np.median([row["seconds"] for row in asked])),
        "cpu_seconds_median": float(np.median([row["cpu"] for row in asked])),
        "peak_bytes": peak,
        "same_as_whole": bool((whole.order[:10] == best.order[:10]).all()),
    }


def _asked(one: Parts, ready: Collection, top: int | None) -> dict:
    worked = time.process_time()
    ranking, seconds = timed(lambda: rank(one, ready, top=top))
    return {
        "seconds": seconds,
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


def _elsewhere(what: str, *case: str) -> dict:
    """The same in a new process."""
    found = output_of("benchmarks.scaling", [what, *case])
    seconds = found.get("seconds_median", found.get("seconds"))
    say(f"{what} {' '.join(case)}: {seconds:.2f} s, {found['peak_bytes'] / 2**20:.0f} MiB")
    return found


def picture(rows: list[dict], path: Path) -> None:
    """Draw peak memory and the cost of a pair against the number of models."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
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
    what, *case = sys.argv[1:]
    print(json.dumps({"query": query, "index": opened, "matrix": matrix}[what](*case)))
