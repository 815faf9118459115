"""The pre-shape space of closed curves: `C = {q : ||q|| = 1, integral q|q| = 0}`, with the L2 metric.

The normal space at q is spanned by q and `n_k = (q_k / |q|) q + |q| e_k` (Srivastava et al., PAMI 2011). SRVFs are
`(*b, d, n)` at `k/n`; integrals are means over the samples.
"""

import functools as ft

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, ArrayLike, Float

from ._curve import norm

_NEWTON_STEPS = 12
_FIXED_POINT_STEPS = 4
_SMALL_STEPS = 3  # of Newton's method, from a point that was closed a small step ago


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


def project_closed(q: ArrayLike) -> Float[Array, "*b d n"]:
    """The point of C nearest to `q`, `(*b, d, n)`.

    It solves `p = unit(q - sum_k x_k n_k(p))` with `x` such that p is closed: Newton's method of optimistix, with
    derivatives by the implicit function theorem. The closure that is left is rounding: below 1e-6 in float32, 1e-12 in
    float64.

    Raises `ValueError` unless q is real of shape `(*b, d >= 2, n)`.
    """
    q = as_field("q", q)
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
            point = unit(q - normal(point, x))
        return point

    tolerance = 8 * jnp.finfo(q.dtype).eps
    solver = optx.Newton(rtol=float(tolerance), atol=float(tolerance))
    near = lax.stop_gradient(close(start, _NEWTON_STEPS))
    guess = _solve(_gram(near), normal_parts(near, start)) / inner(near, lax.stop_gradient(start))
    found = optx.root_find(
        lambda x, q: closure(moved(x, q)), solver, guess, args=start, max_steps=_NEWTON_STEPS, throw=False
    )
    return moved(found.value, start)


def close(q: Float[Array, "*b d n"], steps: int) -> Float[Array, "*b d n"]:
    """A point of C near `q`: Newton steps along the normals at every iterate. Near C it is all but the nearest."""
    for _ in range(steps):
        q = unit(q - normal(q, _solve(_gram(q), closure(q))))
    return q


def normal(q: Float[Array, "*b d n"], x: Float[Array, "*b d"]) -> Float[Array, "*b d n"]:
    """`sum_k x_k n_k` at q: gradients of the closure's components."""
    size = norm(q)
    along = jnp.sum(x[..., None] * q, axis=-2) / jnp.where(size > 0, size, 1)
    return along[..., None, :] * q + size[..., None, :] * x[..., None]


def normal_parts(q: Float[Array, "*b d n"], v: Float[Array, "*b d n"]) -> Float[Array, "*b d"]:
    """`<n_k, v>` for every k."""
    size = norm(q)
    along = jnp.sum(q * v, axis=-2) / jnp.where(size > 0, size, 1)
    return jnp.mean(along[..., None, :] * q + size[..., None, :] * v, axis=-1)


def project_tangent(q: Float[Array, "*b d n"], v: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    """The part of `v` that is tangent to C at q in C, where q is orthogonal to every `n_k`: `<q, n_k>` is twice its
    closure."""
    v = v - inner(q, v)[..., None, None] * q
    return v - normal(q, _solve(_gram(q), normal_parts(q, v)))


def _gram(q: Float[Array, "*b d n"]) -> Float[Array, "*b d d"]:
    """`<n_j, n_k> = 3 integral q_j q_k + delta_jk integral |q|^2`: for unit q, eigenvalues from 1 to 4."""
    second = jnp.einsum("...jn,...kn->...jk", q, q, precision="highest") / q.shape[-1]
    identity = jnp.broadcast_to(jnp.eye(q.shape[-2], dtype=q.dtype), second.shape)
    return 3 * second + jnp.trace(second, axis1=-2, axis2=-1)[..., None, None] * identity


def _solve(a: Float[Array, "*b d d"], b: Float[Array, "*b d"]) -> Float[Array, "*b d"]:
    """`a^-1 b` for positive definite a: Gaussian elimination written out, for which d is small enough."""
    d = b.shape[-1]
    rows = [jnp.concatenate([a[..., i, :], b[..., i, None]], axis=-1) for i in range(d)]
    for i in range(d):
        rows[i] = rows[i] / rows[i][..., i, None]
        rows = [row if k == i else row - row[..., i, None] * rows[i] for k, row in enumerate(rows)]
    return jnp.stack([row[..., d] for row in rows], axis=-1)


def exp_map(q: ArrayLike, v: ArrayLike, steps: int = 16) -> Float[Array, "*b d n"]:
    """Where the geodesic of C from `q` with velocity `v` is at time 1: both `(*b, d, n)`, v tangent to C at q in C.

    The discrete geodesic is shot: `q_{k+1} - 2 q_k + q_{k-1}` is normal to C at `q_k` (the SHAKE method of mechanics).
    The error falls with the square of `steps`.
    Raises `ValueError` unless q and v are real of shape `(*b, d >= 2, n)`, and for steps below 1.
    """
    if steps < 1:
        raise ValueError(f"steps = {steps}: a geodesic has 1 step or more.")
    return _shot(*jnp.broadcast_arrays(as_field("q", q), as_field("v", v)), steps)


@ft.partial(jax.jit, static_argnums=2)
def _shot(q: Float[Array, "*b d n"], v: Float[Array, "*b d n"], steps: int) -> Float[Array, "*b d n"]:
    def step(state, _):
        before, here = state
        return (here, _along_normals(here, 2 * here - before)), None

    first = _along_normals(q, q + v / steps)
    return lax.scan(step, (q, first), None, length=steps - 1)[0][1]


def _along_normals(q: Float[Array, "*b d n"], near: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    """The point of C that differs from `near` by a vector normal to C at q, close by."""
    gram = _gram(q)

    def correct(_, point):
        point = point - normal(q, _solve(gram, closure(point)))
        return point - ((inner(point, point) - 1) / 2)[..., None, None] * q

    return lax.fori_loop(0, _NEWTON_STEPS, correct, near)


def parallel_transport(path: ArrayLike, v: ArrayLike) -> Float[Array, "*b d n"]:
    """`v`, `(*b, d, n)`, tangent to C at the first point of a path in C, `(*b, k, d, n)`, carried to its last one.

    In each step v changes by a vector normal to C halfway, to become tangent at the next point: the implicit midpoint
    rule, whose error falls with the square of the path's steps.
    Raises `ValueError` unless path and v are real and of such shapes.
    """
    path, v = as_field("path", path), as_field("v", v)
    if path.ndim < 3:
        raise ValueError(f"path has shape {path.shape}: give the points of a path, (*batch, points, d, n).")
    batch = jnp.broadcast_shapes(path.shape[:-3], v.shape[:-2])
    return _transported(jnp.broadcast_to(path, batch + path.shape[-3:]), jnp.broadcast_to(v, batch + v.shape[-2:]))


@jax.jit
def _transported(path: Float[Array, "*b k d n"], v: Float[Array, "*b d n"]) -> Float[Array, "*b d n"]:
    points = jnp.moveaxis(path, -3, 0)

    def step(v, ends):
        here, ahead = _normal_frame(close((ends[0] + ends[1]) / 2, _SMALL_STEPS)), _normal_frame(ends[1])
        products = jnp.einsum("...idn,...jdn->...ij", ahead, here, precision="highest") / v.shape[-1]
        parts = jnp.einsum("...idn,...dn->...i", ahead, v, precision="highest") / v.shape[-1]
        return v - jnp.einsum("...i,...idn->...dn", _solve(products, parts), here, precision="highest"), None

    return lax.scan(step, v, (points[:-1], points[1:]))[0]


def _normal_frame(q: Float[Array, "*b d n"]) -> Float[Array, "*b d+1 d n"]:
    """A basis of the normal space at q, along the axis -3: q and every `n_k`."""
    basis = jnp.eye(q.shape[-2], dtype=q.dtype)
    each = jax.vmap(lambda x: normal(q, jnp.broadcast_to(x, q.shape[:-1])), out_axes=-3)(basis)
    return jnp.concatenate([q[..., None, :, :], each], axis=-3)


def as_field(name: str, q: ArrayLike) -> Float[Array, "*b d n"]:
    """The array, if it is one of SRVFs or of their tangent vectors; else `ValueError`."""
    q = jnp.asarray(q)
    if q.ndim < 2 or q.shape[-2] < 2 or not jnp.issubdtype(q.dtype, jnp.floating):
        raise ValueError(f"{name} has shape {q.shape} and dtype {q.dtype}: give real fields as (*batch, d, n), d >= 2.")
    return q


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
