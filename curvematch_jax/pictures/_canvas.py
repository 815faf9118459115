"""Figures outside of pyplot, and the file that they end in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from .._files import replacing, writing
from .._optional import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DPI = 150


def new_figure(width: float, height: float) -> Figure:
    """A figure of that many inches: no backend is chosen, no window opened, nothing kept."""
    module = require("matplotlib.figure", "plot", "drawing a picture")
    return module.Figure(figsize=(width, height), layout="constrained")


def check_picture(path: str | Path) -> None:
    """Refuse a picture that could not be written, before the work that it would show.

    Args:
        path: the picture to be written; its suffix names the format.

    Raises:
        ValueError: the suffix names no format of pictures, or its folder is not writable; one that is not there is
            made with the picture.
        ImportError: without matplotlib (the extra `plot`).
    """
    path = Path(path)
    known = new_figure(1, 1).canvas.get_supported_filetypes()
    if path.suffix.lower().lstrip(".") not in known:
        shown = repr(path.suffix) if path.suffix else "(none)"
        raise ValueError(f"{path}: the suffix {shown} is not a picture format; known are {', '.join(sorted(known))}")
    if path.is_dir():
        raise ValueError(f"{path} is a folder, not a picture to write")
    there = next(folder for folder in path.absolute().parents if folder.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise ValueError(f"{path}: the picture cannot be written: {there} is not a writable folder")


def save(figure: Figure, path: str | Path, tight: bool = False) -> None:
    """Write a figure in the format that the suffix of `path` names; `tight` cuts off the margins.

    Raises:
        ValueError: it cannot be written there.
    """
    check_picture(path)
    path = Path(path)
    with writing(path), replacing(path) as temporary:
        figure.savefig(temporary, dpi=_DPI, bbox_inches="tight" if tight else None)
