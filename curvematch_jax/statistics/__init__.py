"""Statistics of closed curves: means, medians, components, tests, clusters, outliers and regressions of shapes."""

from ._components import TangentPCA
from ._mean import Mean, karcher_mean, karcher_median

__all__ = ["Mean", "TangentPCA", "karcher_mean", "karcher_median"]
