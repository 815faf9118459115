"""Curves for the tests of the engine."""

import numpy as np


def fourier(seed: int, count: int | None = None, n: int = 100, d: int = 3, modes: int = 4, **move) -> np.ndarray:
    """Random smooth closed curves `(count, d, n)`, or one; `move` as in `sample`."""
    random = np.random.default_rng(seed)
    coefficients = random.normal(size=(count or 1, 2, d, modes)) / np.arange(1, modes + 1)
    curves = np.stack([sample(*pair, n, **move) for pair in coefficients])
    return curves if count else curves[0]


def sample(cos, sin, n: int, shift: float = 0.0, bend: float = 0.0) -> np.ndarray:
    """A Fourier curve by arc length, from another start and with another parametrisation."""
    k = np.arange(1, cos.shape[-1] + 1)[:, None]
    evaluate = lambda t: cos @ np.cos(2 * np.pi * k * t) + sin @ np.sin(2 * np.pi * k * t)  # noqa: E731
    t = np.linspace(0, 1, 8001)
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(evaluate(t), axis=1), axis=0))])
    u = np.arange(n) / n
    u = (u + bend * np.sin(2 * np.pi * u) + shift) % 1
    return evaluate(np.interp(u, arc / arc[-1], t)) / arc[-1]


def rotation(seed: int, d: int = 3) -> np.ndarray:
    """A random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))
    q = q * np.sign(np.diag(r))
    q[:, 0] *= np.linalg.det(q)
    return q


def ellipse(n: int, a: float = 2.0, b: float = 1.0) -> np.ndarray:
    t = 2 * np.pi * np.arange(n) / n
    return np.stack([a * np.cos(t), b * np.sin(t), 0 * t])
