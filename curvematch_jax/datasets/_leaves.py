"""Generated leaves: closed curves, planar or in R^3, with a known mean, known components and known groups."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_DENSE = 4096


class Leaves(NamedTuple):
    """Closed curves, and what they were made of.

    Attributes:
        curves: `(k, d, n)`, rotated, scaled, translated, from other start points, unevenly sampled.
        groups: `(k,)`, 0 or 1.
        scores: `(k, 2)`, how much of each component is in each leaf.
        mean: `(d, n)`, the leaf of scores 0, by arc length.
        outlines: `(k, d, n)`, the leaves by arc length, before they were moved.
    """

    curves: np.ndarray
    groups: np.ndarray
    scores: np.ndarray
    mean: np.ndarray
    outlines: np.ndarray


def leaves(
    count: int,
    seed: int = 0,
    n: int = 100,
    d: int = 2,
    deviations: tuple[float, float] = (0.1, 0.05),
    apart: float = 0.0,
    moved: bool = True,
) -> Leaves:
    """`count` leaves around one mean shape, half of them in each of two groups.

    A leaf is `(1.5 r cos t, r sin t)` with `r = 1 + .3 cos 5t + s_1 cos 2t + s_2 sin 3t`; in R^3 it is bent by `.4 cos
    2t + s_1 cos 3t` out of the plane. The mean leaf is its own mirror image. The first component keeps that symmetry
    and the second one breaks it, so they are orthogonal in every metric that knows no left and right. The scores are
    normal with the given deviations, the first around `+- apart / 2` by group.

    Args:
        count: of leaves.
        seed: of numpy's generator; the same leaves for the same.
        n: samples of each.
        d: 2 or 3.
        deviations: of the two scores within a group.
        apart: of the groups' means, in the first score.
        moved: whether the curves are rotated, scaled, translated, started elsewhere and sampled unevenly.

    Raises:
        ValueError: for another d, fewer than 8 samples, or no leaf.
    """
    if d not in (2, 3) or n < 8 or count < 1:
        raise ValueError(f"leaves(count={count}, n={n}, d={d}): at least 1 leaf, 8 samples, and 2 or 3 dimensions.")
    random = np.random.default_rng(seed)
    groups = np.arange(count) * 2 // count
    scores = random.normal(size=(count, 2)) * deviations
    scores[:, 0] += (groups - 0.5) * apart
    even = np.arange(n) / n
    outlines = np.stack([_at(_leaf(pair, d), even) for pair in scores])
    curves = np.stack([_moved(_leaf(pair, d), n, random) for pair in scores]) if moved else outlines
    return Leaves(curves.astype(np.float32), groups, scores, _at(_leaf(np.zeros(2), d), even), outlines)


def _leaf(scores: np.ndarray, d: int) -> np.ndarray:
    """A dense leaf `(d, _DENSE)`."""
    t = 2 * np.pi * np.arange(_DENSE) / _DENSE
    radius = 1 + 0.3 * np.cos(5 * t) + scores[0] * np.cos(2 * t) + scores[1] * np.sin(3 * t)
    leaf = [1.5 * radius * np.cos(t), radius * np.sin(t)]
    return np.stack(leaf if d == 2 else [*leaf, 0.4 * np.cos(2 * t) + scores[0] * np.cos(3 * t)])


def _at(dense: np.ndarray, arcs: np.ndarray) -> np.ndarray:
    """Points of a dense closed curve at shares of its length."""
    closed = np.concatenate([dense, dense[:, :1]], axis=1)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(closed, axis=1), axis=0))])
    return np.stack([np.interp(arcs % 1, length / length[-1], row) for row in closed])


def _moved(dense: np.ndarray, n: int, random: np.random.Generator) -> np.ndarray:
    """Samples of a leaf, from another start, uneven, and the leaf rotated, scaled and translated."""
    even = np.arange(n) / n
    phase, start = random.uniform(0, 2 * np.pi), random.uniform()
    arcs = even + random.uniform(0, 0.06) * np.sin(2 * np.pi * even + phase) + start
    d = len(dense)
    frame, upper = np.linalg.qr(random.normal(size=(d, d)))
    frame = frame * np.sign(np.diag(upper))
    frame[:, 0] *= np.linalg.det(frame)
    return random.uniform(0.5, 2) * frame @ _at(dense, arcs) + random.normal(size=(d, 1)) * 3
