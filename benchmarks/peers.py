"""Other packages beside this one, on the same curves and the same surface.

    python -m benchmarks peers [--pairs 4] [--batch 64] [--samples 100] [--out FILE.json]

The curves are generated leaves in the plane and in R^3, the surface is a generated horse. A package that is not
installed is left out: `pip install fdasrsf lapy geomstats`; geomstats 2.8 needs a numpy below 2.4.

    curves    CPU milliseconds a pair after compilation. `fast` and `accurate` are of this package, in one batch; the
              others take the first `--pairs` pairs one by one. `above_accurate`: how much larger their distances are;
              `failed`: pairs that ended with an error
    fdasrsf   closed curves, rotation, its default dynamic programming
    geomstats open curves by parametrisation alone: it has no closed curves, and one group action at a time
    surface   CPU seconds of 20 eigenvalues by LaPy, and of all parts with their spectrum here; how far the eigenvalues
              are apart. LaPy's are those of the mesh as given, ours those of the cleaned and smoothed surface
"""

from __future__ import annotations

import argparse
import functools as ft
import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

import curvematch_jax as cm
from curvematch_jax.datasets import leaves

from ._measure import PRESETS, T, say
from ._record import record

_RUNS = 3
_EIGENVALUES = 20


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--pairs", type=int, default=4, metavar="N", help="given to the other packages")
    parser.add_argument("--batch", type=int, default=64, metavar="N", help="pairs given to this package")
    parser.add_argument("--samples", type=int, default=100, metavar="N", help="of each curve")


def run(arguments: argparse.Namespace) -> None:
    found = {f"R^{d}": on_curves(d, arguments.pairs, arguments.batch, arguments.samples) for d in (2, 3)}
    record(arguments, {"curves": found, "surface": on_surface()})


def on_curves(d: int, pairs: int, batch: int, samples: int) -> dict[str, Any]:
    """Each package on pairs of closed curves in R^d."""
    made = leaves(2 * batch, seed=1, n=samples, d=d).curves
    first, second = made[:batch], made[batch:]
    best, found = np.empty(0), {}
    for name in ("fast", "accurate"):
        distances = ft.partial(cm.elastic_distance, first, second, PRESETS[name])
        distances().block_until_ready()
        best, seconds = cpu_timed(lambda distances=distances: np.asarray(distances()), _RUNS)
        found[name] = {"milliseconds": 1e3 * seconds / batch}
    for name, distance in {"fdasrsf": by_fdasrsf, "geomstats": by_geomstats}.items():
        if find_spec(name):
            say(f"{name} in R^{d}")
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found[name] = beside(distance, first[:pairs], second[:pairs], best[:pairs])
    return found


def beside(distance: Callable, first: np.ndarray, second: np.ndarray, best: np.ndarray) -> dict[str, Any]:
    """Another package on some pairs; of those on which it ends with an error, the number."""

    def found_or_nan(a: np.ndarray, b: np.ndarray) -> float:
        try:
            return distance(a, b)
        except ValueError as error:
            say(str(error))
            return np.nan

    distances, seconds = cpu_timed(lambda: [found_or_nan(a, b) for a, b in zip(first, second, strict=True)])
    above = np.array(distances) - best
    known = above[np.isfinite(above)]
    facts = {"milliseconds": 1e3 * seconds / len(first), "failed": len(above) - len(known)}
    return facts | ({"above_accurate": {"least": known.min(), "median": np.median(known)}} if len(known) else {})


def by_fdasrsf(a: np.ndarray, b: np.ndarray) -> float:
    from fdasrsf.curve_functions import elastic_distance_curve  # pyright: ignore

    return float(elastic_distance_curve(closed(a), closed(b), closed=1, rotation=True)[0])


def by_geomstats(a: np.ndarray, b: np.ndarray) -> float:
    from geomstats.geometry.discrete_curves import DiscreteCurvesStartingAtOrigin  # pyright: ignore

    space: Any = DiscreteCurvesStartingAtOrigin(ambient_dim=len(a), k_sampling_points=a.shape[1] + 1)
    space.equip_with_group_action("reparametrizations")
    space.equip_with_quotient()
    points = [space.projection(closed(curve).T / float(cm.length(curve))) for curve in (a, b)]
    return float(np.squeeze(space.quotient.metric.dist(*points)))


def closed(curve: np.ndarray) -> np.ndarray:
    """With the first point once more at the end."""
    return np.append(curve, curve[:, :1], axis=1)


def on_surface() -> dict[str, Any]:
    """Parts with their spectrum, and LaPy's spectrum of the same mesh."""
    mesh = cm.creature("horse").mesh
    parts, seconds = cpu_timed(lambda: cm.extract_parts(mesh))
    found: dict[str, Any] = {"vertices": len(mesh.vertices), "parts_seconds": seconds}
    if find_spec("lapy"):
        from lapy import TriaMesh  # pyright: ignore
        from lapy.shapedna import compute_shapedna  # pyright: ignore

        surface = TriaMesh(mesh.vertices, mesh.faces)
        theirs, found["lapy_seconds"] = cpu_timed(lambda: compute_shapedna(surface, k=_EIGENVALUES + 1, lump=True))
        scaled = np.log(theirs["Eigenvalues"][1:] * surface.area())
        found["eigenvalues_apart"] = float(np.expm1(np.abs(scaled - parts.spectrum)).max())
    return found


def cpu_timed(call: Callable[[], T], runs: int = 1) -> tuple[T, float]:
    """The result of a call, and the least CPU seconds of a few."""
    results, seconds = [], []
    for _ in range(runs):
        start = time.process_time()
        results.append(call())
        seconds.append(time.process_time() - start)
    return results[-1], min(seconds)
