"""Speed and quality of the engine: what bounds it, how it grows, and fdasrsf on the same pairs in the same run.

    python benchmarks/engine.py [--quick | --full] [--out FILE.json] [--picture FILE.png]

JSON on stdout, progress on stderr. The curves are random closed curves of five Fourier modes in R^3, 100 samples by arc
length.

    roofs        a matrix product, a copy, and reads from a table: what the machine reaches at best
    presets      pairs a second of `align` and `distance_matrix`; microseconds, operations and reads a pair of each
                 stage, beside the roofs; which stage bounds the preset; updates a second of dynamic programming
    geodesics    closed geodesics a second, from aligned pairs
    peer         fdasrsf (closed curves, rotation, its default dynamic programming): its speed, and its distances
                 beside ours; install it with the `test` extra
    first_calls  seconds of a first call in a new process, without compiled code on disk and with it
    scaling      seconds and peak memory against the number of pairs, and against samples

It takes some minutes; `--quick` about one, without `accurate` and with figures that are only good for a look.
"""

import argparse
import json
import os
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from _measure import PRESETS, fourier_curves, least_seconds, say
from _record import machine, versions, write
from _runs import against_pairs, against_samples, first_calls, picture
from _stages import measured_roofs, stages

import curvematch_jax as cm
from curvematch_jax.elastic import aligned_srvf, project_closed, to_srvf
from curvematch_jax.elastic._geodesic import straighten
from curvematch_jax.elastic._preshape import great_circle

_SLOW = 8  # the share of the pairs that `accurate` gets
_GEODESIC_STEPS = 6


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        presets: measured one by one, first calls included.
        pairs: of curves, for the speed of the presets.
        peer_pairs: given to fdasrsf.
        geodesics: in one batch.
        copied: float32 numbers, for the speed of a copy.
        sides: curves on either side of the matrices that show scaling, by preset.
        samples: n of the curves that show scaling.
        samples_side: curves on either side of the matrices with these.
    """

    presets: tuple[str, ...] = tuple(PRESETS)
    pairs: int = 4096
    peer_pairs: int = 8
    geodesics: int = 256
    copied: int = 2**26
    sides: tuple[tuple[str, tuple[int, ...]], ...] = (("rigid", (32, 100, 316, 1000)), ("fast", (32, 100, 316)))
    samples: tuple[int, ...] = (50, 100, 200, 400)
    samples_side: int = 32

    @classmethod
    def quick(cls) -> "Plan":
        sides = ("rigid", (32, 100)), ("fast", (16, 32))
        return cls(("rigid", "fast"), 512, 1, 32, 2**24, sides, samples=(50, 100), samples_side=16)

    @classmethod
    def full(cls) -> "Plan":
        return cls(sides=(("rigid", (32, 100, 316, 1000)), ("fast", (32, 100, 316, 1000))))


def main() -> None:
    parser = argparse.ArgumentParser(description="Speed and quality of the engine.")
    much = parser.add_mutually_exclusive_group()
    much.add_argument("--quick", action="store_const", dest="plan", const=Plan.quick(), help="about a minute")
    much.add_argument("--full", action="store_const", dest="plan", const=Plan.full(), help="a million fast pairs too")
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="of the scaling")
    parser.set_defaults(plan=Plan())
    options = parser.parse_args()
    results = report(options.plan)
    print(json.dumps(rounded(results), indent=1, allow_nan=False))
    if options.out:
        write(options.out, rounded(results))
    if options.picture:
        options.picture.parent.mkdir(parents=True, exist_ok=True)
        picture(results["scaling"]["pairs"], results["scaling"]["samples"], options.picture)


def report(plan: Plan) -> dict:
    """Everything there is to say about the engine."""
    first, second = fourier_curves(0, plan.pairs), fourier_curves(1, plan.pairs)
    say("roofs")
    results: dict = {
        "versions": versions("fdasrsf"),
        "machine": machine() | {"of": os.cpu_count()},
        "pairs": plan.pairs,
        "roofs": measured_roofs(floats=plan.copied),
        "presets": {},
    }
    for name in plan.presets:
        aligner = PRESETS[name]
        say(f"{name}: speed and stages")
        count = plan.pairs if name != "accurate" else plan.pairs // _SLOW
        speeds = speed(first[:count], second[:count], aligner)
        results["presets"][name] = speeds | stages(aligner, first, second, results["roofs"])
    say("geodesics")
    results["geodesics"] = geodesics(first[: plan.geodesics], second[: plan.geodesics], PRESETS["fast"])
    if plan.peer_pairs:
        say("fdasrsf")
        few = slice(plan.peer_pairs)
        results["peer"] = beside_fdasrsf(first[few], second[few], results["presets"])
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        results["first_calls"] = first_calls(plan.presets, cache)
        results["scaling"] = {
            "pairs": against_pairs(dict(plan.sides), cache),
            "samples": against_samples(plan.samples, plan.samples_side, cache),
        }
    return results


def rounded(results):
    """Five digits are more than there is in a time."""
    if isinstance(results, dict):
        return {key: rounded(value) for key, value in results.items()}
    if isinstance(results, list):
        return [rounded(value) for value in results]
    return float(f"{results:.5g}") if isinstance(results, float) else results


def speed(first: np.ndarray, second: np.ndarray, aligner: cm.Aligner) -> dict[str, float]:
    """Pairs a second, compiled already: of pairs of curves, and of a matrix of about as many pairs."""
    side = int(len(first) ** 0.5)
    align = lambda: jax.block_until_ready(cm.align(first, second, aligner))  # noqa: E731
    matrix = lambda: cm.distance_matrix(first[:side], second[:side], aligner)  # noqa: E731
    rates = {}
    for name, call, count in (("align", align, len(first)), ("distance_matrix", matrix, side * side)):
        call()
        rates[f"{name}_pairs_per_second"] = count / least_seconds(call)
    return rates


def geodesics(first: np.ndarray, second: np.ndarray, aligner: cm.Aligner) -> dict[str, float]:
    """Closed geodesics a second in one batch of aligned pairs, with and without the path that is straightened."""
    found = cm.align(first, second, aligner)
    q1, q2 = to_srvf(first), aligned_srvf(jnp.asarray(second), found.rotation, found.warp)
    join = lambda: project_closed(great_circle(project_closed(q1), project_closed(q2), _GEODESIC_STEPS))  # noqa: E731
    path = jax.block_until_ready(join())
    bend = lambda: jax.block_until_ready(straighten(path))  # noqa: E731
    bend()
    joining, bending = least_seconds(lambda: jax.block_until_ready(join())), least_seconds(bend)
    return {
        "batch": len(first),
        "steps": _GEODESIC_STEPS,
        "straightened_per_second": len(first) / bending,
        "joined_and_straightened_per_second": len(first) / (joining + bending),
    }


def beside_fdasrsf(first: np.ndarray, second: np.ndarray, presets: dict) -> dict:
    """fdasrsf on the same pairs: its speed, and how much larger its distances are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from fdasrsf.curve_functions import elastic_distance_curve

    start = time.perf_counter()
    theirs = np.array([distance_by(elastic_distance_curve, a, b) for a, b in zip(first, second, strict=True)])
    rate = len(first) / (time.perf_counter() - start)
    compared: dict = {"pairs": len(first), "pairs_per_second": rate}
    for name, measured in presets.items():
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


if __name__ == "__main__":
    main()
