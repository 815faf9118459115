"""Outlines of images as closed curves, curves in files, and results as tables."""

from ._files import CURVE_SUFFIXES, NamedCurves, read_curves, write_curves
from ._images import IMAGE_SUFFIXES, read_outlines
from ._masks import Outlines, outlines_of
from ._tables import distances_table, scores_table

__all__ = [
    "CURVE_SUFFIXES",
    "IMAGE_SUFFIXES",
    "NamedCurves",
    "Outlines",
    "distances_table",
    "outlines_of",
    "read_curves",
    "read_outlines",
    "scores_table",
    "write_curves",
]
