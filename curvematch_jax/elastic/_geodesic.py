"""Path straightening: geodesics of closed curves (Klassen and Srivastava, ECCV 2006; Srivastava et al., PAMI 2011)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, ArrayLike, Bool, Float

from ._align import align
from ._aligner import Aligner
from ._check import as_curves
from ._curve import interpolate, srvf_of, velocity
from ._preshape import closure, great_circle, inner, project_closed, project_tangent, sphere_distance, unit
from ._srvf import to_curve, to_srvf

_STRAIGHTENING_STEPS = 10
_OVERSAMPLING = 8


class Geodesic(NamedTuple):
    """A geodesic in the closed pre-shape space.

    Attributes:
        path: `(*b, k, d, n)`, SRVFs from curve1's to that of curve2 laid onto it, equally spaced in time.
        length: `(*b,)`, radians.
        energy: `(*b, s)`, `1/2 integral |alpha'|^2` after every straightening step, the first value before any.
        closure: `(*b,)`, the largest `|integral q|q||` along the path.
        converged: `(*b,)`, whether the norm of the energy's gradient fell below eps^(2/3): 2e-5 in float32, 4e-11 in
            float64. A step divides it by 30 or more.
    """

    path: Float[Array, "*b k d n"]
    length: Float[Array, "*b"]
    energy: Float[Array, "*b s"]
    closure: Float[Array, "*b"]
    converged: Bool[Array, "*b"]

    def curves(self) -> Float[Array, "*b k d n"]:
        """The deformation to draw: centred closed curves of unit length."""
        return to_curve(self.path)


def geodesic(curve1: ArrayLike, curve2: ArrayLike, steps: int = 6, aligner: Aligner | None = None) -> Geodesic:
    """The geodesic from curve1 to curve2 laid onto it, in C, of `steps` steps; closed curves `(*b, d, n)`.

    The ends are aligned, joined by the great circle projected to C, and the path is straightened: the gradient of
    `E = 1/2 integral |alpha'|^2`, in the metric of the paths' first derivative, is descended with fixed ends.

    Raises:
        ValueError: as `align`, and for steps below 1.
    """
    if steps < 1:
        raise ValueError(f"steps = {steps}: a geodesic has 1 step or more.")
    curve1, curve2 = as_curves("curve1", curve1), as_curves("curve2", curve2)
    found = align(curve1, curve2, aligner)
    q1 = jnp.broadcast_to(project_closed(to_srvf(curve1)), (*found.distance.shape, *curve1.shape[-2:]))
    q2 = project_closed(aligned_srvf(curve2, found.rotation, found.warp))
    return straighten(project_closed(great_circle(q1, q2, steps)))


def aligned_srvf(
    curve: Float[Array, "*c d n"], rotation: Float[Array, "*b d d"], warp: Float[Array, "*b m+1"]
) -> Float[Array, "*b d n"]:
    """`R q(gamma) sqrt(gamma')` at `k/n`, of unit norm: how an alignment lays a curve.

    Each sample is the mean over the interval of length `1/n` around it: a warp is finer than the samples.
    """
    n, m = curve.shape[-1], warp.shape[-1] - 1
    if m % (2 * n):
        grid = jnp.arange(2 * m + 1, dtype=warp.dtype)
        fine = jax.vmap(lambda gamma: jnp.interp(grid, grid[::2], gamma))(warp.reshape(-1, m + 1))
        return aligned_srvf(curve, rotation, fine.reshape(*warp.shape[:-1], -1))
    curve = jnp.broadcast_to(curve, (*warp.shape[:-1], *curve.shape[-2:]))
    field = interpolate(srvf_of(velocity(curve, _OVERSAMPLING * n)), (warp[..., :-1] + warp[..., 1:]) / 2)
    field = field * jnp.sqrt(jnp.maximum(jnp.diff(warp, axis=-1) * m, 0))[..., None, :]
    around = jnp.roll(field, m // (2 * n), axis=-1).reshape(*field.shape[:-1], n, m // n)
    return unit(jnp.einsum("...ij,...jn->...in", rotation, jnp.mean(around, axis=-1)))


@jax.jit
def straighten(path: Float[Array, "*b k d n"]) -> Geodesic:
    """Straighten a path in C between its ends."""
    steps = path.shape[-3] - 1
    tolerance = float(jnp.finfo(path.dtype).eps) ** (2 / 3)
    smoothing = _inverse_laplacian(steps, path.dtype)

    def step(path, _):
        inside = path[..., 1:-1, :, :]
        pull = project_tangent(inside, 2 * inside - path[..., :-2, :, :] - path[..., 2:, :, :])
        moved = project_closed(inside - jnp.einsum("ij,...jdn->...idn", smoothing, pull))
        moved = jnp.concatenate([path[..., :1, :, :], moved, path[..., -1:, :, :]], axis=-3)
        size = jnp.sqrt(jnp.max(inner(pull, pull), axis=-1, initial=0))
        better = _energy(moved) <= _energy(path)
        return jnp.where(better[..., None, None, None], moved, path), (_energy(path), size * steps)

    path, (energies, sizes) = lax.scan(step, path, None, length=_STRAIGHTENING_STEPS)
    energy = jnp.concatenate([energies, _energy(path)[None]])
    return Geodesic(
        path=path,
        length=jnp.sum(sphere_distance(path[..., 1:, :, :], path[..., :-1, :, :]), axis=-1),
        energy=jnp.moveaxis(energy, 0, -1),
        closure=jnp.max(jnp.linalg.norm(closure(path), axis=-1), axis=-1),
        converged=sizes[-1] < tolerance,
    )


def _energy(path: Float[Array, "*b k d n"]) -> Float[Array, "*b"]:
    step = jnp.diff(path, axis=-3)
    return (path.shape[-3] - 1) / 2 * jnp.sum(inner(step, step), axis=-1)


def _inverse_laplacian(steps: int, dtype) -> Float[Array, "k k"]:
    """The inverse second difference between fixed ends: a gradient in the metric of the path's derivative."""
    inside = steps - 1
    second = 2 * np.eye(inside) - np.eye(inside, k=1) - np.eye(inside, k=-1)
    return jnp.asarray(np.linalg.inv(second) if inside else second, dtype)
