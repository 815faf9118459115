"""A query beside its best objects, matched parts in the same colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.spatial import KDTree

from .._optional import require
from ..retrieval import Ranking
from ..surface import Mesh, Parts
from ._canvas import new_figure, save
from ._colours import matched_by, part_colours
from ._strokes import Strokes, curve_points, strokes
from ._view import Frame, frame_of, paint, shades

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TILE_INCHES = 2.3
# Twice as fine as in a sheet, for tiles that are larger and carry lines.
_CELLS = 240
# How much of its part's colour the surface has; the rest is white.
_TINT = 0.25
# Towards the viewer, in half tiles: curves lie on the surface, and must not be hidden by the faces that they touch.
_LIFT = 0.05
# Away from the viewer, in half tiles a diameter: where strips overlap, those of the nearest feature point are on top.
_SINK = 3.0
_CURVE_WIDTH = 0.9
# An edge in the face's own colour hides the seams that anti-aliasing leaves.
_SEAM_WIDTH = 0.4

# What each layer of a drawing is made of: corners (t, 4, 3) along the viewer's axes, and each one's RGBA of face and
# edge and width of the edge.
_Layer: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def explanation_picture(
    query: Parts,
    collection: Sequence[Parts],
    ranking: Ranking,
    path: str | Path,
    top: int = 5,
    mesh: Mesh | None = None,
    meshes: Mapping[int, Mesh] | None = None,
) -> None:
    """Draw a query and the best objects of its ranking, matched parts in the same colours and under the same numbers.

    A part is drawn as its level curves, where its feature point is the nearest. Where the mesh is not known, the strips
    of surface between the curves stand in for it. Where several parts of the query matched one part of an object, it
    has the colour of the nearest, and the numbers of all; a part that none matched is grey.

    Args:
        query: the parts that were ranked for.
        collection: the objects that were ranked, in the same order.
        ranking: what `rank(query, collection)` returned.
        path: the picture to write; its suffix chooses the format (png, pdf, svg).
        top: how many of the best objects to draw.
        mesh: the query's surface, to be drawn under its curves.
        meshes: surfaces of objects, by their indices in the collection; any may be missing.

    Raises:
        ValueError: a ranking of another query or collection, `top` less than 1, or a path that cannot be written to.
        ImportError: without matplotlib (the extra `plot`).
    """
    if top < 1:
        raise ValueError(f"top must be at least 1, found {top}")
    if ranking.names != tuple(parts.name for parts in collection) or len(ranking.matched) != len(query.areas):
        raise ValueError("the ranking is not one of this query in this collection")
    surfaces = {} if meshes is None else meshes
    best = ranking.order[:top].tolist()
    figure = new_figure(_TILE_INCHES * (1 + len(best)), _TILE_INCHES + 0.55)
    tiles = figure.subplots(1, 1 + len(best), squeeze=False)[0]
    own = np.arange(len(query.areas))
    _draw(tiles[0], query, own, [[i] for i in own.tolist()], mesh)
    _caption(tiles[0], "query", query.name)
    for place, (axes, j) in enumerate(zip(tiles[1:], best, strict=True), start=1):
        matches, parts = ranking.explain(j), collection[j]
        numbers = [[m.part for m in matches if m.other == other] for other in range(len(parts.areas))]
        _draw(axes, parts, matched_by(matches, len(parts.areas)), numbers, surfaces.get(j))
        nearest = f"\nbest match {matches[0].distance:.3f}" if matches else "\nno parts"
        _caption(axes, str(place), parts.name + nearest)
    save(figure, path)


def _caption(axes: Axes, above: str, below: str) -> None:
    axes.set_title(above, fontsize=9)
    axes.set_xlabel(below, fontsize=8, labelpad=3, parse_math=False)  # A name may have dollars in it.


def _draw(axes: Axes, parts: Parts, owner: np.ndarray, numbers: Sequence[Sequence[int]], mesh: Mesh | None) -> None:
    """One object: its curves in the colours of the query's parts (p,), its points under the numbers of these."""
    axes.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), xticks=[], yticks=[], aspect="equal")
    axes.spines[:].set_visible(False)
    if not len(owner):
        return
    colours, pieces = part_colours(owner), strokes(parts)
    frame = frame_of(curve_points(parts) if mesh is None else mesh.vertices)
    surface = _strips(pieces, frame, colours) if mesh is None else _faces(mesh, pieces, frame, colours)
    layers = [_curves(pieces, frame, colours), surface]
    corners, fills, edges, widths = (np.concatenate(column) for column in zip(*layers, strict=True))
    order = np.argsort(corners[..., 2].mean(axis=1), kind="stable")
    polygons = require("matplotlib.collections", "plot", "drawing a picture").PolyCollection
    axes.add_collection(
        polygons(corners[order, :, :2], facecolors=fills[order], edgecolors=edges[order], linewidths=widths[order])
    )
    _number(axes, frame.seen(parts.points.astype(float)), colours, numbers)


def _curves(pieces: Strokes, frame: Frame, colours: np.ndarray) -> _Layer:
    """The pieces of curves that are not on the far side, each where its part's feature point is the nearest."""
    shown = (_normals(_quads(pieces, frame))[:, 2] >= 0) & (pieces.beyond <= 0)
    ends = frame.seen(pieces.outer[shown]) + np.array([0, 0, _LIFT])
    edges = _opaque(colours[pieces.part[shown]])
    return ends[:, [0, 1, 1, 0]], np.zeros((len(ends), 4)), edges, np.full(len(ends), _CURVE_WIDTH)


def _strips(pieces: Strokes, frame: Frame, colours: np.ndarray) -> _Layer:
    """The strips of surface between curves that face the viewer."""
    quads = _quads(pieces, frame)
    normals = _normals(quads)
    near = normals[:, 2] > 0
    fills = _pale(colours[pieces.part[near]], shades(normals[near]))
    sunk = _SINK * np.maximum(pieces.beyond[near], 0)
    corners = quads[near] - np.stack([0 * sunk, 0 * sunk, sunk], axis=1)[:, None]
    return corners, fills, fills, np.full(len(fills), _SEAM_WIDTH)


def _faces(mesh: Mesh, pieces: Strokes, frame: Frame, colours: np.ndarray) -> _Layer:
    """The faces of a mesh that face the viewer, each in the colour of the curve that is nearest."""
    a, b, c = (mesh.vertices - mesh.vertices.mean(axis=0))[mesh.faces].transpose(1, 0, 2)
    inside_out = float((np.cross(a, b) * c).sum()) < 0
    corners, lit = paint(Mesh(mesh.vertices, mesh.faces[:, ::-1]) if inside_out else mesh, frame, _CELLS)
    fills = _pale(colours[_nearest_part(pieces, frame, corners.mean(axis=1))], lit)
    return corners[:, [0, 1, 2, 2]], fills, fills, np.full(len(fills), _SEAM_WIDTH)


def _nearest_part(pieces: Strokes, frame: Frame, points: np.ndarray) -> np.ndarray:
    """Of points (p, 3) along the viewer's axes: the part (p,) whose curve is the nearest; the first without curves."""
    own = pieces.beyond <= 0
    if not own.any():
        return np.zeros(len(points), int)
    _, nearest = KDTree(frame.seen(pieces.outer[own, 0])).query(points)
    return pieces.part[own][nearest]


def _pale(colours: np.ndarray, lit: np.ndarray) -> np.ndarray:
    return _opaque(np.clip((1 - _TINT * (1 - colours)) * lit[:, None], 0, 1))


def _quads(pieces: Strokes, frame: Frame) -> np.ndarray:
    return frame.seen(np.concatenate([pieces.outer, pieces.inner[:, ::-1]], axis=1))


def _normals(quads: np.ndarray) -> np.ndarray:
    """Outward normals (s, 3) of strips, of any length."""
    return np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])


def _opaque(colours: np.ndarray) -> np.ndarray:
    return np.concatenate([colours, np.ones((len(colours), 1))], axis=1)


def _number(axes: Axes, points: np.ndarray, colours: np.ndarray, numbers: Sequence[Sequence[int]]) -> None:
    """The numbers of the query's parts at feature points (p, 3), the nearest to the viewer last; dots where none is."""
    for i in sorted(range(len(points)), key=lambda i: (bool(numbers[i]), points[i, 2])):
        x, y = points[i, :2].tolist()
        if not numbers[i]:
            axes.plot(x, y, "o", color=colours[i], markersize=4, markeredgecolor="white", markeredgewidth=0.5)
            continue
        box = {"boxstyle": "round,pad=0.18", "facecolor": colours[i], "edgecolor": "white", "linewidth": 0.5}
        text = ",".join(map(str, numbers[i]))
        axes.text(x, y, text, fontsize=5.5, color="white", ha="center", va="center", bbox=box)
