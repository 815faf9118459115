"""What a pair costs, stage by stage: times of the engine's own functions, and the operations counted in their jaxprs.

A cost is an array `(seconds, operations, reads)` to a pair. Seconds are of the whole machine, with a thread for each
core at work on a chunk of its own, as the engine runs them: so the stages of a preset add up to it.

XLA's cost analysis counts the body of a loop once, however often it runs. Here a loop counts as often as it runs, of
branches the dearer one. An operation is one floating-point result of arithmetic, a maximum included; selections,
comparisons and work on integers are none. A matrix product is two operations a term, a transform of n reals
5/2 n log2 n. A read is one element from a computed place, out of a table.
"""

import functools as ft
import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from _measure import cores, seconds_each

import curvematch_jax as cm
from curvematch_jax.elastic._align import read, represent_for
from curvematch_jax.elastic._curve import Representative
from curvematch_jax.elastic._dynamic import _backward, _forward, steps_up_to
from curvematch_jax.elastic._refine import refine
from curvematch_jax.elastic._solve import _search, on_grid
from curvematch_jax.elastic._start import find_starts, peak_shift, shift_covariances
from curvematch_jax.elastic._table import pack
from curvematch_jax.elastic._warp import to_path

_ELEMENTWISE = {
    *(
        "add",
        "add_any",
        "sub",
        "mul",
        "div",
        "rem",
        "neg",
        "abs",
        "sign",
        "max",
        "min",
        "clamp",
        "floor",
        "ceil",
        "round",
    ),
    *("square", "integer_pow", "pow", "sqrt", "rsqrt", "exp", "log", "sin", "cos", "asin", "acos", "atan2", "tanh"),
}
_OVER_OPERAND = {"reduce_sum", "reduce_max", "reduce_min", "cumsum"}


def stages(aligner: cm.Aligner, curves1: np.ndarray, curves2: np.ndarray, roofs: dict[str, float]) -> dict:
    """The stages of one preset in the order in which they run, and which of them bounds it.

    Readings are what is left of the whole: the warps that both curves see, their distances, and the order of the pair.
    Tables are those of two curves: `distance_matrix` makes them once for each curve, not for each pair.
    """
    pairs = aligner.chunk
    tables = jax.jit(ft.partial(represent_for, aligner))
    one, two = (tables(c[:pairs])._replace(times=None) for c in (curves1, curves2))
    price = ft.partial(_cost, pairs)
    costs = {"tables": 2 * price(ft.partial(represent_for, aligner), curves1[:pairs])}
    aligning = _search_costs(price, one, two, aligner) if aligner.slope else _rigid_costs(price, one, two, aligner)
    whole = price(ft.partial(read, aligner=aligner), one, two)
    costs |= aligning | {"readings": whole - _sum(aligning)}
    total = _sum(costs)
    bound = lambda names: max(names, key=lambda name: costs[name][0])  # noqa: E731
    report: dict = {
        "align_bound_by": bound(costs),
        "distance_matrix_bound_by": bound([*aligning, "readings"]),
        "stages": {name: _described(cost, total, roofs) for name, cost in (costs | {"all": total}).items()},
    }
    if aligner.slope:
        report["dynamic_programming"] = _updates(aligner, costs["dynamic programming, forward"][0], roofs)
    return report


def measured_roofs(side: int = 1024, floats: int = 2**26) -> dict[str, float]:
    """What this machine reaches at best in float32: operations a second of a matrix product, bytes a second of a copy
    (read and written ones), and reads a second from a table that fits into the cache."""
    square = jnp.ones((side, side), jnp.float32)
    product = jax.jit(lambda a, b: a @ b)
    multiplying = min(seconds_each(product, square, square, callers=callers) for callers in (1, cores()))
    copying = seconds_each(jax.jit(lambda x: x + 1), jnp.zeros(floats, jnp.float32), callers=1)
    random = np.random.default_rng(0)
    table = jnp.asarray(random.normal(size=(384, 64)), jnp.float32)
    index = jnp.asarray(random.integers(384, size=(1024, 64)), jnp.int32)
    take = jax.jit(lambda t, i: jnp.take_along_axis(t, i, axis=0, mode="promise_in_bounds"))
    return {
        "operations_per_second": 2 * side**3 / multiplying,
        "bytes_per_second": 8 * floats / copying,
        "reads_per_second": index.size / seconds_each(take, table, index, callers=cores()),
    }


def _rigid_costs(price: Callable, one: Representative, two: Representative, aligner: cm.Aligner) -> dict:
    starts = lambda a, b: peak_shift(shift_covariances(a, b))  # noqa: E731
    return {"start points": price(starts, *_coarse(one, two, aligner))}


def _search_costs(price: Callable, one: Representative, two: Representative, aligner: cm.Aligner) -> dict:
    """Start points, dynamic programming, refinement. The rest of the search is rotations and the choice of the best."""
    tangents = _coarse(one, two, aligner)
    search = {"start points": price(lambda a, b: find_starts(shift_covariances(a, b), aligner.seeds), *tangents)}
    band, steps = _band(aligner), steps_up_to(aligner.slope)
    forward = jax.jit(ft.partial(_forward, band=band, steps=steps))
    backward = jax.jit(ft.partial(_backward, band=band, steps=steps))
    lanes = tuple(jnp.tile(_lanes(t), aligner.seeds) for t in tangents)
    search["dynamic programming, forward"] = aligner.passes * price(forward, *lanes)
    search["dynamic programming, backward"] = aligner.passes * price(backward, forward(*lanes))
    find = jax.jit(ft.partial(_search, aligner=aligner))
    search["rest of the search"] = price(find, one, two) - _sum(search)
    return search | _refinement_costs(price, one, two, find(one, two), aligner)


def _refinement_costs(price: Callable, one: Representative, two: Representative, gamma, aligner: cm.Aligner) -> dict:
    """The paths are true ones: how far the reads of neighbouring lanes lie apart depends on them."""
    costs = {}
    for number, stage in enumerate(aligner.stages, start=1):
        u = to_path(gamma[:, : stage.kept].reshape(len(gamma), -1), stage.knots)
        tables = (jnp.tile(pack(_lanes(c.tangents)), stage.kept) for c in (one, two))
        refined = ft.partial(refine, steps=stage.steps, nodes=stage.nodes)
        costs[f"refinement, stage {number}"] = price(refined, *tables, u)
    return costs


def _updates(aligner: cm.Aligner, seconds: float, roofs: dict[str, float]) -> dict[str, float]:
    """Cells of the band, and steps considered in them, of all dynamic programmings of a pair.

    The total of every cell is kept, in float32: the least that goes to memory.
    """
    cells = aligner.grid * (2 * _band(aligner) + 1) * aligner.seeds * aligner.passes
    steps = len(steps_up_to(aligner.slope))
    return {
        "cells": cells,
        "steps_to_a_cell": steps,
        "updates_per_second": cells * steps / seconds,
        "of_copy": 4 * cells / seconds / roofs["bytes_per_second"],
    }


def _band(aligner: cm.Aligner) -> int:
    return max(1, round(aligner.band * aligner.grid))


def _coarse(one: Representative, two: Representative, aligner: cm.Aligner) -> tuple[jax.Array, jax.Array]:
    return on_grid(one, aligner.grid), on_grid(two, aligner.grid)


def _lanes(array: jax.Array) -> jax.Array:
    return jnp.moveaxis(array, 0, -1)


def _cost(pairs: int, function: Callable, *operands) -> np.ndarray:
    seconds = seconds_each(jax.jit(function), *operands, callers=cores())
    counted = operations_and_reads(jax.make_jaxpr(function)(*operands).jaxpr)
    return np.array([seconds, *counted]) / pairs


def _sum(costs: dict[str, np.ndarray]) -> np.ndarray:
    return np.sum(list(costs.values()), axis=0)


def _described(cost: np.ndarray, total: np.ndarray, roofs: dict[str, float]) -> dict[str, float | None]:
    """A cost in words. What is left between two times may come out below zero: then there is no rate."""
    seconds, operations, reads = (float(x) for x in cost)
    rate = lambda amount: amount / seconds if seconds > 0 else None  # noqa: E731
    return {
        "microseconds": seconds * 1e6,
        "share": seconds / float(total[0]),
        "operations": operations,
        "operations_per_second": rate(operations),
        "of_matrix_product": rate(operations / roofs["operations_per_second"]),
        "reads": reads,
        "of_table_reads": rate(reads / roofs["reads_per_second"]),
    }


def operations_and_reads(jaxpr) -> np.ndarray:
    """`(operations, reads)` of a jaxpr, as the head of this module counts them."""
    total = np.zeros(2)
    for equation in jaxpr.eqns:
        inside = [operations_and_reads(body) for body in _bodies(equation)]
        if equation.primitive.name == "cond":
            total += np.max(inside, axis=0)
        elif inside:
            total += equation.params.get("length", 1) * np.sum(inside, axis=0)
        else:
            total += _of_equation(equation)
    return total


def _bodies(equation) -> list:
    """The jaxprs that an equation runs: parameters that are one, close over one, or list such."""
    found = []
    for parameter in equation.params.values():
        for item in parameter if isinstance(parameter, tuple | list) else [parameter]:
            body = getattr(item, "jaxpr", item)
            found += [body] if hasattr(body, "eqns") else []
    return found


def _of_equation(equation) -> tuple[float, float]:
    name, out = equation.primitive.name, equation.outvars[0].aval
    sizes = [variable.aval.size for variable in equation.invars]
    if name == "gather":
        return 0, out.size
    if name == "fft":
        return 2.5 * max(sizes[0], out.size) * math.log2(math.prod(equation.params["fft_lengths"])), 0
    if not jnp.issubdtype(out.dtype, jnp.inexact):
        return 0, 0
    if name == "dot_general":
        summed = equation.params["dimension_numbers"][0][0]
        return 2 * out.size * math.prod(equation.invars[0].aval.shape[axis] for axis in summed), 0
    return (sizes[0] if name in _OVER_OPERAND else out.size if name in _ELEMENTWISE else 0), 0
