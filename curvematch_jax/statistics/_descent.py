"""The descent to a mean or a median of each of several groups of closed curves, all at once.

Minimised is `sum_i w_i d(mu, c_i)^p`, p = 2 for the mean (Karcher 1977), 1 for the median. Every curve is aligned to
mu, `v_i = log_mu(q_i)`, and mu moves along the mean of the `v_i`, with the weights `w_i` or, for the median, `w_i /
d_i` (Weiszfeld's step; Fletcher, Venkatasubramanian, Joshi 2009). A step that does not lower the sum is halved and
taken again. A curve keeps its warp unless another one brings it nearer, so the sum falls through alignment as well.

mu has a parametrisation of its own: the mean of the warps, `sum_i w_i gamma_i`, is the identity (Srivastava and
Klassen, "Functional and Shape Data Analysis", 2016). So a piece that some curves lack gets its share of mu's samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._progress import Report
from ..elastic import Aligner, align
from ..elastic._curve import srvf_of
from ..elastic._lookup import divided
from ._laying import Laid, find_warps, lay, nearer
from ._sample import Sample
from ._tangent import exp, vertices

_TOLERANCE = 3e-4  # of the gradient's norm, in radians
_GAIN = 1e-3  # a warp has to bring a curve nearer by this share
_SETTLED = 2e-3  # share of the sum that another alignment of all curves still takes away
_ROUNDS, _FIXED_ROUNDS = 8, 30  # with alignment, and without
_LEAST_STEP = 1 / 32
_FINE = 8  # entries of a warp to a side, where many are averaged
_NEAREST = 0.05  # share of the mean distance below which Weiszfeld's weights grow no more


@dataclass
class State:
    """Where a descent stands: G base shapes `(G, d, N)`, K curves laid onto them, and the sums `(G,)`."""

    base: np.ndarray
    laid: Laid
    total: np.ndarray

    def where(self, groups: np.ndarray, group: np.ndarray, other: State) -> State:
        """This state in the groups that are marked, the other one in the rest."""
        pick = lambda mask, x, y: np.where(mask.reshape(-1, *(1,) * (x.ndim - 1)), x, y)  # noqa: E731
        laid = Laid(*(pick(groups[group], x, y) for x, y in zip(self.laid, other.laid, strict=True)))
        return State(pick(groups, self.base, other.base), laid, pick(groups, self.total, other.total))


@dataclass(frozen=True, eq=False)
class Descent:
    """K curves in G groups, their weights `(K,)` of sum 1 in each group, and the power of the distance."""

    sample: Sample
    group: np.ndarray
    weights: np.ndarray
    power: int
    aligner: Aligner

    def run(self, starts: np.ndarray, report: Report) -> tuple[State, np.ndarray, np.ndarray]:
        """The last state, the sums after each step `(steps + 1, G)`, and the gradients' norms `(G,)`.

        `starts` are the numbers of the curves from which the groups start. Groups of two have their mean on the
        geodesic that their alignment gives.
        """
        paired = len(self.group) == 2 * len(starts) and bool(np.all(np.bincount(self.group) == 2))
        state = self.pairs() if paired else self.centred_start(starts)
        history, step, settled = [state.total], np.ones(len(starts)), paired
        for number in range(_ROUNDS + _FIXED_ROUNDS):
            report(number, _ROUNDS + _FIXED_ROUNDS)
            settled = settled or number >= _ROUNDS
            ahead = self.gradient(state)
            moving = (_norms(ahead) > _TOLERANCE) & (step > _LEAST_STEP)
            if settled and not moving.any():
                break
            trial = self.moved(state, np.where(moving, step, 0)[:, None, None] * ahead, settled)
            better = trial.total < state.total
            settled = settled or bool(np.all(trial.total > (1 - _SETTLED) * state.total))
            step = np.where(better | ~moving, 1.0, step / 2)
            if better.any():
                state = trial.where(better, self.group, state)
                history.append(state.total)
        report(_ROUNDS + _FIXED_ROUNDS, _ROUNDS + _FIXED_ROUNDS)
        return state, np.stack(history), _norms(self.gradient(state))

    def centred_start(self, starts: np.ndarray) -> State:
        """Each group's base is the curve it starts from, passed at the mean of all curves' warps."""
        even = _even(self.sample.sides, len(starts))
        warp = self._fine_warps(self._polygons(starts, even))
        warp[starts] = _even(warp.shape[1] - 1)
        times = self.times(warp)
        base = self._polygons(starts, np.stack([np.interp(even[0], t, _even(len(t) - 1)) for t in times]))
        return self.state(base, self.carried(warp, times))

    def pairs(self) -> State:
        """Two curves of each group, matched at the times of the path that aligns them; the first is the base."""
        index = np.argsort(self.group, kind="stable").reshape(-1, 2)
        found = align(self.sample.curves[index[:, 0]], self.sample.curves[index[:, 1]], self.aligner)
        warp = np.zeros((len(self.group), self.sample.sides + 1), self.sample.curves.dtype)
        for side, path in enumerate((found.warp1, found.warp2)):
            warp[index[:, side]] = divided(path, self.sample.sides)
        return self.state(self._polygons(index[:, 0], warp[index[:, 0]]), warp)

    def state(self, base: np.ndarray, warp: np.ndarray) -> State:
        laid = lay(self.sample, base, self.group, warp)
        return State(base, laid, self.summed(laid.distance.astype(float) ** self.power, self.weights))

    def moved(self, state: State, step: np.ndarray, settled: bool) -> State:
        """The state a step further, the curves aligned anew unless alignments have settled."""
        base = np.asarray(exp(state.base, step.astype(state.base.dtype)))
        if settled:
            return self.state(base, state.laid.warp)
        both = _finer(state.laid.warp), self._fine_warps(base)
        warp = nearer(self.sample, base, self.group, both, _GAIN, _FINE)
        times = self.times(warp)
        return self.state(_passed(base, times), self.carried(warp, times))

    def gradient(self, state: State) -> np.ndarray:
        """The mean of the velocities, `(G, d, N)`; for the median that of Weiszfeld's step."""
        weights = self.weights
        if self.power == 1:
            least = _NEAREST * self.summed(state.laid.distance, weights)[self.group]
            weights = weights / np.maximum(state.laid.distance, np.maximum(least, np.finfo(float).tiny))
            weights = weights / self.summed(np.ones(len(weights)), weights)[self.group]
        return self.summed(state.laid.v, weights)

    def summed(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weighted sums `(G, ...)` of values `(K, ...)`."""
        total = np.zeros((int(self.group.max()) + 1, *values.shape[1:]))
        np.add.at(total, self.group, weights.reshape(-1, *(1,) * (values.ndim - 1)) * values)
        return total

    def times(self, warp: np.ndarray) -> np.ndarray:
        """Where the mean of the warps of each group is at the base's times, from 0 to 1."""
        return self.summed(warp.astype(float) - warp[:, :1], self.weights)

    def carried(self, warp: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Warps `(K, N + 1)` after the base has got the parametrisation in which their mean is the identity."""
        even = _even(self.sample.sides)
        found = [np.interp(even, times[g], row) for g, row in zip(self.group, warp.astype(float), strict=True)]
        return np.stack(found).astype(warp.dtype)

    def _fine_warps(self, base: np.ndarray) -> np.ndarray:
        return find_warps(self.sample, base, self.group, self.aligner, _FINE * self.sample.sides)

    def _polygons(self, index: np.ndarray, warp: np.ndarray) -> np.ndarray:
        """SRVFs of curves as polygons through the points of a warp."""
        return srvf_of(np.diff(_read(self.sample.points[index], warp), axis=2))


def _finer(warp: np.ndarray) -> np.ndarray:
    """Warps `(K, N + 1)` with every piece divided evenly."""
    share = np.arange(_FINE, dtype=warp.dtype) / np.asarray(_FINE, warp.dtype)
    inside = warp[:, :-1, None] + np.diff(warp, axis=1)[..., None] * share
    return np.concatenate([inside.reshape(len(warp), -1), warp[:, -1:]], axis=1)


def _passed(base: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Base shapes passed so that the mean of the warps is the identity: their polygons, cut at other places."""
    even = _even(base.shape[2])
    places = np.stack([np.interp(even, t, _even(len(t) - 1)) for t in times])
    return srvf_of(np.diff(_read(np.asarray(vertices(base)), places), axis=2))


def _read(polygons: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Points `(b, d, k)` of closed polygons `(b, d, m)` at parameters `(b, k)`."""
    closed = np.concatenate([polygons, polygons[..., :1]], axis=2)
    nodes = _even(polygons.shape[2])
    read = [[np.interp(place % 1, nodes, row) for row in one] for one, place in zip(closed, places, strict=True)]
    return np.asarray(read, polygons.dtype)


def _even(pieces: int, rows: int | None = None) -> np.ndarray:
    """Equal times from 0 to 1, `(pieces + 1,)` or in so many rows."""
    times = np.arange(pieces + 1) / pieces
    return times if rows is None else np.tile(times, (rows, 1))


def _norms(field: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(np.sum(field**2, axis=1), axis=1))
