"""Distances of very many pairs: matrices, and lists of pairs."""

import functools as ft
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import ArrayLike

from .._progress import Progress, reporter
from . import _chunks as chunks
from ._align import align_chunk
from ._aligner import Aligner, Alignment
from ._check import as_aligner, as_shapes, check_pair
from ._distinct import distinct
from ._metric import check_metric, length_between
from ._tabulated import Tables, tables_of


class _Pairs(NamedTuple):
    rows: np.ndarray
    columns: np.ndarray
    place: int  # number of the first pair


def distance_matrix(
    a: ArrayLike | Sequence,
    b: ArrayLike | Sequence | None = None,
    aligner: Aligner | None = None,
    progress: Progress = False,
    metric: str = "arc",
) -> np.ndarray:
    """Elastic distances `(A, B)`, in radians, of all pairs of closed curves `(A, d, n)` and `(B, d, n)`.

    Without `b`, of `a` with itself, each pair computed once. Memory beyond the result is the curves' tables (about
    35 KB a curve in R^3 in float32) and a few chunks, however many pairs there are.

    Args:
        aligner: `Aligner.fast()` unless given.
        progress: False, True for a bar on stderr, or a function of (done, total).
        metric: which distance, as in `elastic_distance`.

    Raises:
        ValueError: as `align`, and for an unknown metric.
    """
    check_metric(metric)
    aligner = as_aligner(aligner, Aligner.fast)
    first = _checked("a", a)
    second = first if b is None else _checked("b", b)
    check_pair(first[:1], second[:1])
    result = np.zeros((len(first), len(second)), np.result_type(first, second))
    if b is None:
        total, pairs = len(first) * (len(first) - 1) // 2, _triangle(len(first), aligner.chunk)
    else:
        total, pairs = result.size, _rectangle(*result.shape, aligner.chunk)
    for part, values in _distances(first, second, pairs, total, aligner, progress, metric):
        result[part.rows, part.columns] = values
        if b is None:
            result[part.columns, part.rows] = values
    return result


def pair_distances(
    a: ArrayLike | Sequence | Tables,
    b: ArrayLike | Sequence | Tables,
    pairs: ArrayLike,
    aligner: Aligner | None = None,
    progress: Progress = False,
    metric: str = "arc",
) -> np.ndarray:
    """Elastic distances `(P,)`, in radians, of the pairs `a[i], b[j]` that the rows of `pairs`, `(P, 2)`, list.

    As `distance_matrix`, for some of its entries. Curves that are compared again and again can be given as what
    `tabulate` made of them. Raises `ValueError` as `align`, and for tables made for another aligner or metric;
    `IndexError` for an index that points outside of the curves.
    """
    check_metric(metric)
    aligner = as_aligner(aligner, Aligner.fast)
    first = _curves("a", a)
    second = first if b is a else _curves("b", b)
    _check_tables(first, second, aligner, metric)
    pairs = np.asarray(pairs)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
        raise ValueError(f"pairs has shape {pairs.shape} and dtype {pairs.dtype}: give integers (P, 2).")
    if pairs.size and (pairs.min() < 0 or pairs[:, 0].max() >= len(first) or pairs[:, 1].max() >= len(second)):
        raise IndexError(f"pairs points outside of the {len(first)} curves in a and {len(second)} in b.")
    result = np.zeros(len(pairs), np.result_type(first.dtype, second.dtype))
    listed = (
        _Pairs(pairs[start : start + aligner.chunk, 0], pairs[start : start + aligner.chunk, 1], start)
        for start in range(0, len(pairs), aligner.chunk)
    )
    for part, values in _distances(first, second, listed, len(pairs), aligner, progress, metric):
        result[part.place : part.place + len(values)] = values
    return result


def tabulate(curves: ArrayLike | Sequence, aligner: Aligner | None = None) -> Tables:
    """What alignment needs to know of closed curves `(C, d, n)`, for `pair_distances`.

    About 35 KB a curve of R^3 in float32, whatever n; 768 bytes for `Rigid(measured=False)`.
    Raises `ValueError` as `align`.
    """
    return tables_of(_checked("curves", curves), as_aligner(aligner, Aligner.fast))


def _curves(name: str, curves: ArrayLike | Sequence | Tables) -> np.ndarray | Tables:
    return curves if isinstance(curves, Tables) else _checked(name, curves)


def _check_tables(first: np.ndarray | Tables, second: np.ndarray | Tables, aligner: Aligner, metric: str) -> None:
    """Raises `ValueError` unless both can be compared by this aligner and metric."""
    for curves in (first, second):
        if isinstance(curves, Tables) and (curves.aligner != aligner or metric != "arc"):
            raise ValueError(
                f"tables made for {curves.aligner} and the metric 'arc' cannot serve {aligner} and {metric!r}: "
                "give curves."
            )
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        check_pair(first[:1], second[:1])
        return
    d1, d2 = (curves.dimension if isinstance(curves, Tables) else curves.shape[1] for curves in (first, second))
    if d1 != d2:
        raise ValueError(f"curves of {d1} and of {d2} dimensions have no distance.")


def _checked(name: str, curves: ArrayLike | Sequence) -> np.ndarray:
    array = np.asarray(as_shapes(name, curves))
    if array.ndim != 3:
        raise ValueError(f"{name} has shape {array.shape}: give one batch of closed curves, (curves, d, n).")
    return distinct(array)[0]


def _triangle(count: int, size: int) -> Iterator[_Pairs]:
    """The pairs i < j, row by row, in chunks."""
    first = np.concatenate([[0], np.cumsum(np.arange(count - 1, 0, -1))])  # number of the first pair of a row
    for start in range(0, int(first[-1]), size):
        number = np.arange(start, min(start + size, int(first[-1])))
        rows = np.searchsorted(first, number, side="right") - 1
        yield _Pairs(rows, number - first[rows] + rows + 1, start)


def _rectangle(rows: int, columns: int, size: int) -> Iterator[_Pairs]:
    for start in range(0, rows * columns, size):
        number = np.arange(start, min(start + size, rows * columns))
        yield _Pairs(*np.divmod(number, columns), start)


def _distances(
    first: np.ndarray | Tables,
    second: np.ndarray | Tables,
    pairs: Iterable[_Pairs],
    total: int,
    aligner: Aligner,
    progress: Progress,
    metric: str,
) -> Iterator[tuple[_Pairs, np.ndarray]]:
    if total == 0:
        return
    report = reporter(progress, "aligning", "pairs")
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray) and metric != "arc":
        compute = _of_curves(first, second, aligner, metric)
    else:
        compute = _of_tables(first, second, aligner)
    done = 0
    for part, values in chunks.run(compute, pairs):
        done += len(part.rows)
        report(done, total)
        yield part, values[: len(part.rows)]


def _of_tables(
    first: np.ndarray | Tables, second: np.ndarray | Tables, aligner: Aligner
) -> Callable[[_Pairs], jax.Array]:
    tables1 = first if isinstance(first, Tables) else tables_of(first, aligner)
    tables2 = tables1 if second is first else second if isinstance(second, Tables) else tables_of(second, aligner)

    def compute(part: _Pairs) -> jax.Array:
        swap = tables1.keys[part.rows] > tables2.keys[part.columns]
        rows, columns = (chunks.padded(index, aligner.chunk) for index in (part.rows, part.columns))
        first, second = tables1[rows].curves, tables2[columns].curves
        first, second = _exchanged(chunks.padded(swap, aligner.chunk), first, second)
        return _distance_chunk(aligner, first, second)

    return compute


def _of_curves(first: np.ndarray, second: np.ndarray, aligner: Aligner, metric: str) -> Callable[[_Pairs], jax.Array]:
    def compute(part: _Pairs) -> jax.Array:
        rows, columns = (chunks.padded(index, aligner.chunk) for index in (part.rows, part.columns))
        return _length_chunk(first[rows], second[columns], aligner, metric)

    return compute


def _exchanged(swap: np.ndarray, first: Any, second: Any) -> tuple[Any, Any]:
    """Both sides of a chunk in the order of their keys, in place: they are copies."""
    for one, two in zip(jax.tree.leaves(first), jax.tree.leaves(second), strict=True):
        one[swap], two[swap] = two[swap], one[swap].copy()
    return first, second


@ft.partial(jax.jit, static_argnums=0)
def _distance_chunk(aligner: Aligner, first: Any, second: Any):
    return aligner.distance(first, second)


def _length_chunk(curve1: np.ndarray, curve2: np.ndarray, aligner: Aligner, metric: str):
    found = align_chunk(aligner, curve1, curve2)
    return _lengths(curve1, curve2, found, metric)


@ft.partial(jax.jit, static_argnames="metric")
def _lengths(curve1, curve2, found: Alignment, metric: str):
    return length_between(curve1, curve2, found, metric)
