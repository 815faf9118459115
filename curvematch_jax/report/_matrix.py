"""The dissimilarity matrix as an image of bytes."""

from __future__ import annotations

import numpy as np

from ._packed import packed


def packed_matrix(matrix: np.ndarray, cells: int) -> dict[str, object]:
    """A matrix (M, M) as at most `cells` rows and columns of bytes; rows and columns of a larger one are averaged.

    The bytes 0 to 255 are the values from `low` to `high`, those of the cells off the diagonal. Cell k stands for the
    objects `bounds[k]` to `bounds[k + 1] - 1`.
    """
    count = min(len(matrix), cells)
    bounds = np.linspace(0, len(matrix), count + 1).round().astype(int)
    means = matrix if count == len(matrix) else _block_means(matrix, bounds)
    others = means[~np.eye(count, dtype=bool)] if count > 1 else means.ravel()
    low, high = float(others.min()), float(others.max())
    scale = 255 / (high - low) if high > low else 0.0
    values = np.clip((means - low) * scale, 0, 255).round()
    return {"count": count, "bounds": bounds.tolist(), "low": low, "high": high, "values": packed(values, "u1")}


def _block_means(matrix: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    sizes = np.diff(bounds)
    rows = np.add.reduceat(matrix, bounds[:-1], axis=0)
    return np.add.reduceat(rows, bounds[:-1], axis=1) / np.outer(sizes, sizes)
