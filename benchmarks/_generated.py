"""Parts made directly, without meshes: large collections with the statistics of extracted ones.

Objects come in classes. A class has parts, a part has level curves, which are ellipses bent by a few more Fourier modes
and change slowly from level to level; the lengths of curves and level sets follow smooth profiles. Members of a class
differ from it by noise in all of that, and lose parts and levels. How much, was set beside the parts of half of
SHREC'07 (200 models in 20 classes): how long curves are and how much they vary, which share of the levels is there,
how far an object is from the nearest, the tenth and the middle one of the others.
"""

import functools as ft
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from curvematch_jax.surface import Extraction, Parts

_MODES = 6
# Median lengths of level curves in diameters, at the first level, the middle ones and the last.
_PROFILE = (0.1, 0.2, 0.29, 0.35, 0.6, 0.83, 0.75, 0.37)
# Parts of an object, at least and at most.
Counts = tuple[int, int]


class _Class(NamedTuple):
    """What the members of a class have in common: P parts, L levels."""

    modes: np.ndarray  # (P, L, 2, 3, modes) cosines and sines
    log_lengths: np.ndarray  # (P, L)
    ends: np.ndarray  # (P,) levels that are there
    size: float  # logarithm of the diameter in units of the root of the area
    spectrum: np.ndarray  # (20,)
    views: np.ndarray  # (322,)


def generated(
    count: int, seed: int = 0, classes: int = 100, parts: Counts = (4, 10), settings: Extraction | None = None
) -> Iterator[Parts]:
    """`count` objects one by one; object j is of class `j % classes`, and the same in any run."""
    settings = Extraction() if settings is None else settings
    prototype = ft.cache(lambda kind: _prototype(np.random.default_rng([seed, 0, kind]), parts, settings.levels))
    for j in range(count):
        random = np.random.default_rng([seed, 1, j])
        yield _member(prototype(j % classes), random, parts, settings, f"generated-{j:05d}")


def _prototype(random: np.random.Generator, counts: Counts, levels: int) -> _Class:
    parts = int(random.integers(counts[0], counts[1] + 1))
    profile = np.interp(np.linspace(0, 1, levels), np.linspace(0, 1, len(_PROFILE)), np.log(_PROFILE))
    log_lengths = profile + 0.35 * random.normal() + 0.55 * _smooth(random, (parts,), levels)
    ends = np.where(random.random(parts) < 0.5, levels, random.integers(levels // 2, levels + 1, parts))
    size = float(0.45 + 0.25 * random.normal())
    spectrum = np.log(4 * np.pi * np.arange(1, 21)) + 0.3 * random.normal(size=20)
    views = random.gamma(1.0, 2 / 322, 322)
    return _Class(_curve_modes(random, parts, levels), log_lengths, ends, size, spectrum, views)


def _curve_modes(random: np.random.Generator, parts: int, levels: int) -> np.ndarray:
    """Modes that fall with their number, the first one an ellipse."""
    scale = 0.55 / np.arange(1, _MODES + 1) ** 2
    modes = _smooth(random, (parts, 2, 3, _MODES), levels) * scale[:, None]
    flat = np.exp(0.35 * _smooth(random, (parts,), levels))
    modes[:, 0, 0, 0] += 1.6 * flat
    modes[:, 1, 1, 0] += 1.6 / flat
    return np.moveaxis(modes, -1, 1)


def _smooth(random: np.random.Generator, shape: tuple[int, ...], levels: int) -> np.ndarray:
    """Standard normal numbers (*shape, levels), correlated over a quarter of the levels."""
    place = np.linspace(0, 1, levels)
    knots = np.linspace(0, 1, 6)
    weights = np.maximum(1 - np.abs(place - knots[:, None]) * 5, 0)
    return random.normal(size=(*shape, len(knots))) @ (weights / np.linalg.norm(weights, axis=0))


def _member(kind: _Class, random: np.random.Generator, counts: Counts, settings: Extraction, name: str) -> Parts:
    """An object of a class: its parts in another order, one more or less, each somewhat changed."""
    all_parts, levels = kind.log_lengths.shape
    count = int(np.clip(all_parts + random.integers(-1, 2), *counts))
    chosen = random.permutation(np.arange(count) % all_parts)
    away = random.gamma(3.0, 1 / 3)  # how far this member is from its class
    modes = kind.modes[chosen] + away * 0.5 * (_curve_modes(random, count, levels) - _round(count, levels))
    log_lengths = kind.log_lengths[chosen] + away * (0.1 * random.normal() + 0.12 * _smooth(random, (count,), levels))
    ends = np.clip(kind.ends[chosen] + random.integers(-1, 2, count), 1, levels)
    mask = (np.arange(levels) < ends[:, None]) & (random.random((count, levels)) > 0.004)
    lengths = np.where(mask, np.exp(log_lengths), 0.0)
    level_sets = np.exp(log_lengths) * (1 + 0.1 * random.gamma(1.0, size=(count, levels)))
    between = np.abs(np.subtract.outer(np.arange(count), np.arange(count))) / count
    return Parts(
        name=name,
        curves=_curves(modes, settings.samples) * mask[..., None, None],
        mask=mask,
        lengths=lengths.astype(np.float32),
        level_set_lengths=level_sets.astype(np.float32),
        centres=np.zeros((count, levels, 3), np.float32),
        areas=random.uniform(0.1, 0.6, count).astype(np.float32),
        points=np.zeros((count, 3), np.float32),
        feature_distances=between.astype(np.float32),
        area=1.0,
        diameter=float(np.exp(kind.size + away * 0.05 * random.normal())),
        settings=settings,
        notes=(),
        spectrum=(kind.spectrum + away * 0.1 * random.normal(size=20)).astype(np.float32),
        views=(kind.views * np.exp(away * 0.4 * random.normal(size=322))).astype(np.float32),
    )


def _round(parts: int, levels: int) -> np.ndarray:
    """The circle that `_curve_modes` scatters around."""
    modes = np.zeros((parts, levels, 2, 3, _MODES))
    modes[..., 0, 0, 0] = modes[..., 1, 1, 0] = 1.6
    return modes


def _curves(modes: np.ndarray, samples: int) -> np.ndarray:
    """Curves `(*b, 3, samples)` of unit length in float32, sampled only nearly by arc length."""
    angle = np.arange(1, _MODES + 1)[:, None] * (2 * np.pi * np.arange(samples) / samples)
    waves = np.stack([np.cos(angle), np.sin(angle)]).astype(np.float32)
    curves = np.einsum("...tdm,tms->...ds", modes.astype(np.float32), waves, optimize=True)
    steps = np.linalg.norm(np.roll(curves, -1, axis=-1) - curves, axis=-2)
    return curves / steps.sum(axis=-1)[..., None, None]
