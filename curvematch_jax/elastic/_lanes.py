"""Arithmetic on vectors and matrices whose components lie on the leading axes, many at once on the axes behind.

Short sums are written out: a row of pairs is then one vectorised loop.

XLA's CPU back end fuses an expensive producer into each of its consumers, which then repeat it. `fusion_barrier` keeps
it apart; `SPLIT_FUSIONS` says where.
"""

import functools as ft
from collections.abc import Callable
from operator import add
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

# The back ends that need `fusion_barrier`; elsewhere it only computes. Results are the same.
SPLIT_FUSIONS = ("cpu",)


def dot(a: Float[Array, "d *#k"], b: Float[Array, "d *#k"]) -> Float[Array, "..."]:
    """`sum_i a_i b_i` over the first axis; the others broadcast."""
    return ft.reduce(add, (x * y for x, y in zip(a, b, strict=True)))


def frobenius(a: Float[Array, "d e *k"], b: Float[Array, "d e *k"]) -> Float[Array, "*k"]:
    """`tr(A^T B)` of matrices on the two first axes."""
    return ft.reduce(add, (dot(x, y) for x, y in zip(a, b, strict=True)))


def rotate(rotation: Float[Array, "e d *l"], field: Float[Array, "d *k"]) -> Float[Array, "e *k"]:
    """`R q`, pointwise; `rotation` has the rank of `field` plus one, with length-1 axes where it is constant."""
    return jnp.stack([dot(row, field) for row in rotation])


def multiply(a: Float[Array, "d e *l"], b: Float[Array, "e f *l"]) -> Float[Array, "d f *l"]:
    """The product of matrices on the two first axes."""
    return jnp.stack([rotate(jnp.swapaxes(b, 0, 1), row) for row in a])


def solve(a: Float[Array, "m m *l"], b: Float[Array, "m k *l"]) -> Float[Array, "m k *l"]:
    """`a^-1 b`, by elimination without pivots: for small a whose symmetric part is positive definite."""
    m = len(a)
    numbers = jnp.arange(m, dtype=jnp.int32).reshape((m,) + (1,) * (a.ndim - 1))

    def eliminate(i, rows):
        row = rows[i] / rows[i, i][None]
        return jnp.where(numbers == i, row[None], rows - rows[:, i][:, None] * row[None])

    return lax.fori_loop(0, m, eliminate, jnp.concatenate([a, b], axis=1))[:, m:]


def running_sum(x: Float[Array, "*k n"], own: float = 0.0) -> Float[Array, "*k n"]:
    """Sum of the entries before each, and a share of its own: small matrix products, faster than a cumulative sum."""
    n = x.shape[-1]
    inside = max(q for q in range(1, int(n**0.5) + 1) if n % q == 0)
    earlier = lambda size: jnp.asarray(np.triu(np.ones((size, size)), 1), x.dtype)  # noqa: E731
    blocks = x.reshape(*x.shape[:-1], n // inside, inside)
    ending = earlier(inside) + own * jnp.eye(inside, dtype=x.dtype)
    within = jnp.matmul(blocks, ending, precision="highest")
    before = jnp.matmul(jnp.sum(blocks, axis=-1), earlier(n // inside), precision="highest")
    return (within + before[..., None]).reshape(x.shape)


def fusion_barrier(compute: Callable[..., Any], true: Bool[Array, ""] | None, *operands: Any) -> Any:
    """`compute(*operands)`, not fused with what uses it.

    An `optimization_barrier` is removed before fusion; a branch is not. `true` has to be so, and unknown to the
    compiler: an argument of the compiled function. None where nothing is to be kept apart.
    """
    if true is None or jax.default_backend() not in SPLIT_FUSIONS:
        return compute(*operands)
    nothing = lambda *_: jax.tree.map(lambda x: filled(0, x, true), jax.eval_shape(compute, *operands))  # noqa: E731
    return lax.cond(true, compute, nothing, *operands)


def filled(value: float, shape: Any, beside: Array) -> Array:
    """An array of one value, of the shape and dtype of another.

    What a loop carries and what two branches give have to agree in whether they vary over the devices of a
    `jax.shard_map`: this varies as `beside` does.
    """
    some = beside.reshape(-1)[0]
    return jnp.full(shape.shape, jnp.where(some == some, value, value)).astype(shape.dtype)
