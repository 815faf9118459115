"""Closed SRVFs as polygons, and the tangent spaces of their manifold C: an exponential and its exact inverse.

A closed polygon of N sides, passed at equal times, has the SRVF `q_k = sqrt(N / |e_k|) e_k` of its sides, scaled to
unit norm: closed without error, and the polygon is its running sum. All statistics are of such fields, `(*b, d, N)`.
"""

import functools as ft

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ..elastic._check import traced
from ..elastic._curve import norm, velocity
from ..elastic._frame import AnyArray
from ..elastic._geodesic import joined, path_length, straighten
from ..elastic._lanes import running_sum
from ..elastic._preshape import close, exp_map, inner, project_tangent

STEPS = 6  # of a geodesic
_LONGEST = 1.0  # radians of one step
_MOST_TURNS = 100  # of tangent vectors, round the sphere
_CLOSING_STEPS = 3
_FINE = 4  # speeds to a sample, for a length


def log(base: Float[Array, "b d n"], q: Float[Array, "b d n"]) -> tuple[Float[Array, "b d n"], Float[Array, " b"]]:
    """The velocity at `base` of the geodesic of C that is at `q` at time 1, and the geodesic's length.

    A straightened path of K steps satisfies `q_{k+1} - 2 q_k + q_{k-1}` normal to C at `q_k`, with which `exp_map`
    shoots: so `exp(base, log(base, q))` is q to rounding. The step's chord is lengthened to its arc."""
    path = straighten(joined(base, q, STEPS)).path
    chord = project_tangent(base, path[..., 1, :, :] - base)
    size = norm_of(chord)[..., None, None]
    arc = jnp.where(size > 0, jnp.arcsin(jnp.minimum(size, 1)) / jnp.where(size > 0, size, 1), 1)
    return STEPS * arc * chord, path_length(path)


def exp(base: Float[AnyArray, "*b d n"], v: Float[AnyArray, "*b d n"]) -> Float[Array, "*b d n"]:
    """Where the geodesic of C from `base` with velocity `v` is at time 1: a point of C, closed to rounding.

    Raises `ValueError` for concrete vectors of hundreds of radians, for which there is no use.
    """
    base, v, steps = jnp.asarray(base), jnp.asarray(v), STEPS
    if not traced(v):
        largest = float(jnp.max(norm_of(v), initial=0))
        if not largest < 2 * np.pi * _MOST_TURNS:
            raise ValueError(f"a tangent vector of {largest:.3g} radians leads {_MOST_TURNS} times round the shapes.")
        steps *= 2 ** max(0, int(np.ceil(np.log2(max(largest, 1e-30) / (_LONGEST * STEPS)))))
    return _shot(base, v, steps)


@ft.partial(jax.jit, static_argnums=2)
def _shot(base: Float[Array, "*b d n"], v: Float[Array, "*b d n"], steps: int) -> Float[Array, "*b d n"]:
    angle = norm_of(v)[..., None, None] / steps
    chord = jnp.where(angle > 0, jnp.sin(angle) / jnp.where(angle > 0, angle, 1), 1)
    return close(exp_map(base, chord * v, steps), _CLOSING_STEPS)


def norm_of(v: Float[Array, "*b d n"]) -> Float[Array, "*b"]:
    """The L2 norm."""
    return jnp.sqrt(inner(v, v))


def shapes_at(base: np.ndarray, v: np.ndarray) -> np.ndarray:
    """`exp` at one base `(d, N)`, in its dtype, of vectors `(*b, d, N)`, which are made tangent. Errors as `exp`."""
    with np.errstate(over="ignore"):  # infinite vectors are refused
        vectors = jnp.asarray(v.astype(base.dtype))
    spread = jnp.broadcast_to(jnp.asarray(base), vectors.shape)
    return np.asarray(exp(spread, project_tangent(spread, vectors)))


@jax.jit
def vertices(q: Float[AnyArray, "*b d n"]) -> Float[Array, "*b d n"]:
    """The polygon of unit length whose sides have the SRVF `q`, its vertices' mean at the origin."""
    q = jnp.asarray(q)
    corners = running_sum(q * norm(q)[..., None, :] / q.shape[-1])
    return corners - jnp.mean(corners, axis=-1, keepdims=True)


def curves_of(q: Float[AnyArray, "*b d n"], samples: int, lengths: ArrayLike) -> np.ndarray:
    """Centred curves `(*b, d, samples)` of lengths `(*b,)` for SRVFs `(*b, d, N)`: the trigonometric polynomials that
    are nearest to their polygons."""
    spectrum = np.fft.rfft(np.asarray(vertices(q), float), axis=-1)[..., : samples // 2 + 1]
    spectrum[..., (samples + 1) // 2 :] = 0
    found = np.fft.irfft(spectrum, n=samples, axis=-1)
    speed = norm(velocity(found, _FINE * samples))
    return (found * (np.asarray(lengths) / speed.mean(axis=-1))[..., None, None]).astype(q.dtype)
