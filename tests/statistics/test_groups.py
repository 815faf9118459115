"""Permutation tests, clusters, outliers and regression."""

import numpy as np
import pytest
from elastic.aligners import FAST
from scipy.stats import kstest

from curvematch_jax import distance_matrix
from curvematch_jax.datasets import leaves
from curvematch_jax.statistics import (
    ShapeRegression,
    energy_test,
    karcher_mean,
    karcher_median,
    outliers,
    shape_kmeans,
    variance_test,
)


def points_matrix(points):
    return np.linalg.norm(points[:, None] - points[None], axis=2)


def test_energy_is_that_of_the_definition():
    random = np.random.default_rng(0)
    points, labels = random.normal(size=(9, 2)), np.repeat(["a", "b"], [4, 5])
    matrix = points_matrix(points)
    a, b = matrix[:4, :4].mean(), matrix[4:, 4:].mean()
    energy = 4 * 5 / (2 * 9) * (2 * matrix[:4, 4:].mean() - a - b) / matrix.mean()
    assert energy_test(matrix, labels, 9).statistic == pytest.approx(energy, rel=1e-4)


def test_frechet_is_that_of_the_definition():
    random = np.random.default_rng(1)
    points, groups = random.normal(size=(11, 2)), np.repeat([0, 1], [5, 6])
    matrix = points_matrix(points)
    matrix /= matrix.mean()

    def about_medoid(rows):
        squares = matrix[np.ix_(rows, rows)] ** 2
        best = squares[np.argmin(squares.sum(axis=1))]
        return best.mean(), np.mean(best**2) - best.mean() ** 2

    parts, shares = [about_medoid(np.flatnonzero(groups == g)) for g in (0, 1)], np.array([5, 6]) / 11
    (v1, s1), (v2, s2) = parts
    f = about_medoid(np.arange(11))[0] - shares @ [v1, v2]
    u = shares[0] * shares[1] * (v1 - v2) ** 2 / (s1 * s2)
    expected = 11 * u / (shares[0] / s1 + shares[1] / s2) + 11 * f**2 / (shares[0] ** 2 * s1 + shares[1] ** 2 * s2)
    assert variance_test(points_matrix(points), groups, 9).statistic == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("test", [energy_test, variance_test])
def test_p_is_uniform_where_groups_are_alike(test):
    random = np.random.default_rng(2)
    labels = np.repeat([0, 1], 10)
    p = [test(points_matrix(random.normal(size=(20, 3))), labels, 199, seed).p for seed in range(200)]
    assert kstest(p, "uniform").pvalue > 0.01


def test_known_groups_are_told_apart(made):
    matrix = distance_matrix(made.curves, aligner=FAST)
    assert energy_test(matrix, made.groups).p <= 0.01
    spread = np.random.default_rng(3).normal(size=(60, 2)) * np.repeat([1, 3], 30)[:, None]
    assert variance_test(points_matrix(spread), np.repeat([0, 1], 30)).p <= 0.01


@pytest.mark.slow
def test_kmeans_finds_the_groups():
    made = leaves(16, seed=4, apart=0.5)
    found = shape_kmeans(made.curves, 2)
    assert found.converged
    assert np.array_equal(found.labels, made.groups)
    assert found.centres.shape == (2, 2, 100)
    one = shape_kmeans(made.curves, 1)
    assert found.inertia < one.inertia / 2
    all_alone = shape_kmeans(made.curves[:3], 3)
    assert sorted(all_alone.labels) == [0, 1, 2]


@pytest.mark.slow
def test_outliers_are_found_and_no_others():
    made = leaves(20, seed=6)
    t = 2 * np.pi * np.arange(100) / 100
    curves = np.concatenate([made.curves, [[2 * np.cos(t), np.sin(t)]]]).astype(np.float32)
    found = outliers(karcher_median(curves))
    assert found.outlier.tolist() == [False] * 20 + [True]
    assert found.p[-1] < 0.01


@pytest.mark.slow
def test_regression_finds_what_the_shape_follows():
    made = leaves(20, seed=7, deviations=(0.1, 0.01))
    mean = karcher_mean(made.curves)
    fit = ShapeRegression.fit(mean, made.scores[:, 0])
    assert fit.r2 > 0.8
    assert fit.test.p <= 0.01
    assert fit.predict([0.0, 0.1]).shape == (2, 2, 100)
    noise = ShapeRegression.fit(mean, np.random.default_rng(0).normal(size=20))
    assert noise.r2 < 0.4
    assert noise.test.p > 0.01


def test_bad_input_gets_a_sentence(made, mean):
    matrix = np.ones((6, 6)) - np.eye(6)
    for call, said in [
        (lambda: energy_test(matrix, [0, 1]), "one label for each"),
        (lambda: energy_test(matrix, [0] * 6), "1 groups"),
        (lambda: energy_test(matrix[:2], [0, 1]), "give a matrix"),
        (lambda: energy_test(matrix + np.triu(matrix), [0, 0, 0, 1, 1, 1]), "not symmetric"),
        (lambda: shape_kmeans(made.curves, 100), "clusters = 100"),
        (lambda: outliers(mean, 2.0), "level = 2.0"),
        (lambda: ShapeRegression.fit(mean, np.ones(24)), "does not vary"),
        (lambda: ShapeRegression.fit(mean, np.ones(3)), "a row for each shape"),
    ]:
        with pytest.raises(ValueError, match=said):
            call()
