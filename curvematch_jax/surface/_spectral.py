"""Spectral distances: those between points of an embedding by the eigenfunctions of the surface's Laplacian.

Geodesic distance is the length of the one shortest way: a bridge that joins two limbs, however thin, changes it
everywhere beyond. Spectral distances come from all ways together, and count the width of each.
"""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg

from ._blas import on_one_thread
from ._mesh import Mesh
from ._smooth import factors
from ._topology import face_components, used

SpectralField = Literal["diffusion", "biharmonic", "commute_time"]

# Eigenpairs besides the constant one. By Weyl's law the shortest waves are a seventh of the square root of the area:
# they tell fingers apart, and no triangles.
_EIGENPAIRS = 150

# Diffusion time over area, which a short cut leaves as it is, unlike the lowest eigenvalue. With 0.02 a snake has
# feature points all along its body, with 0.1 some horses have none at their ears.
_TIME = 0.05

# Eigenvalues are looked for next to this value, with the area as unit: just below 0, where the matrix is regular.
_SHIFT = -1e-2

# With fewer vertices than this times the eigenpairs, the dense matrix is the quicker way to them.
_DENSE = 4

_WEIGHTS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "diffusion": lambda eigenvalues: np.exp(-_TIME * eigenvalues),
    "biharmonic": lambda eigenvalues: 1 / eigenvalues,
    "commute_time": lambda eigenvalues: 1 / np.sqrt(eigenvalues),
}


class SpectralDistances:
    """Spectral distances on one mesh; the embedding is prepared once.

    With the eigenvalues `l_i` and eigenfunctions `e_i` of the Laplacian of the surface, scaled to unit area,

        d(x, y)^2 = A sum_i (1 - l_i / l_K)^2 w(l_i)^2 (e_i(x) - e_i(y))^2,    i = 1..K,

    where `w = 1 / l` makes the biharmonic distance (Lipman, Rustamov, Funkhouser: Biharmonic distance, ACM Trans.
    Graph. 29(3), 2010), `w = 1 / sqrt(l)` the square root of commute time (Qiu, Hancock: Clustering and embedding using
    commute times, IEEE PAMI 29(11), 2007) and `w = exp(-t l)` the diffusion distance (Coifman, Lafon: Diffusion maps,
    Appl. Comput. Harmon. Anal. 21(1), 2006). The area `A` brings all of them back to lengths in the mesh's unit.

    On a surface the whole sum of commute times diverges, and what a mesh makes of it depends on its triangles. The
    first K terms do not. Fading them out (a Riesz mean) keeps the last ones from showing as ripples, whose crests
    would be taken for feature points, and makes it indifferent where a multiple eigenvalue is cut.

    Args:
        mesh: a closed, connected mesh, as `clean` makes them.
        field: the weights.

    Raises:
        ValueError: the mesh is not connected, or has vertices without faces.
    """

    def __init__(self, mesh: Mesh, field: SpectralField):
        if face_components(mesh.faces)[0] > 1 or used(mesh.faces).sum() < len(mesh.vertices):
            raise ValueError(f"{mesh.name or 'mesh'}: spectral distances need one connected surface and nothing else")
        size = float(np.sqrt(mesh.area))
        eigenvalues, functions = eigenpairs(mesh, _EIGENPAIRS)
        fading = 1 - eigenvalues / eigenvalues[-1]
        self._embedding = size * fading * _WEIGHTS[field](eigenvalues) * functions

    def __call__(self, source: int) -> np.ndarray:
        """Distances `(v,)` from vertex `source`, in mesh units: 0 at the source."""
        return np.linalg.norm(self._embedding - self._embedding[source], axis=1)


def eigenpairs(mesh: Mesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest eigenpairs of a connected surface's Laplacian, without the constant one.

    `C e = l M e` with the cotangents `C` and the vertices' areas `M` on the diagonal, as the ordinary problem of
    `M^-1/2 C M^-1/2`. Lanczos steps start from a fixed vector, so the result is always the same.

    Args:
        count: how many; of a small mesh at most `v - 1`.

    Returns:
        eigenvalues `(k,)`, ascending, and eigenfunctions `(v, k)` of unit norm, each up to its sign, of the surface
        scaled to unit area.
    """
    mass, cotangents = mesh.laplacian
    root = sp.diags_array(1 / np.sqrt(mass))
    start = np.random.default_rng(0).standard_normal(len(mass))
    matrix = (root @ cotangents @ root).tocsc()
    eigenvalues, functions = _lowest(matrix, min(count + 1, len(mass)), start, mesh.name)
    return eigenvalues[1:], root @ functions[:, 1:]


@on_one_thread
def _lowest(matrix: sp.csc_array, count: int, start: np.ndarray, name: str) -> Any:
    """The lowest eigenvalues of a symmetric matrix, ascending, and their eigenvectors."""
    if len(start) < _DENSE * count:
        return scipy.linalg.eigh(matrix.toarray(), subset_by_index=(0, count - 1))
    solver = factors(matrix - _SHIFT * sp.eye_array(len(start)), name)
    operator: Any = scipy.sparse.linalg.LinearOperator
    inverse = operator(matrix.shape, matvec=solver.solve, dtype=matrix.dtype)
    # To the last digit: with any other tolerance Lanczos steps end before they find all copies of multiple eigenvalues.
    return scipy.sparse.linalg.eigsh(matrix, count, sigma=_SHIFT, v0=start, OPinv=inverse)
