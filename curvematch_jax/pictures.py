"""Pictures of results: a dissimilarity matrix with its classes in blocks, and sheets of ranked rows of meshes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ._optional import require
from .surface import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DPI = 150
# The view of every mesh: z up, seen from the front left and a little from above; the light comes with the viewer.
_AZIMUTH, _ELEVATION = np.radians(50.0), np.radians(18.0)
_LIGHT = np.array([-0.35, 0.5, 0.79])
_SURFACE, _QUERY = np.array([0.66, 0.76, 0.90]), np.array([0.93, 0.82, 0.62])
# Told apart by colour-blind readers too, and by the dashes.
_RELEVANT, _OTHER, _NEUTRAL = ("#1a9850", "-"), ("#d7301f", (0, (4, 2))), ("#555555", "-")
_TILE_INCHES = 1.45
# Grid cells across a tile: about two pixels each.
_CELLS = 120


@dataclass(frozen=True, eq=False)
class Tile:
    """One mesh of a sheet, what is written under it, and whether it is relevant (`None`: not known)."""

    mesh: Mesh
    caption: str = ""
    relevant: bool | None = None


def matrix_picture(dissimilarity: np.ndarray, labels: Sequence[str], path: str | Path) -> None:
    """Draw a dissimilarity matrix, dark where objects are similar, its classes in blocks.

    Args:
        dissimilarity: `(M, M)`, rows are queries. Values that are not finite are drawn as missing.
        labels: `(M,)` classes. They come in alphabetical order, objects of a class in the order given.
        path: the picture to write; its suffix chooses the format (png, pdf, svg).

    Raises:
        ValueError: a matrix that is not square and non-empty, or another number of labels.
        ImportError: without matplotlib (the extra `plot`).
    """
    matrix = np.asarray(dissimilarity, dtype=float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise ValueError(f"a dissimilarity matrix has the shape (M, M) with M > 0, not {matrix.shape}")
    if len(labels) != len(matrix):
        raise ValueError(f"the matrix has {len(matrix)} rows, but there are {len(labels)} labels")
    order = np.argsort(np.asarray(labels), kind="stable")
    classes, starts, counts = np.unique(np.asarray(labels)[order], return_index=True, return_counts=True)

    figure = _figure(6.4, 5.6)
    axes = figure.add_subplot()
    shown = np.ma.masked_invalid(matrix[np.ix_(order, order)])
    image = axes.imshow(shown, cmap="magma", interpolation="nearest")
    _draw_blocks(axes, [str(c) for c in classes], starts, counts)
    axes.set_ylabel("query")
    figure.colorbar(image, ax=axes, label="dissimilarity", fraction=0.046, pad=0.03)
    figure.savefig(path, dpi=_DPI, bbox_inches="tight")


def sheet(rows: Sequence[Sequence[Tile]], path: str | Path) -> None:
    """Draw ranked rows: in each, a query and then its matches, best first, as shaded meshes.

    A match has a green frame when it is relevant, a dashed red one when it is not, a grey one when that is not known.

    Args:
        rows: each begins with the query's tile. They may differ in length.
        path: the picture to write; its suffix chooses the format.

    Raises:
        ValueError: no row, or a row without a tile.
        ImportError: without matplotlib (the extra `plot`).
    """
    if not rows or not all(rows):
        raise ValueError("a sheet needs at least one row, and each row a query")
    columns = max(len(row) for row in rows)
    figure = _figure(_TILE_INCHES * columns, (_TILE_INCHES + 0.22) * len(rows) + 0.25)
    grid = figure.add_gridspec(len(rows), columns)
    for i, row in enumerate(rows):
        for j, tile in enumerate(row):
            axes = figure.add_subplot(grid[i, j])
            _draw_tile(axes, tile, is_query=j == 0)
            if i == 0:
                axes.set_title("query" if j == 0 else str(j), fontsize=8)
    figure.savefig(path, dpi=_DPI)


def _figure(width: float, height: float) -> "Figure":
    """A figure outside of pyplot: no backend is chosen, no window opened, nothing kept."""
    module = require("matplotlib.figure", "plot", "drawing a picture")
    return module.Figure(figsize=(width, height), layout="constrained")


def _draw_blocks(axes: "Axes", classes: Sequence[str], starts: np.ndarray, counts: np.ndarray) -> None:
    for start in starts[1:]:
        axes.axhline(start - 0.5, color="white", linewidth=0.7)
        axes.axvline(start - 0.5, color="white", linewidth=0.7)
    middles = starts + (counts - 1) / 2
    size = float(np.clip(160 / len(classes), 3, 9))
    axes.set_xticks(middles, classes, rotation=90, fontsize=size)
    axes.set_yticks(middles, classes, fontsize=size)
    axes.tick_params(length=0)


def _draw_tile(axes: "Axes", tile: Tile, is_query: bool) -> None:
    collection = require("matplotlib.collections", "plot", "drawing a picture").PolyCollection
    triangles, shades = _project(tile.mesh)
    colours = np.clip(shades[:, None] * (_QUERY if is_query else _SURFACE), 0, 1)
    # An edge in the face's own colour hides the seams that anti-aliasing leaves.
    axes.add_collection(collection(triangles, facecolors=colours, edgecolors=colours, linewidths=0.3))
    axes.set_xlim(-1.08, 1.08)
    axes.set_ylim(-1.08, 1.08)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_xlabel(tile.caption, fontsize=7, labelpad=2)
    colour, dashes = _NEUTRAL if tile.relevant is None else _RELEVANT if tile.relevant else _OTHER
    for spine in axes.spines.values():
        spine.set(color=colour, linestyle=dashes, linewidth=0.8 if tile.relevant is None else 1.8)


def _project(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t, 3, 2) that face the viewer, farthest first, filling [-1, 1]^2, and their shades (t,)."""
    points, faces = _thinned(mesh.vertices @ _view().T, mesh.faces)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    smooth = np.zeros_like(points)
    for k in range(3):
        np.add.at(smooth, faces[:, k], normals)
    shading = smooth[faces].sum(axis=1)
    length = np.linalg.norm(shading, axis=1)
    lit = np.clip(shading @ _LIGHT / np.where(length > 0, length, 1), 0, 1)
    facing = np.flatnonzero(normals[:, 2] > 0)
    order = facing[np.argsort(corners[facing, :, 2].mean(axis=1), kind="stable")]
    return corners[order, :, :2], 0.38 + 0.67 * lit[order]


def _view() -> np.ndarray:
    """Rotation (3, 3) to the viewer's axes: right, up, towards the viewer."""
    cos_a, sin_a, cos_e, sin_e = np.cos(_AZIMUTH), np.sin(_AZIMUTH), np.cos(_ELEVATION), np.sin(_ELEVATION)
    right = [-sin_a, cos_a, 0]
    up = [-sin_e * cos_a, -sin_e * sin_a, cos_e]
    towards = [cos_e * cos_a, cos_e * sin_a, sin_e]
    return np.array([right, up, towards])


def _thinned(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The projected mesh scaled to fill the tile, vertices of one grid cell merged.

    At the size of a thumbnail nothing is lost, and a scan of a million faces draws as fast as any other mesh.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    half = max(float((high - low)[:2].max()) / 2, np.finfo(float).tiny)
    points = (points - (low + high) / 2) / half
    _, first, cell = np.unique(np.round(points * (_CELLS / 2)), axis=0, return_index=True, return_inverse=True)
    merged = cell.reshape(-1)[faces]
    a, b, c = merged.T
    return points[first], merged[(a != b) & (b != c) & (c != a)]
