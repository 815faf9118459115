"""The surfaces on the way from one part to another: geodesics of their level curves, put together again in space."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from curvematch_jax.elastic import Geodesic, align, geodesic
from curvematch_jax.surface import Parts

# Lengths of level curves (L,) and their centres (L, 3) seen from the feature point, in the object's unit.
_Sizes: TypeAlias = tuple[np.ndarray, np.ndarray]

# Radians: how far alignments of different levels turn a part, and still mean the same.
_ALIKE = 0.8


class Way(NamedTuple):
    """From one part to another in s steps, through L levels that both have; the feature point stays at 0."""

    curves: np.ndarray  # (s + 1, L, n, 3) in the first part's position, in its unit
    levels: np.ndarray  # (L,)
    geodesics: Geodesic  # of the L levels


def way(first: Parts, i: int, second: Parts, j: int, count: int, steps: int) -> Way:
    """The way from part i of one object to part j of another, through at most `count` levels.

    A geodesic knows shapes alone. Sizes and places are interpolated: the second part is laid onto the first by one
    rotation about the feature point, and what a level's own alignment turned it by is undone step by step. A level that
    was turned otherwise, since it looks much the same upside down, stays as it was aligned: undone, it would spin.

    Raises:
        ValueError: the parts have no level in common.
    """
    levels = np.flatnonzero(first.mask[i] & second.mask[j])[:count]
    if not len(levels):
        raise ValueError(f"part {i} of {first.name} and part {j} of {second.name} have no level in common")
    one, other = first.curves[i, levels], second.curves[j, levels]
    found = geodesic(one, other, steps)
    shapes = np.asarray(found.curves(), float).transpose(1, 0, 3, 2)  # (s + 1, L, n, 3)
    turned = Rotation.from_matrix(np.asarray(align(one, other).rotation, float))
    before, after = _sizes(first, i, levels), _sizes(second, j, levels)
    onto = _onto(shapes, turned, before, after)
    after = after[0], onto.apply(after[1])
    left = (onto * turned.inv()).as_rotvec()
    left[np.linalg.norm(left, axis=1) > _ALIKE] = 0
    times = np.linspace(0, 1, steps + 1)
    curves = [_between(shape, left, before, after, time) for shape, time in zip(shapes, times, strict=True)]
    return Way(np.stack(curves), levels, found)


def lofted(curves: np.ndarray) -> np.ndarray:
    """Curves (L, n, 3) with start points moved, so that samples of one number are as near as can be on the next."""
    aligned = [curves[0]]
    count = curves.shape[1]
    shifts = (np.arange(count) + np.arange(count)[:, None]) % count
    for curve in curves[1:]:
        rolled = curve[shifts]
        aligned.append(rolled[np.argmin(((rolled - aligned[-1]) ** 2).sum(axis=(1, 2)))])
    return np.stack(aligned)


def _onto(shapes: np.ndarray, turned: Rotation, before: _Sizes, after: _Sizes) -> Rotation:
    """The rotation about the feature point that lays the second part onto the first, by the levels that agree."""
    alike = np.stack([(turned * each.inv()).magnitude() for each in turned]) <= _ALIKE
    agree = alike[alike.sum(axis=1).argmax()]
    back = np.stack([each.inv().apply(curve) for each, curve in zip(turned, shapes[-1], strict=True)])
    first = _placed(shapes[0][agree], before[0][agree], before[1][agree])
    second = _placed(back[agree], after[0][agree], after[1][agree])
    return Rotation.align_vectors(first, second)[0]


def _sizes(parts: Parts, part: int, levels: np.ndarray) -> _Sizes:
    return parts.lengths[part, levels], (parts.centres[part, levels] - parts.points[part]) / parts.diameter


def _placed(shapes: np.ndarray, lengths: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """All points (p, 3) of curves of unit length, put where they belong."""
    return (shapes * lengths[:, None, None] + centres[:, None]).reshape(-1, 3)


def _between(
    shapes: np.ndarray,
    left: np.ndarray,
    before: _Sizes,
    after: _Sizes,
    time: float,
) -> np.ndarray:
    lengths, centres = ((1 - time) * a + time * b for a, b in zip(before, after, strict=True))
    turned = [Rotation.from_rotvec(time * turn).apply(shape) for turn, shape in zip(left, shapes, strict=True)]
    return _placed(np.stack(turned), lengths, centres).reshape(shapes.shape)
