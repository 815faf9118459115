"""The masses that the parts of a query put on the objects."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..retrieval import Ranking
from ._canvas import new_figure, save
from ._colours import part_colours

_CELL_INCHES = 0.3


def masses_picture(ranking: Ranking, path: str | Path, top: int = 20) -> None:
    """Draw the masses of a query's parts as a heat map, parts by objects, best object first.

    The parts go by the numbers and colours that they have in `explanation_picture`. The bars above are the pignistic
    probabilities of the objects.

    Args:
        ranking: of one query of at least one part.
        path: the picture to write; its suffix chooses the format (png, pdf, svg).
        top: how many of the best objects to draw.

    Raises:
        ValueError: `top` less than 1, a query without parts, or a path that cannot be written to.
        ImportError: without matplotlib (the extra `plot`).
    """
    if top < 1:
        raise ValueError(f"top must be at least 1, found {top}")
    best = ranking.order[:top]
    masses = ranking.masses[:, best]
    if not len(masses):
        raise ValueError("the query has no parts, so there are no masses to draw")
    parts, objects = masses.shape
    figure = new_figure(1.9 + _CELL_INCHES * objects, 2.4 + _CELL_INCHES * parts)
    bars, heat = figure.subplots(2, 1, sharex=True, height_ratios=(0.9, _CELL_INCHES * parts))
    bars.bar(np.arange(objects), ranking.probability[best], color="#555555", width=0.7)
    bars.set_ylabel("probability", fontsize=8)
    bars.tick_params(labelsize=7, bottom=False, labelbottom=False)
    bars.spines[["top", "right"]].set_visible(False)
    image = heat.imshow(masses, cmap="viridis", aspect="auto", interpolation="nearest")
    names = [ranking.names[j] for j in best.tolist()]
    heat.set_xticks(np.arange(objects), names, rotation=90, fontsize=7, parse_math=False)
    heat.set_yticks(np.arange(parts), [str(i) for i in range(parts)], fontsize=7, fontweight="bold")
    for label, colour in zip(heat.get_yticklabels(), part_colours(np.arange(parts)), strict=True):
        label.set_color(colour)
    heat.tick_params(length=0)
    heat.set_ylabel("part of the query", fontsize=8)
    scale = figure.colorbar(image, ax=heat, pad=0.02)
    scale.set_label("mass", fontsize=8)
    scale.ax.tick_params(labelsize=7)
    save(figure, path)
