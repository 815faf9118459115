"""Smoothing of surfaces, before anything is measured on them, and of functions on surfaces."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from ._blas import on_one_thread
from ._mesh import Mesh, MeshError

# A surface of which a step takes off so much of the area was rough, and is smoothed again, this often in all.
_ROUGH, _STEPS = 0.08, 3

# A surface of which a step leaves less than this is no rough one: it is thinner than the waves that are taken off.
_LEFT = 0.1


def smooth(mesh: Mesh, length: float) -> Mesh:
    """A surface without its roughness: implicit steps of bi-Laplacian smoothing, on most surfaces one.

    A step solves `(M + t^2 C M^-1 C) x = M x0` with the cotangents `C`, the vertices' areas `M` and `t = length^2 A`, A
    the surface's area. A wave of wavelength w keeps `1 / (1 + (2 pi length sqrt(A) / w)^4)` of its amplitude: half at
    `2 pi length`, next to all at three times that, so that limbs do not become thinner as with an ordinary Laplacian
    step (Desbrun, Meyer, Schroeder, Barr: Implicit fairing of irregular meshes, SIGGRAPH 1999). Roughness makes
    level curves longer by tens of per cent and differently on every scan.

    On a rough surface, distances and areas are not yet those of the surface beneath, so that a step leaves too much. If
    it took off a large share of the area, another follows, on the surface that it made. Needles and wires that are
    thinner than the waves would vanish, and stay as they are.

    Args:
        mesh: a closed surface.
        length: in square roots of the surface's area; 0 leaves the mesh as it is.
    """
    if not length:
        return mesh
    for _ in range(_STEPS):
        before, smoothed = mesh.area, _smoothed_once(mesh, length)
        if smoothed.area < _LEFT * before:
            break
        mesh = smoothed
        if mesh.area > (1 - _ROUGH) * before:
            break
    return mesh


def _smoothed_once(mesh: Mesh, length: float) -> Mesh:
    size, centre = float(np.sqrt(mesh.area)), mesh.vertices.mean(axis=0)
    unit = (mesh.vertices - centre) / size
    mass, cotangents = mesh.laplacian
    # 1 / (1 + t^2 l^2) is the real part of 1 / (1 + i t l), whose matrix has a third of the entries.
    system = factors(sp.diags_array(mass) + 1j * length**2 * cotangents, mesh.name)
    moved = system.solve(mass[:, None] * unit + 0j).real
    if not np.isfinite(moved).all():
        return mesh
    return Mesh(moved * size + centre, mesh.faces, mesh.name)


def smoothing_step(mesh: Mesh, length: float) -> Callable[[np.ndarray], np.ndarray]:
    """What smooths functions `(v,)` on a mesh: one implicit step of heat flow, `(M + length^2 A C) x = M x0`.

    A wave of wavelength w keeps `1 / (1 + (2 pi length sqrt(A) / w)^2)` of its amplitude.

    Args:
        length: in square roots of the surface's area.
    """
    mass, cotangents = mesh.laplacian
    solver = factors(sp.diags_array(mass) + length**2 * cotangents, mesh.name)
    return lambda function: solver.solve(mass * function)


@on_one_thread
def factors(matrix: Any, name: str) -> scipy.sparse.linalg.SuperLU:
    """What solves a symmetric system, of the mesh of this name, whose real part is positive."""
    try:
        # Symmetric and positive: an ordering for such matrices, no pivoting and no dense panels take half of the time.
        return scipy.sparse.linalg.splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            relax=1,
            panel_size=1,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # singular to all digits
        raise MeshError(f"{name or 'mesh'}: its triangles are too thin to be measured") from None
