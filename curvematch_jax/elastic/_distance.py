"""The elastic distance, differentiable by the envelope theorem."""

import functools as ft

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ._align import align
from ._aligner import Aligner
from ._check import as_aligner, as_shapes, check_pair, check_path, traced
from ._curve import interpolate, srvf_of, unrepeated, velocity
from ._metric import check_metric, length_between, length_to_ends, path_between
from ._preshape import sphere_distance, unit

_PIECES = 32


def elastic_distance(
    curve1: ArrayLike, curve2: ArrayLike, aligner: Aligner | None = None, metric: str = "arc"
) -> Float[Array, "*b"]:
    """Distance of closed curves `(*b, d, n)` in shape space, in radians: symmetric, and blind to position, scale,
    rotation, start point and parametrisation.

    Differentiable in both curves, forward and reverse, under jit and vmap: at an optimal alignment the derivative of
    the distance is the one with rotation and warps held fixed (envelope theorem). Where the distance is 0, or where two
    alignments tie, it has none; a finite value is returned there: 0 up to a distance of `sqrt(eps)`, 3e-4 in float32.
    Refused are derivatives for aligners that do not warp, whose alignment is not optimal among all paths, and second
    derivatives, which would need those of the path.

    Args:
        aligner: `Aligner.accurate()` unless given.
        metric: "arc", the arc cosine on the sphere of SRVFs; "projected", the length of that great circle projected to
            the closed curves; "straightened", the length of the geodesic of closed curves. Both of the last have the
            geodesic's derivative.

    Raises:
        ValueError: as `align`, and for another metric.
    """
    check_metric(metric)
    aligner = as_aligner(aligner, Aligner.accurate)
    curve1, curve2 = as_shapes("curve1", curve1), as_shapes("curve2", curve2)
    check_pair(curve1, curve2)
    return (
        _distance(aligner, metric, curve1, curve2)
        if traced(curve1, curve2)
        else _value(aligner, metric, curve1, curve2)
    )


def alignment_distance(
    curve1: ArrayLike, curve2: ArrayLike, rotation: ArrayLike, warp1: ArrayLike, warp2: ArrayLike
) -> Float[Array, "*b"]:
    """The distance, in radians, that a rotation `(*b, d, d)` and two warps `(*b, m + 1)` of any m achieve.

    It is what an `Alignment` certifies: the angle between `q1(warp1) sqrt(warp1')` and `R q2(warp2) sqrt(warp2')`, with
    the trigonometric interpolants of the curves, the warps linear between their samples, and the midpoint rule on
    pieces of their intervals, at least 32 to a sample of the curves. A curve whose warp falls is run through backwards:
    its SRVF changes sign. The batches broadcast.

    Raises `ValueError` as `align`, and for what is no rotation and pair of warps of these curves.
    """
    curve1, curve2 = as_shapes("curve1", curve1), as_shapes("curve2", curve2)
    check_pair(curve1, curve2)
    path = [jnp.asarray(x, curve1.dtype) for x in (rotation, warp1, warp2)]
    batch = check_path(curve1, curve2, *path)
    rotation, warp1, warp2 = (
        jnp.broadcast_to(x, (*batch, *x.shape[-k:])) for x, k in zip(path, (2, 1, 1), strict=True)
    )
    nodes = max(1, -(-_PIECES * curve1.shape[-1] // (warp1.shape[-1] - 1)))
    q1, q2 = _carried(curve1, warp1, nodes), _carried(curve2, warp2, nodes)
    return sphere_distance(unit(q1), unit(rotation @ q2))


def _carried(curve: Float[Array, "*c d n"], warp: Float[Array, "*b nodes"], nodes: int) -> Float[Array, "*b d k"]:
    curve, warp = unrepeated(curve, warp)
    field = srvf_of(velocity(curve, _PIECES * curve.shape[-1]))
    steps = jnp.diff(warp, axis=-1)
    share = (jnp.arange(nodes, dtype=warp.dtype) + 0.5) / nodes
    place = (warp[..., :-1, None] + steps[..., None] * share.reshape((1,) * warp.ndim + (-1,))).reshape(
        *warp.shape[:-1], -1
    )
    moved = interpolate(jnp.broadcast_to(field, (*warp.shape[:-1], *field.shape[-2:])), place)
    sense = jnp.sign(warp[..., -1:] - warp[..., :1])
    root = sense * jnp.sqrt(jnp.maximum(sense * steps, 0) * steps.shape[-1])
    return moved * jnp.repeat(root, nodes, axis=-1)[..., None, :]


def _value(aligner: Aligner, metric: str, curve1: Float[Array, "*b d n"], curve2: Float[Array, "*c d n"]):
    found = align(curve1, curve2, aligner)
    if metric == "arc":
        return found.distance
    return length_between(curve1, curve2, found, metric)


@ft.partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _distance(aligner: Aligner, metric: str, curve1: Float[Array, "*b d n"], curve2: Float[Array, "*c d n"]):
    return _value(aligner, metric, curve1, curve2)


@_distance.defjvp
def _distance_jvp(aligner: Aligner, metric: str, primals, tangents):
    if not aligner.warps:
        raise ValueError(f"the distance for {aligner} has no derivative: use an aligner that warps, Aligner.fast().")
    curve1, curve2 = primals
    found = align(curve1, curve2, aligner)
    if metric == "arc":
        fixed = lambda a, b: alignment_distance(a, b, found.rotation, found.warp1, found.warp2)  # noqa: E731
        return found.distance, _away_from_0(found.distance, jax.jvp(fixed, primals, tangents)[1])
    path = path_between(curve1, curve2, found, "straightened")
    fixed = lambda a, b: length_to_ends(path, a, b, found)  # noqa: E731
    length = length_between(curve1, curve2, found, metric)
    return length, _away_from_0(found.distance, jax.jvp(fixed, primals, tangents)[1])


def _away_from_0(distance: Float[Array, "*b"], slope: Float[Array, "*b"]) -> Float[Array, "*b"]:
    return jnp.where(distance > jnp.finfo(distance.dtype).eps ** 0.5, slope, 0)
