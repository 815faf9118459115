"""Geodesics: closed, straight, evenly spaced, from end to end."""

import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import ellipse, fourier, moved, rotation, srvf, warps, x64

from curvematch_jax.elastic import Aligner, align, aligned_srvf, geodesic, project_closed, to_srvf
from curvematch_jax.elastic import _geodesic as geodesics
from curvematch_jax.elastic import _preshape as preshape

RIGID, N, STEPS = Aligner.rigid(), 32, 4


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return fourier(0, 3, n=N).astype(np.float32), fourier(1, 3, n=N).astype(np.float32)


@pytest.fixture(name="found", scope="module")
def fixture_found(pair):
    return geodesic(*pair, steps=STEPS, aligner=RIGID)


def test_every_point_of_the_path_is_closed_and_of_unit_norm(found):
    assert found.path.shape == (3, STEPS + 1, 3, N)
    gaps = np.linalg.norm(np.asarray(preshape.closure(found.path)), axis=-1)
    assert gaps.max() < 1e-6
    np.testing.assert_allclose(found.closure, gaps.max(axis=-1), atol=1e-7)
    np.testing.assert_allclose(preshape.inner(found.path, found.path), 1, atol=1e-5)


def test_the_path_begins_at_the_first_curve_and_ends_at_the_second_laid_onto_it(found, pair):
    np.testing.assert_allclose(found.path[:, 0], project_closed(to_srvf(pair[0])), atol=1e-4)
    swapped = preshape.sphere_distance(found.path[:, 0], found.path[:, -1])
    assert (np.asarray(found.length) >= np.asarray(swapped) - 1e-5).all()
    np.testing.assert_allclose(found.length, swapped, rtol=0.02)


def test_straightening_lowers_the_energy_to_that_of_even_speed(found):
    energy = np.asarray(found.energy)
    assert (np.diff(energy, axis=-1) <= 1e-6).all()
    assert np.asarray(found.converged).all()
    chord = 2 * np.sin(np.asarray(found.length) / STEPS / 2)
    np.testing.assert_allclose(energy[:, -1], STEPS**2 / 2 * chord**2, rtol=1e-3)
    steps = np.asarray(preshape.sphere_distance(found.path[:, 1:], found.path[:, :-1]))
    np.testing.assert_allclose(steps / steps.mean(axis=-1, keepdims=True), 1, atol=0.01)


def test_the_curves_along_the_path_do_not_collapse(found):
    curves = np.asarray(found.curves())
    assert curves.shape == found.path.shape
    segments = np.linalg.norm(np.roll(curves, -1, axis=-1) - curves, axis=-2)
    assert segments.min() > 0


def test_straight_paths_have_no_tangential_acceleration_in_float64():
    """From a bent path, down to the geodesic: closed to 1e-12 at every step, and shorter than any path nearby."""
    with x64():
        q1, q2 = (project_closed(to_srvf(fourier(s, n=N))) for s in (2, 3))
        path = preshape.great_circle(q1, q2, STEPS)
        bump = jnp.asarray(
            np.sin(np.pi * np.arange(STEPS + 1) / STEPS)[:, None, None] * np.asarray(to_srvf(fourier(4, n=N)))
        )
        bent = project_closed(path + 0.3 * bump)
        found = geodesics.straighten(bent)
        assert bool(found.converged)
        assert found.path.dtype == jnp.float64
        assert float(found.closure) < 1e-12
        assert float(found.energy[-1]) < 0.95 * float(found.energy[0])
        inside = found.path[1:-1]
        pull = preshape.project_tangent(inside, 2 * inside - found.path[:-2] - found.path[2:])
        assert float(preshape.inner(pull, pull).max()) ** 0.5 < 1e-10
        for size in (0.02, -0.02):
            other = project_closed(found.path + size * bump)
            assert float(geodesics._energy(other)) > float(found.energy[-1])


def test_a_curve_to_its_moved_copy_is_no_way_at_all(pair):
    found = geodesic(pair[0], moved(pair[0], 3).astype(np.float32), steps=STEPS, aligner=RIGID)
    np.testing.assert_allclose(found.length, 0, atol=0.02)
    assert np.isfinite(found.path).all()


def test_batches_broadcast_and_a_single_step_is_allowed(pair):
    found = geodesic(pair[0], pair[1][0], steps=1, aligner=RIGID)
    assert found.path.shape == (3, 2, 3, N)
    np.testing.assert_allclose(found.length[0], align(pair[0][0], pair[1][0], RIGID).distance, atol=0.05)
    assert float(found.length.max()) < np.pi


def test_a_curve_there_and_back_has_a_finite_geodesic():
    straight = np.stack([ellipse(N, 2.0, height) for height in (1e-2, 1e-3, 1e-4)]).astype(np.float32)
    found = geodesic(straight, ellipse(N).astype(np.float32), steps=STEPS, aligner=RIGID)
    assert np.isfinite(found.path).all()
    assert np.isfinite(found.length).all()
    assert float(found.closure.max()) < 1e-6


@pytest.mark.parametrize("steps", [0, -3])
def test_steps_below_one_are_refused(pair, steps):
    with pytest.raises(ValueError, match=f"steps = {steps}"):
        geodesic(*pair, steps=steps)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_an_alignment_lays_a_curve_as_defined(d):
    n = 80
    curve, gamma = fourier(5, n=n, d=d, modes=2), warps(6, 1, n, rough=0.0)[:, 0]
    gamma = gamma + 0.05 * np.sin(2 * np.pi * np.arange(n + 1) / n)
    turn = rotation(7, d)
    found = aligned_srvf(*(jnp.asarray(x, jnp.float32) for x in (curve, turn, gamma)))
    slope = 1 + 0.1 * np.pi * np.cos(2 * np.pi * np.arange(n) / n)
    expected = turn @ srvf(curve, gamma[:-1]) * np.sqrt(slope)
    np.testing.assert_allclose(found, expected / np.sqrt(np.mean(np.sum(expected**2, axis=0))), atol=0.01)


def test_six_steps_are_as_long_as_fifty():
    with x64():
        q1, q2 = (project_closed(to_srvf(fourier(s, 4, n=N))) for s in (8, 9))
        few, many = (geodesics.straighten(geodesics.joined(q1, q2, steps)) for steps in (6, 50))
        assert bool(many.converged.all())
        np.testing.assert_allclose(few.length, many.length, rtol=1e-3)
        assert (np.asarray(few.length) >= np.asarray(preshape.sphere_distance(q1, q2))).all()


def test_a_finer_warp_lays_a_curve_as_a_coarse_one():
    """Between the samples a warp may be anything: a sample takes the mean slope around it."""
    curve, gamma = jnp.asarray(fourier(5, n=N), jnp.float32), jnp.asarray(warps(6, 1, N, rough=0.0)[:, 0], jnp.float32)
    turn = jnp.eye(3)
    fine = jnp.interp(jnp.arange(8 * N + 1) / (8 * N), jnp.arange(N + 1) / N, gamma)
    np.testing.assert_allclose(aligned_srvf(curve, turn, fine), aligned_srvf(curve, turn, gamma), atol=1e-4)
