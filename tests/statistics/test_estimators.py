"""Estimators in scikit-learn's own machinery: clones, parameters, pipelines, searches, and its checks."""

from typing import Any

import numpy as np
import pytest
from elastic.aligners import FAST

from curvematch_jax import distance_matrix, resample
from curvematch_jax.datasets import leaves
from curvematch_jax.statistics import (
    ShapeKMeans,
    ShapeRegressor,
    ShapeTransformer,
    TangentPCA,
    pairwise_shape_distances,
)

sklearn = pytest.importorskip("sklearn")

from sklearn.base import clone  # noqa: E402
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis  # noqa: E402
from sklearn.model_selection import GridSearchCV, cross_val_score  # noqa: E402
from sklearn.neighbors import KNeighborsClassifier  # noqa: E402
from sklearn.pipeline import Pipeline  # noqa: E402
from sklearn.utils.estimator_checks import (  # noqa: E402
    check_estimator_cloneable,
    check_estimator_repr,
    check_estimator_tags_renamed,
    check_get_params_invariance,
    check_mixin_order,
    check_no_attributes_set_in_init,
    check_parameters_default_constructible,
    check_set_params,
    check_valid_tag_types,
)

ESTIMATORS = (ShapeTransformer(2, 0.5, FAST), ShapeKMeans(3, FAST), ShapeRegressor(FAST))
CHECKS = (
    *(check_estimator_cloneable, check_estimator_repr, check_estimator_tags_renamed, check_get_params_invariance),
    *(check_mixin_order, check_no_attributes_set_in_init, check_parameters_default_constructible, check_set_params),
    check_valid_tag_types,
)
each = pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda e: type(e).__name__)


@pytest.fixture(name="few", scope="module")
def fixture_few():
    return leaves(12, seed=4, n=32, apart=0.5, deviations=(0.05, 0.03))


@each
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_scikit_learn_finds_nothing_amiss(estimator, check):
    check(type(estimator).__name__, estimator)


@each
def test_clones_have_the_parameters_and_nothing_learned(estimator, few):
    copy: Any = clone(estimator)
    assert copy.get_params() == estimator.get_params()
    assert copy.set_params(aligner=None).aligner is None
    assert estimator.aligner == FAST
    with pytest.raises(sklearn.exceptions.NotFittedError):
        (copy.transform if hasattr(copy, "transform") else copy.predict)(few.curves)


def test_a_transformer_gives_the_scores_and_the_curves_of_components(made, mean):
    transformer = ShapeTransformer(2, aligner=FAST).fit(made.curves)
    components = TangentPCA.fit(mean, 2)
    scores = transformer.transform(made.curves[:5])
    assert np.allclose(scores, components.transform(made.curves[:5], FAST), atol=5e-3)
    assert np.allclose(transformer.inverse_transform(scores), components.inverse_transform(scores), atol=5e-3)
    longer = [np.asarray(resample(curve, 120)) for curve in made.curves[:5]]
    assert np.allclose(transformer.transform(longer), scores, atol=0.03)
    with pytest.raises(ValueError, match="of 3 dimensions"):
        transformer.transform(leaves(2, n=32, d=3).curves)


@pytest.mark.slow
def test_a_search_over_a_pipeline_tells_groups_apart(few):
    model = Pipeline([("shape", ShapeTransformer(aligner=FAST)), ("line", LinearDiscriminantAnalysis())])
    search = GridSearchCV(model, {"shape__n_components": [1, 2]}, cv=2)
    search.fit(few.curves, few.groups)
    assert search.best_score_ == 1
    assert search.predict(few.curves).tolist() == few.groups.tolist()


@pytest.mark.slow
def test_clusters_are_the_groups_and_predicted_again(few):
    found = ShapeKMeans(2, FAST).fit(few.curves)
    assert found.labels_.tolist() == few.groups.tolist()
    assert found.predict(few.curves).tolist() == few.groups.tolist()
    assert found.fit_predict(few.curves).tolist() == few.groups.tolist()


@pytest.mark.slow
def test_a_regressor_predicts_shapes_by_numbers(few):
    x = few.scores[:, :1]
    fitted = ShapeRegressor(FAST).fit(x, few.curves)
    predicted = fitted.predict(x)
    assert predicted.shape == few.curves.shape
    assert fitted.score(x, few.curves) > 0.7
    assert fitted.score(x[::-1], few.curves) < 0
    with pytest.raises(ValueError, match="a row for each shape"):
        fitted.fit(x[:3], few.curves)


def test_matrices_are_for_everything_precomputed(few):
    matrix = pairwise_shape_distances(few.curves, aligner=FAST)
    assert np.allclose(matrix, distance_matrix(few.curves, aligner=FAST), atol=1e-4)
    scores = cross_val_score(KNeighborsClassifier(1, metric="precomputed"), matrix, few.groups, cv=3)
    assert scores.mean() == 1
    mixed = [few.curves[0], np.asarray(resample(few.curves[1], 40))]
    assert pairwise_shape_distances(mixed, few.curves[:3], FAST).shape == (2, 3)
