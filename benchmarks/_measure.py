"""What the benchmarks of the engine share: presets, curves and clocks."""

import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import numpy as np

import curvematch_jax as cm

PRESETS: dict[str, cm.Aligner] = {name: getattr(cm.Aligner, name)() for name in ("rigid", "fast", "accurate")}
_MODES = 5
_DENSE = 16  # points to a sample, where arc length is measured
_LEAST_SECONDS = 0.05  # of calls, for one reading of the clock


def fourier_curves(seed: int, count: int, n: int = 100, d: int = 3) -> np.ndarray:
    """Random closed curves `(count, d, n)` of five Fourier modes in float32, sampled by arc length.

    In numpy, curve by curve: neither first calls nor peaks of memory are touched.
    """
    random = np.random.default_rng(seed)
    coefficients = random.normal(size=(count, 2, d, _MODES)) / np.arange(1, _MODES + 1)
    return np.stack([_fourier_curve(cosines, sines, n) for cosines, sines in coefficients]).astype(np.float32)


def _fourier_curve(cosines: np.ndarray, sines: np.ndarray, n: int) -> np.ndarray:
    def at(times):
        phase = 2 * np.pi * np.outer(np.arange(1, _MODES + 1), times)
        return cosines @ np.cos(phase) + sines @ np.sin(phase)

    times = np.linspace(0, 1, _DENSE * n + 1)
    arcs = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(at(times), axis=1), axis=0))])
    return at(np.interp(np.arange(n) / n, arcs / arcs[-1], times))


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def least_seconds(call: Callable[[], object], repeats: int = 5, enough: float = 2.0) -> float:
    """The least seconds of a few calls, of fewer when they take long. The caller has compiled already."""
    seconds: list[float] = []
    while len(seconds) < repeats and sum(seconds) < enough:
        seconds.append(_seconds(call))
    return min(seconds)


def seconds_each(function: Callable, *operands, callers: int) -> float:
    """Seconds of the machine for one call of a jitted function, while `callers` threads call it without pause."""
    call = lambda: jax.block_until_ready(function(*operands))  # noqa: E731
    call()
    calls = callers * int(np.clip(_LEAST_SECONDS / _seconds(call), 2, 100))
    with ThreadPoolExecutor(callers) as pool:
        return least_seconds(lambda: list(pool.map(lambda _: call(), range(calls)))) / calls


def _seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def rounded(results: Any) -> Any:
    """Five digits are more than there is in a time."""
    if isinstance(results, dict):
        return {key: rounded(value) for key, value in results.items()}
    if isinstance(results, list):
        return [rounded(value) for value in results]
    return float(f"{results:.5g}") if isinstance(results, float) else results


def say(text: str) -> None:
    """Progress, where it does not mix with the results."""
    print(text, file=sys.stderr, flush=True)
