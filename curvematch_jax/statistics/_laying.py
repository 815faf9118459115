"""Curves laid onto base shapes: read along a warp as polygons, turned, and seen from the base's tangent space."""

from __future__ import annotations

import functools as ft
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..elastic import Aligner
from ..elastic import _chunks as chunks
from ..elastic._align import _align_tables
from ..elastic._curve import interpolate, srvf_of
from ..elastic._frame import AnyArray
from ..elastic._matched import warp_onto
from ..elastic._preshape import sphere_distance
from ..elastic._rotation import best_rotation, covariance
from ..elastic._tabulated import tables_of
from ._sample import Sample
from ._tangent import log, vertices

_CHUNK = 32


class Laid(NamedTuple):
    """K curves laid onto base shapes, arrays of numpy.

    Attributes:
        warp: `(K, N + 1)`, parameters of the curve, lifted, at the N equal times of its base.
        rotation: `(K, d, d)`, from the curve to the base.
        q: `(K, d, N)`, SRVFs of the curves, turned, as polygons through the points of those parameters.
        v: `(K, d, N)`, the velocities of the geodesics from the base to q.
        distance: `(K,)`, their lengths, in radians.
    """

    warp: np.ndarray
    rotation: np.ndarray
    q: np.ndarray
    v: np.ndarray
    distance: np.ndarray


def lay(sample: Sample, base: np.ndarray, group: np.ndarray, warp: np.ndarray) -> Laid:
    """Each curve, along its warp, laid onto `base[group]`, with the best rotation."""

    def compute(part: np.ndarray) -> tuple[Array, ...]:
        index = chunks.padded(part, _CHUNK)
        return _laid(base[group[index]], sample.points[index], warp[index])

    return Laid(*_gathered(compute, len(sample)))


def onto(base: np.ndarray, curves: np.ndarray, aligner: Aligner) -> tuple[Laid, Sample]:
    """Curves `(K, d, n)` aligned to one base `(d, N)`, and what is known of them."""
    if curves.shape[1] != base.shape[0]:
        raise ValueError(f"curves of {curves.shape[1]} dimensions cannot be laid onto one of {base.shape[0]}.")
    sample, group = Sample.of(curves, aligner), np.zeros(len(curves), int)
    warp = find_warps(sample, base[None], group, aligner, base.shape[1])
    return lay(sample, base[None], group, warp), sample


def find_warps(sample: Sample, base: np.ndarray, group: np.ndarray, aligner: Aligner, sides: int) -> np.ndarray:
    """Each curve aligned to `base[group]`: warps `(K, sides + 1)` onto equal times of the base."""
    bases = tables_of(np.asarray(vertices(base)), aligner)

    def compute(part: np.ndarray) -> tuple[Array]:
        index = chunks.padded(part, _CHUNK)
        first, second = bases[group[index]], sample.tables[index]
        return (_warps(aligner, first.curves, second.curves, first.keys > second.keys, sides),)

    return _gathered(compute, len(sample))[0]


def nearer(
    sample: Sample,
    base: np.ndarray,
    group: np.ndarray,
    warps: tuple[np.ndarray, np.ndarray],
    gain: float,
    stride: int,
) -> np.ndarray:
    """For each curve the second warp where it brings the curve nearer than the first, by a share of more than `gain`.

    Both are read at every `stride`-th entry.
    """

    def compute(part: np.ndarray) -> tuple[Array, ...]:
        index = chunks.padded(part, _CHUNK)
        onto, points = base[group[index]], sample.points[index]
        return tuple(_apart(onto, points, warp[index, ::stride]) for warp in warps)

    first, second = _gathered(compute, len(sample))
    return np.where((second < (1 - gain) * first)[:, None], warps[1], warps[0])


def _gathered(compute: Callable[[np.ndarray], Any], count: int) -> list[np.ndarray]:
    """What is computed of each chunk of the numbers below `count`, side by side."""
    parts = [np.arange(start, min(start + _CHUNK, count)) for start in range(0, count, _CHUNK)]
    found = {int(part[0]): [np.asarray(x)[: len(part)] for x in values] for part, values in chunks.run(compute, parts)}
    return [np.concatenate(column) for column in zip(*(found[k] for k in sorted(found)), strict=True)]


@jax.jit
def _laid(base: Float[AnyArray, "k d n"], points: Float[AnyArray, "k d m"], warp: Float[AnyArray, "k nodes"]):
    rotation, q = _turned(base, points, warp)
    v, distance = log(base, q)
    return warp, rotation, q, v, distance


@jax.jit
def _apart(base: Float[AnyArray, "k d n"], points: Float[AnyArray, "k d m"], warp: Float[AnyArray, "k nodes"]):
    return sphere_distance(jnp.asarray(base), _turned(base, points, warp)[1])


def _turned(base, points, warp) -> tuple[Float[Array, "k d d"], Float[Array, "k d n"]]:
    """The best rotation, and the polygon's SRVF turned by it."""
    q = srvf_of(jnp.diff(interpolate(points, warp), axis=-1))
    lanes = lambda x: jnp.moveaxis(x, 1, 0)  # noqa: E731
    rotation = jnp.moveaxis(best_rotation(covariance(lanes(base), lanes(q))), -1, 0)
    return rotation, jnp.matmul(rotation, q, precision="highest")


@ft.partial(jax.jit, static_argnums=(0, 4))
def _warps(aligner: Aligner, bases: Any, curves: Any, swap: Bool[Array, " k"], sides: int) -> Float[Array, "k nodes"]:
    """As `align`, in an order of the two that depends on their shapes alone."""
    pick = lambda x, y: jnp.where(swap.reshape(-1, *(1,) * (x.ndim - 1)), x, y)  # noqa: E731
    first, second = jax.tree.map(pick, curves, bases), jax.tree.map(pick, bases, curves)
    return warp_onto(_align_tables(aligner, first, second, swap), sides)
