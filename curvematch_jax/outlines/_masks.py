"""Outlines of binary and label images as closed curves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from .._optional import require
from .._words import counted
from ..elastic import resample

_LEAST_PIXELS = 9
_LEAST_POINTS = 8
_MOST_SMOOTHING = 10_000
_EMPTY = "the image has no foreground: every pixel is 0."


class Outlines(NamedTuple):
    """Attributes: closed curves `(k, 2, n)` in pixels, x to the right and y up, counter-clockwise; their names; and
    what was passed over or is noteworthy, a sentence each."""

    curves: np.ndarray
    names: tuple[str, ...]
    notes: tuple[str, ...]


def outlines_of(
    image: ArrayLike, n: int = 100, smoothing: float = 1.0, each: bool = False, name: str = "outline"
) -> Outlines:
    """The outline of the largest shape in a binary image, or that of each label.

    The contour at half height, between pixel centres, is a staircase. Its points are moved towards the means of their
    neighbours within `smoothing` pixels of arc (a Gaussian of that deviation), by no more than `smoothing` pixels each:
    so no point of the curve is farther than that from the contour, but for sampling. Then `n` samples at equal arc
    lengths.

    Args:
        image: `(rows, columns)`; 0 is background. Without `each` everything else is foreground.
        n: samples of a curve.
        smoothing: in pixels; 0 leaves the staircase.
        each: one outline for each positive label, the largest piece of it.
        name: of the outline, or what the labels' names begin with.

    Raises:
        ValueError: for what is no image of one channel, an image without foreground, shapes of fewer than 9 pixels and
            shapes that reach the border, if there is no other one. With `each` those are left out, and named in the
            notes.
        ImportError: without scikit-image (the extra `outlines`).
    """
    array = as_mask(image)
    if not isinstance(n, int | np.integer) or n < _LEAST_POINTS:
        raise ValueError(f"n = {n!r}: give a whole number of samples, 8 or more.")
    if not isinstance(smoothing, float | int | np.number) or not 0 <= smoothing <= _MOST_SMOOTHING:
        raise ValueError(f"smoothing = {smoothing!r}: give pixels, 0 to {_MOST_SMOOTHING}.")
    curves, names, notes = [], [], []
    masks = {f"{name}-{label}": array == label for label in np.unique(array[array > 0])} if each else {name: array > 0}
    for title, mask in masks.items():
        try:
            curve, said = _outline(mask, smoothing)
        except ValueError as problem:
            if not each:
                raise
            notes.append(f"{title}: {problem}")
            continue
        curves.append(np.asarray(resample(curve, n)))
        names.append(title)
        notes += [f"{title}: {note}" for note in said]
    if not curves:
        raise ValueError("; ".join(notes) or _EMPTY)
    return Outlines(np.stack(curves), tuple(names), tuple(notes))


def as_mask(image: ArrayLike) -> np.ndarray:
    """An image of one channel as an array of numbers, `(rows, columns)`; channels that are all alike count as one."""
    if np.ma.is_masked(image):
        raise ValueError("the image is a masked array that hides pixels: set them to 0, or to a label.")
    array = np.asarray(image)
    if array.ndim == 3 and array.shape[2] in (3, 4):
        array = array[..., :3]
        if (array != array[..., :1]).any():
            raise ValueError("the image is coloured: give a mask, or labels, of one channel.")
        array = array[..., 0]
    if array.ndim != 2 or array.dtype.kind not in "biuf" or not array.size:
        raise ValueError(f"the image has shape {array.shape} and dtype {array.dtype}: give a mask (rows, columns).")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError("the image holds NaN or infinity.")
    return array.astype(int) if array.dtype.kind == "b" else array


def _outline(mask: np.ndarray, smoothing: float) -> tuple[np.ndarray, list[str]]:
    """The outline `(2, m)` of the largest piece of a mask, and what there is to say."""
    measure = require("skimage.measure", "outlines", "reading outlines")
    pieces = measure.label(mask, connectivity=1)
    sizes = np.bincount(pieces.ravel())[1:]
    if not len(sizes):
        raise ValueError(_EMPTY)
    piece = pieces == int(np.argmax(sizes)) + 1
    if sizes.max() < _LEAST_PIXELS:
        most = counted(int(sizes.max()), "pixel")
        raise ValueError(f"the largest piece has {most}: an outline needs {_LEAST_PIXELS} or more.")
    edge = np.concatenate([piece[0], piece[-1], piece[:, 0], piece[:, -1]])
    if edge.any():
        raise ValueError(
            "the shape reaches the border of the image, where its outline is open: invert the image if its shape is "
            "dark, as pixels of the shape are those that are not 0; otherwise pad it with 0."
        )
    notes = []
    if len(sizes) > 1:
        left = counted(int(sizes.sum() - sizes.max()), "pixel")
        pieces_left = counted(len(sizes) - 1, "smaller piece is", "smaller pieces are")
        notes.append(
            f"{pieces_left} left out, {left} in all: for outlines of these, split the image, or label its pieces and "
            "use each=True (--each)"
        )
    contours = sorted(measure.find_contours(piece.astype(float), 0.5), key=len)
    outer = max(contours, key=lambda c: np.prod(np.ptp(c, axis=0)))
    if len(contours) > 1:
        notes.append(f"{counted(len(contours) - 1, 'hole')} left out")
    curve = np.stack([outer[:-1, 1], -outer[:-1, 0]])
    if _area(curve) < 0:
        curve = curve[:, ::-1]
    return _smoothed(curve, smoothing), notes


def _area(curve: np.ndarray) -> float:
    """Positive when the curve runs counter-clockwise."""
    x, y = curve
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _smoothed(curve: np.ndarray, smoothing: float) -> np.ndarray:
    """The curve through a periodic Gaussian of `smoothing` pixels of arc, no point moved by more than that."""
    if not smoothing:
        return curve
    steps = np.linalg.norm(np.diff(curve, axis=1, append=curve[:, :1]), axis=0)
    frequency = np.fft.rfftfreq(curve.shape[1], steps.mean())
    spectrum = np.fft.rfft(curve, axis=1) * np.exp(-2 * (np.pi * smoothing * frequency) ** 2)
    moved = np.fft.irfft(spectrum, n=curve.shape[1], axis=1) - curve
    far = np.linalg.norm(moved, axis=0)
    return curve + moved * np.minimum(1, smoothing / np.maximum(far, 1e-12))
