"""Statistics of closed curves: means, medians, components, tests, clusters, outliers and regressions of shapes."""

from typing import Any

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
    "ShapeKMeans",
    "ShapeRegression",
    "ShapeRegressor",
    "ShapeTransformer",
    "TangentPCA",
    "energy_test",
    "karcher_mean",
    "karcher_median",
    "outliers",
    "pairwise_shape_distances",
    "shape_kmeans",
    "variance_test",
]

_OF_SCIKIT_LEARN = ("ShapeKMeans", "ShapeRegressor", "ShapeTransformer", "pairwise_shape_distances")


def __getattr__(name: str) -> Any:
    """The estimators, which need scikit-learn (the extra `learn`), on their first use."""
    if name not in _OF_SCIKIT_LEARN:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import _estimators

    return getattr(_estimators, name)
