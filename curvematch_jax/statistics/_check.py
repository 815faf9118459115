"""What is given beside curves: numbers, labels and distances. Each check raises a `ValueError` of one sentence."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import ArrayLike

from ..elastic import Aligner
from ..elastic._check import as_aligner

_ROUNDING = 1e-4  # of a matrix of distances, in units of its largest


def as_reals(name: str, values: ArrayLike | Sequence | None) -> np.ndarray:
    """Finite real numbers as float64."""
    if np.ma.is_masked(values):
        raise ValueError(f"{name} is a masked array that hides numbers: give all of them.")
    try:
        found = np.asarray(values)
        if found.dtype.kind not in "biufO":
            raise TypeError
        found = found.astype(float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} holds other things than real numbers, or rows of different lengths.") from None
    if not np.isfinite(found).all():
        raise ValueError(f"{name} holds NaN or infinity, or nothing.")
    return found


def as_whole(name: str, value: Any, least: int) -> int:
    """A whole number, `least` or more."""
    try:
        found = operator.index(value)
    except TypeError:
        found = least - 1
    if isinstance(value, bool) or found < least:
        raise ValueError(f"{name} = {value!r}: give a whole number, {least} or more.")
    return found


def as_unmirrored(aligner: Any, default: Callable[[], Aligner]) -> Aligner:
    """An aligner that keeps the sense of curves: what lies on a mean cannot be mirrored on the way."""
    found = as_aligner(aligner, default)
    if found.mirror:
        raise ValueError(
            f"aligner = {found}: statistics take curves as they are. Give the `mirror_image` of those that "
            "`align` mirrors, where the determinant of the rotation is -1, and leave mirror=False."
        )
    return found


def as_between(name: str, value: Any, low: float, high: float) -> float:
    """A number above `low` and below `high`."""
    found = as_reals(name, value)
    if found.shape != () or not low < found < high:
        raise ValueError(f"{name} = {value!r}: give a number between {low:g} and {high:g}.")
    return float(found)


def as_distances(name: str, matrix: ArrayLike | Sequence | None) -> np.ndarray:
    """Distances `(k, k)` in units of their mean: symmetric, not negative, and 0 from each shape to itself."""
    found = as_reals(name, matrix)
    if found.ndim != 2 or found.shape[0] != found.shape[1]:
        raise ValueError(f"{name} has shape {found.shape}: give a matrix (k, k).")
    found = found / max(np.abs(found).max(initial=0), np.finfo(float).tiny)
    if not np.allclose(found, found.T, atol=_ROUNDING) or found.min(initial=0) < 0:
        raise ValueError(f"{name} is not symmetric, or holds negative numbers.")
    if np.abs(np.diag(found)).max(initial=0) > _ROUNDING:
        raise ValueError(f"{name} is not 0 on its diagonal: give distances, not similarities.")
    return found / max(found.mean(), np.finfo(float).tiny)


def as_groups_of(labels: Any, count: int) -> np.ndarray:
    """Numbers of groups `(k,)`, 0 to G - 1, of labels of any kind: two groups or more, of two members or more each."""
    names = np.asarray(labels).tolist() if hasattr(labels, "dtype") else labels
    flat = isinstance(names, list | tuple) and not any(isinstance(name, list | tuple | dict | set) for name in names)
    if not flat or len(names) != count:
        raise ValueError(f"labels are no list of one label for each of the {count} shapes.")
    missing = [i for i, name in enumerate(names) if name is None or name != name]
    if missing:
        raise ValueError(f"labels has none for shape {missing[0]}: leave that shape out, or name its group.")
    numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
    groups = np.array([numbers[name] for name in names])
    members = np.bincount(groups)
    if len(members) < 2 or members.min() < 2:
        raise ValueError(f"labels has {len(members)} groups, the smallest of {members.min()}: give two of two or more.")
    return groups
