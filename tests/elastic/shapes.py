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


def lifts(seed: int, lanes: int, m: int, rough: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Random paths of two curves: both warps, `(lanes, m + 1)` each."""
    return warps(seed, lanes, m, rough).T, warps(seed + 1000, lanes, m, rough).T


def paths(seed: int, lanes: int, knots: int, steep: float = 0.6) -> np.ndarray:
    """Random paths `(lanes, knots)`: periodic u with `|u'| <= steep`, around different start points."""
    random = np.random.default_rng(seed)
    slope = random.uniform(-1, 1, size=(lanes, knots))
    slope -= slope.mean(axis=1, keepdims=True)
    slope *= steep / np.abs(slope).max(axis=1, keepdims=True)
    u = np.cumsum(slope, axis=1) / knots
    return u - u.mean(axis=1, keepdims=True) + random.uniform(-0.5, 0.5, size=(lanes, 1))


def polygon(n: int, corners: int = 4) -> np.ndarray:
    """A regular polygon in the plane, samples at equal arc lengths, one on every corner."""
    angle = 2 * np.pi * np.arange(corners + 1) / corners
    place = np.arange(n) * corners / n
    return np.stack([np.interp(place, np.arange(corners + 1), f(angle)) for f in (np.cos, np.sin)])


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


def certified(curve1: np.ndarray, curve2: np.ndarray, rotation, warp1, warp2, nodes: int = 4) -> float:
    """The angle between `q1(warp1) sqrt(warp1')` and `R q2(warp2) sqrt(warp2')` of one pair, by definition."""
    share = (np.arange(nodes) + 0.5) / nodes

    def carried(curve, warp):
        steps = np.diff(np.asarray(warp, float))
        x = (np.asarray(warp, float)[:-1, None] + share * steps[:, None]).ravel()
        return srvf(curve.astype(float), x) * np.repeat(np.sqrt(steps * len(steps)), nodes)

    q1, q2 = carried(curve1, warp1), np.asarray(rotation, float) @ carried(curve2, warp2)
    return float(np.arccos(min(np.sum(q1 * q2) / np.linalg.norm(q1) / np.linalg.norm(q2), 1.0)))


def lift(x: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The lift through `(nodes, values)`, both growing by 1 over the whole, at any real x: of one lane, by numpy."""
    turns = np.floor(x - nodes[0])
    return np.interp(x - turns, nodes, values) + turns


def kabsch(c: np.ndarray) -> np.ndarray:
    """The rotation that maximises `tr(R^T C)`, by numpy's SVD."""
    u, _, vt = np.linalg.svd(c)
    signs = np.ones(len(c))
    signs[-1] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return (u * signs) @ vt


def x64(enabled=True):
    """A context with float64 arrays, or without, in the calling thread."""
    enable = jax.enable_x64 if hasattr(jax, "enable_x64") else jax.experimental.enable_x64
    return enable(enabled)
