"""Curves with repeated samples, in numpy: the same curve without them, and the way back.

A repeated sample is a stop of the parametrisation, not a feature of the shape. A trigonometric interpolant would
overshoot there, so it is taken through the distinct samples only, and sampled as often as the given curve.
"""

from typing import Any

import numpy as np

from ._frame import AnyArray, namespace

Places = dict[int, np.ndarray]


def resolution(n: int, dtype: Any) -> float:
    """How far apart samples of a curve of size 1 to 2 have to be, to be told from rounding."""
    return min(4 * float(np.finfo(dtype).eps), 1e-3 / n)


def is_new(curves: AnyArray, dtype: Any = None) -> AnyArray:
    """Which samples of curves `(*b, d, n)` differ from the one before, by more than the rounding of `dtype`, `(*b, n)`.

    Of a run of equal samples the first is new, also where the run goes over the end; the first sample always is.
    """
    xp = namespace(curves)
    size = (curves.max(axis=-1, keepdims=True) - curves.min(axis=-1, keepdims=True)).max(axis=-2, keepdims=True)
    tolerance = size * resolution(curves.shape[-1], curves.dtype if dtype is None else dtype) / 2
    differs = lambda other: (abs(curves - other) > tolerance).any(axis=-2)  # noqa: E731
    new = differs(xp.roll(curves, 1, axis=-1))
    count = new.astype(np.int32)
    last_run = xp.cumsum(count[..., ::-1], axis=-1)[..., ::-1] <= count  # Nothing new comes after.
    over_the_end = last_run & ~new[..., :1]
    first = (np.arange(curves.shape[-1]) == 0).reshape((1,) * (new.ndim - 1) + (-1,))
    return (new & ~over_the_end) | first


def distinct(curves: np.ndarray, dtype: Any = None) -> tuple[np.ndarray, Places]:
    """Curves `(b, d, n)` without repeated samples, and where the samples of those that had some lie, `(n + 1,)`.

    The first sample stays first. What is equal up to the rounding of `dtype`, the curves' own unless given, is
    repeated. Curves without repeated samples are handed back as they are.
    """
    new = np.asarray(is_new(curves, dtype))
    places: Places = {}
    for index in np.flatnonzero(~new.all(axis=1)):
        kept = curves[index][:, new[index]]
        if kept.shape[1] < 3:
            continue
        if not places:
            curves = curves.copy()
        places[int(index)] = _places(curves[index], new[index])
        curves[index] = _resampled(kept, curves.shape[2])
    return curves, places


def original_parameter(warp: np.ndarray, places: Places) -> np.ndarray:
    """Lifted warps `(b, m + 1)` of distinct curves, as parameters of the curves as they were given.

    Monotone, with `warp[m] = warp[0] + 1` or `- 1`, before and after. Where the given curve stops at repeated samples,
    the result jumps over them, or to some place among them.
    """
    warp = np.array(warp)
    for index, place in places.items():
        warp[index] = _relabelled(warp[index], place, _equal(place))
    return warp


def distinct_parameter(warp: np.ndarray, places: Places) -> np.ndarray:
    """Lifted warps `(b, m + 1)` of curves as they were given, as parameters of the distinct curves: the way back."""
    warp = np.array(warp)
    for index, place in places.items():
        warp[index] = _relabelled(warp[index], _equal(place), place)
    return warp


def _places(curve: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Parameters, on the distinct curve, of the samples `(d, n)` of the given one, and of its end."""
    rank, kept = np.cumsum(new) - 1, int(new.sum())
    tail = len(new) - int(np.argmax(new[::-1]))  # after the last new sample: a run of it, and then of the first one
    to_first, to_last = (np.abs(curve[:, tail:] - curve[:, [k]]).max(axis=0) for k in (0, tail - 1))
    rank[tail:] += np.maximum.accumulate(to_first < to_last)
    return np.append(rank, kept) / kept


def _equal(place: np.ndarray) -> np.ndarray:
    return np.linspace(0, 1, len(place))


def _relabelled(warp: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A lifted warp with the parameters `nodes` as `values`, between 0 and 1."""
    x = warp.astype(float)
    turns = np.floor(x - nodes[0])
    found = (np.interp(x - turns, nodes, values) + turns).astype(warp.dtype)
    found[-1] = found[0] + np.sign(x[-1] - x[0])
    return np.clip(found, min(found[0], found[-1]), max(found[0], found[-1]))  # Against the rounding of the sum.


def _resampled(curve: np.ndarray, n: int) -> np.ndarray:
    """The trigonometric interpolant of `(d, m)` samples at `n > m` equal parameters, without the alternating mode of
    even m: the curve that the samples alone would be taken for."""
    m = curve.shape[1]
    spectrum = np.fft.rfft(curve, axis=1)
    if m % 2 == 0:
        spectrum[:, -1] = 0
    return (np.fft.irfft(spectrum, n=n, axis=1) * (n / m)).astype(curve.dtype)
