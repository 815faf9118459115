"""The level curves of every part of one model, blue next to the feature point and red far from it.

    python -m benchmarks.figures.level_curves [FOLDER] [--out DIR] [--model NAME] [--top 12]

Without `--model` the first of the class with the most models is shown. The JSON has which levels each part has, and the
lengths of its curves and the radii of the levels in the unit of the parts.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps

from benchmarks.figures._common import Collection, Described, Figure, Numbers, command
from benchmarks.figures._drawing import curve, draw, points, surface, tiles
from curvematch_jax.pictures._canvas import save
from curvematch_jax.pictures._colours import part_colours
from curvematch_jax.pictures._view import frame_of
from curvematch_jax.surface import Parts

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def on_the_mesh(parts: Parts, part: int) -> np.ndarray:
    """The level curves (L, n, 3) of one part, where they are on the mesh."""
    levels = parts.mask[part]
    curves = parts.curves[part, levels] * (parts.lengths[part, levels] * parts.diameter)[:, None, None]
    return (curves + parts.centres[part, levels, :, None]).transpose(0, 2, 1).astype(float)


def level_colours(parts: Parts) -> np.ndarray:
    """Colours (L, 4) of the levels, from the feature point outwards."""
    return colormaps["turbo"](np.linspace(0.08, 0.92, parts.mask.shape[1]))


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """A tile for each part."""
    chosen = collection.named([arguments.model] if arguments.model else []) or collection.members()
    model = collection.described[chosen[0]]
    shown = range(min(arguments.top, len(model.parts.points)))
    figure, axes = tiles(len(shown))
    for each, part in zip(axes, shown, strict=True):
        _draw(each, model, part)
    save(figure, picture)
    parts = model.parts
    lengths = [parts.lengths[k][parts.mask[k]].round(4).tolist() for k in shown]
    levels = [np.flatnonzero(parts.mask[k]).tolist() for k in shown]
    return {"model": model.name, "radii": parts.settings.radii.tolist(), "levels": levels, "lengths": lengths}


def _draw(axes: Axes, model: Described, part: int) -> None:
    frame, parts = frame_of(model.mesh.vertices), model.parts
    colours = level_colours(parts)[parts.mask[part]]
    rings = zip(on_the_mesh(parts, part), colours, strict=True)
    draw(axes, [surface(model.mesh, frame), *(curve(ring, frame, colour) for ring, colour in rings)])
    points(axes, parts.points[[part]].astype(float), frame, part_colours(np.array([part])), [str(part)])
    axes.set_xlabel(f"part {part}: {parts.mask[part].sum()} levels", fontsize=8)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--model", metavar="NAME", help="by default the first of the class with the most models")
    parser.add_argument("--top", type=int, default=12, help="parts")


FIGURE = Figure("level_curves", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
