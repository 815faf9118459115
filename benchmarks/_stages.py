"""What a pair costs, stage by stage: times of the engine's own functions.

Seconds are of the whole machine, with a thread for each core at work on a chunk of its own, as the engine runs them. A
round of the search is the search up to it less the search before it; what the named stages leave of an alignment is its
rest: the choice of the best path, and what XLA does otherwise when the stages are compiled together.
"""

import functools as ft
from collections.abc import Callable

import jax
import numpy as np

import curvematch_jax as cm
from curvematch_jax.elastic._certify import path_distance
from curvematch_jax.elastic._refine import from_warps, refine
from curvematch_jax.elastic._search import search
from curvematch_jax.elastic._start import best_start, shift_covariances

from ._measure import cores, seconds_each


def stages(aligner: cm.Aligner, curves1: np.ndarray, curves2: np.ndarray) -> dict:
    """Microseconds a pair of the stages of one aligner, in the order in which they run, and which of them bounds it.

    Tables are those of two curves: `distance_matrix` makes them once for each curve, not for each pair.
    """
    curves1, curves2 = curves1[: aligner.chunk], curves2[: aligner.chunk]
    tabulate = jax.jit(aligner.tabulate)
    tables = tabulate(curves1), tabulate(curves2)
    price = ft.partial(_microseconds, len(curves1))
    costs = {"tables": 2 * price(aligner.tabulate, curves1)}
    inside: dict[str, float] = {}
    if isinstance(aligner, cm.Elastic):
        inside = _elastic_costs(price, aligner, *tables)
    elif isinstance(aligner, cm.Rigid):
        inside = {"start points": price(lambda a, b: best_start(shift_covariances(a.tangents, b.tangents)), *tables)}
    inside["rest"] = price(aligner.distance, *tables) - sum(inside.values())
    costs |= inside
    total = sum(costs.values())
    report: dict = {
        "align_bound_by": max(costs, key=costs.__getitem__),
        "distance_matrix_bound_by": max(inside, key=inside.__getitem__),
        "stages": {name: {"microseconds": cost, "share": cost / total} for name, cost in costs.items()},
    }
    if isinstance(aligner, cm.Elastic):
        for number, round_ in enumerate(aligner.rounds, start=1):
            row = report["stages"][f"round {number}"]
            cells = round_.paths * round_.nodes * (2 * round_.width + 1)
            row["updates"] = cells * (2 * round_.slopes + 1)  # steps considered in all cells of the strips of a pair
            row["updates_per_second"] = row["updates"] / row["microseconds"] * 1e6
    return report


def _elastic_costs(price: Callable, aligner: cm.Elastic, first, second) -> dict[str, float]:
    """Paths are true ones in all stages: how far the reads of neighbouring lanes lie apart depends on them."""
    costs: dict[str, float] = {}
    for number in range(1, len(aligner.rounds) + 1):
        so_far = price(ft.partial(_paths, aligner, number), first, second)
        costs[f"round {number}"] = so_far - sum(costs.values())
    paths = jax.jit(ft.partial(_paths, aligner, len(aligner.rounds)))(first, second)
    costs["refinement"] = price(ft.partial(_refined, aligner), first, second, paths)
    found = jax.jit(aligner.align)(first, second)
    rotation = np.moveaxis(np.asarray(found.rotation), 0, -1)
    measure = ft.partial(path_distance, nodes=aligner.nodes)
    return costs | {"certificate": price(measure, first, second, rotation, found.warp1, found.warp2)}


def _paths(aligner: cm.Elastic, rounds: int, first, second):
    return search(first, second, aligner.rounds[:rounds], first.count[0] > 0)


def _refined(aligner: cm.Elastic, first, second, paths):
    best = paths.best(aligner.paths)
    warp1, warp2 = (warp.reshape(-1, warp.shape[-1]) for warp in (best.warp1, best.warp2))
    rotation = best.rotation.reshape(*best.rotation.shape[:2], -1)
    return refine(first, second, from_warps(warp1, warp2, aligner.knots), rotation, aligner.steps, first.count[0] > 0)


def _microseconds(pairs: int, function: Callable, *operands) -> float:
    return seconds_each(jax.jit(function), *operands, callers=cores()) / pairs * 1e6
