"""Cyclic tridiagonal systems, many at once."""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float


def solve_cyclic(
    diagonal: Float[Array, "l m"], beside: Float[Array, "l m"], right: Float[Array, "k l m"]
) -> Float[Array, "k l m"]:
    """Solve symmetric positive definite cyclic tridiagonal systems; `beside[i]` couples i and i+1, the last wraps.

    Cyclic reduction of all rows at once: each of `log2(m)` rounds eliminates both neighbours of every row, in favour of
    those twice as far, until every row is its own neighbour. m is a power of two.
    """
    size = diagonal.shape[-1]

    def reduce(level, system):
        """Row i couples with rows i - step, by `upper[i - step]`, and i + step."""
        middle, upper, sides = system
        before = lambda x: jnp.roll(x, 2**level, axis=-1)  # noqa: E731
        after = lambda x: jnp.roll(x, -(2**level), axis=-1)  # noqa: E731
        lower = before(upper)
        low, high = -lower / before(middle), -upper / after(middle)
        return (
            middle + low * lower + high * upper,
            high * after(upper),
            sides + low[None] * before(sides) + high[None] * after(sides),
        )

    middle, upper, sides = lax.fori_loop(0, size.bit_length() - 1, reduce, (diagonal, beside, right))
    return sides / (middle + 2 * upper)[None]
