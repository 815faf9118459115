"""The best rotation, in closed form, for matrices whose entries lie on the leading axes: `(d, d, *lanes)`.

For `C = integral q1 q2^T`, `tr(R^T C) = <q1, R q2>` is maximal over SO(d) at `s_1 + ... + s_{d-1} + sign(det C) s_d`
(Kabsch; Horn's quaternions for d = 3). Lanes last: arithmetic on whole rows of pairs instead of tiny matrices.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ._lanes import dot, frobenius, solve

_NEWTON_STEPS = 8
_SQUARINGS = 18


def rotation_gain(c: Float[Array, "d d *l"]) -> Float[Array, "*l"]:
    """The largest `tr(R^T C)` over rotations R."""
    if c.shape[0] == 2:
        return jnp.sqrt((c[0, 0] + c[1, 1]) ** 2 + (c[0, 1] - c[1, 0]) ** 2)
    if c.shape[0] == 3:
        return _quartic_root(c)
    return frobenius(best_rotation(c), c)


def best_rotation(c: Float[Array, "d d *l"]) -> Float[Array, "d d *l"]:
    """The rotation R that maximises `tr(R^T C)`; some maximiser where there are several, always finite."""
    if c.shape[0] == 2:
        return _planar(c)
    if c.shape[0] == 3:
        return _by_quaternions(c)
    return _kabsch(c)


def _planar(c: Float[Array, "2 2 *l"]) -> Float[Array, "2 2 *l"]:
    x, y = c[0, 0] + c[1, 1], c[1, 0] - c[0, 1]
    size = jnp.sqrt(x * x + y * y)
    safe = jnp.where(size > 0, size, 1)
    cos, sin = jnp.where(size > 0, x / safe, 1), y / safe
    return jnp.stack([jnp.stack([cos, -sin]), jnp.stack([sin, cos])])


def _quartic_root(c: Float[Array, "3 3 *l"]) -> Float[Array, "*l"]:
    """Largest eigenvalue of Horn's matrix: Newton from above on its characteristic polynomial (Theobald, 2005)."""
    cofactors = [
        c[(i + 1) % 3, (j + 1) % 3] * c[(i + 2) % 3, (j + 2) % 3]
        - c[(i + 1) % 3, (j + 2) % 3] * c[(i + 2) % 3, (j + 1) % 3]
        for i in range(3)
        for j in range(3)
    ]
    determinant = sum(c[0, j] * cofactors[j] for j in range(3))
    square = frobenius(c, c)
    constant = square * square - 4 * sum(x * x for x in cofactors)
    root = jnp.sqrt(3 * square)
    for _ in range(_NEWTON_STEPS):
        value = ((root * root - 2 * square) * root - 8 * determinant) * root + constant
        slope = 4 * (root * root - square) * root - 8 * determinant
        root = root - jnp.where(slope > 0, value / jnp.where(slope > 0, slope, 1), 0)
    return root


def _by_quaternions(c: Float[Array, "3 3 *l"]) -> Float[Array, "3 3 *l"]:
    """`tr(R^T C)` is a quadratic form of the quaternion of R: the largest eigenvector of Horn's matrix."""
    products = jnp.asarray(_PRODUCTS, c.dtype)
    x = _largest_eigenvector(jnp.tensordot(products, c, 2, precision="highest"))
    return jnp.tensordot(products, x[:, None] * x[None], ((0, 1), (0, 1)), precision="highest")


def _quaternion_products() -> np.ndarray:
    """B, `(4, 4, 3, 3)`: the rotation of a unit quaternion is `R_ij = sum_ab B_abij x_a x_b`."""
    one = np.eye(3)
    found = np.zeros((4, 4, 3, 3))
    found[0, 0] = one
    found[0, 1:] = found[1:, 0] = np.cross(one[:, None], one[None]).swapaxes(1, 2)  # v -> e_k x v
    outer = one[:, None, :, None] * one[None, :, None, :]
    found[1:, 1:] = outer + outer.swapaxes(0, 1) - one[:, :, None, None] * one
    return found


_PRODUCTS = _quaternion_products()


def _largest_eigenvector(k: Float[Array, "4 4 *l"]) -> Float[Array, "4 *l"]:
    """Power iteration by repeated squaring: no special case, and finite where eigenvalues coincide."""
    lanes = (1,) * (k.ndim - 2)
    size = jnp.sqrt(frobenius(k, k))
    power = k / jnp.where(size > 0, size, 1)[None, None] + jnp.eye(4, dtype=k.dtype).reshape(4, 4, *lanes)

    def square(_, power):
        power = dot(jnp.swapaxes(power, 0, 1)[:, :, None], power[:, None])
        return power / (power[0, 0] + power[1, 1] + power[2, 2] + power[3, 3])[None, None]

    power = lax.fori_loop(0, _SQUARINGS, square, power)
    diagonal = jnp.stack([power[i, i] for i in range(4)])
    column = jnp.argmax(diagonal, axis=0)
    vector = jnp.take_along_axis(power, column[None, None], axis=1)[:, 0]
    return vector / jnp.sqrt(dot(vector, vector))[None]


def _kabsch(c: Float[Array, "d d *l"]) -> Float[Array, "d d *l"]:
    u, _, vh = jnp.linalg.svd(jnp.moveaxis(c, (0, 1), (-2, -1)))
    sign = jnp.sign(jnp.linalg.det(u) * jnp.linalg.det(vh))
    u = u.at[..., -1].multiply(sign[..., None])
    return jnp.moveaxis(u @ vh, (-2, -1), (0, 1))


def generators(q: Float[Array, "d *k"]) -> list[Float[Array, "d *k"]]:
    """`E q` for a basis E of the antisymmetric matrices."""
    found = []
    for i in range(len(q)):
        for j in range(i + 1, len(q)):
            rows = [jnp.zeros_like(q[0])] * len(q)
            rows[i], rows[j] = q[j], -q[i]
            found.append(jnp.stack(rows))
    return found


def generator_components(c: Float[Array, "d d *l"]) -> Float[Array, "g *l"]:
    """`<E, C>` of the same basis: the means of `<p, E q>` from `C = mean p q^T`."""
    above, below = np.triu_indices(len(c), 1)
    return c[above, below] - c[below, above]


def generator_products(c: Float[Array, "d d *l"]) -> Float[Array, "g g *l"]:
    """The means of `<E q, F q>` for E and F of the same basis, from `C = mean q q^T`."""
    above, below = np.triu_indices(len(c), 1)
    number = np.arange(len(above))
    basis = np.zeros((len(above), *c.shape[:2]))
    basis[number, above, below], basis[number, below, above] = 1, -1
    products = jnp.asarray(np.einsum("aki,bkj->abij", basis, basis), c.dtype)
    return jnp.tensordot(products, c, 2, precision="highest")


def cayley(x: Float[Array, "g *l"], d: int) -> Float[Array, "d d *l"]:
    """`(1 - A/2)^-1 (1 + A/2)` for `A = sum_k x_k E_k`: a rotation, `exp(A)` but for terms of third order."""
    lanes = (1,) * (x.ndim - 1)
    one = jnp.eye(d, dtype=x.dtype)
    half = sum(value[None, None] * e.reshape(d, d, *lanes) for value, e in zip(x, generators(one), strict=True)) / 2
    one = one.reshape(d, d, *lanes)
    return solve(one - half, one + half)


def covariance(q1: Float[Array, "d l n"], q2: Float[Array, "e l n"]) -> Float[Array, "d e l"]:
    """`C = mean_k q1_k q2_k^T`."""
    return jnp.mean(q1[:, None] * q2[None], axis=-1)
