"""Means and components of closed curves: against fdasrsf in the plane, and of many curves in space.

    python -m benchmarks statistics [--curves 30] [--many 100 1000] [--samples 100] [--out FILE.json]

`planar`: the mean and the components of the same generated leaves by `karcher_mean` and `TangentPCA`, and by
`fdacurve(mode="C")` of fdasrsf with its `karcher_mean`, `karcher_cov` and `shape_pca`, on one core, from curves whose
first point is repeated at the end. Both have compiled before.

    variance  the mean squared distance of the leaves to each of the two means, by `elastic_distance` with
              `Aligner.accurate()`, which certifies what its alignments achieve; `own` is the one each states itself
    mean      the distance of each mean to the leaf that the others were made around

`space`: what fdasrsf says to three leaves in R^3, if it raises. `many`: `karcher_mean` of so many leaves in R^3, and
the most memory that the process holds meanwhile (Linux).

Of times there are `seconds` by the clock, and `cpu`, those of all cores, on which other programs weigh less.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

import curvematch_jax as cm
from curvematch_jax.datasets import Leaves, leaves
from curvematch_jax.statistics import TangentPCA, karcher_mean

from ._measure import forget_peak, resident_bytes, say, timed
from ._record import record

_SHOWN = 3  # components
_MIB = 2**20


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--curves", type=int, default=30, metavar="N", help="compared with fdasrsf")
    parser.add_argument("--many", type=int, nargs="*", default=[100, 1000], metavar="N", help="in R^3")
    parser.add_argument("--samples", type=int, default=100, metavar="N", help="of each curve")


def run(arguments: argparse.Namespace) -> None:
    if not find_spec("fdasrsf"):
        raise ImportError("fdasrsf is what this compares with, and not installed: pip install fdasrsf")
    made = leaves(arguments.curves, seed=1, n=arguments.samples)
    results = {
        "planar": {"curvematch_jax": ours(made), "fdasrsf": theirs(made)},
        "space": {"fdasrsf": raised(np.asarray(leaves(3, n=arguments.samples, d=3).curves))},
        "many": {str(count): large(count, arguments.samples) for count in arguments.many},
    }
    record(arguments, results)


def ours(made: Leaves) -> dict[str, Any]:
    """Mean and components by this package."""
    analysed = lambda: (mean := karcher_mean(made.curves), TangentPCA.fit(mean))  # noqa: E731
    analysed()
    (mean, components), times = clocked(analysed)
    own = float(mean.variance)
    return rated("curvematch_jax", mean.curve, made, own, components.deviations, times)


def theirs(made: Leaves) -> dict[str, Any]:
    """Mean and components by fdasrsf."""
    averaged(made.curves[:2])
    found, times = clocked(lambda: averaged(made.curves))
    own = float(found.qun[-1]) / len(made.curves)
    rounds = len(found.qun) - 1
    deviations = np.sqrt(found.s / found.q_mean.shape[1])
    return rated("fdasrsf", found.beta_mean[:, :-1], made, own, deviations, times) | {"rounds": rounds}


def averaged(curves: np.ndarray) -> Any:
    """fdasrsf's object with the mean and the components of curves `(k, d, n)`."""
    from fdasrsf.curve_stats import fdacurve  # pyright: ignore

    closed = np.concatenate([curves, curves[..., :1]], axis=2).astype(float)
    found = fdacurve(np.moveaxis(closed, 0, 2), mode="C", N=closed.shape[2])
    with contextlib.redirect_stdout(io.StringIO()):
        found.karcher_mean(cores=1)
        found.karcher_cov()
        found.shape_pca(_SHOWN)
    return found


def rated(
    name: str, mean: np.ndarray, made: Leaves, own: float, deviations: np.ndarray, times: dict[str, float]
) -> dict[str, Any]:
    """What a mean is worth, by distances that favour neither."""
    accurate, mean = cm.Aligner.accurate(), np.asarray(mean, np.float32)
    apart = np.asarray(cm.elastic_distance(mean, made.curves, accurate), float)
    off = float(cm.elastic_distance(mean, made.mean.astype(np.float32), accurate))
    say(f"{name}: variance {np.mean(apart**2):.5f}, {off:.4f} from the leaf, {times['seconds']:.1f} s")
    return {
        "variance": float(np.mean(apart**2)),
        "own": own,
        "mean": off,
        "deviations": deviations[:_SHOWN].tolist(),
    } | times


def raised(curves: np.ndarray) -> str | None:
    """What fdasrsf says to curves in R^3; None if it has a mean of them."""
    try:
        averaged(curves)
    except Exception as problem:
        return f"{type(problem).__name__}: {problem}"
    return None


def large(count: int, samples: int) -> dict[str, Any]:
    """The mean of many leaves in R^3; a few have been averaged before."""
    karcher_mean(leaves(3, n=samples, d=3).curves)
    made = leaves(count, seed=2, n=samples, d=3)
    forget_peak()
    mean, times = clocked(lambda: karcher_mean(made.curves))
    peak = resident_bytes("VmHWM") / _MIB
    say(f"{count} curves in R^3: {times['seconds']:.1f} s, {peak:.0f} MiB")
    return times | {
        "peak_mib": peak,
        "converged": bool(mean.converged),
        "variance": float(mean.variance),
        "steps": len(mean.history) - 1,
    }


def clocked(call: Callable[[], Any]) -> tuple[Any, dict[str, float]]:
    """The result, and seconds by the clock and of all cores."""
    cpu = time.process_time()
    result, seconds = timed(call)
    return result, {"seconds": seconds, "cpu": time.process_time() - cpu}
