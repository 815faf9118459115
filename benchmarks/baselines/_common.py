"""What several baselines share."""

from collections.abc import Sequence

import numpy as np
import potpourri3d
from scipy.spatial.distance import cdist

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._fields import Geodesics


def l1(queries: Sequence[np.ndarray], objects: Sequence[np.ndarray]) -> np.ndarray:
    """Sums of absolute differences `(Q, M)` of descriptions that are vectors."""
    return cdist(np.stack(queries), np.stack(objects), "cityblock")


def geodesics_between(mesh: Mesh, sources: int) -> tuple[np.ndarray, np.ndarray]:
    """Geodesic distances from vertices that are spread over the surface by its area.

    Returns:
        distances `(sources, v)`, and the area that each vertex stands for `(v,)`.
    """
    areas = potpourri3d.vertex_areas(mesh.vertices, mesh.faces)
    order = np.random.default_rng(0).permutation(len(areas))  # neighbours in the file are often so on the surface
    shares = np.cumsum(areas[order])
    places = (np.arange(sources) + 0.5) / sources * shares[-1]
    distances = Geodesics(mesh)
    return np.stack([distances(v) for v in order[np.searchsorted(shares[:-1], places)].tolist()]), areas
