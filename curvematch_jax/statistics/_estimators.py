"""Estimators of scikit-learn for closed curves: components, clusters, regression, and distances.

Curves come as arrays `(k, d, n)`, or as lists of arrays `(d, n_i)`. What scikit-learn has for matrices of distances
(`metric="precomputed"`) and for vectors works on what these give.
"""

from __future__ import annotations

import jax
import numpy as np

from .._optional import require
from ..elastic import Aligner, distance_matrix
from ._clusters import shape_kmeans
from ._components import TangentPCA
from ._mean import karcher_mean
from ._regression import ShapeRegression
from ._sample import as_sample

base = require("sklearn.base", "learn", "an estimator")
validation = require("sklearn.utils.validation", "learn", "an estimator")


class _OfCurves(base.BaseEstimator):
    """What scikit-learn asks of estimators whose X is of three dimensions."""

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array, tags.input_tags.two_d_array = True, False
        return tags


class ShapeTransformer(base.TransformerMixin, _OfCurves):
    """Curves to tangent coordinates at their mean, `TangentPCA`, and back.

    Args:
        n_components: how many; all unless given.
        size: weight of the logarithm of length, as one more coordinate.
        aligner: `Aligner.accurate()` unless given.
    """

    def __init__(self, n_components: int | None = None, size: float = 0.0, aligner: Aligner | None = None):
        self.n_components = n_components
        self.size = size
        self.aligner = aligner

    def fit(self, X, y=None):
        self.mean_ = karcher_mean(_curves(self, X), aligner=self.aligner)
        self.components_ = TangentPCA.fit(self.mean_, self.n_components, self.size)
        self.explained_variance_ratio_ = self.components_.explained
        return self

    def transform(self, X) -> np.ndarray:
        validation.check_is_fitted(self)
        return self.components_.transform(_curves(self, X, fitted=True), self.aligner)

    def inverse_transform(self, X) -> np.ndarray:
        """Scores `(m, c)` to closed curves `(m, d, n)`."""
        validation.check_is_fitted(self)
        return self.components_.inverse_transform(X)


class ShapeKMeans(base.ClusterMixin, _OfCurves):
    """`shape_kmeans`: groups of curves around Karcher means."""

    def __init__(self, n_clusters: int = 2, aligner: Aligner | None = None):
        self.n_clusters = n_clusters
        self.aligner = aligner

    def fit(self, X, y=None):
        found = shape_kmeans(_curves(self, X), self.n_clusters, self.aligner)
        self.labels_, self.cluster_centers_, self.inertia_ = found.labels, found.centres, found.inertia
        return self

    def predict(self, X) -> np.ndarray:
        validation.check_is_fitted(self)
        return np.argmin(distance_matrix(_curves(self, X, fitted=True), self.cluster_centers_, self.aligner), axis=1)


class ShapeRegressor(base.RegressorMixin, base.BaseEstimator):
    """`ShapeRegression`: numbers `(k, p)` to curves `(k, d, n)`. The score is the share of the variance of shape
    that is explained."""

    def __init__(self, aligner: Aligner | None = None):
        self.aligner = aligner

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        tags.target_tags.single_output = False
        return tags

    def fit(self, X, y):
        self.mean_ = karcher_mean(as_sample(y), aligner=self.aligner)
        self.regression_ = ShapeRegression.fit(self.mean_, np.asarray(X, float))
        self.n_features_in_ = len(self.regression_.slopes)
        return self

    def predict(self, X) -> np.ndarray:
        validation.check_is_fitted(self)
        return self.regression_.predict(np.asarray(X, float))

    def score(self, X, y, sample_weight=None) -> float:
        curves, found = as_sample(y), self.predict(X)
        mean = np.broadcast_to(self.mean_.curve, found.shape)
        squares = [np.average(_between(curves, other) ** 2, weights=sample_weight) for other in (found, mean)]
        return float(1 - squares[0] / squares[1])


def pairwise_shape_distances(X, Y=None, aligner: Aligner | None = None) -> np.ndarray:
    """Elastic distances `(k, m)` for everything that takes `metric="precomputed"`; curves as arrays or lists."""
    first = as_sample(X)
    return distance_matrix(first, None if Y is None else as_sample(Y, first.shape[2]), aligner)


def _between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    from ..elastic import elastic_distance

    return np.asarray(jax.device_get(elastic_distance(a, b, Aligner.fast())), float)


def _curves(estimator, X, fitted: bool = False) -> np.ndarray:
    """Curves of one number of samples, that of the fit."""
    found = as_sample(X, getattr(estimator, "n_samples_", None) if fitted else None)
    if fitted and found.shape[1] != estimator.n_features_in_:
        raise ValueError(
            f"X has curves of {found.shape[1]} dimensions, but {type(estimator).__name__} was fitted to those of "
            f"{estimator.n_features_in_}."
        )
    if not fitted:
        estimator.n_samples_, estimator.n_features_in_ = found.shape[2], found.shape[1]
    return found
