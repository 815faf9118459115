"""Sheets of ranked rows of meshes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .._optional import require
from ..surface import Mesh
from ._canvas import new_figure, save
from ._view import paint

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SURFACE, _QUERY = np.array([0.66, 0.76, 0.90]), np.array([0.93, 0.82, 0.62])
# Told apart by colour-blind readers too, and by the dashes.
_RELEVANT, _OTHER, _NEUTRAL = ("#1a9850", "-"), ("#d7301f", (0, (4, 2))), ("#555555", "-")
_TILE_INCHES = 1.45


@dataclass(frozen=True, eq=False)
class Tile:
    """One mesh of a sheet, what is written under it, and whether it is relevant (`None`: not known)."""

    mesh: Mesh
    caption: str = ""
    relevant: bool | None = None


def sheet(rows: Sequence[Sequence[Tile]], path: str | Path) -> None:
    """Draw ranked rows: in each, a query and then its matches, best first, as shaded meshes.

    A match has a green frame when it is relevant, a dashed red one when it is not, a grey one when that is not known.

    Args:
        rows: each begins with the query's tile. They may differ in length.
        path: the picture to write; its suffix chooses the format.

    Raises:
        ValueError: no row, a row without a tile, or a path that cannot be written to.
        ImportError: without matplotlib (the extra `plot`).
    """
    if not rows or not all(rows):
        raise ValueError("a sheet needs at least one row, and each row a query")
    columns = max(len(row) for row in rows)
    figure = new_figure(_TILE_INCHES * columns, (_TILE_INCHES + 0.22) * len(rows) + 0.25)
    grid = figure.add_gridspec(len(rows), columns)
    for i, row in enumerate(rows):
        for j, tile in enumerate(row):
            axes = figure.add_subplot(grid[i, j])
            _draw_tile(axes, tile, is_query=j == 0)
            if i == 0:
                axes.set_title("query" if j == 0 else str(j), fontsize=8)
    save(figure, path)


def _draw_tile(axes: "Axes", tile: Tile, is_query: bool) -> None:
    collection = require("matplotlib.collections", "plot", "drawing a picture").PolyCollection
    corners, shades = paint(tile.mesh)
    colours = np.clip(shades[:, None] * (_QUERY if is_query else _SURFACE), 0, 1)
    # An edge in the face's own colour hides the seams that anti-aliasing leaves.
    axes.add_collection(collection(corners[..., :2], facecolors=colours, edgecolors=colours, linewidths=0.3))
    axes.set_xlim(-1.08, 1.08)
    axes.set_ylim(-1.08, 1.08)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_xlabel(tile.caption, fontsize=7, labelpad=2)
    colour, dashes = _NEUTRAL if tile.relevant is None else _RELEVANT if tile.relevant else _OTHER
    for spine in axes.spines.values():
        spine.set(color=colour, linestyle=dashes, linewidth=0.8 if tile.relevant is None else 1.8)
