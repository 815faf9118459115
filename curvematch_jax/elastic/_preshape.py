"""The pre-shape space of closed curves: `C = {q : ||q|| = 1, integral q|q| = 0}`, with the L2 metric.

The normal space at q is spanned by q and `n_k = (q_k / |q|) q + |q| e_k` (Srivastava et al., PAMI 2011). SRVFs are
`(*b, d, n)` at `k/n`; integrals are means over the samples.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from ._curve import norm

_NEWTON_STEPS = 12
_FIXED_POINT_STEPS = 4


def inner(q1: Float[Array, "*b d n"], q2: Float[Array, "*b d n"]) -> Float[Array, "*b"]:
    """The L2 inner product."""
    return jnp.mean(jnp.sum(q1 * q2, axis=-2), axis=-1)


def closure(q: Float[Array, "*b d n"]) -> Float[Array, "*b d"]:
    """`integral q|q|`: where the curve of `q` ends, seen from where it starts."""
    return jnp.mean(q * norm(q)[..., None, :], axis=-1)


def unit(q: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    """`q` scaled to unit norm; zero stays zero."""
    square = inner(q, q)[..., None, None]
    return q / jnp.sqrt(jnp.where(square > 0, square, 1))


def normals(q: Float[Array, "*b d n"]) -> Float[Array, "*b d d n"]:
    """`n_k`, the gradients of the closure's components, along the axis -3."""
    size = norm(q)
    direction = q / jnp.where(size > 0, size, 1)[..., None, :]
    identity = jnp.eye(q.shape[-2], dtype=q.dtype)[..., None]
    identity = identity.reshape((1,) * (q.ndim - 2) + identity.shape)
    return direction[..., :, None, :] * q[..., None, :, :] + size[..., None, None, :] * identity


def project_closed(q: ArrayLike) -> Float[Array, "*b d n"]:
    """The point of C nearest to `q`, `(*b, d, n)`, for q not far from closed.

    It solves `p = unit(q - sum_k x_k n_k(p))` with `x` such that p is closed: Newton's method of optimistix, with
    derivatives by the implicit function theorem. The closure that is left is rounding: below 1e-6 in float32, 1e-12 in
    float64.

    Raises `ValueError` unless q is real of shape `(*b, d >= 2, n)`.
    """
    q = jnp.asarray(q)
    if q.ndim < 2 or q.shape[-2] < 2 or not jnp.issubdtype(q.dtype, jnp.floating):
        raise ValueError(f"q has shape {q.shape} and dtype {q.dtype}: give real SRVFs as (*batch, d, n), d >= 2.")
    return _project(q.reshape(-1, *q.shape[-2:])).reshape(q.shape)


@jax.jit
def _project(q: Float[Array, "b d n"]) -> Float[Array, "b d n"]:
    return jax.vmap(_project_one)(q)


def _project_one(q: Float[Array, "d n"]) -> Float[Array, "d n"]:
    import optimistix as optx

    start = unit(q)

    def moved(x, q):
        point = q
        for _ in range(_FIXED_POINT_STEPS):
            point = unit(q - jnp.einsum("k,kdn->dn", x, normals(point)))
        return point

    tolerance = 8 * jnp.finfo(q.dtype).eps
    solver = optx.Newton(rtol=float(tolerance), atol=float(tolerance))
    zero = jnp.zeros(q.shape[0], q.dtype)
    found = optx.root_find(
        lambda x, q: closure(moved(x, q)), solver, zero, args=start, max_steps=_NEWTON_STEPS, throw=False
    )
    return moved(found.value, start)


def project_tangent(q: Float[Array, "*b d n"], v: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    """The part of `v` that is tangent to C at `q`."""
    basis = jnp.concatenate([q[..., None, :, :], normals(q)], axis=-3)
    n = q.shape[-1]
    gram = jnp.einsum("...idn,...jdn->...ij", basis, basis) / n
    right = jnp.einsum("...idn,...dn->...i", basis, v) / n
    ridge = jnp.finfo(q.dtype).eps * jnp.eye(gram.shape[-1], dtype=q.dtype)
    ridge = ridge.reshape((1,) * (gram.ndim - 2) + ridge.shape)
    weights = jnp.linalg.solve(gram + ridge, right[..., None])[..., 0]
    return v - jnp.einsum("...i,...idn->...dn", weights, basis)


def great_circle(q1: Float[Array, "*b d n"], q2: Float[Array, "*b d n"], steps: int) -> Float[Array, "*b k d n"]:
    """`steps + 1` equally spaced points of the great circle from `q1` to `q2` on the unit sphere of L2."""
    angle = sphere_distance(q1, q2)[..., None, None, None]
    time = jnp.linspace(0, 1, steps + 1, dtype=q1.dtype).reshape((1,) * (q1.ndim - 2) + (-1, 1, 1))
    safe = jnp.where(jnp.sin(angle) > 0, jnp.sin(angle), 1)
    weight1 = jnp.where(jnp.sin(angle) > 0, jnp.sin((1 - time) * angle) / safe, 1 - time)
    weight2 = jnp.where(jnp.sin(angle) > 0, jnp.sin(time * angle) / safe, time)
    return weight1 * q1[..., None, :, :] + weight2 * q2[..., None, :, :]


def sphere_distance(q1: Float[Array, "*b d n"], q2: Float[Array, "*b d n"]) -> Float[Array, "*b"]:
    """The arc cosine of `<q1, q2>` for unit q, through the chord: precise near 0, with derivative 0 at 0."""
    difference = q1 - q2
    square = inner(difference, difference)
    chord = jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1)), 0)
    return 2 * jnp.arcsin(jnp.minimum(chord / 2, 1))
