"""Cyclic tridiagonal systems, many at once."""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

_SHORT = 128  # rows of a system that is eliminated all at once


def solve_cyclic(
    diagonal: Float[Array, "l m"], beside: Float[Array, "l m"], right: Float[Array, "k l m"]
) -> Float[Array, "k l m"]:
    """Solve symmetric positive definite cyclic tridiagonal systems; `beside[i]` couples i and i+1, the last wraps.

    Cyclic reduction: the even rows alone make such a system once the odd ones are eliminated. m is a power of two.
    """
    if diagonal.shape[-1] <= _SHORT:
        return _at_once(diagonal, beside, right)
    (even, odd), (after, before), (right_even, right_odd) = map(_halves, (diagonal, beside, right))
    after_share, before_share = after / odd, before / odd  # of the odd row that follows, and of the one ahead
    behind = lambda x: jnp.roll(x, 1, axis=-1)  # noqa: E731
    solved = solve_cyclic(
        even - after * after_share - behind(before * before_share),
        -after * before_share,
        right_even - after_share[None] * right_odd - behind(before_share[None] * right_odd),
    )
    ahead = jnp.roll(solved, -1, axis=-1)
    between = right_odd / odd[None] - after_share[None] * solved - before_share[None] * ahead
    return jnp.stack([solved, between], axis=-1).reshape(right.shape)


def _halves(x: Float[Array, "*k m"]) -> tuple[Float[Array, "*k h"], Float[Array, "*k h"]]:
    pairs = x.reshape(*x.shape[:-1], -1, 2)
    return pairs[..., 0], pairs[..., 1]


def _at_once(
    diagonal: Float[Array, "l m"], beside: Float[Array, "l m"], right: Float[Array, "k l m"]
) -> Float[Array, "k l m"]:
    """Each of `log2(m)` rounds eliminates both neighbours of every row, in favour of those twice as far, until every
    row is its own neighbour.
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
