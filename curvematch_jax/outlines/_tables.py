"""Scores and distances as tables of pandas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike

from .._optional import require

if TYPE_CHECKING:
    import pandas


def scores_table(scores: ArrayLike, names: Sequence[str], groups: Sequence[str] | None = None) -> pandas.DataFrame:
    """Scores `(k, c)` as a table: a row for each curve, columns `PC1`, `PC2`, ..., and `group` where given.

    Raises `ValueError` for names or groups that are not one for each row, `ImportError` without pandas (`outlines`).
    """
    found = np.asarray(scores)
    _check(found.ndim == 2 and _are(len(found), names) and (groups is None or _are(len(found), groups)), found.shape)
    columns = [f"PC{i + 1}" for i in range(found.shape[1])]
    table = _pandas().DataFrame(found, index=list(names), columns=columns)
    if groups is not None:
        table.insert(0, "group", list(groups))
    return table


def distances_table(matrix: ArrayLike, names: Sequence[str]) -> pandas.DataFrame:
    """A matrix of distances `(k, k)` with the curves' names on both sides. Errors as `scores_table`."""
    found = np.asarray(matrix)
    _check(found.ndim == 2 and found.shape[0] == found.shape[1] and _are(len(found), names), found.shape)
    return _pandas().DataFrame(found, index=list(names), columns=list(names))


def _are(count: int, names: Sequence[str]) -> bool:
    return not isinstance(names, str) and len(names) == count


def _check(fits: bool, shape: tuple[int, ...]) -> None:
    if not fits:
        raise ValueError(f"the numbers have shape {shape}: give a name, and a group if any, for each row.")


def _pandas():
    return require("pandas", "outlines", "a table")
