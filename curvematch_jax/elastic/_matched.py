"""What an alignment says about its two curves: matched points, one curve laid onto the other, one warp for two."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._aligner import Alignment
from ._check import as_curves, check_pair
from ._curve import interpolate, oversampled, srvf_of, unrepeated
from ._lookup import divided

_OVERSAMPLING = 8


def matched_points(
    curve1: ArrayLike, curve2: ArrayLike, alignment: Alignment
) -> tuple[Float[Array, "*b d m"], Float[Array, "*b d m"]]:
    """The points of both curves, in their own coordinates, that `alignment` matches: at the times `k/m` of its path.

    Raises `ValueError` as `align`.
    """
    curve1, curve2 = as_curves("curve1", curve1), as_curves("curve2", curve2)
    check_pair(curve1, curve2)
    return _points(curve1, alignment.warp1)[..., :-1], _points(curve2, alignment.warp2)[..., :-1]


def warp_onto(alignment: Alignment, n: int) -> Float[Array, "*b {n}+1"]:
    """The parameters of curve2 that are matched with `k/n`, the samples of curve1: lifted and never falling.

    One warp says less than the path: where curve1 stands still while curve2 moves on, it jumps.
    """
    warp1, warp2 = alignment.warp1, alignment.warp2
    place = jnp.asarray(np.arange(n + 1) / n, warp1.dtype)
    place = jnp.broadcast_to(place, (*warp1.shape[:-1], n + 1))
    turns = jnp.floor(place - warp1[..., :1])
    find = jnp.vectorize(jnp.interp, signature="(k),(m),(m)->(k)")
    turn = jnp.round(warp2[..., -1:] - warp2[..., :1])  # 1, or -1 where curve2 is run through backwards
    found = find(place - turns, warp1, warp2) + turn * turns
    return jnp.concatenate([found[..., :-1], found[..., :1] + turn], axis=-1)


def aligned_curve(curve1: ArrayLike, curve2: ArrayLike, alignment: Alignment) -> Float[Array, "*b d n"]:
    """curve2 laid onto curve1, sample by sample: turned, and read where curve1 has its samples.

    Both keep their size; curve2's centre of samples is moved to that of curve1. Raises `ValueError` as `align`.
    """
    curve1, curve2 = as_curves("curve1", curve1), as_curves("curve2", curve2)
    check_pair(curve1, curve2)
    points = _points(curve2, warp_onto(alignment, curve1.shape[-1]))[..., :-1]
    turned = jnp.einsum("...ij,...jn->...in", alignment.rotation, points)
    mean = lambda x: jnp.mean(x, axis=-1, keepdims=True)  # noqa: E731
    return turned - mean(turned) + jnp.broadcast_to(mean(curve1), (*turned.shape[:-1], 1))


def srvfs_along(
    curve1: Float[Array, "*c d n"], curve2: Float[Array, "*e d n"], alignment: Alignment, samples: int
) -> tuple[Float[Array, "*b d {samples}"], Float[Array, "*b d {samples}"]]:
    """SRVFs of unit norm, closed, of the polygons through matched points at `samples` equal times; the second turned.

    An isometry of the pair: one curve stands still while a piece of the other is passed that it lacks.
    """
    warps = (divided(warp, samples) for warp in (alignment.warp1, alignment.warp2))
    q1, q2 = (srvf_of(jnp.diff(_points(c, w), axis=-1)) for c, w in zip((curve1, curve2), warps, strict=True))
    return jnp.asarray(q1), alignment.rotation @ q2


def _points(curve: Float[Array, "*c d n"], warp: Float[Array, "*e nodes"]) -> Float[Array, "*b d nodes"]:
    """Where a curve is at the parameters of a lifted warp."""
    curve, warp = unrepeated(curve, warp)
    points = oversampled(curve, _OVERSAMPLING * curve.shape[-1])
    batch = jnp.broadcast_shapes(curve.shape[:-2], warp.shape[:-1])
    return interpolate(
        jnp.broadcast_to(points, (*batch, *points.shape[-2:])), jnp.broadcast_to(warp, (*batch, warp.shape[-1]))
    )
