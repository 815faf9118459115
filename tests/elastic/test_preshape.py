"""The manifold of closed SRVFs: projection, tangent space, great circles."""

import contextlib

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

# Each is compiled on its own.
DIMENSIONS = [pytest.param(2, marks=pytest.mark.slow), 3, pytest.param(4, marks=pytest.mark.slow)]


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


@pytest.mark.parametrize("d", DIMENSIONS)
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


def far_fields(d, n=48):
    """Fields of all kinds, most of them far from closed: arcs of circles, noise, waves, and fields of great mean."""
    random, t = np.random.default_rng(d), np.arange(n) / n
    arcs = np.zeros((60, d, n))
    angle = np.linspace(0.2, 2 * np.pi, 60)[:, None] * t
    arcs[:, 0], arcs[:, 1] = np.cos(angle), np.sin(angle)
    closed = np.asarray(to_srvf(fourier(d, 60, n=n, d=d)))
    opened = closed + random.normal(size=(60, d, 1)) * random.uniform(0, 2.5, size=(60, 1, 1))
    k = np.arange(5)[:, None]
    cos, sin = random.normal(size=(2, 60, d, 5))
    cos[30:, :, 0] *= 5
    waves = cos @ np.cos(2 * np.pi * k * t) + sin @ np.sin(2 * np.pi * k * t)
    there_and_back = np.zeros((4, d, n))
    there_and_back[:, 0] = np.sin(2 * np.pi * t) + np.array([[0], [0.1], [0.5], [0.9]])
    return np.concatenate([arcs, opened, waves, random.normal(size=(60, d, n)), there_and_back])


@pytest.mark.parametrize("double", [False, True], ids=["float32", "float64"])
@pytest.mark.parametrize("d", DIMENSIONS)
def test_fields_of_all_kinds_are_closed(d, double):
    with x64() if double else contextlib.nullcontext():
        q = far_fields(d).astype(float if double else np.float32)
        found = np.asarray(project_closed(q), float)
        ends = np.mean(found * np.linalg.norm(found, axis=1, keepdims=True), axis=-1)
        assert np.abs(ends).max() < (1e-12 if double else 1e-6)
        np.testing.assert_allclose(np.mean(np.sum(found**2, axis=1), axis=-1), 1, atol=1e-5)
        moved = np.asarray(preshape.sphere_distance(jnp.asarray(found, q.dtype), preshape.unit(jnp.asarray(q))))
        assert moved.max() < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("double", [False, True], ids=["float32", "float64"])
def test_the_gradient_of_projection_is_finite_for_fields_of_all_kinds(double):
    with x64() if double else contextlib.nullcontext():
        q = jnp.asarray(far_fields(3).astype(float if double else np.float32))
        assert jnp.isfinite(jax.jit(jax.grad(lambda q: jnp.sum(project_closed(q) ** 3)))(q)).all()


def test_no_closed_field_is_nearer_where_the_dual_says_so():
    """Against Newton steps along the normals, and against closed fields around what was found."""
    with x64():
        q = preshape.unit(jnp.asarray(far_fields(3)))
        regular = np.asarray(jax.vmap(preshape._multiplier)(q)[1])
        assert 0.4 < regular.mean() < 0.95
        q = q[regular]
        here = preshape.sphere_distance(project_closed(q), q)
        others = preshape._close_gently(q, 60)
        assert (preshape.sphere_distance(others, q) > here - 1e-9).all()
        noise = jnp.asarray(np.random.default_rng(0).normal(size=q.shape))
        for size in (0.01, 0.1):
            around = preshape._close_gently(project_closed(q) + size * noise, 60)
            assert (preshape.sphere_distance(around, q) > here - 1e-9).all()


def test_the_equation_of_each_sample_is_solved_for_all_multipliers():
    with x64():
        random = np.random.default_rng(1)
        q = jnp.asarray(random.normal(size=(3, 2000)))
        for size in (0.0, 0.1, 0.3, 0.45, 0.48):
            x = jnp.asarray(random.normal(size=3))
            x = x * size / jnp.linalg.norm(x)
            p, value = preshape._moved(q, x)
            np.testing.assert_allclose(p + preshape.normal(p, x), q, atol=1e-10)
            merit = lambda p: preshape.inner(q, p) - preshape.inner(p, p) / 2 - preshape.closure(p) @ x  # noqa: B023, E731
            np.testing.assert_allclose(merit(p), value, rtol=1e-10)
            for _ in range(20):
                assert merit(p + random.normal() * jnp.asarray(random.normal(size=q.shape))) < value


@pytest.mark.parametrize("size", [1e-30, 1e-20, 1e19, 1e30])
def test_projection_is_blind_to_size(size):
    q = open_field(3, size=0.2)
    np.testing.assert_allclose(project_closed(q * np.float32(size)), project_closed(q), atol=1e-5)


def straight_fields(n=32):
    line = np.array([0.6, 0.0, 0.8])[:, None]
    wave = np.sin(2 * np.pi * np.arange(n) / n)
    return {"zero": 0 * line * wave, "even": line + 0 * wave, "uneven": line * (1.5 + wave), "back": -line * (2 + wave)}


def test_what_cannot_be_closed_is_refused_and_traced_stays_without_nan():
    lines = [one.astype(np.float32) for one in straight_fields().values()]
    good = open_field(0)
    for line in lines:
        words = r"^q cannot be closed in field 1 of 2: it is zero, or all but a straight line"
        with pytest.raises(ValueError, match=words):
            project_closed(np.stack([good, line]))
    q = np.stack([good, *lines])

    def cubed(q):
        closed = project_closed(q)
        return jnp.sum(closed**3), closed

    slope, found = jax.jit(jax.grad(cubed, has_aux=True))(q)
    np.testing.assert_allclose(found[0], project_closed(good), atol=1e-6)
    np.testing.assert_allclose(found[1:], preshape.unit(jnp.asarray(lines)), atol=1e-6)
    assert jnp.isfinite(slope).all()


def test_a_field_of_nan_is_refused():
    with pytest.raises(ValueError, match=r"^q holds NaN or infinity"):
        project_closed(open_field(0) * np.nan)


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
        value = lambda q: jnp.sum(project_closed(q) * weight)  # noqa: E731
        along = jax.jit(lambda q: jax.jvp(value, (q,), (direction,)))
        slope = along(q)[1]
        np.testing.assert_allclose(jnp.sum(jax.jit(jax.grad(value))(q) * direction), slope, rtol=1e-8)
        ahead, behind = (along(q + h * direction)[0] for h in (1e-5, -1e-5))
        np.testing.assert_allclose(slope, (ahead - behind) / 2e-5, rtol=1e-4)


@pytest.mark.slow
def test_the_gradient_where_closed_gently_and_second_derivatives_by_finite_differences():
    with x64():
        fields = jnp.asarray(far_fields(3)[[10, 45, 70, 130, 200]])
        weight, direction = (jnp.asarray(fourier(s, n=48)) for s in (5, 6))
        value = jax.jit(lambda q: jnp.sum(project_closed(q) * weight[None], axis=(-2, -1)))
        along = jax.jit(lambda q: jax.jvp(value, (q,), (jnp.broadcast_to(direction, q.shape),)))
        slope = along(fields)[1]
        ahead, behind = (along(fields + h * direction[None]) for h in (1e-6, -1e-6))
        np.testing.assert_allclose(slope, (ahead[0] - behind[0]) / 2e-6, rtol=1e-4, atol=1e-6)
        twice = jax.jvp(lambda q: along(q)[1], (fields,), (jnp.broadcast_to(direction, fields.shape),))[1]
        np.testing.assert_allclose(twice, (ahead[1] - behind[1]) / 2e-6, rtol=1e-3, atol=1e-4)


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


@pytest.mark.parametrize("d", DIMENSIONS)
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
        few, many = (
            float(preshape.sphere_distance(exp_map(q1, log_map(q1, q2, steps), steps), q2)) for steps in (8, 32)
        )
        assert many < 2e-3
        assert few / many > 3.5**2


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
        v = log_map(q1, q2, 32)
        np.testing.assert_allclose(preshape.normal_parts(q1, v), 0, atol=1e-12)
        path = geodesics.straighten(geodesics.joined(q1, q2, 32))
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
