"""Clocks, memory and progress, and what is measured most: the presets on random curves."""

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import jax
import numpy as np

import curvematch_jax as cm

PRESETS: dict[str, cm.Aligner] = {name: getattr(cm.Aligner, name)() for name in ("rigid", "fast", "accurate")}
_MODES = 5
_DENSE = 16  # points to a sample, where arc length is measured
_LEAST_SECONDS = 0.05  # of calls, for one reading of the clock
_SAMPLING_SECONDS = 0.2  # of memory

T = TypeVar("T")


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


def use_every_core() -> None:
    """Make every core a device of JAX, as `curvematch` does; too late once JAX has started, and then without effect."""
    with suppress(RuntimeError):
        jax.config.update("jax_num_cpu_devices", cores())


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """The result of a call, and its seconds."""
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start


def least_seconds(call: Callable[[], object], repeats: int = 5, enough: float = 2.0) -> float:
    """The least seconds of a few calls, of fewer when they take long. The caller has compiled already."""
    seconds: list[float] = []
    while len(seconds) < repeats and sum(seconds) < enough:
        seconds.append(timed(call)[1])
    return min(seconds)


def seconds_each(function: Callable, *operands, callers: int) -> float:
    """Seconds of the machine for one call of a jitted function, while `callers` threads call it without pause."""
    call = lambda: jax.block_until_ready(function(*operands))  # noqa: E731
    call()
    calls = callers * int(np.clip(_LEAST_SECONDS / timed(call)[1], 2, 100))
    with ThreadPoolExecutor(callers) as pool:
        return least_seconds(lambda: list(pool.map(lambda _: call(), range(calls)))) / calls


def resident_bytes(key: str) -> int:
    """Of this process: `VmRSS`, what is in memory now, or `VmHWM`, the most that ever was (Linux)."""
    (kibibytes,) = re.findall(rf"^{key}:\s*(\d+) kB$", Path("/proc/self/status").read_text(), re.MULTILINE)
    return int(kibibytes) * 1024


def forget_peak() -> None:
    """Let `VmHWM` begin anew."""
    Path("/proc/self/clear_refs").write_text("5")


@contextmanager
def peak_memory() -> Iterator[list[int]]:
    """Fill a list with the resident bytes of this process and all below it, sampled while the block runs (Linux)."""
    samples, done = [0], threading.Event()

    def sample() -> None:
        while not done.wait(_SAMPLING_SECONDS):
            samples.append(_tree_bytes(os.getpid()))

    thread = threading.Thread(target=sample, daemon=True)
    thread.start()
    try:
        yield samples
    finally:
        done.set()
        thread.join()


def _tree_bytes(root: int) -> int:
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


def say(text: str) -> None:
    """Progress and tables, on stderr, where they do not mix with the results."""
    print(text, file=sys.stderr, flush=True)
