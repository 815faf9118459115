"""Runs in processes of their own: there a first call is a first call, and the peak of memory is that of one run.

    python benchmarks/_runs.py '{"preset": "rigid", "side": 32}'

Memory is what Linux says of the process (`VmHWM`, set back after the first call); `ru_maxrss` would not do, since a
process inherits its parent's peak there.
"""

import dataclasses
import functools as ft
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
from _measure import PRESETS, fourier_curves, least_seconds, say

import curvematch_jax as cm
from curvematch_jax._optional import require

CALLS = ("align", "distance_matrix")
LIMITS = {"cold": 20.0, "warm": 3.0}  # seconds of a first call
_FEW = 4  # curves on each side in the first call: more than fit into the small chunk of `align`
_LINES = {"rigid": ("#555555", "--", "s"), "fast": ("#2b6cb0", "-", "o"), "accurate": ("#d7301f", ":", "^")}


@dataclass(frozen=True)
class Run:
    """Align `side^2` pairs of curves of n samples: all of a matrix, or as many pairs with curves of their own."""

    preset: str
    side: int
    n: int = 100
    call: str = "distance_matrix"

    def measured(self) -> dict[str, float]:
        """In this process, which has called nothing yet: seconds and bytes of the first, small call, and of the run."""
        few = self._operands(min(_FEW, self.side))
        many = self._operands(self.side)
        start = time.perf_counter()
        self._align(*few)
        first_seconds = time.perf_counter() - start
        first_peak = resident_bytes("VmHWM")
        forget_peak()
        before = resident_bytes("VmRSS")
        seconds = least_seconds(lambda: self._align(*many))
        return {
            "pairs": self.side**2,
            "n": self.n,
            "seconds": seconds,
            "pairs_per_second": self.side**2 / seconds,
            "peak_bytes": resident_bytes("VmHWM"),
            "bytes_before": before,
            "first_call_seconds": first_seconds,
            "first_call_peak_bytes": first_peak,
        }

    def elsewhere(self, cache: Path) -> dict[str, float]:
        """In a new process, which finds and leaves compiled code in a folder."""
        settings = {"JAX_COMPILATION_CACHE_DIR": str(cache), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
        command = [sys.executable, __file__, json.dumps(dataclasses.asdict(self))]
        done = subprocess.run(command, env=os.environ | settings, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{self} failed:\n{done.stderr}")
        return json.loads(done.stdout)

    def _operands(self, side: int):
        count = side if self.call == "distance_matrix" else side**2
        return fourier_curves(0, count, self.n), fourier_curves(1, count, self.n)

    def _align(self, first, second) -> None:
        jax.block_until_ready(getattr(cm, self.call)(first, second, PRESETS[self.preset]))


def first_calls(presets: Iterable[str], cache: Path) -> dict:
    """Seconds of the first call in a new process: with an empty folder of compiled code, and with the one it filled."""
    report = {}
    for preset in presets:
        for call in CALLS:
            run, folder = Run(preset, _FEW, call=call), cache / preset / call
            seconds = {heat: run.elsewhere(folder)["first_call_seconds"] for heat in LIMITS}
            say(f"first {call}, {preset}: {seconds['cold']:.1f} s cold, {seconds['warm']:.1f} s warm")
            within = all(seconds[heat] <= limit for heat, limit in LIMITS.items())
            report.setdefault(preset, {})[call] = seconds | {"within_limits": within}
    return report


def against_pairs(sides: dict[str, tuple[int, ...]], cache: Path) -> dict[str, list]:
    """Matrices of `side^2` pairs, by preset. Nothing is compiled in these processes: that would be the peak of most."""
    return {preset: [_run(Run(preset, side), cache) for side in row] for preset, row in sides.items()}


def against_samples(samples: tuple[int, ...], side: int, cache: Path) -> list:
    """Matrices of curves of n samples."""
    return [_run(Run("fast", side, n), cache) for n in samples]


def _run(run: Run, cache: Path) -> dict[str, float]:
    folder = cache / run.preset / run.call
    _compile(dataclasses.replace(run, side=_FEW), folder)
    found = run.elsewhere(folder)
    say(f"{run.preset}, {found['pairs']:.0f} pairs, n = {run.n}: {found['seconds']:.2f} s, "
        f"{found['peak_bytes'] / 2**20:.0f} MiB")  # fmt: skip
    return found


@ft.cache
def _compile(run: Run, cache: Path) -> None:
    run.elsewhere(cache)


def picture(pairs: dict[str, list], samples: list, path: Path) -> None:
    """Draw time and memory against pairs, and time against samples; thin lines are proportional to the pairs."""
    figure = require("matplotlib.figure", "plot", "drawing a picture").Figure(figsize=(10.5, 3.4), layout="constrained")
    times, memory, by_samples = figure.subplots(1, 3)
    for preset, rows in pairs.items():
        _line(times, rows, "pairs", "seconds", preset)
        _line(memory, rows, "pairs", "peak_bytes", preset, scale=2**-20)
        ends = [rows[0]["pairs"], rows[-1]["pairs"]]
        times.plot(ends, [end / rows[-1]["pairs_per_second"] for end in ends], color="#bbbbbb", linewidth=0.7, zorder=0)
    _line(by_samples, samples, "n", "seconds", "fast")
    by_samples.set_xticks([row["n"] for row in samples], [str(row["n"]) for row in samples], minor=False)
    by_samples.set_xticks([], minor=True)
    for axes, x, y in (
        (times, "pairs", "seconds"),
        (memory, "pairs", "peak memory, MiB"),
        (by_samples, "samples of a curve", f"seconds for {samples[0]['pairs']} pairs"),
    ):
        low, high = np.log10(axes.get_ylim())
        axes.set(xlabel=x, ylabel=y, ylim=(10 ** np.floor(low), 10 ** np.ceil(high)))
        axes.grid(which="major", color="#dddddd", linewidth=0.6)
        axes.legend(frameon=False)
    figure.savefig(path, dpi=150)


def _line(axes, rows: list, x: str, y: str, preset: str, scale: float = 1) -> None:
    colour, dashes, marker = _LINES[preset]
    values = [row[y] * scale for row in rows]
    axes.loglog([row[x] for row in rows], values, color=colour, linestyle=dashes, marker=marker, label=preset)


def resident_bytes(key: str) -> int:
    """`VmRSS`, what is in memory now, or `VmHWM`, the most that ever was."""
    (kibibytes,) = re.findall(rf"^{key}:\s*(\d+) kB$", Path("/proc/self/status").read_text(), re.MULTILINE)
    return int(kibibytes) * 1024


def forget_peak() -> None:
    """Let `VmHWM` begin anew."""
    Path("/proc/self/clear_refs").write_text("5")


if __name__ == "__main__":
    print(json.dumps(Run(**json.loads(sys.argv[1])).measured()))
