"""Geodesics: closed, straight, evenly spaced, from end to end."""

import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import LEAN, RIGID
from elastic.shapes import ellipse, fourier, moved, x64

from curvematch_jax.elastic import _geodesic as geodesics
from curvematch_jax.elastic import _preshape as preshape
from curvematch_jax.elastic import align, exp_map, geodesic, log_map, matched_points, project_closed, to_srvf

N, STEPS = 32, 4


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return fourier(0, 3, n=N).astype(np.float32), fourier(1, 3, n=N).astype(np.float32)


@pytest.fixture(name="found", scope="module")
def fixture_found(pair):
    return geodesic(*pair, steps=STEPS, aligner=RIGID)


def test_every_point_of_the_path_is_closed_and_of_unit_norm(found):
    assert found.path.shape == (3, STEPS + 1, 3, 2 * N)
    gaps = np.linalg.norm(np.asarray(preshape.closure(found.path)), axis=-1)
    assert gaps.max() < 1e-6
    np.testing.assert_allclose(found.closure, gaps.max(axis=-1), atol=1e-7)
    np.testing.assert_allclose(preshape.inner(found.path, found.path), 1, atol=1e-5)


def apart(drawn, points):
    """Between a polygon and points `(b, d, k)`, both centred and of unit length: the root mean square."""
    points = points - points.mean(axis=-1, keepdims=True)
    sides = np.linalg.norm(np.roll(points, -1, axis=-1) - points, axis=-2)
    points = points / sides.sum(axis=-1)[..., None, None]
    return np.sqrt(np.mean(np.sum((drawn - points) ** 2, axis=-2), axis=-1))


@pytest.mark.parametrize(
    "aligner", [pytest.param(RIGID, id="rigid"), pytest.param(LEAN, id="lean", marks=pytest.mark.slow)]
)
def test_the_path_leads_from_the_first_curve_to_the_second_laid_onto_it(pair, aligner):
    """Both ends are the curves' own matched points, the second ones turned."""
    alignment = align(*pair, aligner)
    m = alignment.warp1.shape[-1] - 1
    drawn = np.asarray(geodesic(*pair, steps=STEPS, aligner=aligner, samples=m).curves())
    one, other = (np.asarray(x, float) for x in matched_points(*pair, alignment))
    assert apart(drawn[:, 0], one).max() < 1e-3
    assert apart(drawn[:, -1], np.asarray(alignment.rotation) @ other).max() < 1e-3


def test_the_length_is_that_of_the_alignment_or_more(found):
    straight = np.asarray(preshape.sphere_distance(found.path[:, 0], found.path[:, -1]))
    assert (np.asarray(found.length) >= straight - 1e-5).all()
    np.testing.assert_allclose(found.length, straight, rtol=0.02)


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
    assert found.path.shape == (3, 2, 3, 2 * N)
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


@pytest.mark.parametrize("samples", [0, 7])
def test_too_few_samples_are_refused(pair, samples):
    with pytest.raises(ValueError, match=f"samples = {samples}: closed curves need 8 or more"):
        geodesic(*pair, aligner=RIGID, samples=samples)


@pytest.mark.parametrize(
    ("d", "samples"), [(2, 40), *(pytest.param(*some, marks=pytest.mark.slow) for some in ((3, 100), (4, 64)))]
)
def test_geodesics_of_any_dimension_are_closed_and_converge(d, samples):
    curves, others = (fourier(s, 2, n=N, d=d, modes=2) for s in (0, 1))
    with x64():
        found = geodesic(curves, others, steps=STEPS, aligner=RIGID, samples=samples)
        assert found.path.shape == (2, STEPS + 1, d, samples)
        assert found.path.dtype == np.float64
        assert np.asarray(found.converged).all()
        assert float(found.closure.max()) < 1e-12


def test_the_velocity_at_the_start_leads_to_the_end(found):
    """`exp_map` along `log_map`: up to the error of the steps."""
    start, end = found.path[:, 0], found.path[:, -1]
    velocity = log_map(start, end)
    np.testing.assert_allclose(np.sqrt(preshape.inner(velocity, velocity)), found.length, rtol=2e-3)
    assert float(preshape.sphere_distance(exp_map(start, velocity), end).max()) < 0.02


@pytest.mark.slow
def test_six_steps_are_as_long_as_fifty():
    with x64():
        q1, q2 = (project_closed(to_srvf(fourier(s, 4, n=N))) for s in (8, 9))
        few, many = (geodesics.straighten(geodesics.joined(q1, q2, steps)) for steps in (6, 50))
        assert bool(many.converged.all())
        np.testing.assert_allclose(few.length, many.length, rtol=1e-3)
        assert (np.asarray(few.length) >= np.asarray(preshape.sphere_distance(q1, q2))).all()
