"""What is refused, and in which words; what is let through."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import ellipse, fourier

import curvematch_jax.elastic as elastic
from curvematch_jax.elastic._check import MIN_SAMPLES, as_curves

GOOD = fourier(0, 3, n=20)


def broken(index, value):
    curves = GOOD.copy()
    curves[index] = value
    return curves


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (np.zeros(9), r"shape \(9,\)"),
        (GOOD[:, :1], r"d = 1"),
        (GOOD[..., : MIN_SAMPLES - 1], r"n = 7"),
        (broken((1, 0, 3), np.nan), "NaN or infinity in curve 1 of 3"),
        (broken((slice(1, None), 2, 0), -np.inf), "NaN or infinity in curve 1 and 1 more of 3"),
        (broken(2, 0.5), "fewer than 3 distinct points in curve 2 of 3"),
        (np.ones((1, 2, 10)), "fewer than 3 distinct points in curve 0 of 1"),
        (np.linspace([0, 0, 0], [1, 2, 3], 20).T, "open in curve 0 of 1.* 19 times"),
        (ellipse(40)[:, :30], "open in curve 0"),
        (GOOD.astype(complex), "complex128"),
        (np.full((2, 10), "x"), "dtype <U1"),
    ],
    ids=["1-d", "d=1", "n=7", "nan", "inf", "point", "constant", "segment", "arc", "complex", "text"],
)
def test_what_is_no_closed_curve_is_refused_in_one_sentence_that_names_it(curve, words):
    with pytest.raises(ValueError, match=f"^outline .*{words}") as caught:
        as_curves("outline", curve)
    assert "\n" not in str(caught.value)


def test_a_back_and_forth_between_two_points_is_no_curve():
    curve = np.zeros((2, 20))
    curve[0, 10:] = 1
    with pytest.raises(ValueError, match="fewer than 3 distinct points"):
        as_curves("curve", curve)


@pytest.mark.parametrize("curve", [ellipse(8), fourier(1, 2, n=400, d=2), fourier(2, n=31, d=4)])
def test_closed_curves_pass_unchanged(curve):
    found = as_curves("curve", curve.astype(np.float32))
    assert found.dtype == jnp.float32
    np.testing.assert_array_equal(found, curve.astype(np.float32))


def test_a_coarse_curve_is_not_taken_for_an_open_one():
    """The last step of the second is three times the others."""
    square = np.array([[0, 1, 2, 2, 2, 1, 0, 0], [0, 0, 0, 1, 2, 2, 2, 1]], float)
    as_curves("curve", square)
    as_curves("curve", ellipse(40)[:, :38])


def test_integers_become_floats():
    square = np.array([[0, 1, 2, 2, 2, 1, 0, 0], [0, 0, 0, 1, 2, 2, 2, 1]])
    assert jnp.issubdtype(as_curves("curve", square).dtype, jnp.floating)


def test_traced_curves_are_checked_for_shape_and_type_alone():
    jax.jit(lambda c: as_curves("curve", c))(jnp.full((2, 9), jnp.nan))
    with pytest.raises(ValueError, match="curve has shape"):
        jax.jit(lambda c: as_curves("curve", c))(jnp.zeros((2, 5)))
    with pytest.raises(ValueError, match="curve has dtype int32"):
        jax.jit(lambda c: as_curves("curve", c))(jnp.zeros((2, 9), jnp.int32))


PAIRS = [elastic.align, elastic.elastic_distance, elastic.geodesic]


@pytest.mark.parametrize("function", PAIRS)
def test_every_function_of_two_curves_names_the_bad_one(function):
    with pytest.raises(ValueError, match=r"^curve1 holds NaN"):
        function(broken((0, 0, 0), np.nan), GOOD)
    with pytest.raises(ValueError, match=r"^curve2 is open"):
        function(ellipse(40), ellipse(80)[:, :40])


@pytest.mark.parametrize("function", PAIRS)
def test_pairs_have_to_fit_each_other(function):
    with pytest.raises(ValueError, match=r"\(3, 20\) and \(3, 30\).*resample"):
        function(GOOD, fourier(0, 3, n=30))
    with pytest.raises(ValueError, match=r"\(3, 20\) and \(2, 20\)"):
        function(GOOD, GOOD[:, :2])
    with pytest.raises(ValueError, match=r"\(3,\) and \(2,\), do not broadcast"):
        function(GOOD, GOOD[:2])


@pytest.mark.parametrize("function", [elastic.length, elastic.to_srvf, lambda c: elastic.resample(c, 10)])
def test_every_function_of_one_curve_names_it(function):
    with pytest.raises(ValueError, match=r"^curve holds NaN"):
        function(broken((0, 0, 0), np.nan))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"grid": 7}, r"Aligner.grid = 7.* 8 or more"),
        ({"seeds": 0}, r"Aligner.seeds = 0"),
        ({"slope": -1}, r"Aligner.slope = -1"),
        ({"passes": 0}, r"Aligner.passes = 0"),
        ({"table": 0}, r"Aligner.table = 0"),
        ({"fineness": 0}, r"Aligner.fineness = 0"),
        ({"chunk": 0}, r"Aligner.chunk = 0"),
        ({"band": 0.0}, r"Aligner.band = 0.0"),
        ({"band": 0.6}, r"Aligner.band = 0.6"),
        ({"seeds": 6, "stages": (elastic.Stage(7, 1, 48),)}, r"not 48, 6, \[7\]"),
        ({"grid": 8, "seeds": 9}, r"not 8, 9, \[3, 1\]"),
        ({"stages": (elastic.Stage(1, 1, 48), elastic.Stage(2, 1, 48))}, r"not 48, 8, \[1, 2\]"),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        elastic.Aligner(**settings)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"kept": 0}, "Stage.kept = 0.* 1 or more"),
        ({"steps": -1}, "Stage.steps = -1"),
        ({"knots": 7}, "Stage.knots = 7.* 8 or more"),
        ({"nodes": 0}, "Stage.nodes = 0"),
    ],
)
def test_stages_that_cannot_be_are_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        elastic.Stage(**{"kept": 1, "steps": 1, "knots": 48, **settings})


def test_presets_differ_and_can_be_settings_of_a_compilation():
    presets = [elastic.Aligner.fast(), elastic.Aligner.accurate(), elastic.Aligner.rigid()]
    assert len(set(presets)) == 3
    assert elastic.Aligner.fast() == elastic.Aligner()
    assert hash(elastic.Aligner.accurate()) == hash(elastic.Aligner.accurate())
