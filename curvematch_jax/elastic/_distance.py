"""The elastic distance, differentiable by the envelope theorem."""

import functools as ft

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ._align import align
from ._aligner import Aligner
from ._check import as_curves, check_pair, traced
from ._curve import interpolate, srvf_of, velocity
from ._kind import check_kind, length_between, length_to_ends, path_between
from ._preshape import sphere_distance, unit

_PIECES = 32


def elastic_distance(
    curve1: ArrayLike, curve2: ArrayLike, aligner: Aligner | None = None, kind: str = "arc"
) -> Float[Array, "*b"]:
    """Distance of closed curves `(*b, d, n)` in shape space, in radians: symmetric, and blind to position, scale,
    rotation, start point and parametrisation.

    Differentiable in both curves, forward and reverse, under jit and vmap: at an optimal alignment the derivative of
    the distance is the one with rotation and warp held fixed (envelope theorem). Where the distance is 0, or where two
    alignments tie, it has no derivative; a finite value is returned there, 0 at distance 0.
    Without a warp (`Aligner.rigid()`) the alignment is not optimal over warps, and the derivative is that of the fixed
    alignment only, not of the distance.

    Args:
        aligner: `Aligner.accurate()` unless given.
        kind: "arc", the arc cosine on the sphere of SRVFs; "projected", the length of that great circle projected to
            the closed curves; "straightened", the length of the geodesic of closed curves. Both of the last have the
            geodesic's derivative.

    Raises:
        ValueError: as `align`, and for another kind.
    """
    check_kind(kind)
    aligner = Aligner.accurate() if aligner is None else aligner
    curve1, curve2 = as_curves("curve1", curve1), as_curves("curve2", curve2)
    check_pair(curve1, curve2)
    return _distance(aligner, kind, curve1, curve2) if traced(curve1, curve2) else _value(aligner, kind, curve1, curve2)


def alignment_distance(
    curve1: ArrayLike, curve2: ArrayLike, rotation: ArrayLike, warp: ArrayLike
) -> Float[Array, "*b"]:
    """The distance, in radians, that a rotation `(*b, d, d)` and a warp `(*b, m + 1)` of any m achieve.

    It is what an `Alignment` certifies: the angle between `q1` and `R q2(gamma) sqrt(gamma')`, with the trigonometric
    interpolants of the curves, gamma linear between its samples, and the midpoint rule on pieces of its intervals, at
    least 32 to a sample of the curve.
    """
    curve1, curve2 = as_curves("curve1", curve1), as_curves("curve2", curve2)
    check_pair(curve1, curve2)
    rotation, warp = jnp.asarray(rotation, curve1.dtype), jnp.asarray(warp, curve1.dtype)
    n, m = curve1.shape[-1], warp.shape[-1] - 1
    nodes = max(1, -(-_PIECES * n // m))
    q1, field2 = (srvf_of(velocity(c, max(n, 2 * nodes * m))) for c in (curve1, curve2))
    share = (jnp.arange(nodes, dtype=warp.dtype) + 0.5) / nodes
    steps = jnp.diff(warp, axis=-1)
    x = warp[..., :-1, None] + share.reshape((1,) * warp.ndim + (-1,)) * steps[..., None]
    field2 = jnp.broadcast_to(field2, (*warp.shape[:-1], *field2.shape[-2:]))
    moved = interpolate(field2, x.reshape(*warp.shape[:-1], m * nodes))
    root = jnp.repeat(jnp.sqrt(jnp.maximum(steps * m, 0)), nodes, axis=-1)
    q2 = jnp.einsum("...ij,...jn->...in", rotation, moved) * root[..., None, :]
    return sphere_distance(jnp.broadcast_to(unit(q1[..., 1::2]), q2.shape), unit(q2))


def _value(aligner: Aligner, kind: str, curve1: Float[Array, "*b d n"], curve2: Float[Array, "*c d n"]):
    found = align(curve1, curve2, aligner)
    if kind == "arc":
        return found.distance
    return length_between(curve1, curve2, found.rotation, found.warp, kind)


@ft.partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _distance(aligner: Aligner, kind: str, curve1: Float[Array, "*b d n"], curve2: Float[Array, "*c d n"]):
    return _value(aligner, kind, curve1, curve2)


@_distance.defjvp
def _distance_jvp(aligner: Aligner, kind: str, primals, tangents):
    curve1, curve2 = primals
    found = align(curve1, curve2, aligner)
    if kind == "arc":
        fixed = lambda a, b: alignment_distance(a, b, found.rotation, found.warp)  # noqa: E731
        return found.distance, jax.jvp(fixed, primals, tangents)[1]
    path = path_between(curve1, curve2, found.rotation, found.warp, "straightened")
    fixed = lambda a, b: length_to_ends(path, a, b, found.rotation, found.warp)  # noqa: E731
    length = length_between(curve1, curve2, found.rotation, found.warp, kind)
    return length, jax.jvp(fixed, primals, tangents)[1]
