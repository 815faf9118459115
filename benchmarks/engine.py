"""Speed and quality of the engine, beside fdasrsf on the same pairs in the same run.

    python benchmarks/engine.py [--pairs 2048] [--peer-pairs 8] [--out FILE.json]

The curves are random closed curves of five Fourier modes in R^3, 100 samples by arc length. Compile time is measured
apart: the first call of each function minus its second. The peer (fdasrsf, with closed curves, rotation and its default
dynamic programming) is timed on a few pairs, and its distance compared with ours; install it with the `test` extra.
"""

import argparse
import functools as ft
import importlib.metadata
import json
import os
import platform
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np

import curvematch_jax as cm
from curvematch_jax.elastic._curve import represent
from curvematch_jax.elastic._start import find_starts, shift_covariances

PRESETS = {"rigid": cm.Aligner.rigid(), "fast": cm.Aligner.fast(), "accurate": cm.Aligner.accurate()}
_REPEATS = 3


def main() -> None:
    parser = argparse.ArgumentParser(description="Speed and quality of the engine.")
    parser.add_argument("--pairs", type=int, default=2048)
    parser.add_argument("--peer-pairs", type=int, default=8)
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    options = parser.parse_args()
    first, second = fourier_curves(0, options.pairs), fourier_curves(1, options.pairs)
    results: dict = {
        "versions": {name: importlib.metadata.version(name) for name in ("jax", "jaxlib", "numpy", "fdasrsf")},
        "machine": {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count()},
        "pairs": options.pairs,
        "stages": stages(first, second),
        "presets": {},
    }
    for name, aligner in PRESETS.items():
        count = options.pairs if name != "accurate" else max(64, options.pairs // 8)
        seconds, compiling = timed(lambda a, s=aligner: cm.align(a[0], a[1], s), (first[:count], second[:count]))
        results["presets"][name] = {"pairs_per_second": count / seconds, "compile_seconds": compiling}
    side = int(options.pairs**0.5)
    seconds, _ = timed(lambda a: cm.distance_matrix(a[0], a[1]), (first[:side], second[:side]))
    results["matrix_pairs_per_second_fast"] = side * side / seconds
    if options.peer_pairs:
        results["peer"] = beside_fdasrsf(first[: options.peer_pairs], second[: options.peer_pairs], results["presets"])
    print(json.dumps(results, indent=1))
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(json.dumps(results, indent=1) + "\n")


def fourier_curves(seed: int, count: int, n: int = 100) -> np.ndarray:
    """Random closed curves `(count, 3, n)` in float32, by arc length."""
    random = np.random.default_rng(seed)
    k = np.arange(1, 6)
    waves = 2 * np.pi * np.outer(k, np.arange(4 * n) / (4 * n))
    coefficients = random.normal(size=(2, count, 3, 5)) / k
    dense = coefficients[0] @ np.cos(waves) + coefficients[1] @ np.sin(waves)
    return np.asarray(cm.resample(dense.astype(np.float32), n))


def timed(function: Callable, argument) -> tuple[float, float]:
    """The least seconds of a few calls, and those that the first call took beyond."""
    start = time.perf_counter()
    jax.block_until_ready(function(argument))
    first = time.perf_counter() - start
    seconds = []
    for _ in range(_REPEATS):
        start = time.perf_counter()
        jax.block_until_ready(function(argument))
        seconds.append(time.perf_counter() - start)
    return min(seconds), first - min(seconds)


def stages(first: np.ndarray, second: np.ndarray) -> dict[str, float]:
    """Microseconds a pair of the stages before dynamic programming, one chunk on one thread."""
    aligner = cm.Aligner.fast()
    a, b = first[: aligner.chunk], second[: aligner.chunk]
    tables = jax.jit(ft.partial(represent, grid=aligner.grid, nodes=aligner.nodes))
    starts = jax.jit(lambda pair: find_starts(shift_covariances(pair[0], pair[1]), aligner.seeds))
    tangents = tables(a).tangents, tables(b).tangents
    return {
        "tables of one curve": timed(tables, a)[0] / len(a) * 1e6,
        "start points": timed(starts, tangents)[0] / len(a) * 1e6,
    }


def beside_fdasrsf(first: np.ndarray, second: np.ndarray, presets: dict) -> dict:
    """fdasrsf on the same pairs: its speed, and how much larger its distances are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from fdasrsf.curve_functions import elastic_distance_curve

    start = time.perf_counter()
    theirs = np.array([distance_by(elastic_distance_curve, a, b) for a, b in zip(first, second, strict=True)])
    rate = len(first) / (time.perf_counter() - start)
    report: dict = {"pairs": len(first), "pairs_per_second": rate}
    for name, aligner in PRESETS.items():
        ours = np.asarray(cm.align(first, second, aligner).distance)
        report[name] = {
            "times_faster": presets[name]["pairs_per_second"] / rate,
            "distance_less_by_median": float(np.median(theirs - ours)),
            "distance_less_by_least": float((theirs - ours).min()),
        }
    return report


def distance_by(elastic_distance_curve: Callable, a: np.ndarray, b: np.ndarray) -> float:
    """The peer takes closed curves in float64 with the end point repeated."""
    closed = (np.concatenate([c, c[:, :1]], axis=1).astype(float) for c in (a, b))
    return float(elastic_distance_curve(*closed, closed=1, rotation=True, scale=False)[0])


if __name__ == "__main__":
    main()
