"""Closed curves, planar or in space: a mean with its curves, components, scores, a row of curves, a movie."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import ArrayLike

from .._files import replacing, writing
from .._optional import require
from ..elastic import resample
from ._canvas import check_picture, new_figure, save

_DARK, _PALE = "#1b3a5d", "#9db4c8"
_COLOURS = ("#1b6ca8", "#d1495b", "#2e8b57", "#edae49", "#6a4c93", "#8d6a4f", "#3a3a3a", "#7fb7be")
_MOVIE_SUFFIXES = (".gif", ".mp4")
_INCHES = 2.2
_SAMPLES = 400  # of a curve as it is drawn, at least: with 100 the polygon shows
_NAMED = 30  # points at most, or their names cover each other


def mean_picture(mean: ArrayLike, aligned: ArrayLike, path: str | Path) -> None:
    """Draw a mean `(d, n)` over the curves `(k, d, n)` that are aligned to it; d is 2 or 3.

    Raises `ValueError` for other shapes and a path that cannot be written to, `ImportError` without matplotlib
    (`plot`)."""
    mean, aligned = _as_curves(np.asarray(mean)[None]), _as_curves(aligned)
    figure = new_figure(4.5, 4.5)
    axes = _axes(figure, 1, 1, np.concatenate([mean, aligned]))[0]
    for curve in aligned:
        _draw(axes, curve, color=_PALE, linewidth=0.6)
    _draw(axes, mean[0], color=_DARK, linewidth=2)
    save(figure, path, tight=True)


def components_picture(
    rows: ArrayLike, path: str | Path, titles: Sequence[str] = (), columns: Sequence[str] = ()
) -> None:
    """Draw rows of curves `(c, s, d, n)`, such as `TangentPCA.along` of several components, with the titles of the rows
    and the captions of the columns. Errors as `mean_picture`."""
    rows = np.asarray(rows, float)
    if rows.ndim != 4:
        raise ValueError(f"rows has shape {rows.shape}: give curves (rows, columns, d, n).")
    count, width = rows.shape[:2]
    curves = _as_curves(rows.reshape(-1, *rows.shape[2:]))
    figure = new_figure(_INCHES * width, _INCHES * count)
    for index, axes in enumerate(_axes(figure, count, width, curves)):
        row, column = divmod(index, width)
        _draw(axes, curves[index], color=_DARK, linewidth=1.5)
        if column == 0 and row < len(titles):
            axes.annotate(titles[row], (0, 0.5), xycoords="axes fraction", ha="right", va="center", rotation=90)
        if row == 0 and column < len(columns):
            axes.set_title(columns[column], fontsize=10)
    save(figure, path, tight=True)


def geodesic_picture(curves: ArrayLike, path: str | Path) -> None:
    """Draw the curves `(k, d, n)` of a deformation, such as `Geodesic.curves()`, in a row. Errors as `mean_picture`."""
    components_picture(np.asarray(curves)[None], path)


def scores_picture(
    scores: ArrayLike, path: str | Path, groups: Sequence[str] | None = None, names: Sequence[str] | None = None
) -> None:
    """Draw the two first scores of each curve, `(k, c >= 1)`, in the colours of their groups; 30 curves or fewer with
    their names. Errors as `mean_picture`."""
    found = np.asarray(scores, float)
    if found.ndim != 2 or any(given is not None and len(given) != len(found) for given in (groups, names)):
        raise ValueError(
            f"scores has shape {found.shape}: give numbers (curves, components), and, if any, a group for each curve "
            "and a name for each."
        )
    labels = np.asarray(["" for _ in found] if groups is None else [str(group) for group in groups])
    figure = new_figure(5, 4.2)
    axes = figure.add_subplot()
    second = found[:, 1] if found.shape[1] > 1 else np.zeros(len(found))
    for number, label in enumerate(np.unique(labels)):
        mask = labels == label
        axes.scatter(found[mask, 0], second[mask], s=18, color=_COLOURS[number % len(_COLOURS)], label=label or None)
    for name, x, y in zip(names, found[:, 0], second, strict=True) if names and len(found) <= _NAMED else ():
        axes.annotate(name, (x, y), xytext=(3, 3), textcoords="offset points", fontsize=6)
    axes.set_xlabel("first score, radians")
    axes.set_ylabel("second score, radians")
    if groups is not None:
        axes.legend(frameon=False, fontsize=8)
    save(figure, path, tight=True)


def movie(curves: ArrayLike, path: str | Path, seconds: float = 3.0) -> None:
    """Write the curves `(k, d, n)` as a movie, there and back: `.gif`, or `.mp4` where ffmpeg is installed.

    Raises `ValueError` for other shapes, another suffix, or a place that cannot be written to; `ImportError` without
    matplotlib (`plot`).
    """
    path, curves = Path(path), _as_curves(curves)
    animation = require("matplotlib.animation", "plot", "a movie")
    if path.suffix.lower() not in _MOVIE_SUFFIXES or not seconds > 0:
        raise ValueError(f"{path}: a movie is one of {', '.join(_MOVIE_SUFFIXES)}, and lasts more than 0 seconds.")
    if path.suffix.lower() == ".mp4" and not animation.FFMpegWriter.isAvailable():
        raise ValueError(f"{path}: an mp4 needs ffmpeg, which is not installed; name a .gif.")
    check_picture(path.with_suffix(".png"))
    order = [*range(len(curves)), *range(len(curves) - 2, 0, -1)]
    rate = max(1, round(len(order) / seconds))
    kind = animation.PillowWriter if path.suffix.lower() == ".gif" else animation.FFMpegWriter
    figure, writer = new_figure(4, 4), kind(fps=rate)
    axes = _axes(figure, 1, 1, curves)[0]
    with writing(path), replacing(path) as temporary, writer.saving(figure, str(temporary), 100):
        for index in order:
            lines = _draw(axes, curves[index], color=_DARK, linewidth=2)
            writer.grab_frame()
            for line in lines:
                line.remove()


def _as_curves(curves: ArrayLike) -> np.ndarray:
    """Curves as they are drawn: smooth, with more samples where they have few."""
    found = np.asarray(curves, float)
    if found.ndim != 3 or found.shape[1] not in (2, 3) or not found.size or not np.isfinite(found).all():
        raise ValueError(f"the curves have shape {found.shape}: give finite ones (k, d, n), d = 2 or 3.")
    return np.asarray(resample(found, max(_SAMPLES, found.shape[2])))


def _axes(figure: Any, rows: int, columns: int, curves: np.ndarray) -> list[Any]:
    """Axes of one scale, as large as the largest curve needs."""
    flat = curves.shape[1] == 2
    reach = 1.05 * np.abs(curves - curves.mean(axis=2, keepdims=True)).max()
    found = []
    for index in range(rows * columns):
        axes = figure.add_subplot(rows, columns, index + 1, **({} if flat else {"projection": "3d"}))
        for limit in ("xlim", "ylim") if flat else ("xlim", "ylim", "zlim"):
            getattr(axes, f"set_{limit}")(-reach, reach)
        if flat:
            axes.set_aspect("equal")
        else:
            axes.set_box_aspect((1, 1, 1))
        axes.set_axis_off()
        found.append(axes)
    return found


def _draw(axes: Any, curve: np.ndarray, **style: Any) -> list[Any]:
    centred = curve - curve.mean(axis=1, keepdims=True)
    return axes.plot(*np.concatenate([centred, centred[:, :1]], axis=1), **style)
