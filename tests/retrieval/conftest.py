"""Parts without surfaces: smooth closed curves from a few random Fourier modes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from curvematch_jax.surface import Extraction, Parts

SETTINGS = Extraction(levels=3, samples=32)


def synthetic_parts(
    name: str = "", seed: int = 0, parts: int = 3, settings: Extraction = SETTINGS, noise: float = 0.0, **changes: Any
) -> Parts:
    """Parts whose shapes follow from `seed` alone; `noise` moves them, differently for different names."""
    rng, noisy = np.random.default_rng(seed), np.random.default_rng(sum(name.encode()) + 1)
    shape = (parts, settings.levels, 3, settings.samples)
    modes = rng.normal(size=(2, *shape[:-1], 3)) + noise * noisy.normal(size=(2, *shape[:-1], 3))
    curves = _closed(modes / np.arange(1, 4), settings.samples)
    mask = np.ones(shape[:2], bool)
    fields: dict[str, Any] = {
        "curves": curves.astype(np.float32),
        "mask": mask,
        "lengths": rng.uniform(0.1, 0.5, size=shape[:2]).astype(np.float32),
        "level_set_lengths": rng.uniform(0.5, 1.0, size=shape[:2]).astype(np.float32),
        "centres": rng.normal(size=(*shape[:2], 3)).astype(np.float32),
        "areas": rng.uniform(0.05, 0.3, size=parts).astype(np.float32),
        "points": rng.normal(size=(parts, 3)).astype(np.float32),
        "feature_distances": np.ones((parts, parts), np.float32) - np.eye(parts, dtype=np.float32),
        "notes": (),
        "spectrum": _moved(rng, noisy, noise, 20),
        "views": _moved(rng, noisy, noise, 30),
    }
    return Parts(name=name, area=1.5, diameter=2.0, settings=settings, **(fields | changes))


def _moved(rng: np.random.Generator, noisy: np.random.Generator, noise: float, count: int) -> np.ndarray:
    return (rng.normal(size=count) + noise * noisy.normal(size=count)).astype(np.float32)


def _closed(modes: np.ndarray, samples: int) -> np.ndarray:
    """Curves `(*b, 3, samples)` by arc length, centred, of unit length, from cosine and sine modes `(2, *b, 3, k)`."""
    time = 2 * np.pi * np.arange(8 * samples) / (8 * samples)
    angles = np.arange(1, modes.shape[-1] + 1)[:, None] * time
    fine = modes[0] @ np.cos(angles) + modes[1] @ np.sin(angles)
    flat = [_by_arc_length(curve, samples) for curve in fine.reshape(-1, *fine.shape[-2:])]
    return np.array(flat).reshape(*fine.shape[:-1], samples)


def _by_arc_length(curve: np.ndarray, samples: int) -> np.ndarray:
    closed = np.concatenate([curve, curve[:, :1]], axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed), axis=0))])
    even = np.arange(samples) * along[-1] / samples
    points = np.array([np.interp(even, along, row) for row in closed])
    points -= points.mean(axis=1, keepdims=True)
    return points / np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=0).sum()


@pytest.fixture(name="make_parts", scope="session")
def fixture_make_parts() -> Callable[..., Parts]:
    return synthetic_parts
