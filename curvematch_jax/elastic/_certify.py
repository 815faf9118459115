"""The distance that a path achieves."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ._lanes import dot, fusion_barrier, rotate
from ._lookup import periodic
from ._tables import CurveTable


def path_distance(
    first: CurveTable,
    second: CurveTable,
    rotation: Float[Array, "d d b"],
    warp1: Float[Array, "b nodes"],
    warp2: Float[Array, "b nodes"],
    nodes: int,
) -> Float[Array, " b"]:
    """The angle between `q1(warp1) sqrt(warp1')` and `R q2(warp2) sqrt(warp2')`, in radians.

    The midpoint rule with `nodes` nodes to a piece of the warps. Through the distance on the sphere,
    `2 arcsin(|u - v| / 2)`: precise near 0, where a rounded cosine is not.
    """
    q1, q2 = _carried(first, warp1, nodes), rotate(rotation[..., None], _carried(second, warp2, nodes))
    apart = q1 - q2
    mean = lambda x: jnp.mean(x, axis=-1)  # noqa: E731
    square, size2 = mean(dot(apart, apart)), mean(dot(q2, q2))
    more = mean(dot(apart, apart + 2 * q2))  # |q1|^2 - |q2|^2
    size1 = size2 + more
    unequal = more / (jnp.sqrt(size1) + jnp.sqrt(size2))
    square = (square - unequal * unequal) / jnp.sqrt(size1 * size2)
    return 2 * jnp.arcsin(jnp.minimum(jnp.sqrt(jnp.maximum(square, 0)) / 2, 1))


def _carried(table: CurveTable, warp: Float[Array, "b nodes"], nodes: int) -> Float[Array, "d b k"]:
    step = jnp.maximum(jnp.diff(warp, axis=1), 0)
    place = jnp.concatenate([warp[:, :-1] + (node + 0.5) / nodes * step for node in range(nodes)], axis=1)
    root = jnp.tile(jnp.sqrt(step * step.shape[1]), nodes)
    return fusion_barrier(lambda: periodic(table.srvf, table.count, place) * root[None], table.count[0] > 0)
