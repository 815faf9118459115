"""Runs of the engine in processes of their own, where a first call is a first call and the peak of memory is one run's.

    python -m benchmarks._runs '{"task": "Matrix", "preset": "rigid", "side": 32}'

They use what engines of all times have, so that the same runs measure the package of another commit. Memory is what
Linux says of the process (`VmHWM`, set back after the first call); `ru_maxrss` would not do, since a process inherits
its parent's peak there.
"""

import dataclasses
import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import curvematch_jax as cm

from ._elsewhere import output_of
from ._measure import PRESETS, forget_peak, fourier_curves, least_seconds, resident_bytes, say, timed

CALLS = ("align", "distance_matrix")
NEW_CALLS = ("elastic_distance", "resample", "distance_matrix")
LIMITS = {"cold": 6.0, "warm": 3.0}  # seconds of a first call
_FEW = 4  # curves on each side in the first call: more than fit into the small chunk of `align`


@dataclass(frozen=True)
class Matrix:
    """Align `side^2` pairs of curves of n samples: all of a matrix, or as many pairs with curves of their own."""

    preset: str
    side: int
    n: int = 100
    call: str = "distance_matrix"

    def measured(self) -> dict[str, float]:
        """In this process, which has called nothing yet: seconds and bytes of the first, small call, and of the run."""
        few, many = self._operands(min(_FEW, self.side)), self._operands(self.side)
        first_seconds = timed(lambda: self._align(*few))[1]
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

    def _operands(self, side: int):
        count = side if self.call == "distance_matrix" else side**2
        return fourier_curves(0, count, self.n), fourier_curves(1, count, self.n)

    def _align(self, first, second) -> None:
        jax.block_until_ready(getattr(cm, self.call)(first, second, PRESETS[self.preset]))


@dataclass(frozen=True)
class NewSamples:
    """A call with a number of samples that it has not met yet, after others in the same dimension."""

    call: str
    samples: tuple[int, ...] = (100, 73, 128, 301)
    dimension: int = 3

    def measured(self) -> dict:
        """Seconds of the very first call, and of the first with each other number of samples."""
        curves = {n: fourier_curves(0, _FEW, n, self.dimension) for n in self.samples}
        first, *others = (timed(lambda c=c: jax.block_until_ready(self._call(c)))[1] for c in curves.values())
        return {"first_seconds": first, "seconds": dict(zip(map(str, self.samples[1:]), others, strict=True))}

    def _call(self, curves: np.ndarray):
        if self.call == "resample":
            return cm.resample(curves, 100)
        return getattr(cm, self.call)(curves, curves[::-1], PRESETS["fast"])


@dataclass(frozen=True)
class Lengths:
    """Outlines, each of a length of its own, brought to 100 samples one by one."""

    count: int = 40

    def measured(self) -> dict[str, float]:
        outlines = [fourier_curves(k, 1, 100 + 17 * k, 2)[0] for k in range(self.count)]
        jax.block_until_ready(jax.numpy.zeros(1))
        forget_peak()
        before = resident_bytes("VmRSS")
        seconds = timed(lambda: [jax.block_until_ready(cm.resample(outline, 100)) for outline in outlines])[1]
        return {"outlines": self.count, "seconds": seconds, "added_bytes": resident_bytes("VmHWM") - before}


@dataclass(frozen=True)
class Engine:
    """An engine, this one or that of another package, and the folder of its compiled code."""

    cache: Path
    package: Path | None = None

    def run(self, task: Matrix | NewSamples | Lengths) -> dict:
        """In a new process, which finds and leaves compiled code in a folder of this preset and call."""
        kind, facts = type(task).__name__, dataclasses.asdict(task)
        folder = self.cache / kind / facts.get("preset", "") / facts.get("call", "")
        settings = {"JAX_COMPILATION_CACHE_DIR": str(folder), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
        return output_of("benchmarks._runs", [json.dumps({"task": kind} | facts)], self.package, **settings)


def first_calls(engine: Engine, presets: Iterable[str]) -> dict:
    """Seconds of the first call in a new process: with an empty folder of compiled code, and with the one it filled."""
    report = {}
    for preset in presets:
        for call in CALLS:
            run = Matrix(preset, _FEW, call=call)
            seconds = {heat: engine.run(run)["first_call_seconds"] for heat in LIMITS}
            say(f"first {call}, {preset}: {seconds['cold']:.1f} s cold, {seconds['warm']:.1f} s warm")
            within = all(seconds[heat] <= limit for heat, limit in LIMITS.items())
            named = {f"{heat}_seconds": value for heat, value in seconds.items()}
            report.setdefault(preset, {})[call] = named | {"within_limits": within}
    return report


def speeds(engine: Engine, sides: dict[str, int]) -> dict:
    """Pairs a second, compiled already: of pairs of curves, and of a matrix of as many pairs."""
    report = {}
    for preset, side in sides.items():
        found = {call: engine.run(Matrix(preset, side, call=call))["pairs_per_second"] for call in CALLS}
        say(f"{preset}: " + ", ".join(f"{call} {rate:.0f} pairs a second" for call, rate in found.items()))
        report[preset] = {f"{call}_pairs_per_second": rate for call, rate in found.items()}
    return report


def new_samples(engine: Engine, samples: tuple[int, ...]) -> dict:
    """Seconds of calls with a new number of samples, after the first call of that dimension."""
    report = {call: engine.run(NewSamples(call, samples)) for call in NEW_CALLS}
    say("new numbers of samples: " + ", ".join(f"{k} {max(v['seconds'].values()):.2f} s" for k, v in report.items()))
    return report


def against_pairs(engine: Engine, sides: dict[str, tuple[int, ...]]) -> dict[str, list]:
    """Matrices of `side^2` pairs, by preset."""
    return {preset: [_compiled(engine, Matrix(preset, side)) for side in row] for preset, row in sides.items()}


def against_samples(engine: Engine, samples: tuple[int, ...], side: int) -> list:
    """Matrices of curves of n samples."""
    return [_compiled(engine, Matrix("fast", side, n)) for n in samples]


def _compiled(engine: Engine, run: Matrix) -> dict[str, float]:
    """In a process where nothing is compiled: that would be the peak of most."""
    engine.run(dataclasses.replace(run, side=_FEW))
    found = engine.run(run)
    say(f"{run.preset}, {found['pairs']:.0f} pairs, n = {run.n}: {found['seconds']:.2f} s, "
        f"{found['peak_bytes'] / 2**20:.0f} MiB")  # fmt: skip
    return found


if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    tasks = {"Matrix": Matrix, "NewSamples": NewSamples, "Lengths": Lengths}
    print(json.dumps(tasks[given.pop("task")](**given).measured()))
