"""Curves with repeated samples, in numpy: the same curve without them, and the way back.

A repeated sample is a stop of the parametrisation, not a feature of the shape. A trigonometric interpolant would
overshoot there, so it is taken through the distinct samples only, and sampled as often as the given curve.
"""

import numpy as np

Places = dict[int, np.ndarray]


def distinct(curves: np.ndarray) -> tuple[np.ndarray, Places]:
    """Curves `(b, d, n)` without repeated samples, and where the samples of those that had some lie, `(n + 1,)`."""
    new = np.any(curves != np.roll(curves, 1, axis=2), axis=1)
    places: Places = {}
    for index in np.flatnonzero(~new.all(axis=1)):
        kept = curves[index][:, new[index]]
        if not places:
            curves = curves.copy()
        curves[index] = _resampled(kept, curves.shape[2])
        rank = np.cumsum(new[index]) - 1
        places[int(index)] = np.append(rank, rank[0] + kept.shape[1]) / kept.shape[1]
    return curves, places


def original_parameter(warp: np.ndarray, places: Places) -> np.ndarray:
    """Warps `(b, m + 1)` into the parameters of distinct curves, as warps into those of the curves as given."""
    if places:
        warp = np.array(warp)
    for index, place in places.items():
        moved = _lift(warp[index], place, _equal(place))
        warp[index] = np.append(moved[:-1], moved[0] + 1)
    return warp


def _equal(place: np.ndarray) -> np.ndarray:
    return np.linspace(0, 1, len(place))


def _lift(x: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    turns = np.floor(x - nodes[0])
    return np.interp(x - turns, nodes, values) + turns


def _resampled(curve: np.ndarray, n: int) -> np.ndarray:
    """The trigonometric interpolant of `(d, m)` samples at `n >= m` equal parameters."""
    m = curve.shape[1]
    spectrum = np.fft.rfft(curve, axis=1)
    if m % 2 == 0:
        spectrum[:, -1] /= 2
    return (np.fft.irfft(spectrum, n=n, axis=1) * (n / m)).astype(curve.dtype)
