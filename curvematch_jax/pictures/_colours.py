"""Which part is drawn in which colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..retrieval import Match

# Those of Okabe and Ito first; the others are as far as can be from them, and from each other, in the eyes of readers
# with and without red or green cones, and none is pale or grey.
PALETTE = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#4d00b3", "#800033",
    "#66e6b3", "#8066ff", "#99804d", "#801a66", "#00d5ee", "#0000ff", "#e6b366", "#801a00",
)  # fmt: skip
UNMATCHED = "#9a9a9a"


def matched_by(matches: Sequence[Match], parts: int) -> np.ndarray:
    """Which part of the query each of an object's parts (parts,) answers to: the nearest that matched it, or -1."""
    owner = np.full(parts, -1)
    for match in sorted(matches, key=lambda m: m.distance, reverse=True):
        owner[match.other] = match.part
    return owner


def part_colours(owner: np.ndarray) -> np.ndarray:
    """Colours (p, 3) of parts, given the part of the query (p,) that each one answers to; grey where there is none."""
    rgb = np.array([_rgb(colour) for colour in (*PALETTE, UNMATCHED)])
    return rgb[np.where(owner < 0, len(PALETTE), owner % len(PALETTE))]


def _rgb(colour: str) -> list[float]:
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
