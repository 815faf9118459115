"""What figures are drawn with: surfaces, curves and points, painted from far to near; precision against recall."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.collections import PolyCollection

from curvematch_jax.pictures._canvas import new_figure, save
from curvematch_jax.pictures._colours import PALETTE
from curvematch_jax.pictures._view import Frame, paint, shades
from curvematch_jax.surface import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GREY = (0.86, 0.87, 0.89)
_TILE_INCHES = 2.1
_CELLS = 240
# Towards the viewer, in half tiles: curves lie on the surface, and must not be hidden by the faces that they touch.
_LIFT = 0.03
# Told apart without colours, too.
_MARKERS = "os^Dv<>ph"
_RECALL = np.linspace(0, 1, 11)
_SEAM_WIDTH = 0.4  # in the face's own colour, over the seams that anti-aliasing leaves


class Layer(NamedTuple):
    """Polygons to be painted: corners (t, 4, 3) along the viewer's axes, RGBA of faces and edges, widths of edges."""

    corners: np.ndarray
    fills: np.ndarray
    edges: np.ndarray
    widths: np.ndarray


def tiles(count: int, columns: int = 6) -> tuple[Figure, list[Axes]]:
    """A figure with that many empty tiles, in rows."""
    columns = min(count, columns)
    rows = -(-count // columns)
    figure = new_figure(_TILE_INCHES * columns, (_TILE_INCHES + 0.3) * rows)
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for each in axes:
        each.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), xticks=[], yticks=[], aspect="equal")
        each.spines[:].set_visible(False)
    return figure, axes[:count]


def surface(mesh: Mesh, frame: Frame, colour: Sequence[float] = GREY) -> Layer:
    """The faces of a mesh that face the viewer."""
    corners, lit = paint(mesh, frame, _CELLS)
    return _filled(corners[:, [0, 1, 2, 2]], np.asarray(colour), lit)


def tube(curves: np.ndarray, tip: np.ndarray, frame: Frame, colour: Sequence[float] = GREY) -> Layer:
    """The surface through closed curves (k, n, 3), from a tip (3,) on, as far as it faces the viewer.

    Curves run counter-clockwise around the tip. Samples of the same number are joined.
    """
    rings = frame.seen(np.concatenate([np.broadcast_to(tip, (1, *curves.shape[1:])), curves]))
    after = np.roll(rings, -1, axis=1)
    quads = np.stack([rings[1:], after[1:], after[:-1], rings[:-1]], axis=2).reshape(-1, 4, 3)
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    # What is seen from inside, through the open end, is drawn darker.
    lit = np.where(normals[:, 2] > 0, shades(normals), 0.55 * shades(-normals))
    return _filled(quads, np.asarray(colour), lit)


def curve(points: np.ndarray, frame: Frame, colour: Sequence[float], width: float = 0.9) -> Layer:
    """A closed curve (n, 3) that lies on a surface."""
    seen = frame.seen(points) + np.array([0, 0, _LIFT])
    ends = np.stack([seen, np.roll(seen, -1, axis=0)], axis=1)[:, [0, 1, 1, 0]]
    count = len(ends)
    edges = np.broadcast_to([*colour[:3], 1.0], (count, 4))
    return Layer(ends, np.zeros((count, 4)), edges, np.full(count, width))


def draw(axes: Axes, layers: Iterable[Layer]) -> None:
    """All layers together, farthest first."""
    corners, fills, edges, widths = (np.concatenate(column) for column in zip(*layers, strict=True))
    order = np.argsort(corners[..., 2].mean(axis=1), kind="stable")
    axes.add_collection(
        PolyCollection(
            list(corners[order, :, :2]), facecolors=fills[order], edgecolors=edges[order], linewidths=widths[order]
        )
    )


def points(axes: Axes, places: np.ndarray, frame: Frame, colours: np.ndarray, names: Sequence[str]) -> None:
    """Numbered points (p, 3), the nearest to the viewer last; dots where a name is empty."""
    seen = frame.seen(places)
    for k in np.argsort(seen[:, 2], kind="stable").tolist():
        x, y = seen[k, :2].tolist()
        if not names[k]:
            axes.plot(x, y, "o", color=colours[k], markersize=4, markeredgecolor="white", markeredgewidth=0.5)
            continue
        box = {"boxstyle": "round,pad=0.18", "facecolor": colours[k], "edgecolor": "white", "linewidth": 0.5}
        axes.text(x, y, str(names[k]), fontsize=5.5, color="white", ha="center", va="center", bbox=box)


def precision_recall(curves: Mapping[str, Sequence[float]], path: Path, title: str = "") -> None:
    """Draw 11-point interpolated precision of several methods; the first is drawn on top of the others."""
    figure = new_figure(5.2, 4.0)
    axes = figure.add_subplot()
    for k, (name, precision) in enumerate(curves.items()):
        axes.plot(_RECALL, precision, color=PALETTE[k % len(PALETTE)], marker=_MARKERS[k % len(_MARKERS)], label=name,
                  markersize=4, linewidth=2.2 if k == 0 else 1.2, zorder=len(curves) - k + 2)  # fmt: skip
    axes.set(xlim=(-0.02, 1.02), ylim=(0, 1.03), xlabel="recall", ylabel="interpolated precision", title=title)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8, frameon=False, loc="lower left")
    save(figure, path)


def _filled(corners: np.ndarray, colour: np.ndarray, lit: np.ndarray) -> Layer:
    fills = np.ones((len(corners), 4))
    fills[:, :3] = np.clip(colour * lit[:, None], 0, 1)
    return Layer(corners, fills, fills, np.full(len(corners), _SEAM_WIDTH))
