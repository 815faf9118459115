"""The figures of comparison.md: fdasrsf, geomstats and LaPy beside this package, on the same curves and meshes.

    pip install ".[prep]" fdasrsf lapy geomstats "numpy<2.4" && python docs/measure_peers.py

Times are CPU seconds of this process after compilation, the least of three runs where runs are short. Distances are
those that each package returns.
"""

import time
import warnings
from collections.abc import Callable

import numpy as np

from curvematch_jax import Aligner, align, creature, distance_matrix, extract_parts
from curvematch_jax.datasets import leaves

PAIRS, BATCH = 4, 64


def cpu_seconds(work: Callable, runs: int = 3) -> tuple[float, object]:
    """The least CPU time of a few runs, and what the last one returned."""
    seconds, result = [], None
    for _ in range(runs):
        start = time.process_time()
        result = work()
        seconds.append(time.process_time() - start)
    return min(seconds), result


def closed(curve: np.ndarray) -> np.ndarray:
    """With the first point once more at the end."""
    return np.append(curve, curve[:, :1], axis=1)


def curves(d: int) -> np.ndarray:
    return leaves(2 * BATCH, seed=1, d=d).curves


def ours(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    found = {}
    for name, aligner in (("fast", Aligner.fast()), ("accurate", Aligner.accurate())):
        align(first, second, aligner)
        seconds, alignment = cpu_seconds(lambda aligner=aligner: np.asarray(align(first, second, aligner).distance))
        found[name] = alignment
        print(
            f"  curvematch_jax, {name}: {1e3 * seconds / len(first):.3f} ms a pair, mean {alignment[:PAIRS].mean():.4f}"
        )
    return found["accurate"]


def by_fdasrsf(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    from fdasrsf.curve_functions import elastic_distance_curve

    def distances():
        pairs = zip(first[:PAIRS], second[:PAIRS], strict=True)
        return np.array([elastic_distance_curve(closed(a), closed(b), closed=1, rotation=True)[0] for a, b in pairs])

    seconds, found = cpu_seconds(distances, runs=1)
    print(f"  fdasrsf, closed: {1e3 * seconds / PAIRS:.0f} ms a pair, mean {found.mean():.4f}")
    return found


def by_geomstats(first: np.ndarray, second: np.ndarray) -> None:
    """Open curves by parametrisation alone: it knows no closed curves, and one group action at a time."""
    from geomstats.geometry.discrete_curves import DiscreteCurvesStartingAtOrigin

    space = DiscreteCurvesStartingAtOrigin(ambient_dim=first.shape[1], k_sampling_points=first.shape[2] + 1)
    space.equip_with_group_action("reparametrizations")
    space.equip_with_quotient()
    a, b = (space.projection(closed(curve[0]).T / length(curve[0])) for curve in (first, second))
    seconds, found = cpu_seconds(lambda: space.quotient.metric.dist(a, b), runs=1)
    print(f"  geomstats, open: {1e3 * seconds:.0f} ms a pair, distance {float(np.squeeze(found)):.4f}")


def length(curve: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(closed(curve)), axis=0).sum())


def spectra() -> None:
    from lapy import TriaMesh
    from lapy.shapedna import compute_shapedna

    mesh = creature("horse").mesh
    surface = TriaMesh(mesh.vertices, mesh.faces)
    seconds, found = cpu_seconds(lambda: compute_shapedna(surface, k=21, lump=True))
    scaled = np.asarray(found["Eigenvalues"])[1:] * surface.area()
    parts_seconds, parts = cpu_seconds(lambda: extract_parts(mesh), runs=1)
    apart = np.abs(np.log(scaled) - parts.spectrum).max()
    print(f"surface of {len(mesh.vertices)} vertices")
    print(f"  LaPy, 20 eigenvalues: {seconds:.2f} s; ours differ by at most {100 * np.expm1(apart):.1f} %")
    print(f"  curvematch_jax, all parts with the spectrum: {parts_seconds:.2f} s")


def main() -> None:
    warnings.simplefilter("ignore")
    for d in (2, 3):
        made = curves(d)
        first, second = made[:BATCH], made[BATCH:]
        print(f"closed curves of 100 samples in R^{d}")
        best = ours(first, second)
        theirs = by_fdasrsf(first, second)
        print(f"  fdasrsf is above `accurate` by {np.median(theirs - best[:PAIRS]):.3f} radians in the median")
        by_geomstats(first, second)
    start = time.process_time()
    distance_matrix(made)
    print(f"matrix of {len(made)} curves, fast: {time.process_time() - start:.1f} s with what is left to compile")
    spectra()


if __name__ == "__main__":
    main()
