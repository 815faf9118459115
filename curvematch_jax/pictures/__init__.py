"""Pictures of results: matrices in blocks, sheets of ranked meshes, matched parts in the same colours, masses of parts,
means and components of curves.

Everything here needs matplotlib, the extra `plot`, and draws to a file: no window, no backend is touched.
"""

from ._canvas import check_picture
from ._curves import components_picture, geodesic_picture, mean_picture, movie, scores_picture
from ._explanation import explanation_picture
from ._masses import masses_picture
from ._matrix import matrix_picture
from ._sheet import Tile, sheet

__all__ = [
    "Tile",
    "check_picture",
    "components_picture",
    "explanation_picture",
    "geodesic_picture",
    "masses_picture",
    "matrix_picture",
    "mean_picture",
    "movie",
    "scores_picture",
    "sheet",
]
