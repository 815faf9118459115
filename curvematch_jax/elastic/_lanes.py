"""Arithmetic on lanes-last arrays in forms that XLA's CPU back end compiles well.

It turns a reduction fused with its operands into a scalar loop: short sums are written out instead (14 times faster for
the products of the refinement), long ones are matrix products. And it fuses an expensive producer into each of its
consumers, which then repeat it: `once` keeps it apart (twice as fast for the look-ups of the refinement).
"""

from collections.abc import Callable
from functools import reduce
from operator import add
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float


def dot(a: Float[Array, "d *#k"], b: Float[Array, "d *#k"]) -> Float[Array, "..."]:
    """`sum_i a_i b_i` over the first axis; the others broadcast."""
    return reduce(add, (x * y for x, y in zip(a, b, strict=True)))


def frobenius(a: Float[Array, "d d *k"], b: Float[Array, "d d *k"]) -> Float[Array, "*k"]:
    """`tr(A^T B)` of matrices on the two first axes."""
    return reduce(add, (dot(x, y) for x, y in zip(a, b, strict=True)))


def mean_rows(x: Float[Array, "*k n l"]) -> Float[Array, "*k l"]:
    """Mean over the rows, as a matrix product: it stands outside of the fused loops."""
    n = x.shape[-2]
    weights = jnp.full((1,) * (x.ndim - 2) + (1, n), 1 / n, x.dtype)
    weights = jnp.broadcast_to(weights, (*x.shape[:-2], 1, n))
    return jnp.matmul(weights, x, precision="highest")[..., 0, :]


def cumulative(x: Float[Array, "*k n l"]) -> Float[Array, "*k n l"]:
    """Sum of the rows before each: XLA's cumulative sum is several times slower than these two matrix products."""
    n = x.shape[-2]
    inside = max(q for q in range(1, int(n**0.5) + 1) if n % q == 0)
    blocks = x.reshape(*x.shape[:-2], n // inside, inside, x.shape[-1])
    within = _before(inside, blocks.dtype) @ blocks
    whole = within[..., -1, :] + blocks[..., -1, :]
    return (within + (_before(n // inside, x.dtype) @ whole)[..., None, :]).reshape(x.shape)


def _before(n: int, dtype) -> Float[Array, "{n} {n}"]:
    return jnp.asarray(np.tril(np.ones((n, n)), -1), dtype)


def once(compute: Callable[..., Any], *operands: Array) -> Any:
    """`compute(*operands)`, not fused with what uses it.

    An `optimization_barrier` is removed before fusion; a branch is not.
    The branch is taken unless the first operand begins with NaN; then the result is NaN.
    """
    nothing = lambda *_: jax.tree.map(lambda x: jnp.full(x.shape, jnp.nan, x.dtype), jax.eval_shape(compute, *operands))  # noqa: E731
    first = operands[0].ravel()[0]
    return lax.cond(first == first, compute, nothing, *operands)
