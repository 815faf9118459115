"""A dissimilarity matrix with its classes in blocks."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ._canvas import new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def matrix_picture(dissimilarity: np.ndarray, labels: Sequence[str], path: str | Path) -> None:
    """Draw a dissimilarity matrix, dark where objects are similar, its classes in blocks.

    Args:
        dissimilarity: `(M, M)`, rows are queries. Values that are not finite are drawn as missing.
        labels: `(M,)` classes. They come in alphabetical order, objects of a class in the order given.
        path: the picture to write; its suffix chooses the format (png, pdf, svg).

    Raises:
        ValueError: a matrix that is not square and non-empty, another number of labels, or a path that cannot be
            written to.
        ImportError: without matplotlib (the extra `plot`).
    """
    matrix = np.asarray(dissimilarity, dtype=float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise ValueError(f"a dissimilarity matrix has the shape (M, M) with M > 0, not {matrix.shape}")
    if len(labels) != len(matrix):
        raise ValueError(f"the matrix has {len(matrix)} rows, but there are {len(labels)} labels")
    order = np.argsort(np.asarray(labels), kind="stable")
    classes, starts, counts = np.unique(np.asarray(labels)[order], return_index=True, return_counts=True)

    figure = new_figure(6.4, 5.6)
    axes = figure.add_subplot()
    shown = np.ma.masked_invalid(matrix[np.ix_(order, order)])
    image = axes.imshow(shown, cmap="magma", interpolation="nearest")
    _draw_blocks(axes, [str(c) for c in classes], starts, counts)
    axes.set_ylabel("query")
    figure.colorbar(image, ax=axes, label="dissimilarity", fraction=0.046, pad=0.03)
    save(figure, path, tight=True)


def _draw_blocks(axes: "Axes", classes: Sequence[str], starts: np.ndarray, counts: np.ndarray) -> None:
    for start in starts[1:]:
        axes.axhline(start - 0.5, color="white", linewidth=0.7)
        axes.axvline(start - 0.5, color="white", linewidth=0.7)
    middles = starts + (counts - 1) / 2
    size = float(np.clip(160 / len(classes), 3, 9))
    axes.set_xticks(middles, classes, rotation=90, fontsize=size)
    axes.set_yticks(middles, classes, fontsize=size)
    axes.tick_params(length=0)
