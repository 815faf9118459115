"""Samples of closed curves: what their statistics need to know of each, and what a sample has to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import ArrayLike

from ..elastic import Aligner, Tables, resample
from ..elastic._align import order_key
from ..elastic._check import MIN_SAMPLES, as_framed, as_shapes
from ..elastic._curve import length
from ..elastic._distinct import Places, distinct, original_parameter
from ..elastic._tabulated import tables_of
from ._check import as_reals

_OVERSAMPLING = 8
_MOST_READ = 4096  # entries of a table to read from
_LEAST_SIDES, _MANY = 200, 400


@dataclass(frozen=True, eq=False)
class Sample:
    """K closed curves `(K, d, n)`, ready to be laid onto others again and again.

    Attributes:
        curves: centred, of a size near 1, without repeated samples.
        points: `(K, d, m)`, their trigonometric interpolants, to be read linearly.
        tables: as the aligner sees them.
        lengths: `(K,)`, in the units of the curves as they were given.
        places: of repeated samples.
        sides: of the polygons that stand for them.
    """

    curves: np.ndarray
    points: np.ndarray
    tables: Tables
    lengths: np.ndarray
    places: Places
    sides: int

    @classmethod
    def of(cls, curves: np.ndarray, aligner: Aligner) -> Sample:
        """Of curves `(K, d, n)` that `as_sample` has checked."""
        shapes, places = distinct(np.asarray(as_shapes("curves", curves)))
        n = shapes.shape[2]
        points = _oversampled(shapes, n * max(1, min(_OVERSAMPLING, _MOST_READ // n)))
        sides, lengths = sides_of(n), np.asarray(length(curves))
        # Of as many samples as a base has: tables of other sizes round differently, and the warp of a copy shows it.
        tables = tables_of(_oversampled(shapes, sides), aligner)
        return cls(shapes, points, tables, lengths, places, sides)

    def __len__(self) -> int:
        return len(self.curves)

    def original(self, warp: np.ndarray) -> np.ndarray:
        """Warps `(K, m + 1)` as parameters of the curves as they were given."""
        return original_parameter(warp, self.places)


def sides_of(n: int) -> int:
    """How many sides a polygon has that stands for a curve of n samples: a multiple of n."""
    return n * max(1 if n > _MANY else 2, -(-_LEAST_SIDES // n))


def as_sample(curves: ArrayLike | Sequence, samples: int | None = None) -> np.ndarray:
    """Closed curves `(K, d, n)`, from an array or from a list of arrays `(d, n_i)` of any lengths.

    Curves of different lengths are resampled by arc length to `samples`, the most that one has unless given.
    Raises `ValueError` for what are no closed curves, for different dimensions, and for none.
    """
    if isinstance(curves, list | tuple):
        curves = _of_a_list(curves, samples)
    found = np.asarray(as_framed_numbers(curves))
    if found.ndim != 3:
        raise ValueError(f"curves has shape {found.shape}: give a sample of closed curves, (curves, d, n).")
    if not len(found):
        raise ValueError("curves holds no curve: give a sample of closed curves, (curves, d, n).")
    return found if samples in (None, found.shape[2]) else np.asarray(resample(found, samples))


def as_framed_numbers(curves: ArrayLike | Sequence) -> np.ndarray:
    """Checked curves as they are, in what JAX computes in."""
    shape, frame = as_framed("curves", curves)
    return np.asarray(frame.points("curves", shape))


def _of_a_list(curves: Sequence, samples: int | None) -> Sequence | np.ndarray:
    """Curves of a list of one length; lists of equal arrays come back as they are."""
    for index, curve in enumerate(curves):
        if np.ma.is_masked(curve):
            raise ValueError(f"curve {index} of the list is a masked array that hides samples: give whole curves.")
    if len({np.shape(curve) for curve in curves}) < 2:
        return curves
    flat = [index for index, curve in enumerate(curves) if np.ndim(curve) != 2]
    if flat:
        raise ValueError(f"curve {flat[0]} of the list has shape {np.shape(curves[flat[0]])}: give each as (d, n).")
    dimensions = sorted({np.shape(curve)[0] for curve in curves})
    if len(dimensions) > 1:
        raise ValueError(f"the curves have different dimensions, {dimensions}: a sample is of one.")
    for index, curve in enumerate(curves):
        as_framed(f"curve {index} of the list", curve)
    most = max(np.shape(curve)[1] for curve in curves) if samples is None else samples
    return np.stack([np.asarray(resample(curve, max(most, MIN_SAMPLES))) for curve in curves])


def as_weights(weights: ArrayLike | None, shape: tuple[int, ...]) -> np.ndarray:
    """Weights `(*b, k)` of sum 1 in each group. `ValueError` for others than finite numbers, 0 or more, some above."""
    if weights is None:
        return np.full(shape, 1 / shape[-1])
    found = as_reals("weights", weights)
    try:
        found = np.broadcast_to(found, shape)
    except ValueError:
        raise ValueError(f"weights has shape {found.shape}: give a number for each curve, {shape}.") from None
    if (found < 0).any() or ((found > 0).sum(axis=-1) < 2).any():
        raise ValueError(
            "weights holds negative numbers, or zeros for all curves of a group but one: two or more have to count."
        )
    found = found / found.max(axis=-1, keepdims=True)
    return found / found.sum(axis=-1, keepdims=True)


def in_order(curves: np.ndarray) -> np.ndarray:
    """An order of curves `(K, d, n)` that depends on the curves alone, so that sums do, to the last digit."""
    return np.argsort(np.asarray(order_key(np.asarray(as_shapes("curves", curves)))), kind="stable")


def _oversampled(curves: np.ndarray, m: int) -> np.ndarray:
    """The trigonometric interpolants at `k/m`, without the alternating mode of even n."""
    n = curves.shape[2]
    spectrum = np.fft.rfft(curves.astype(float), axis=2)
    spectrum[..., (n + 1) // 2 :] = 0
    return (np.fft.irfft(spectrum, n=m, axis=2) * (m / n)).astype(curves.dtype)
