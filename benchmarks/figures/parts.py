"""Pictures of parts: feature points, level curves, and the geodesic from one part to another."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from scipy.optimize import linear_sum_assignment

from curvematch_jax.pictures._canvas import save
from curvematch_jax.pictures._colours import part_colours
from curvematch_jax.pictures._view import frame_of
from curvematch_jax.retrieval import Matching, rank
from curvematch_jax.retrieval._distances import part_distances
from curvematch_jax.retrieval._stack import stack
from curvematch_jax.surface import Parts

from ._collection import Collection, Described, Numbers
from ._drawing import curve, draw, points, surface, tiles, tube
from ._loft import lofted, way

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POSES = 6
_PARTS = 12
# Of the geodesic: level curves of a part, from the feature point on, and steps.
_LEVELS, _STEPS = 12, 6
# Of the surfaces at both its ends.
_FIRST, _LAST = np.array([0.62, 0.74, 0.90]), np.array([0.95, 0.80, 0.58])
_LINE = (0.25, 0.25, 0.3)


def feature_points(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Feature points of one class in several poses, each in the colour and under the number of the first model's.

    The class is that of `--models`. Parts are assigned one to one, so that their distances add up to the least; left
    and right may be exchanged. Points without a partner are grey. The JSON has how many points each pose has, which
    point of the first each one is (-1: none), and how far assigned parts are apart on average.
    """
    named = collection.named(arguments.models[:1])
    label = collection.labels[named[0]] if named else None
    chosen = [collection.described[k] for k in collection.members(label)[:_POSES]]
    first, poses = chosen[0], {}
    figure, axes = tiles(len(chosen))
    for each, model in zip(axes, chosen, strict=True):
        owner, distance = assigned(first.parts, model.parts)
        _draw_points(each, model, owner)
        poses[model.name] = {"points": len(owner), "is": owner.tolist(), "distance": distance}
    save(figure, picture)
    return {"class": first.label, "first": first.name, "poses": poses}


def assigned(first: Parts, other: Parts) -> tuple[np.ndarray, float]:
    """Which part of the first each of the other's parts (p,) is, -1 for none, and the mean distance of these pairs."""
    matching, shape = Matching(), (len(first.areas), len(other.areas))
    pairs = np.argwhere(np.ones(shape, bool))
    left, right = stack([first], matching.unit), stack([other], matching.unit)
    distances = part_distances(left, right, pairs, matching, matching.aligner).reshape(shape)
    rows, columns = linear_sum_assignment(distances)
    owner = np.full(shape[1], -1)
    owner[columns] = rows
    return owner, float(distances[rows, columns].mean())


def _draw_points(axes: Axes, model: Described, owner: np.ndarray) -> None:
    frame = frame_of(model.mesh.vertices)
    draw(axes, [surface(model.mesh, frame)])
    names = [str(k) if k >= 0 else "" for k in owner.tolist()]
    points(axes, model.parts.points.astype(float), frame, part_colours(owner), names)
    axes.set_xlabel(model.name, fontsize=8)


def level_curves(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The level curves of every part of one model, blue next to the feature point and red far from it.

    The JSON has which levels each part has, and the lengths of its curves and the radii of the levels in the unit of
    the parts.
    """
    chosen = collection.named(arguments.models[:1]) or collection.members()
    model = collection.described[chosen[0]]
    shown = range(min(_PARTS, len(model.parts.points)))
    figure, axes = tiles(len(shown))
    for each, part in zip(axes, shown, strict=True):
        _draw_curves(each, model, part)
    save(figure, picture)
    parts = model.parts
    lengths = [parts.lengths[k][parts.mask[k]].round(4).tolist() for k in shown]
    levels = [np.flatnonzero(parts.mask[k]).tolist() for k in shown]
    return {"model": model.name, "radii": parts.settings.radii.tolist(), "levels": levels, "lengths": lengths}


def on_the_mesh(parts: Parts, part: int) -> np.ndarray:
    """The level curves (L, n, 3) of one part, where they are on the mesh."""
    levels = parts.mask[part]
    curves = parts.curves[part, levels] * (parts.lengths[part, levels] * parts.diameter)[:, None, None]
    return (curves + parts.centres[part, levels, :, None]).transpose(0, 2, 1).astype(float)


def level_colours(parts: Parts) -> np.ndarray:
    """Colours (L, 4) of the levels, from the feature point outwards."""
    return colormaps["turbo"](np.linspace(0.08, 0.92, parts.mask.shape[1]))


def _draw_curves(axes: Axes, model: Described, part: int) -> None:
    frame, parts = frame_of(model.mesh.vertices), model.parts
    colours = level_colours(parts)[parts.mask[part]]
    rings = zip(on_the_mesh(parts, part), colours, strict=True)
    draw(axes, [surface(model.mesh, frame), *(curve(ring, frame, colour) for ring, colour in rings)])
    points(axes, parts.points[[part]].astype(float), frame, part_colours(np.array([part])), [str(part)])
    axes.set_xlabel(f"part {part}: {parts.mask[part].sum()} levels", fontsize=8)


def part_geodesic(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The geodesic between the parts of two models that match best: level curves deformed, and surfaces in between.

    Without two `--models` these are the first of the class with the most models, and what of another class is most
    similar to it. Surfaces are tubes through the curves, from the feature point on. Sizes and places of the curves are
    interpolated. The JSON has the length of each level's geodesic in radians.
    """
    first, second = collection.named(arguments.models[:2]) if len(arguments.models) > 1 else default_models(collection)
    one, other = collection.parts[first], collection.parts[second]
    i, j = rank(one, [other]).explain(0)[0][:2]
    found = way(one, i, other, j, _LEVELS, _STEPS)
    figure, axes = tiles(len(found.curves), columns=len(found.curves))
    frame = frame_of(np.concatenate([found.curves.reshape(-1, 3), np.zeros((1, 3))]))
    for each, curves, time in zip(axes, found.curves, np.linspace(0, 1, len(axes)), strict=True):
        surface = tube(lofted(curves), np.zeros(3), frame, (1 - time) * _FIRST + time * _LAST)
        draw(each, [surface, *(curve(ring, frame, _LINE, 0.6) for ring in curves)])
    names = [collection.described[k].name for k in (first, second)]
    axes[0].set_xlabel(f"{names[0]}, part {i}", fontsize=8)
    axes[-1].set_xlabel(f"{names[1]}, part {j}", fontsize=8)
    save(figure, picture)
    return {
        "models": names,
        "parts": [i, j],
        "steps": _STEPS,
        "levels": found.levels.tolist(),
        "lengths": np.asarray(found.geodesics.length, float).round(4).tolist(),
        "converged": np.asarray(found.geodesics.converged).tolist(),
    }


def default_models(collection: Collection) -> tuple[int, int]:
    """The first model of the class with the most, and what is most similar to it of another class."""
    first = collection.members()[0]
    others = [j for j, label in enumerate(collection.labels) if label != collection.labels[first]]
    if not others:
        raise ValueError(f"{collection.name} has one class: name two models")
    ranking = rank(collection.parts[first], [collection.parts[j] for j in others])
    return first, others[int(ranking.order[0])]
