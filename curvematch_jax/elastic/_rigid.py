"""Alignment by rotation and start point alone, both curves by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._aligner import Aligner, Alignment, check_least
from ._certify import path_distance
from ._frame import AnyArray
from ._lanes import dot, fusion_barrier, rotate
from ._mirror import WithImage, both, nearer, with_images
from ._refine import refine, warps_of
from ._rotation import best_rotation
from ._start import Peak, best_start, shift_covariances
from ._tables import CAPACITY, CurveTable, tabulate

_KNOTS, _STEPS, _NODES = 256, 3, 2


class RigidTable(NamedTuple):
    """Tangents at equal arc lengths; and the whole table, where distances are measured, not estimated."""

    tangents: Float[Array, "b d n"]
    curve: CurveTable | None


@dataclass(frozen=True)
class Rigid(Aligner):
    """Alignment by rotation and start point.

    Attributes:
        grid: arc lengths at which curves are compared.
        measured: whether `distance` is that of the alignment. Else it is an estimate from the tangents on the grid
            alone: many times as fast, in a fraction of the memory, and a few hundredths off for curves with corners.
        mirror: whether curve2 may be taken for its mirror image, where that is nearer.
        chunk: pairs computed at once.
    """

    warps: ClassVar[bool] = False

    grid: int = 64
    measured: bool = True
    mirror: bool = False
    chunk: int = 64

    def __post_init__(self) -> None:
        check_least(self, {"grid": 8, "chunk": 1})

    @staticmethod
    def estimate() -> Rigid:
        """Distances alone, not measured: small tables, of which many fit into a processor's cache at once."""
        return Rigid(measured=False, chunk=512)

    def tabulate(self, curve: Float[AnyArray, "b d n"]) -> RigidTable | WithImage:
        return with_images(self._table, curve) if self.mirror else self._table(curve)

    def align(self, first: Any, second: Any) -> Alignment:
        return nearer(self._aligned(*both(first, second))) if self.mirror else self._aligned(first, second)

    def distance(self, first: Any, second: Any) -> Float[Array, " b"]:
        if self.mirror:
            return jnp.minimum(*jnp.split(self._distance(*both(first, second)), 2))
        return self._distance(first, second)

    def _table(self, curve: Float[AnyArray, "b d n"]) -> RigidTable:
        table = tabulate(curve, CAPACITY)  # here arc length is all that relates the parameters of the curves
        size = table.tangents.shape[-1]
        if size % self.grid:
            raise ValueError(f"Rigid.grid = {self.grid}: it has to divide {size}.")
        return RigidTable(table.tangents[..., :: size // self.grid], table if self.measured else None)

    def _aligned(self, first: RigidTable, second: RigidTable) -> Alignment:
        if first.curve is None or second.curve is None:
            raise ValueError("Rigid(measured=False) estimates distances only: use Rigid() to align.")
        peak = best_start(shift_covariances(first.tangents, second.tangents))
        half = jnp.broadcast_to((peak.shift / (2 * self.grid))[:, None], (len(peak.shift), _KNOTS))
        true, curves = first.curve.count[0] > 0, (first.curve, second.curve)
        state = refine(*curves, half, best_rotation(peak.covariance), _STEPS, true, shifted=True)
        warp1, warp2 = warps_of(*curves, state.u)
        distance = path_distance(*curves, state.rotation, warp1, warp2, _NODES)
        return Alignment(jnp.moveaxis(state.rotation, -1, 0), warp1, warp2, distance)

    def _distance(self, first: RigidTable, second: RigidTable) -> Float[Array, " b"]:
        if self.measured:
            return self._aligned(first, second).distance
        peak = best_start(shift_covariances(first.tangents, second.tangents))
        return _estimate(first.tangents, second.tangents, peak)


def _estimate(t1: Float[Array, "b d n"], t2: Float[Array, "b d n"], peak: Peak) -> Float[Array, " b"]:
    """`arccos <t1, R t2>` for t2 shifted, by a parabola between its samples; through the chord, precise near 0.

    The squared chord to a parabola of unit vectors is the parabola of the squared chords to each.
    """
    n = t1.shape[-1]
    place = (peak.nearest[:, None] + jnp.asarray(np.arange(-1, n + 1), jnp.int32)[None]) % n
    look_up = lambda: jnp.take_along_axis(t2, place[:, None], axis=2, mode="promise_in_bounds")  # noqa: E731
    around = jnp.moveaxis(fusion_barrier(look_up, peak.nearest[0] >= 0), 1, 0)
    t1, t2 = jnp.moveaxis(t1, 1, 0), rotate(best_rotation(peak.covariance)[..., None], around)
    apart = [t1 - t2[..., k : k + n] for k in range(3)]
    chords = [weight * jnp.mean(dot(x, x), axis=-1) for weight, x in zip(peak.weights, apart, strict=True)]
    return 2 * jnp.arcsin(jnp.minimum(jnp.sqrt(jnp.maximum(sum(chords), 0)) / 2, 1))
