"""From parts to what is drawn of them: pieces of level curves, told apart by the feature point that is nearest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from ..surface import Parts

# How far the strips of a part go on where another's are nearer, in diameters: without it there are gaps between them.
OVERLAP = 0.16


class Strokes(NamedTuple):
    """Pieces of level curves, and the strips of surface between them and the next curves towards the feature points.

    Curves run counter-clockwise around the feature point, so that a strip `outer[0], outer[1], inner[1], inner[0]` does
    as well, seen from outside.
    """

    outer: np.ndarray  # (s, 2, 3) ends of a piece, in mesh units
    inner: np.ndarray  # (s, 2, 3) what is nearest to them on the next curve inside
    part: np.ndarray  # (s,)
    beyond: np.ndarray  # (s,) how much nearer the nearest other feature point is, in diameters; negative if it is not


class _Samples(NamedTuple):
    """The samples of one part's curves, its feature point first."""

    points: np.ndarray  # (p, 3)
    radii: np.ndarray  # (p,) distance from the feature point, in diameters
    following: np.ndarray  # (p,) index of the next sample along the curve
    inside: np.ndarray  # (p,) index of the nearest sample of the next curve inside


def strokes(parts: Parts) -> Strokes:
    """The pieces of all curves that are about as near to their part's feature point as to any other's.

    Parts overlap: most reach half across the object. Told apart by `beyond`, they cover the surface once.
    """
    samples = [_samples(parts, i) for i in range(len(parts.areas))]
    found = [Strokes(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)), np.zeros(0, int), np.zeros(0))]
    for i, own in enumerate(samples):
        others = [_distance(other, own.points, parts.diameter) for j, other in enumerate(samples) if j != i]
        beyond = own.radii - np.min([np.full(len(own.radii), np.inf), *others], axis=0)
        beyond = np.maximum(beyond, beyond[own.following])
        start = np.flatnonzero((beyond <= OVERLAP) & (own.radii > 0))
        ends = np.stack([start, own.following[start]], axis=1)
        found.append(Strokes(own.points[ends], own.points[own.inside[ends]], np.full(len(start), i), beyond[start]))
    return Strokes(*(np.concatenate(column) for column in zip(*found, strict=True)))


def curve_points(parts: Parts) -> np.ndarray:
    """All points of a drawing (p, 3): the feature points and the samples of all curves, in mesh units."""
    return np.concatenate([np.zeros((0, 3)), *(_samples(parts, i).points for i in range(len(parts.areas)))])


def _distance(part: _Samples, points: np.ndarray, diameter: float) -> np.ndarray:
    """Distances (p,) of points on the surface (p, 3) from a part's feature point, in diameters.

    That of the nearest sample, with the gap to it added, or taken off where it lies farther out.
    """
    gap, nearest = KDTree(part.points).query(points)
    outward = part.points[nearest] - part.points[part.inside[nearest]]
    farther_out = ((points - part.points[nearest]) * outward).sum(axis=1) < 0
    # A larger gap than that between two curves says that the sample is elsewhere, such as on another limb.
    close = gap <= np.linalg.norm(outward, axis=1)
    return part.radii[nearest] + np.where(farther_out & close, -gap, gap) / diameter


def _samples(parts: Parts, i: int) -> _Samples:
    levels = np.flatnonzero(parts.mask[i])
    scale = parts.lengths[i, levels, None, None] * parts.diameter
    curves = (parts.curves[i, levels] * scale + parts.centres[i, levels, :, None]).transpose(0, 2, 1).astype(float)
    count = curves.shape[1]
    rings = [parts.points[i : i + 1].astype(float), *curves]
    starts = np.concatenate([[0, 1], 1 + count * np.arange(1, len(curves) + 1)])
    inside = [start + KDTree(ring).query(curve)[1] for start, ring, curve in zip(starts, rings, curves, strict=False)]
    around = np.roll(np.arange(count), -1)
    return _Samples(
        points=np.concatenate(rings),
        radii=np.concatenate([[0.0], np.repeat(parts.settings.radii[levels], count)]),
        following=np.concatenate([[0], *(start + around for start in starts[1:-1])]).astype(int),
        inside=np.concatenate([[0], *inside]).astype(int),
    )
