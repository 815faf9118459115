"""The pre-shape space of closed curves: `C = {q : ||q|| = 1, integral q|q| = 0}`, with the L2 metric.

The normal space at q is spanned by q and `n_k = (q_k / |q|) q + |q| e_k` (Srivastava et al., PAMI 2011). SRVFs are
`(*b, d, n)` at `k/n`; integrals are means over the samples.
"""

import functools as ft
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, ArrayLike, Bool, Float

from ._check import as_field, traced
from ._curve import norm
from ._lanes import solve

_NEWTON_STEPS = 12
_DUAL_STEPS = 40
_ANGLE_STEPS = 12
_GENTLE_STEPS = 60
_POLISHING_STEPS = 3
_LONGEST = 0.25  # of a gentle step's multiplier
_SHORTEST = 1e-4  # share of a Newton step
_FARTHEST = 0.48  # of multipliers: at 1/2 what is nearest jumps within one sample
_STRAIGHT = 2e-5  # 1 - |integral q|q||^2 of unit fields: those of straight lines have 0
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


def project_closed(q: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """The point of C nearest to `q`, `(*b, d, n)`, closed to rounding: below 1e-6 in float32, 1e-12 in float64.

    It solves `s q = p + sum_k x_k n_k(p)` with p closed and some s, where x minimises a convex function: no other point
    of C is nearer. Derivatives are by the implicit function theorem, with optimistix.
    Of fields that all but keep to one half-space, as those of short arcs, what is nearest jumps within one sample. They
    are closed by damped Newton steps along the normals.

    Raises `ValueError` unless q is real and finite of shape `(*b, d >= 2, n)`, and for what cannot be closed: zero, and
    straight lines that never turn back. Traced, those come back zero, or straight and of unit norm.
    """
    field = as_field("q", q)
    found = _project(field.reshape(-1, *field.shape[-2:])).reshape(field.shape)
    if not traced(q):
        _check_closed(np.asarray(found).reshape(-1, *field.shape[-2:]))
    return found


def _check_closed(fields: np.ndarray) -> None:
    """`ValueError` unless fields `(b, d, n)` are of unit norm and closed."""
    ends = np.linalg.norm(np.mean(fields * np.linalg.norm(fields, axis=1, keepdims=True), axis=2), axis=1)
    unit_norm = np.abs(np.mean(np.sum(fields * fields, axis=1), axis=1) - 1) < 1e-3
    bad = ~(unit_norm & (ends < (1e-6 if fields.dtype == np.float32 else 1e-12)))
    if bad.any():
        raise ValueError(
            f"q cannot be closed in field {int(np.argmax(bad))} of {len(bad)}: it is zero, or all but a straight "
            "line that never turns back."
        )


@jax.jit
def _project(q: Float[Array, "b d n"]) -> Float[Array, "b d n"]:
    largest = lax.stop_gradient(jnp.max(jnp.abs(q), axis=(1, 2), keepdims=True))
    start = unit(q / jnp.where(largest > 0, largest, 1))
    x, regular = jax.vmap(_multiplier)(lax.stop_gradient(start))
    straight = lax.stop_gradient(1 - jnp.sum(closure(start) ** 2, axis=1)) < _STRAIGHT
    hopeless = (straight | (largest[:, 0, 0] == 0))[:, None, None]
    regular = regular[:, None, None] & ~hopeless
    circle = jnp.asarray(_circle(*q.shape[1:]), q.dtype)[None]  # a stand-in, where a branch could have no derivative
    nearest = unit(jax.vmap(_nearest)(jnp.where(regular, start, circle), jnp.where(regular[:, 0], x, 0)))
    others = jnp.where(regular | hopeless, circle, start)
    gently = lax.cond(jnp.all(regular | hopeless), lambda q: q, lambda q: _close_gently(q, _GENTLE_STEPS), others)
    closed = _close_gently(jnp.where(regular, nearest, gently), _POLISHING_STEPS)
    return jnp.where(hopeless, start, closed)


def _close_gently(q: Float[Array, "b d n"], steps: int) -> Float[Array, "b d n"]:
    """As `close`, in damped steps along the normals of C within the sphere: they close all but straight lines."""

    def step(_, q):
        ends = closure(q)
        x = _solve(_gram(q) - 4 * ends[..., :, None] * ends[..., None, :], ends)
        size = jnp.sqrt(jnp.sum(x * x, axis=-1, keepdims=True) + _LONGEST**2)
        return unit(q - normal(q, x * (_LONGEST / size)))

    return lax.fori_loop(0, steps, step, q)


def _circle(d: int, n: int) -> np.ndarray:
    angle = 2 * np.pi * np.arange(n) / n
    return np.concatenate([[np.cos(angle), np.sin(angle)], np.zeros((d - 2, n))])


def _nearest(q: Float[Array, "d n"], x: Float[Array, " d"]) -> Float[Array, "d n"]:
    """The p of the multiplier near x with which it is closed; its derivatives are those of the exact one."""
    import optimistix as optx

    tolerance = float(jnp.finfo(q.dtype).eps)
    solver = optx.Newton(rtol=tolerance, atol=tolerance)
    found = optx.root_find(
        lambda x, q: closure(_moved(q, x)[0]), solver, x, args=q, max_steps=_POLISHING_STEPS, throw=False
    )
    return _moved(q, found.value)[0]


def _multiplier(q: Float[Array, "d n"]) -> tuple[Float[Array, " d"], Bool[Array, ""]]:
    """The x with which the p of `_moved` is closed, and whether it was found: by damped Newton steps.

    It minimises `D(x) = max_p <q, p> - |p|^2 / 2 - <x, p|p|>`, over all fields p: convex, with the gradient
    `-closure(p)`. For p of C, `<q, p> <= sqrt(2 D(x))` with any x, with equality at the minimum: no p is nearer to q.
    """
    eps = float(jnp.finfo(q.dtype).eps)

    def ends(x):
        p, value = _moved(q, x)
        return closure(p), (closure(p), value)

    def step(state):
        x, value, newton, _, share, count = state
        ahead = x - share * newton
        slope, (gap, there) = jax.jacfwd(ends, has_aux=True)(ahead)
        found = ahead, there, _solve(slope, gap), jnp.linalg.norm(gap) / there
        accepted = (jnp.sum(ahead * ahead) < _FARTHEST**2) & (there < value + 4 * eps) & jnp.isfinite(found[2]).all()
        state = (jnp.where(accepted, a, b) for a, b in zip(found, state, strict=False))
        return *state, jnp.where(accepted, jnp.minimum(4 * share, 1), share / 4), count + 1

    def still_open(state):
        return (state[3] > eps) & (state[4] > _SHORTEST) & (state[5] < _DUAL_STEPS)

    zero, far = jnp.zeros(q.shape[0], q.dtype), jnp.full((), jnp.inf, q.dtype)
    found = lax.while_loop(still_open, step, (zero, far, zero, far, jnp.ones((), q.dtype), 0))
    return found[0], found[3] < eps**0.7


def _moved(q: Float[Array, "d n"], x: Float[Array, " d"]) -> tuple[Float[Array, "d n"], Float[Array, ""]]:
    """The p with the largest `<q, p> - |p|^2 / 2 - <x, p|p|>`, for `|x| < 1/2`, and that number.

    There `q = p + sum_k x_k n_k(p)`. With `p = (|q| / t) u` for unit u, `t q/|q| - x = (1 + <x, u>) u`: an equation for
    the number t of each sample.
    """
    size = norm(q)
    direction = q / jnp.where(size > 0, size, 1)[None]
    along, square = jnp.sum(x[:, None] * direction, axis=0), jnp.sum(x * x)
    t = _ratio(*lax.stop_gradient((along, square)))
    for _ in range(2):  # Exact already, these are for first and second derivatives.
        root = jnp.sqrt(t * t - 2 * t * along + square)
        miss = t * t - 3 * t * along + 2 * square - root
        t = t - miss / (2 * t - 3 * along - (t - along) / root)
    towards = t[None] * direction - x[:, None]
    p = towards * (size / (t * norm(towards)))[None]
    return p, jnp.mean(jnp.sum(q * p, axis=0)) / 2


def _ratio(along: Float[Array, " n"], square: Float[Array, ""]) -> Float[Array, " n"]:
    """The t of `_moved` for `<x, q/|q|>` and `|x|^2`, from the angle between p and q.

    The tangent of half that angle is the one zero, from 0 to 1, of a polynomial, which rises there.
    """
    across = jnp.sqrt(jnp.maximum(square - along**2, 0))
    more, less = 2 * (1 + along), 2 * (1 - along)

    def step(_, state):
        low, high, h = state
        miss = h * (more + less * h * h) - across * (1 + h * h * (6 + h * h))
        low, high = jnp.where(miss < 0, h, low), jnp.where(miss < 0, high, h)
        slope = more + 3 * less * h * h - across * h * (12 + 4 * h * h)
        ahead = h - miss / jnp.where(slope > 0, slope, 1)
        return low, high, jnp.where((slope > 0) & (ahead >= low) & (ahead <= high), ahead, (low + high) / 2)

    h = lax.fori_loop(0, _ANGLE_STEPS, step, (jnp.zeros_like(along), jnp.ones_like(along), across / more))[2]
    cosine, sine = (1 - h * h) / (1 + h * h), 2 * h / (1 + h * h)
    return (1 + 2 * (along * cosine - across * sine)) / cosine


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
    """`a^-1 b` for positive definite a, by elimination without pivots."""
    lanes_last = lambda x, axes: jnp.moveaxis(x, tuple(range(-axes, 0)), tuple(range(axes)))  # noqa: E731
    return jnp.moveaxis(solve(lanes_last(a, 2), lanes_last(b, 1)[:, None])[:, 0], 0, -1)


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
