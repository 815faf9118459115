"""The spectrum of a surface, which does not change when it is bent.

M. Reuter, F.-E. Wolter, N. Peinecke, "Laplace-Beltrami spectra as 'Shape-DNA' of surfaces and solids", Computer-Aided
Design 38(4), 2006. The Laplacian is that of linear elements with the vertices' areas as masses, theirs of cubic ones.
"""

import numpy as np

from ._mesh import Mesh
from ._spectral import eigenpairs

# By Weyl's law they grow in proportion to their index; the 20th wave is half a square root of the area long.
EIGENVALUES = 20


def spectrum(mesh: Mesh, count: int = EIGENVALUES) -> np.ndarray:
    """The lowest eigenvalues above 0 times the area, `(count,)`, ascending; fewer of a mesh of fewer vertices."""
    return eigenpairs(mesh, count)[0]
