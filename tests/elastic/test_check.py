"""What is refused, and in which words; what is let through."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import ellipse, fourier, x64

import curvematch_jax.elastic as elastic
from curvematch_jax.elastic._check import MIN_SAMPLES, as_curves, as_field, as_shapes, check_batches

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


@pytest.mark.parametrize(
    ("shape", "advice"),
    [
        ((100, 2), r"e\.g\. curve1\.T"),
        ((100, 3), r"e\.g\. curve1\.T"),
        ((4, 100, 2), r"e\.g\. np\.swapaxes\(curve1, -1, -2\)"),
    ],
)
def test_samples_by_components_are_called_transposed(shape, advice):
    curve = np.zeros(shape)
    words = r"curve1 has shape .*, which looks transposed: give \(\*batch, d, n\), " + advice
    for check in (as_curves, as_shapes, as_field):
        with pytest.raises(ValueError, match=words):
            check("curve1", curve)
    with pytest.raises(ValueError, match=words):
        jax.jit(lambda x: as_curves("curve1", x))(curve)
    with pytest.raises(ValueError, match=r"^curve 3 of the list .* e\.g\. (curve\.T|np\.swapaxes\(curve, )"):
        as_shapes("curve 3 of the list", curve)


def test_a_list_of_curves_of_different_lengths_names_them():
    words = r"a holds curves of \(d, n\) = \(3, 50\) and \(3, 100\): .*; resample\(curve, n\) changes n\."
    with pytest.raises(ValueError, match=words):
        elastic.distance_matrix([ellipse(50), ellipse(100)])
    with pytest.raises(ValueError, match="no array of real numbers"):
        as_curves("a", [[1.0, 2.0], [1.0]])


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


def test_two_points_in_turn_are_no_curve():
    """Every step is long, and yet there are two points alone."""
    curve = np.zeros((2, 20))
    curve[:, ::2] = 1
    with pytest.raises(ValueError, match="fewer than 3 distinct points"):
        as_curves("curve", curve)


def held(dtype):
    return np.round(GOOD * 64).astype(dtype)


@pytest.mark.usefixtures("float32")
@pytest.mark.parametrize(
    ("curve", "dtype"),
    [
        (held(">f4"), np.float32),
        (held(">f8"), np.float64),
        (held(np.float16), np.float32),
        (held(jnp.bfloat16), np.float32),
        (held(np.longdouble), np.float64),
        (held(int), np.float64),
        (held(np.int8), np.float64),
        (held(object), np.float64),
        (held(float).tolist(), np.float64),
        ([jnp.asarray(one, jnp.float32) for one in held(float)], np.float32),
        (np.ma.masked_array(held(float), mask=False), np.float64),
        (np.asfortranarray(held(np.float32)), np.float32),
    ],
    ids=["f4", "f8", "half", "bfloat16", "long", "int", "int8", "object", "list", "list of arrays", "mask", "order"],
)
def test_real_numbers_of_every_kind_are_taken(curve, dtype):
    expected = np.round(GOOD * 64)
    found = as_curves("curve", curve)
    assert isinstance(found, jax.Array)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected, rtol=1e-2)
    with x64():
        found = as_curves("curve", curve)
        assert found.dtype == dtype
        np.testing.assert_allclose(found, expected, rtol=1e-2)
        np.testing.assert_allclose(elastic.length(curve), elastic.length(found), rtol=1e-6)


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (np.ma.masked_invalid(broken((0, 0, slice(2)), np.nan)), "outline is a masked array that hides 2 numbers"),
        ([[1.0, 2.0], [3.0]], "outline is no array of real numbers"),
        ([["a"]], "outline has dtype <U1"),
        (np.array([[object()]]), "outline is no array of real numbers"),
        (np.array([[10**400]], object), "outline is no array of real numbers"),
        ("curve", "outline"),
        (np.zeros((2, 9), "datetime64[s]"), "outline has dtype datetime64"),
        (np.full((2, 9), 1j), "outline has dtype complex128"),
    ],
    ids=["mask", "ragged", "text", "things", "huge", "word", "time", "complex"],
)
def test_what_holds_no_real_numbers_is_refused_in_one_sentence(curve, words):
    for function in (as_curves, as_shapes):
        with pytest.raises(ValueError, match=f"^{words}") as caught:
            function("outline", curve)
        assert "\n" not in str(caught.value)


def test_the_callers_array_is_not_shared():
    curve = GOOD.astype(np.float32)
    found, kept = as_curves("curve", curve), curve.copy()
    curve[:] = 0
    np.testing.assert_array_equal(found, kept)


FAR = np.array([[5e5], [4.6e6], [300.0]])


@pytest.mark.usefixtures("float32")
@pytest.mark.parametrize("dtype", [np.float64, np.longdouble])
def test_shapes_are_taken_in_the_precision_in_which_they_came(dtype):
    """float32 steps by half a unit there."""
    near, far = as_shapes("curve", GOOD), as_shapes("curve", GOOD.astype(dtype) + FAR)
    assert far.dtype == np.float32
    np.testing.assert_allclose(far, near, atol=1e-6)
    with pytest.raises(ValueError, match=r"^curve is so far from the origin that float32 .* centre\(curve\)"):
        as_curves("curve", GOOD.astype(dtype) + FAR)
    with x64():
        np.testing.assert_array_equal(as_curves("curve", GOOD + FAR), GOOD + FAR)


@pytest.mark.parametrize("size", [1e-300, 1e-30, 1e-20, 1.0, 1e19, 1e25, 1e307])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_shapes_are_those_of_every_size(size, dtype):
    if not 1e-37 < size < 1e37 and dtype == np.float32:
        pytest.skip("not in float32")
    curve = (GOOD * size).astype(dtype)
    found = as_shapes("curve", curve)
    extent = (found.max(axis=-1) - found.min(axis=-1)).max(axis=-1)
    assert ((extent >= 0.99) & (extent <= 2)).all()
    np.testing.assert_allclose(elastic.to_srvf(found), elastic.to_srvf(GOOD), atol=2e-5)


@pytest.mark.usefixtures("float32")
@pytest.mark.parametrize(("size", "words"), [(1e45, "too large"), (1e-45, "too small")])
def test_what_float32_cannot_hold_is_refused_unless_it_has_to_be_held(size, words):
    curve = GOOD * size
    held_in_units = (elastic.length, elastic.centre, lambda c: elastic.resample(c, 30), lambda c: as_curves("curve", c))
    for function in held_in_units:
        with pytest.raises(ValueError, match=f"^curve is {words} for float32"):
            function(curve)
    np.testing.assert_allclose(elastic.to_srvf(curve), elastic.to_srvf(GOOD), atol=1e-6)


@pytest.mark.parametrize("size", [1e-20, 1.0, 1e25])
def test_traced_shapes_are_the_same_with_right_and_finite_derivatives(size):
    """Of what is blind to place and size, here the direction of one chord."""
    blind = lambda c: (c[0, 3] - c[0, 9]) / jnp.linalg.norm(c[:, 3] - c[:, 9])  # noqa: E731
    curve = jnp.asarray(GOOD[0] * size, jnp.float32)
    traced = jax.jit(lambda c: as_shapes("curve", c))
    np.testing.assert_allclose(traced(curve), as_shapes("curve", curve), atol=1e-6)
    found = jax.grad(lambda c: blind(as_shapes("curve", c)))(curve)
    expected = jax.grad(blind)(jnp.asarray(GOOD[0], jnp.float32))
    np.testing.assert_allclose(found * size, expected, atol=1e-4)


def test_traced_constants_have_finite_derivatives():
    point = jnp.ones((2, 9))
    assert jnp.isfinite(jax.grad(lambda c: jnp.sum(as_shapes("curve", c) ** 2))(point)).all()


def test_traced_half_precision_becomes_float32():
    assert jax.jit(lambda c: as_curves("curve", c))(jnp.asarray(GOOD, jnp.bfloat16)).dtype == jnp.float32


def test_batches_that_do_not_broadcast_are_named():
    assert check_batches(a=(3, 1), b=(4,), c=()) == (3, 4)
    with pytest.raises(ValueError, match=r"^the batches of a, b and c, \(3,\), \(2,\) and \(\), do not broadcast\.$"):
        check_batches(a=(3,), b=(2,), c=())


@pytest.mark.usefixtures("float32")
def test_fields_are_real_finite_and_at_least_of_float32():
    q = np.ones((2, 9))
    for dtype in (np.float16, jnp.bfloat16, ">f4", np.float64, np.longdouble):
        assert as_field("q", q.astype(dtype)).dtype == jnp.float32
    assert as_field("q", q.tolist()).shape == (2, 9)
    with pytest.raises(ValueError, match=r"^q holds NaN or infinity"):
        as_field("q", q * np.nan)
    with pytest.raises(ValueError, match=r"^q is a masked array that hides"):
        as_field("q", np.ma.masked_greater(q, 0))


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
