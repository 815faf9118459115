"""Karcher means and medians of closed curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from .._progress import Progress, reporter
from ..elastic import Aligner
from ._check import as_unmirrored
from ._descent import Descent, State
from ._medoid import rough_medoids
from ._sample import Sample, as_sample, as_weights, in_order
from ._tangent import curves_of

_CONVERGED = 1e-3  # norm of the gradient, in radians


class Mean(NamedTuple):
    """A mean shape, or a median, and the curves aligned to it. Groups are on the axes `*b`.

    Of curve i, the point `c_i(warp_i(t))` is matched with the mean's at t:
    `aligned_i(t) = scale_i rotation_i c_i(warp_i(t))`, centred.

    Attributes:
        curve: `(*b, d, n)`, centred, of the geometric mean of the curves' lengths.
        srvf: `(*b, d, N)`, of the mean as a polygon of N sides, passed at equal times; N is a multiple of n.
        aligned: `(*b, k, d, n)`, the curves sampled where the mean is, turned, and of its length.
        rotation: `(*b, k, d, d)`.
        warp: `(*b, k, N + 1)`, lifted, in turns; their mean is the identity but for where curves start.
        scale: `(*b, k)`.
        tangents: `(*b, k, d, N)`, at `srvf`, of the geodesics to the aligned curves.
        distances: `(*b, k)`, their lengths in radians.
        weights: `(*b, k)`, of sum 1.
        lengths: `(*b, k)`, of the curves.
        history: `(s, *b)`, what is minimised, from the start and after each step: it falls.
        gradient: `(*b,)`, its norm at the end, in radians.
        converged: `(*b,)`, whether that is 1e-3 or less.
    """

    curve: np.ndarray
    srvf: np.ndarray
    aligned: np.ndarray
    rotation: np.ndarray
    warp: np.ndarray
    scale: np.ndarray
    tangents: np.ndarray
    distances: np.ndarray
    weights: np.ndarray
    lengths: np.ndarray
    history: np.ndarray
    gradient: np.ndarray
    converged: np.ndarray

    @property
    def variance(self) -> np.ndarray:
        """`sum_i w_i d_i^2`, `(*b,)`, in square radians."""
        return np.asarray(np.sum(self.weights * self.distances.astype(float) ** 2, axis=-1))

    @property
    def start(self) -> np.ndarray:
        """Where on each curve the mean's first sample is, `(*b, k)`, in turns."""
        return self.warp[..., 0] % 1


def karcher_mean(
    curves: ArrayLike | Sequence,
    weights: ArrayLike | None = None,
    aligner: Aligner | None = None,
    progress: Progress = False,
) -> Mean:
    """The shape that minimises `sum_i w_i d(mu, c_i)^2` over closed curves mu.

    d is the geodesic distance of closed curves, blind to position, scale, rotation, start point and parametrisation.
    The descent is deterministic, and the same for every order of the curves.

    Args:
        curves: `(*b, k, d, n)`, k of each group; or a list of arrays `(d, n_i)`, resampled by arc length.
        weights: `(*b, k)`, 1 unless given; with 0 a curve is aligned but does not count.
        aligner: `Aligner.accurate()` unless given. The descent ends in a local minimum with any aligner; with
            `Aligner.fast()` it is more often a worse one, in which a curve is aligned badly.
        progress: False, True for a bar on stderr, or a function of (done, total).

    Raises:
        ValueError: for fewer than two curves, and for what are no closed curves of one dimension.
    """
    return _descended(curves, weights, 2, aligner, progress)


def karcher_median(
    curves: ArrayLike | Sequence,
    weights: ArrayLike | None = None,
    aligner: Aligner | None = None,
    progress: Progress = False,
) -> Mean:
    """The shape that minimises `sum_i w_i d(mu, c_i)`: as `karcher_mean`, but outliers hardly move it."""
    return _descended(curves, weights, 1, aligner, progress)


def _descended(curves, weights, power: int, aligner: Aligner | None, progress: Progress) -> Mean:
    given = as_groups(curves)
    *batch, k, d, n = given.shape
    if k < 2:
        raise ValueError(f"curves has shape {given.shape}: a mean is of two curves or more.")
    shares = as_weights(weights, given.shape[:-2])
    aligner = as_unmirrored(aligner, Aligner.accurate)
    group = np.repeat(np.arange(int(np.prod(batch))), k)
    found = means(given.reshape(-1, d, n), group, shares.reshape(-1), power, aligner, progress)
    return _shaped(found, tuple(batch), k)


def as_groups(curves: ArrayLike | Sequence) -> np.ndarray:
    """Curves `(*b, k, d, n)`, checked; lists of curves of different lengths as one group."""
    if isinstance(curves, list | tuple) or np.ndim(curves) < 4:
        return as_sample(curves)
    shape = np.shape(curves)
    flat = as_sample(np.reshape(np.asarray(curves), (-1, *shape[-2:])))
    return flat.reshape(*shape[:-2], *flat.shape[1:])


def means(
    curves: np.ndarray, group: np.ndarray, weights: np.ndarray, power: int, aligner: Aligner, progress: Progress = False
) -> Mean:
    """Of groups of any sizes: curves `(K, d, n)`, their groups `(K,)`, 0 to G - 1, and weights, of sum 1 in each.

    What is of each curve has K entries, in the order given; what is of each mean has G.
    """
    order = np.lexsort((np.argsort(in_order(curves)), group))
    sample, group, shares = Sample.of(curves[order], aligner), group[order], weights[order]
    starts = rough_medoids(sample.curves, group, shares)
    descent = Descent(sample, group, shares, power, aligner)
    state, history, gradient = descent.run(starts, reporter(progress, "averaging", "rounds"))
    return _result(descent, state, history, gradient, np.argsort(order), curves.shape[2])


def _result(descent: Descent, state: State, history, gradient, back: np.ndarray, n: int) -> Mean:
    """The mean, what is of each curve in the order in which they were given."""
    sample, laid = descent.sample, state.laid
    length = np.exp(descent.summed(np.log(sample.lengths.astype(float)), descent.weights))
    own = length[descent.group]
    return Mean(
        curve=curves_of(state.base, n, length),
        srvf=state.base,
        aligned=curves_of(laid.q, n, own)[back],
        rotation=laid.rotation[back],
        warp=sample.original(laid.warp)[back],
        scale=(own / sample.lengths).astype(laid.q.dtype)[back],
        tangents=laid.v[back],
        distances=laid.distance[back],
        weights=descent.weights[back],
        lengths=sample.lengths[back],
        history=history,
        gradient=gradient,
        converged=gradient <= _CONVERGED,
    )


def as_mean(name: str, mean: Any) -> Mean:
    """A mean of one group; `ValueError` for those of several, and for anything else."""
    if not isinstance(mean, Mean):
        raise ValueError(f"{name} is no mean: give what karcher_mean or karcher_median of curves returns.")
    if mean.srvf.ndim != 2:
        raise ValueError(f"{name} has groups {mean.srvf.shape[:-2]}: give the mean of one group.")
    return mean


_OF_EACH_CURVE = ("aligned", "rotation", "warp", "scale", "tangents", "distances", "weights", "lengths")


def _shaped(mean: Mean, batch: tuple[int, ...], k: int) -> Mean:
    """Groups of one size on the axes of the batch."""
    fields = {}
    for name, value in mean._asdict().items():
        if name == "history":
            fields[name] = value.reshape((-1, *batch))
        else:
            fields[name] = value.reshape((*batch, *((k,) if name in _OF_EACH_CURVE else ()), *value.shape[1:]))
    return Mean(**fields)
