"""Statistics of closed curves: means, medians, components, tests, clusters, outliers and regressions of shapes."""

from ._clusters import Clusters, shape_kmeans
from ._components import TangentPCA
from ._mean import Mean, karcher_mean, karcher_median
from ._outliers import Outliers, outliers
from ._permutation import PermutationTest, energy_test, variance_test
from ._regression import ShapeRegression

__all__ = [
    "Clusters",
    "Mean",
    "Outliers",
    "PermutationTest",
    "ShapeRegression",
    "TangentPCA",
    "energy_test",
    "karcher_mean",
    "karcher_median",
    "outliers",
    "shape_kmeans",
    "variance_test",
]
