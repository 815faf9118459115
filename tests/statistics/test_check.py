"""Hostile input to everything public: the right answer, or one sentence that names what was given."""

import dataclasses

import jax
import numpy as np
import pytest
from elastic.aligners import FAST

from curvematch_jax.statistics import (
    ShapeRegression,
    TangentPCA,
    energy_test,
    karcher_mean,
    karcher_median,
    shape_kmeans,
    variance_test,
)
from curvematch_jax.statistics._check import as_between, as_distances, as_groups_of, as_reals, as_whole
from curvematch_jax.statistics._mean import as_mean

pytestmark = pytest.mark.filterwarnings("error")
NUMBERS = np.arange(24.0)


@pytest.fixture(name="components", scope="module")
def fixture_components(mean):
    return TangentPCA.fit(mean, 2)


@pytest.mark.parametrize(
    "values",
    [
        "a",
        None,
        ["a", "b"],
        [1j],
        [[1], [1, 2]],
        [np.nan],
        [np.inf],
        [None, 1.0],
        np.ma.masked_array([1, 2], [False, True]),
    ],
)
def test_other_things_than_finite_real_numbers_are_refused(values):
    with pytest.raises(ValueError, match=r"^x "):
        as_reals("x", values)


@pytest.mark.parametrize("values", [[1, 2], np.array([1, 2], ">i4"), np.array([1, 2], object), [True, 2]])
def test_numbers_of_every_kind_are_taken(values):
    assert as_reals("x", values).tolist() == [1, 2]


@pytest.mark.parametrize("value", [0, -1, 2.0, 2.5, "a", None, True, np.nan, [1]])
def test_other_things_than_whole_numbers_are_refused(value):
    with pytest.raises(ValueError, match=r"^n = .*whole number, 1 or more"):
        as_whole("n", value, 1)
    assert as_whole("n", np.int64(3), 1) == 3


@pytest.mark.parametrize("value", [0, 1, -1.0, np.nan, "a", None, [0.5]])
def test_other_things_than_numbers_between_limits_are_refused(value):
    with pytest.raises(ValueError, match=r"^level "):
        as_between("level", value, 0, 1)
    assert as_between("level", 0.5, 0, 1) == 0.5


def test_what_is_no_mean_of_one_group_is_refused(made, mean):
    for other, said in [(made.curves, "is no mean"), (mean._replace(srvf=mean.srvf[None]), "has groups")]:
        with pytest.raises(ValueError, match=said):
            as_mean("median", other)


@pytest.mark.parametrize("unit", [1e-300, 1.0, 1e307])
def test_the_unit_of_distances_does_not_matter(unit):
    matrix = np.abs(NUMBERS[:6] - NUMBERS[:6, None])
    assert np.allclose(as_distances("distances", matrix * unit), as_distances("distances", matrix))


def test_labels_of_mixed_kinds_are_groups():
    assert as_groups_of([0, "a", (0), "a"], 4).tolist() == [0, 1, 0, 1]
    assert as_groups_of(np.array([2.5, 1.0, 2.5, 1.0]), 4).tolist() == [0, 1, 0, 1]
    for labels in ([0, 0, None, None], [0.0, 0.0, np.nan, np.nan]):
        with pytest.raises(ValueError, match="none for shape 2"):
            as_groups_of(labels, 4)


@pytest.mark.parametrize("test", [energy_test, variance_test])
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: -m, "negative"),
        (lambda m: m * np.nan, "NaN"),
        (lambda m: 1 / (1 + m), "not 0 on its diagonal"),
        (lambda m: np.triu(m), "not symmetric"),
        (lambda m: m[:3], "give a matrix"),
        (lambda m: m * 1j, "real numbers"),
    ],
)
def test_what_are_no_distances_gets_a_sentence(test, change, said):
    matrix = np.abs(NUMBERS[:6] - NUMBERS[:6, None])
    with pytest.raises(ValueError, match=said):
        test(change(matrix), [0, 0, 0, 1, 1, 1])


def test_calls_with_other_arguments_get_a_sentence(made, mean, components):
    matrix = np.abs(NUMBERS - NUMBERS[:, None])
    two = [0, 1] * 12
    other = mean._replace(srvf=-mean.srvf)
    for call, said in [
        (lambda: energy_test(matrix, two, 9, -1), "seed = -1"),
        (lambda: TangentPCA.fit(mean, 2, -1.0), "size = -1.0"),
        (lambda: TangentPCA.fit(mean, 2, np.nan), "size holds NaN"),
        (lambda: TangentPCA.fit(mean, 2, 1e300), r"size = 1e\+300"),
        (lambda: TangentPCA.fit(mean, 3, 1e-3).inverse_transform([0, 0, 90]), "sizes that"),
        (lambda: components.scores(other), "another mean"),
        (lambda: components.inverse_transform("a"), "scores holds"),
        (lambda: components.inverse_transform([1e200]), "radians"),
        (lambda: components.sample(jax.random.key(0), -1), "n = -1"),
        (lambda: components.along(0, 1.0), "list of deviations"),
        (lambda: shape_kmeans(made.curves, 2, matrix=matrix * np.nan), "matrix holds NaN"),
        (lambda: shape_kmeans(made.curves, 2, matrix=-matrix), "negative"),
        (lambda: ShapeRegression.fit(mean, NUMBERS * 1e200), "another unit"),
        (lambda: ShapeRegression.fit(mean, np.zeros((24, 0))), "a row for each"),
        (lambda: ShapeRegression.fit(mean, NUMBERS, 0), "permutations = 0"),
        (lambda: ShapeRegression.fit(mean, NUMBERS, 9).predict([1e200]), "radians"),
    ]:
        with pytest.raises(ValueError, match=said):
            call()


def test_the_unit_and_the_zero_of_numbers_do_not_matter(mean):
    fits = [ShapeRegression.fit(mean, x, 19) for x in (NUMBERS, NUMBERS * 1e-90, NUMBERS + 1e9)]
    assert [fit.r2 for fit in fits] == pytest.approx([fits[0].r2] * 3, rel=1e-5)
    assert np.allclose(fits[0].predict([3.0]), fits[1].predict([3e-90]), atol=1e-4)


@pytest.mark.parametrize("unit", [1e-20, 1e20])
def test_the_unit_of_curves_does_not_matter(made, unit):
    curves, scale = made.curves[:6], np.float32(unit)
    here, there = karcher_mean(curves, aligner=FAST), karcher_mean((curves * scale).astype(">f4"), aligner=FAST)
    assert np.allclose(there.curve / scale, here.curve, atol=1e-3)
    assert np.allclose(there.distances, here.distances, atol=1e-4)


def test_copies_are_their_own_mean_and_median(made):
    copies = np.stack([made.curves[0]] * 4)
    for found in (karcher_mean(copies, aligner=FAST), karcher_median(copies, aligner=FAST)):
        assert found.converged
        assert found.distances.max() < 1e-4


@pytest.mark.parametrize(
    ("curves", "said"),
    [
        (lambda c: [np.ma.masked_array(c[0], c[0] > 1), c[1]], "curve 0 of the list is a masked array"),
        (lambda c: [c[0], c[1][:, ::2] * np.nan], "curve 1 of the list holds NaN"),
        (lambda c: [c[0], c[1][:, ::20]], "curve 1 of the list has shape"),
        (lambda c: [None, c[0]], "curve 0 of the list has shape"),
        (lambda c: c[:, :, ::20], "8 samples or more"),
        (lambda c: c * 1j, "complex"),
        (lambda c: c[:0], "no curve"),
        (lambda c: "curves", "real numbers"),
    ],
)
def test_hostile_curves_get_a_sentence(made, curves, said):
    with pytest.raises(ValueError, match=said):
        karcher_mean(curves(made.curves))


def test_aligners_that_mirror_are_refused(made):
    aligner = dataclasses.replace(FAST, mirror=True)
    for refused in (karcher_mean, karcher_median, lambda c, aligner: shape_kmeans(c, 2, aligner)):
        with pytest.raises(ValueError, match="statistics take curves as they are"):
            refused(made.curves, aligner=aligner)
