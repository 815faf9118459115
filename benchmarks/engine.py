"""Speed of the engine: what bounds it, how it grows, and fdasrsf on the same pairs.

    python -m benchmarks engine [--quick | --full] [--baseline COMMIT] [--out FILE.json]

The curves are random closed curves of five Fourier modes in R^3, 100 samples by arc length. With `--out` a picture of
the scaling is drawn beside the file.

    first_calls  seconds of a first call in a new process, without compiled code on disk and with it
    speeds       pairs a second of `align` and `distance_matrix`, by preset
    new_samples  seconds of a first call, and then of calls with other numbers of samples, in one process
    lengths      40 outlines of 40 lengths through `resample`, in a new process: seconds, and bytes beyond those before
    stages       microseconds a pair of each stage of a preset, and which stage bounds it
    geodesics    closed geodesics a second, from aligned pairs
    peer         fdasrsf (closed curves, rotation, its default dynamic programming): its speed, and its distances
                 beside ours; left out where it is not installed: it is in the extra `oracles`
    scaling      seconds and peak memory against the number of pairs, and against samples
    baseline     with `--baseline`: the first four of these of the package of another commit, from a temporary checkout,
                 each right after ours; `times_faster` is how many times as fast ours are. The last commit of the first
                 engine is 7435b05

It takes some minutes; `--quick` about two, without `accurate` and with figures that are only good for a look.
"""

import argparse
import tempfile
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import curvematch_jax as cm
from curvematch_jax.elastic._geodesic import joined, straighten
from curvematch_jax.elastic._matched import srvfs_along

from ._elsewhere import checkout
from ._measure import PRESETS, fourier_curves, least_seconds, say, timed
from ._record import record
from ._runs import Engine, Lengths, against_pairs, against_samples, first_calls, new_samples, speeds
from ._stages import stages

_GEODESIC_STEPS = 6
_LINES = {"rigid": ("#555555", "--", "s"), "fast": ("#2b6cb0", "-", "o"), "accurate": ("#d7301f", ":", "^")}


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        speeds: by preset, pairs in each direction: the square is aligned.
        peer_pairs: given to fdasrsf.
        geodesics: in one batch.
        new: numbers of samples one after the other.
        sides: curves on either side of the matrices that show scaling, by preset.
        samples: n of the curves that show scaling.
        samples_side: curves on either side of the matrices with these.
    """

    speeds: tuple[tuple[str, int], ...] = (("rigid", 64), ("fast", 64), ("accurate", 32))
    peer_pairs: int = 8
    geodesics: int = 256
    new: tuple[int, ...] = (100, 73, 128, 301)
    sides: tuple[tuple[str, tuple[int, ...]], ...] = (("rigid", (32, 100, 316, 1000)), ("fast", (32, 100, 316)))
    samples: tuple[int, ...] = (50, 100, 200, 400)
    samples_side: int = 32

    @classmethod
    def quick(cls) -> "Plan":
        sides = ("rigid", (32, 100)), ("fast", (16, 32))
        return cls((("rigid", 24), ("fast", 24)), 1, 32, (100, 73), sides, samples=(50, 100), samples_side=16)

    @classmethod
    def full(cls) -> "Plan":
        return cls(sides=(("rigid", (32, 100, 316, 1000)), ("fast", (32, 100, 316, 1000))))


def options(parser: argparse.ArgumentParser) -> None:
    much = parser.add_mutually_exclusive_group()
    much.add_argument("--quick", action="store_true", help="about two minutes")
    much.add_argument("--full", action="store_true", help="a million fast pairs too")
    parser.add_argument("--baseline", metavar="COMMIT", help="whose package is measured as well")


def run(arguments: argparse.Namespace) -> None:
    plan = Plan.quick() if arguments.quick else Plan.full() if arguments.full else Plan()
    results = report(plan, arguments.baseline)
    record(arguments, results)
    if arguments.out:
        picture(results["scaling"]["pairs"], results["scaling"]["samples"], arguments.out.with_suffix(".png"))


def report(plan: Plan, baseline: str | None) -> dict:
    """Everything there is to say about the engine."""
    results: dict = {
        "presets": {name: str(PRESETS[name]) for name, _ in plan.speeds},
        "device": jax.devices()[0].device_kind,
    }
    with tempfile.TemporaryDirectory() as folder:
        engine = Engine(Path(folder) / "engine")
        with checkout(baseline) if baseline else nullcontext() as package:
            other = Engine(Path(folder) / "baseline", package) if package else None
            results |= beside(plan, engine, other)
        if baseline:
            results["baseline"]["commit"] = baseline
        results |= here(plan, results["speeds"])
        results["scaling"] = {
            "pairs": against_pairs(engine, dict(plan.sides)),
            "samples": against_samples(engine, plan.samples, plan.samples_side),
        }
    return results


def beside(plan: Plan, engine: Engine, other: Engine | None) -> dict:
    """What is measured of both engines, in turn."""
    presets = dict(plan.speeds)
    sections: dict[str, Callable[[Engine], dict]] = {
        "first_calls": lambda engine: first_calls(engine, presets),
        "speeds": lambda engine: speeds(engine, presets),
        "new_samples": lambda engine: new_samples(engine, plan.new),
        "lengths": lambda engine: engine.run(Lengths()),
    }
    ours, theirs = {}, {}
    for name, section in sections.items():
        say(name)
        ours[name] = section(engine)
        if other:
            say(f"{name}, baseline")
            theirs[name] = section(other)
    return ours | ({"baseline": theirs | {"times_faster": times_faster(ours, theirs)}} if other else {})


def times_faster(ours: dict, theirs: dict, timed: bool = False) -> dict:
    """Rates of ours over theirs, and seconds of theirs over ours, where both have them."""
    ratios = {}
    for key in ours.keys() & theirs.keys():
        mine, other = ours[key], theirs[key]
        if isinstance(mine, dict):
            ratios[key] = times_faster(mine, other, key == "seconds")
        elif key.endswith("per_second"):
            ratios[key] = mine / other
        elif timed or key.endswith("seconds"):
            ratios[key] = other / mine
    return {key: ratios[key] for key in ours if key in ratios}


def here(plan: Plan, speeds: dict) -> dict:
    """What is measured in this process."""
    most = max(plan.geodesics, plan.peer_pairs, *(aligner.chunk for aligner in PRESETS.values()))
    first, second = fourier_curves(0, most), fourier_curves(1, most)
    found: dict = {"stages": {}}
    for name in speeds:
        say(f"{name}: stages")
        found["stages"][name] = stages(PRESETS[name], first, second)
    say("geodesics")
    found["geodesics"] = geodesics(first[: plan.geodesics], second[: plan.geodesics], PRESETS["fast"])
    if plan.peer_pairs and find_spec("fdasrsf"):
        say("fdasrsf")
        found["peer"] = beside_fdasrsf(first[: plan.peer_pairs], second[: plan.peer_pairs], speeds)
    return found


def geodesics(first: np.ndarray, second: np.ndarray, aligner: cm.Aligner) -> dict[str, float]:
    """Closed geodesics a second in one batch of aligned pairs, with and without the path that is straightened."""
    found = cm.align(first, second, aligner)
    q1, q2 = srvfs_along(jnp.asarray(first), jnp.asarray(second), found, 2 * first.shape[-1])
    join = lambda: jax.block_until_ready(joined(q1, q2, _GEODESIC_STEPS))  # noqa: E731
    path = join()
    bend = lambda: jax.block_until_ready(straighten(path))  # noqa: E731
    bend()
    joining, bending = least_seconds(join), least_seconds(bend)
    return {
        "batch": len(first),
        "steps": _GEODESIC_STEPS,
        "straightened_per_second": len(first) / bending,
        "joined_and_straightened_per_second": len(first) / (joining + bending),
    }


def beside_fdasrsf(first: np.ndarray, second: np.ndarray, speeds: dict) -> dict:
    """fdasrsf on the same pairs: its speed, and how much larger its distances are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from fdasrsf.curve_functions import elastic_distance_curve  # pyright: ignore

    pairs = list(zip(first, second, strict=True))
    theirs, seconds = timed(lambda: np.array([distance_by(elastic_distance_curve, a, b) for a, b in pairs]))
    rate = len(first) / seconds
    compared: dict = {"pairs": len(first), "pairs_per_second": rate}
    for name, measured in speeds.items():
        ours = np.asarray(cm.align(first, second, PRESETS[name]).distance)
        compared[name] = {
            "times_faster": measured["align_pairs_per_second"] / rate,
            "distance_less_by_median": float(np.median(theirs - ours)),
            "distance_less_by_least": float((theirs - ours).min()),
        }
    return compared


def distance_by(elastic_distance_curve: Callable, a: np.ndarray, b: np.ndarray) -> float:
    """The peer takes closed curves in float64 with the end point repeated."""
    closed = (np.concatenate([c, c[:, :1]], axis=1).astype(float) for c in (a, b))
    return float(elastic_distance_curve(*closed, closed=1, rotation=True, scale=False)[0])


def picture(pairs: dict[str, list], samples: list, path: Path) -> None:
    """Draw time and memory against pairs, and time against samples; thin lines are proportional to the pairs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 3.4), layout="constrained")
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
