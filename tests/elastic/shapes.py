"""Curves for the tests of the engine."""

import jax
import numpy as np


def fourier(
    seed: int, count: int | None = None, n: int = 100, d: int = 3, modes: int = 4, decay: float = 1.0, **move
) -> np.ndarray:
    """Random smooth closed curves `(count, d, n)`, or one; wave k is `k**decay` times smaller; `move`: see `sample`."""
    random = np.random.default_rng(seed)
    coefficients = random.normal(size=(count or 1, 2, d, modes)) / np.arange(1, modes + 1) ** decay
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


def moved(curve: np.ndarray, seed: int, scale: float = 3.0, shift: float = 5.0) -> np.ndarray:
    """The curves `(*b, d, n)`, rotated, scaled and translated."""
    return scale * np.einsum("ij,...jn->...in", rotation(seed, curve.shape[-2]), curve) + shift


def warps(seed: int, lanes: int, n: int, rough: float = 0.4) -> np.ndarray:
    """Random increasing warps `(n + 1, lanes)` with different start points."""
    random = np.random.default_rng(seed)
    steps = np.exp(rough * random.normal(size=(n, lanes)))
    gamma = np.concatenate([np.zeros((1, lanes)), np.cumsum(steps, axis=0)]) / steps.sum(axis=0)
    return gamma + random.uniform(-1, 1, size=lanes)


def paths(seed: int, lanes: int, knots: int, steep: float = 0.6) -> np.ndarray:
    """Random paths `(knots, lanes)`: periodic u with `|u'| <= steep`, around different start points."""
    random = np.random.default_rng(seed)
    slope = random.uniform(-1, 1, size=(knots, lanes))
    slope -= slope.mean(axis=0)
    slope *= steep / np.abs(slope).max(axis=0)
    u = np.cumsum(slope, axis=0) / knots
    return u - u.mean(axis=0) + random.uniform(-0.5, 0.5, size=lanes)


def unit_tangents(seed: int, count: int, t: int, d: int = 3, modes: int = 3) -> np.ndarray:
    """Smooth closed fields of unit vectors `(d, t, count)`, lanes last: directions of Fourier curves."""
    random = np.random.default_rng(seed)
    k = np.arange(1, modes + 1)[:, None]
    angle = 2 * np.pi * k * np.arange(t) / t
    cos, sin = random.normal(size=(2, count, d, modes)) / k[:, 0] ** 2
    field = np.moveaxis(cos @ np.cos(angle) + sin @ np.sin(angle), 0, -1)
    return field / np.linalg.norm(field, axis=0)


def spectral(curve: np.ndarray, x: np.ndarray, order: int = 0) -> np.ndarray:
    """The trigonometric interpolant of a curve `(d, n)`, or a derivative, at any parameters `(k,)`: a sum of waves."""
    n = curve.shape[-1]
    coefficients = np.fft.fft(curve, axis=-1) / n
    frequency = np.fft.fftfreq(n, 1 / n)
    if n % 2 == 0:
        coefficients[..., n // 2] = 0  # What an even number of samples leaves open.
    waves = np.exp(2j * np.pi * np.outer(frequency, x)) * ((2j * np.pi * frequency) ** order)[:, None]
    return np.real(coefficients @ waves)


def srvf(curve: np.ndarray, x: np.ndarray) -> np.ndarray:
    """SRVF of a curve `(d, n)` at any parameters."""
    velocity = spectral(curve, x, order=1)
    return velocity / np.sqrt(np.linalg.norm(velocity, axis=0))


def certified(curve1: np.ndarray, curve2: np.ndarray, rotation, warp, nodes: int = 4) -> float:
    """The angle between `q1` and `R q2(gamma) sqrt(gamma')` of one pair, by definition; `nodes` to an interval."""
    n = len(warp) - 1
    share = (np.arange(nodes) + 0.5) / nodes
    steps = np.diff(np.asarray(warp, float))
    t = ((np.arange(n)[:, None] + share) / n).ravel()
    x = (np.asarray(warp, float)[:-1, None] + share * steps[:, None]).ravel()
    q1 = srvf(curve1.astype(float), t)
    q2 = np.asarray(rotation, float) @ srvf(curve2.astype(float), x) * np.repeat(np.sqrt(steps * n), nodes)
    return float(np.arccos(np.sum(q1 * q2) / np.linalg.norm(q1) / np.linalg.norm(q2)))


def kabsch(c: np.ndarray) -> np.ndarray:
    """The rotation that maximises `tr(R^T C)`, by numpy's SVD."""
    u, _, vt = np.linalg.svd(c)
    signs = np.ones(len(c))
    signs[-1] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return (u * signs) @ vt


def x64():
    """A context with float64 arrays, in the calling thread."""
    enable = jax.enable_x64 if hasattr(jax, "enable_x64") else jax.experimental.enable_x64
    return enable(True)
