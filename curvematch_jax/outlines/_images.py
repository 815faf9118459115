"""Image files to outlines."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from .._files import IMAGE_SUFFIXES
from .._optional import require
from ._masks import Outlines, outlines_of

_MOST_PIXELS = 10**8


def read_outlines(path: str | Path, n: int = 100, smoothing: float = 1.0, each: bool = False) -> Outlines:
    """The outlines of an image file, PNG or TIFF, as `outlines_of`; they are named after the file.

    Raises `ValueError`, with the file's name, for a file that is not there, is no image of that kind or has more than
    10^8 pixels, and as `outlines_of`; `ImportError` without scikit-image (the extra `outlines`)."""
    path = Path(path)
    try:
        return outlines_of(_pixels(path), n, smoothing, each, path.stem)
    except ValueError as problem:
        raise ValueError(f"{path}: {problem}") from None


def _pixels(path: Path) -> np.ndarray:
    if not path.exists():
        raise ValueError("no such file or folder.")
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise ValueError(f"not an image format that can be read; known are {', '.join(IMAGE_SUFFIXES)}.")
    image = require("PIL.Image", "outlines", "reading images")
    try:
        # Not of damaged notes beside the pixels.
        with warnings.catch_warnings(action="ignore"), image.open(path, formats=("PNG", "TIFF")) as opened:
            if opened.width * opened.height > _MOST_PIXELS:
                raise ValueError(f"it has {opened.width} x {opened.height} pixels; {_MOST_PIXELS} are the most.")
            return np.asarray(opened)
    except (OSError, SyntaxError, image.DecompressionBombError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else "it is no PNG or TIFF image"
        raise ValueError(f"cannot be read ({reason}).") from None
