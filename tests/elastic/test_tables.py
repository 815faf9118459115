"""What is kept of a curve: its SRVF at equal parameters, and its arc length."""

import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import ellipse, fourier, moved, srvf, x64

from curvematch_jax.elastic._tables import CAPACITY, tabulate

N = 100


def tables(curve):
    return tabulate(jnp.asarray(curve))


@pytest.mark.parametrize(("d", "n"), [(2, 16), (3, 100), (4, 1024), (3, 3000)])
def test_entries_are_the_srvf_of_the_interpolant(d, n):
    """At equal parameters, a whole number of them to a sample where there is room; zeros behind them."""
    curves = fourier(0, 2, n=n, d=d, modes=2)
    with x64():
        table = tables(curves)
        count = int(table.count[0])
        assert table.srvf.shape == (2, d, CAPACITY)
        assert count == (n * min(10, CAPACITY // n) if n <= CAPACITY else CAPACITY)
        np.testing.assert_array_equal(table.srvf[..., count:], 0)
        np.testing.assert_allclose(np.sum(np.asarray(table.srvf) ** 2, axis=(1, 2)) / count, 1, atol=1e-12)
        if n > CAPACITY:
            return
        for curve, entries in zip(curves, np.asarray(table.srvf), strict=True):
            expected = srvf(curve, np.arange(count) / count)
            expected /= np.sqrt(np.mean(np.sum(expected**2, axis=0)))
            np.testing.assert_allclose(entries[:, :count], expected, atol=1e-8)


def test_curves_counted_from_another_sample_have_the_same_entries():
    curves = fourier(1, 2)
    with x64():
        plain, rolled = tables(curves), tables(np.roll(curves, -7, axis=-1))
        count = int(plain.count[0])
        np.testing.assert_allclose(rolled.srvf[..., :count], np.roll(plain.srvf[..., :count], -70, axis=-1), atol=1e-11)


@pytest.mark.parametrize("n", [16, 100, 1024])
def test_times_invert_the_arc_length(n):
    curve = ellipse(n)
    with x64():
        times = np.asarray(tables(curve[None]).times)[0]
    assert times[0] == 0
    assert times[-1] == pytest.approx(1, abs=1e-12)
    assert np.diff(times).min() > 0
    x = np.linspace(0, 1, 100_001)
    speed = np.hypot(2 * np.sin(2 * np.pi * x), np.cos(2 * np.pi * x))
    arc = np.append(0, np.cumsum((speed[1:] + speed[:-1]) / 2))
    np.testing.assert_allclose(
        np.interp(times, x, arc / arc[-1]), np.linspace(0, 1, len(times)), atol=0.01 if n < 20 else 3e-3
    )


def test_tangents_are_directions_at_equal_arc_lengths():
    table = tables(ellipse(N, 1.0, 1.0)[None].astype(np.float32))
    np.testing.assert_allclose(np.linalg.norm(table.tangents, axis=1), 1, atol=1e-5)
    t = 2 * np.pi * np.arange(table.tangents.shape[-1]) / table.tangents.shape[-1]
    np.testing.assert_allclose(table.tangents[0], [-np.sin(t), np.cos(t), 0 * t], atol=0.01)


def test_position_and_size_are_forgotten():
    curves = fourier(2, 3).astype(np.float32)
    plain, away = tables(curves), tables(3 * curves + 5)
    for name, atol in (("srvf", 1e-4), ("times", 1e-5)):
        np.testing.assert_allclose(getattr(plain, name), getattr(away, name), atol=atol)


def test_turned_curves_have_turned_tables():
    curves = fourier(3, 1)
    with x64():
        plain, turned = tables(curves), tables(moved(curves, 4))
        gram = lambda table: np.einsum("bdi,bdj->bij", table.srvf[..., ::64], table.srvf[..., ::64])  # noqa: E731
        np.testing.assert_allclose(gram(plain), gram(turned), atol=1e-10)
        np.testing.assert_allclose(plain.times, turned.times, atol=1e-10)


def test_a_curve_of_no_size_has_finite_tables():
    """It is refused where its numbers can be seen; in traced code they can't."""
    assert all(np.isfinite(x).all() for x in tables(np.ones((1, 3, 20), np.float32)))


def test_curves_do_not_mix():
    curves = fourier(4, 3).astype(np.float32)
    plain = tables(curves)
    curves[0] = np.nan
    for before, after in zip(plain, tables(curves), strict=True):
        np.testing.assert_array_equal(before[1:], after[1:])
