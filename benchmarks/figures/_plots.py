"""Precision against recall, many methods in one plot."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from curvematch_jax.pictures._canvas import new_figure, save
from curvematch_jax.pictures._colours import PALETTE

# Told apart without colours, too.
_MARKERS = "os^Dv<>ph"
_RECALL = np.linspace(0, 1, 11)


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
