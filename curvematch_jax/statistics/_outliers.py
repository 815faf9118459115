"""Which shapes of a sample are outliers, and at what level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from ._check import as_between
from ._mean import Mean, as_mean

_CONSISTENT = 1.4826  # times the median absolute deviation is the deviation of normal numbers


class Outliers(NamedTuple):
    """Attributes: p-values of each shape `(k,)`, and which are outliers `(k,)`."""

    p: np.ndarray
    outlier: np.ndarray


def outliers(median: Mean, level: float = 0.05) -> Outliers:
    """The shapes that are farther from the median than the others allow.

    Logarithms of distances to `karcher_median(curves)` are taken for normal, with the centre and the spread of their
    median and median absolute deviation, which outliers hardly change; p is one-sided. The probability that a sample
    without outliers has any that is called one is `level` (Holm 1979).

    Raises:
        ValueError: for a median of several groups, fewer than 5 shapes, shapes of which half are alike, or a level not
            between 0 and 1.
    """
    if as_mean("median", median).distances.size < 5:
        raise ValueError(f"median is of {median.distances.size} curves: outliers are told among 5 or more.")
    level = as_between("level", level, 0, 1)
    logs = np.log(np.maximum(median.distances.astype(float), np.finfo(median.distances.dtype).eps))
    away = logs - np.median(logs)
    spread = _CONSISTENT * np.median(np.abs(away))
    if spread == 0:
        raise ValueError(
            "half of the shapes are equally far from the median: there is no spread to measure outliers by."
        )
    p = norm.sf(away / spread)
    order = np.argsort(p)
    adjusted = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    outlier = np.zeros(len(p), bool)
    outlier[order] = adjusted <= level
    return Outliers(p, outlier)
