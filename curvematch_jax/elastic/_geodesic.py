"""Path straightening: geodesics of closed curves (Klassen and Srivastava, ECCV 2006; Srivastava et al., PAMI 2011)."""

import functools as ft
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, ArrayLike, Bool, Float

from ._align import align
from ._aligner import Aligner
from ._check import MIN_SAMPLES, as_field, as_shapes
from ._curve import centre, norm
from ._lanes import running_sum
from ._matched import srvfs_along
from ._preshape import (
    close,
    closure,
    great_circle,
    inner,
    project_tangent,
    sphere_distance,
    unit,
)

_CONTRACTION = 0.35  # of the energy's gradient in one step, at worst: curves with sharp turns, far apart
_CLOSING_STEPS = 3


class Geodesic(NamedTuple):
    """A geodesic in the closed pre-shape space.

    Attributes:
        path: `(*b, k, d, samples)`, SRVFs from curve1's to that of curve2 as aligned, equally spaced in time.
        length: `(*b,)`, radians.
        energy: `(*b, s)`, `1/2 integral |alpha'|^2` after every straightening step, the first value before any.
        closure: `(*b,)`, the largest `|integral q|q||` along the path.
        converged: `(*b,)`, whether the norm of the energy's gradient fell below eps^(2/3): 2e-5 in float32, 4e-11 in
            float64. A step divides it by 3 at least, mostly by 30; there are 11 and 23 of them.
    """

    path: Float[Array, "*b k d n"]
    length: Float[Array, "*b"]
    energy: Float[Array, "*b s"]
    closure: Float[Array, "*b"]
    converged: Bool[Array, "*b"]

    def curves(self) -> Float[Array, "*b k d n"]:
        """The deformation to draw: centred closed polygons of unit length, from curve1 to curve2 as aligned."""
        sides = self.path * norm(self.path)[..., None, :] / self.path.shape[-1]
        return centre(running_sum(sides))


def geodesic(
    curve1: ArrayLike, curve2: ArrayLike, steps: int = 6, aligner: Aligner | None = None, samples: int | None = None
) -> Geodesic:
    """The geodesic in C from curve1 to curve2 as aligned, of `steps` steps; closed curves `(*b, d, n)`.

    The curves are aligned and read at equal times of the path that matches them; their SRVFs are joined by the great
    circle projected to C, and this path is straightened: the gradient of `E = 1/2 integral |alpha'|^2`, in the metric
    of the paths' first derivative, is descended with fixed ends.

    Args:
        steps: of the geodesic.
        aligner: `Aligner.accurate()` unless given.
        samples: of each curve on the way; twice n unless given.

    Raises:
        ValueError: as `align`, and for steps below 1 or samples below 8.
    """
    if steps < 1:
        raise ValueError(f"steps = {steps}: a geodesic has 1 step or more.")
    curve1, curve2 = as_shapes("curve1", curve1), as_shapes("curve2", curve2)
    found = align(curve1, curve2, aligner)
    samples = 2 * curve1.shape[-1] if samples is None else samples
    if samples < MIN_SAMPLES:
        raise ValueError(f"samples = {samples}: closed curves need {MIN_SAMPLES} or more.")
    return straighten(joined(*srvfs_along(curve1, curve2, found, samples), steps))


def log_map(q1: ArrayLike, q2: ArrayLike, steps: int = 16) -> Float[Array, "*b d n"]:
    """The velocity at `q1` of the geodesic of C that reaches `q2` at time 1; both in C, `(*b, d, n)`.

    From a straightened path of `steps` steps; `exp_map(q1, log_map(q1, q2))` is q2 but for their errors.
    Raises `ValueError` unless q1 and q2 are real of shape `(*b, d >= 2, n)`, and for steps below 1.
    """
    if steps < 1:
        raise ValueError(f"steps = {steps}: a geodesic has 1 step or more.")
    found = straighten(joined(*jnp.broadcast_arrays(as_field("q1", q1), as_field("q2", q2)), steps))
    start, ahead = found.path[..., 0, :, :], found.path[..., 1, :, :]
    return unit(project_tangent(start, ahead - start)) * found.length[..., None, None]


@ft.partial(jax.jit, static_argnums=2)
def joined(q1: Float[Array, "*b d n"], q2: Float[Array, "*b d n"], steps: int) -> Float[Array, "*b k d n"]:
    """The great circle between two points of C, projected to C."""
    path = close(great_circle(q1, q2, steps), 2 * _CLOSING_STEPS)
    return jnp.concatenate([q1[..., None, :, :], path[..., 1:-1, :, :], q2[..., None, :, :]], axis=-3)


@jax.jit
def straighten(path: Float[Array, "*b k d n"]) -> Geodesic:
    """Straighten a path in C between its ends."""
    steps = path.shape[-3] - 1
    tolerance = float(jnp.finfo(path.dtype).eps) ** (2 / 3)
    count = math.ceil(math.log(tolerance) / math.log(_CONTRACTION))
    smoothing = _inverse_laplacian(steps, path.dtype)

    def step(path, _):
        inside = path[..., 1:-1, :, :]
        pull = project_tangent(inside, 2 * inside - path[..., :-2, :, :] - path[..., 2:, :, :])
        moved = close(inside - jnp.einsum("ij,...jdn->...idn", smoothing, pull), _CLOSING_STEPS)
        moved = jnp.concatenate([path[..., :1, :, :], moved, path[..., -1:, :, :]], axis=-3)
        size = jnp.sqrt(jnp.max(inner(pull, pull), axis=-1, initial=0))
        better = _energy(moved) <= _energy(path) * (1 + 8 * jnp.finfo(path.dtype).eps)  # rounding is no reason to stop
        return jnp.where(better[..., None, None, None], moved, path), (_energy(path), size * steps)

    path, (energies, sizes) = lax.scan(step, path, None, length=count)
    energy = jnp.concatenate([energies, _energy(path)[None]])
    return Geodesic(
        path=path,
        length=path_length(path),
        energy=jnp.moveaxis(energy, 0, -1),
        closure=jnp.max(jnp.linalg.norm(closure(path), axis=-1), axis=-1),
        converged=sizes[-1] < tolerance,
    )


def path_length(path: Float[Array, "*b k d n"]) -> Float[Array, "*b"]:
    """The length of a path of SRVFs, in radians: great circles between its points."""
    return jnp.sum(sphere_distance(path[..., 1:, :, :], path[..., :-1, :, :]), axis=-1)


def _energy(path: Float[Array, "*b k d n"]) -> Float[Array, "*b"]:
    step = jnp.diff(path, axis=-3)
    return (path.shape[-3] - 1) / 2 * jnp.sum(inner(step, step), axis=-1)


def _inverse_laplacian(steps: int, dtype) -> Float[Array, "k k"]:
    """The inverse second difference between fixed ends: a gradient in the metric of the path's derivative."""
    inside = steps - 1
    second = 2 * np.eye(inside) - np.eye(inside, k=1) - np.eye(inside, k=-1)
    return jnp.asarray(np.linalg.inv(second) if inside else second, dtype)
