"""The manifold of closed SRVFs: projection, tangent space, great circles."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, x64
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import _geodesic as geodesics
from curvematch_jax.elastic import _preshape as preshape
from curvematch_jax.elastic import exp_map, log_map, parallel_transport, project_closed, to_curve, to_srvf


def open_field(seed, n=32, d=3, dtype=np.float32, size=0.1):
    """An SRVF that misses closure by about `size`, in every component."""
    q = np.asarray(to_srvf(fourier(seed, n=n, d=d)), dtype)
    return q + size * np.random.default_rng(seed).normal(size=(d, 1)).astype(dtype)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.floats(0, 0.1))
def test_projection_closes_and_is_idempotent(seed, size):
    found = project_closed(open_field(seed, size=size))
    assert float(jnp.abs(preshape.closure(found)).max()) < 1e-6
    np.testing.assert_allclose(preshape.inner(found, found), 1, atol=1e-6)
    np.testing.assert_allclose(project_closed(found), found, atol=2e-6)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_projection_closes_to_rounding_in_float64(d):
    with x64():
        q = open_field(1, d=d, dtype=np.float64, size=0.1)
        found = project_closed(q)
        assert found.dtype == jnp.float64
        assert float(jnp.abs(preshape.closure(jnp.asarray(q))).max()) > 0.05
        assert float(jnp.abs(preshape.closure(found)).max()) < 1e-12


def test_the_projected_point_is_the_nearest_one():
    """What takes q to it is normal to the manifold; and no closed field near it is nearer to q."""
    with x64():
        q = open_field(2, dtype=np.float64, size=0.1)
        found = project_closed(q)
        rest = preshape.project_tangent(found, preshape.unit(jnp.asarray(q)))
        assert float(preshape.inner(rest, rest)) ** 0.5 < 1e-6
        here = float(preshape.sphere_distance(found, preshape.unit(jnp.asarray(q))))
        for seed in range(5):
            other = project_closed(found + 0.02 * fourier(seed, n=32))
            assert float(preshape.sphere_distance(other, preshape.unit(jnp.asarray(q)))) > here


def test_closing_a_curve_does_not_collapse_its_points():
    curve = np.asarray(to_curve(project_closed(open_field(3, n=32, size=0.1))))
    segments = np.linalg.norm(np.roll(curve, -1, axis=1) - curve, axis=0)
    assert segments.min() > 0.05 / 32


def test_a_field_far_from_closed_is_closed_as_well():
    assert float(jnp.abs(preshape.closure(project_closed(open_field(3, size=0.2)))).max()) < 1e-6


def test_projection_takes_batches_and_transformations():
    q = np.stack([open_field(s) for s in range(4)])
    alone = np.stack([project_closed(one) for one in q])
    np.testing.assert_allclose(project_closed(q.reshape(2, 2, 3, 32)).reshape(4, 3, 32), alone, atol=2e-6)
    np.testing.assert_allclose(jax.jit(jax.vmap(project_closed))(q), alone, atol=2e-6)


def test_the_gradient_of_projection_by_finite_differences():
    with x64():
        q, weight, direction = (
            jnp.asarray(x) for x in (open_field(4, dtype=np.float64), fourier(5, n=32), fourier(6, n=32))
        )
        value = jax.jit(lambda q: jnp.sum(project_closed(q) * weight))
        slope = jax.jvp(value, (q,), (direction,))[1]
        np.testing.assert_allclose(jnp.sum(jax.grad(value)(q) * direction), slope, rtol=1e-8)
        difference = (value(q + 1e-5 * direction) - value(q - 1e-5 * direction)) / 2e-5
        np.testing.assert_allclose(slope, difference, rtol=1e-4)


@pytest.mark.parametrize("q", [np.zeros(9), np.zeros((1, 9)), np.zeros((3, 9), int)])
def test_what_is_no_srvf_is_refused(q):
    with pytest.raises(ValueError, match="q has shape"):
        project_closed(q)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_tangents_are_orthogonal_to_the_normal_space_and_stay(d):
    with x64():
        q = project_closed(open_field(5, d=d, dtype=np.float64))
        v = jnp.asarray(fourier(7, n=32, d=d))
        tangent = preshape.project_tangent(q, v)
        assert abs(float(preshape.inner(tangent, q))) < 1e-12
        assert float(jnp.abs(preshape.normal_parts(q, tangent)).max()) < 1e-12
        np.testing.assert_allclose(preshape.project_tangent(q, tangent), tangent, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_normals_are_the_gradients_of_the_closure(d):
    with x64():
        q, v = (jnp.asarray(open_field(s, d=d, dtype=np.float64)) for s in (6, 7))
        x = jnp.asarray(np.random.default_rng(8).normal(size=d))
        closure, back = jax.vjp(preshape.closure, q)
        assert closure.shape == (d,)
        np.testing.assert_allclose(preshape.normal(q, x), back(x)[0] * q.shape[-1], atol=1e-12)
        np.testing.assert_allclose(preshape.normal_parts(q, v), jax.jvp(preshape.closure, (q,), (v,))[1], atol=1e-12)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_closing_is_all_but_the_nearest_point(d):
    with x64():
        q = jnp.asarray(open_field(9, d=d, dtype=np.float64, size=0.02))
        found = preshape.close(q, 6)
        assert float(jnp.abs(preshape.closure(found)).max()) < 1e-14
        moved = preshape.sphere_distance(found, preshape.unit(q))
        np.testing.assert_allclose(preshape.sphere_distance(found, project_closed(q)), 0, atol=0.05 * float(moved))


def closed_pair(seed, n=32, d=3):
    return (project_closed(to_srvf(fourier(s, n=n, d=d))) for s in (seed, seed + 1))


def test_exp_of_log_comes_back_with_the_square_of_the_steps():
    with x64():
        q1, q2 = closed_pair(10)
        missed = [
            float(preshape.sphere_distance(exp_map(q1, log_map(q1, q2, steps), steps), q2)) for steps in (8, 16, 32)
        ]
        assert missed[2] < 2e-3
        assert missed[0] / missed[1] > 3.5
        assert missed[1] / missed[2] > 3.5


def test_exp_stays_on_the_manifold_and_at_its_speed():
    with x64():
        q1, q2 = closed_pair(12)
        v = 0.7 * preshape.unit(log_map(q1, q2))
        points = jnp.stack([q1, *(exp_map(q1, v * k / 20, 80) for k in range(1, 21))])
        assert float(jnp.abs(preshape.closure(points)).max()) < 1e-12
        np.testing.assert_allclose(jnp.sum(preshape.sphere_distance(points[1:], points[:-1])), 0.7, rtol=2e-3)
        np.testing.assert_allclose(exp_map(q1, 0 * v), q1, atol=1e-12)


def test_log_has_the_length_of_the_geodesic_and_is_tangent():
    with x64():
        q1, q2 = closed_pair(14)
        v = log_map(q1, q2, 24)
        np.testing.assert_allclose(preshape.normal_parts(q1, v), 0, atol=1e-12)
        path = geodesics.straighten(geodesics.joined(q1, q2, 24))
        np.testing.assert_allclose(preshape.inner(v, v) ** 0.5, path.length, rtol=1e-12)


def test_transport_keeps_inner_products_and_the_velocity_of_a_geodesic():
    """With the square of the steps; and there and back is no way at all."""
    with x64():
        q1, q2 = closed_pair(16)
        drawn = jnp.stack([jnp.asarray(fourier(s, n=32)) for s in (18, 19)])
        fields = preshape.project_tangent(jnp.broadcast_to(q1, drawn.shape), drawn)
        before = preshape.inner(*fields)
        errors = []
        for steps in (8, 32):
            path = geodesics.straighten(geodesics.joined(q1, q2, steps)).path
            carried = parallel_transport(path, fields)
            np.testing.assert_allclose(
                preshape.normal_parts(jnp.broadcast_to(q2, carried.shape), carried), 0, atol=1e-10
            )
            np.testing.assert_allclose(preshape.inner(jnp.broadcast_to(q2, carried.shape), carried), 0, atol=1e-10)
            errors.append(abs(float(preshape.inner(*carried) - before)))
            arrived = parallel_transport(path, log_map(q1, q2, steps))
            np.testing.assert_allclose(arrived, -log_map(q2, q1, steps), atol=20 / steps**2)
            back = parallel_transport(path[::-1], carried)
            np.testing.assert_allclose(back, fields, atol=20 / steps**2)
        assert errors[1] < max(errors[0] / 8, 1e-8)


@pytest.mark.parametrize("call", [lambda q: exp_map(q, q, 0), lambda q: log_map(q, q, -1)])
def test_steps_below_one_are_refused(call):
    with pytest.raises(ValueError, match="a geodesic has 1 step or more"):
        call(np.asarray(to_srvf(fourier(0, n=32))))


def test_what_is_no_path_is_refused():
    q = np.asarray(to_srvf(fourier(0, n=32)))
    with pytest.raises(ValueError, match="path has shape"):
        parallel_transport(q, q)


def test_great_circles_join_their_ends_at_even_speed():
    q1, q2 = (to_srvf(fourier(s, 2, n=32)) for s in (0, 1))
    path = preshape.great_circle(q1, q2, 5)
    assert path.shape == (2, 6, 3, 32)
    np.testing.assert_allclose(path[:, 0], q1, atol=1e-5)
    np.testing.assert_allclose(path[:, -1], q2, atol=1e-5)
    np.testing.assert_allclose(preshape.inner(path, path), 1, atol=1e-5)
    expected = np.arccos(np.asarray(preshape.inner(q1, q2)))
    steps = preshape.sphere_distance(path[:, 1:], path[:, :-1])
    np.testing.assert_allclose(steps, np.broadcast_to(expected[:, None] / 5, (2, 5)), atol=1e-5)


def test_a_great_circle_from_a_point_to_itself_stays():
    q = to_srvf(fourier(0, n=32))
    np.testing.assert_allclose(preshape.great_circle(q, q, 3), jnp.broadcast_to(q, (4, 3, 32)), atol=1e-6)


def test_sphere_distance_is_precise_and_flat_at_zero():
    with x64():
        q = to_srvf(fourier(0, n=32))
        tangent = preshape.unit(preshape.project_tangent(q, jnp.asarray(fourier(1, n=32))))
        for angle in (1e-9, 1e-3, 1.0, 3.0):
            other = jnp.cos(angle) * q + jnp.sin(angle) * tangent
            np.testing.assert_allclose(preshape.sphere_distance(q, other), angle, rtol=1e-6)
        np.testing.assert_array_equal(jax.grad(lambda p: preshape.sphere_distance(p, q))(q), 0)
