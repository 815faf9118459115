"""Arrays as text: base64 of little-endian numbers, read back by `page/data.js`."""

from __future__ import annotations

import base64
from typing import Literal

import numpy as np

Kind = Literal["u1", "u2", "u4", "f4"]


def packed(values: np.ndarray, kind: Kind) -> str:
    """The numbers of an array, in C order, as bytes of `kind`, as base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode("ascii")


def spread(count: int, limit: int) -> np.ndarray:
    """At most `limit` of `count` indices, evenly spread, ascending."""
    return np.arange(count) if count <= limit else np.linspace(0, count - 1, limit).round().astype(int)
