"""Refinement: its match, its equations and its solver against autodiff, finite differences and dense algebra."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, kabsch, warps, x64

from curvematch_jax.elastic import _refine as refinement
from curvematch_jax.elastic._curve import srvf_of, velocity
from curvematch_jax.elastic._warp import nodes_like

N, NODES, LANES = 20, 3, 4
match, distance, normal_equations = (
    jax.jit(f) for f in (refinement.match, refinement.distance, refinement._normal_equations)
)
refine = jax.jit(refinement.refine, static_argnames="steps")


def problem(dtype=np.float64, d=3, rough=0.4):
    """SRVFs at the quadrature nodes, tables, and random warps, lanes last."""
    fields = [srvf_of(velocity(jnp.asarray(fourier(s, LANES, n=N, d=d), dtype), 2 * NODES * N)) for s in (0, 1)]
    first, second = (jnp.moveaxis(field, 0, -1) for field in fields)
    return first[:, 1::2].reshape(d, N, NODES, LANES), second, jnp.asarray(warps(2, LANES, N, rough), dtype)


def moved_field(table, gamma):
    """`q2(gamma) sqrt(gamma')` at the nodes `(d, n, m)` of one lane, in jax.numpy for autodiff."""
    steps = jnp.diff(gamma)
    share = (jnp.arange(NODES, dtype=gamma.dtype) + 0.5) / NODES
    x = (gamma[:-1, None] + share[None] * steps[:, None]).ravel()
    size = table.shape[1]
    padded = jnp.concatenate([table, table[:, :1]], axis=1)
    nodes = jnp.arange(size + 1, dtype=gamma.dtype) / size
    rows = jnp.stack([jnp.interp(x % 1, nodes, row) for row in padded])
    return rows.reshape(-1, N, NODES) * jnp.sqrt(steps * N)[None, :, None]


def closed(free):
    return jnp.concatenate([free, free[:1] + 1])


@pytest.mark.parametrize("d", [2, 3, 4])
def test_match_is_the_cosine_at_the_best_rotation(d):
    with x64():
        q1, table, gamma = problem(d=d)
        found = match(q1, table, gamma)
        for lane in range(LANES):
            q2 = np.asarray(moved_field(table[..., lane], gamma[:, lane]))
            c = np.einsum("inm,jnm->ij", q1[..., lane], q2) / (N * NODES)
            turn = kabsch(c)
            np.testing.assert_allclose(found.rotation[..., lane], turn, atol=1e-5)
            np.testing.assert_allclose(found.cosine[lane], np.sum(turn * c), atol=1e-9)


def test_distance_is_the_angle_between_the_unit_fields():
    with x64():
        q1, table, gamma = problem()
        here = match(q1, table, gamma)
        found = distance(q1, here)
        for lane in range(LANES):
            q2 = np.asarray(moved_field(table[..., lane], gamma[:, lane]))
            turned = np.einsum("ij,jnm->inm", here.rotation[..., lane], q2)
            first = np.asarray(q1[..., lane])
            cosine = np.sum(first * turned) / np.linalg.norm(first) / np.linalg.norm(turned)
            np.testing.assert_allclose(found[lane], np.arccos(cosine), atol=1e-9)


def test_distance_is_precise_near_zero():
    """In float32 the arc cosine of a rounded cosine would say 0 or 3e-4."""
    _, table, _ = problem(np.float32)
    first = jnp.moveaxis(table, -1, 0)[:, :, 1::2].reshape(LANES, 3, N, NODES)
    same = jnp.moveaxis(first, 0, -1)
    here = match(same, table, nodes_like(jnp.zeros((N + 1, LANES), jnp.float32)))
    assert float(distance(same, here).max()) < 2e-2  # the table is linear between its samples
    tilted = same.at[0].add(1e-4)
    q2 = here._replace(
        rotation=jnp.broadcast_to(jnp.eye(3)[..., None], (3, 3, LANES)), q2=tilted, root=jnp.ones((N, LANES))
    )
    size = np.sqrt(np.mean(np.sum(np.square(same), axis=0), axis=(0, 1)))
    difference = 1e-4 / size
    mean = np.mean(np.asarray(same)[0], axis=(0, 1)) / size
    np.testing.assert_allclose(distance(same, q2), difference * np.sqrt(1 - mean**2), rtol=0.02)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_the_gradient_is_that_of_the_cosine_by_finite_differences(d):
    """Rotation included: at the best one its own derivative plays no part."""
    with x64():
        q1, table, gamma = problem(d=d)
        gradient = normal_equations(q1, match(q1, table, gamma))[0]
        cosine = lambda free: match(q1, table, closed(free)).cosine  # noqa: E731
        for seed in range(3):
            direction = np.random.default_rng(seed).normal(size=(N, 1)) * np.ones(LANES)
            step = 1e-7 * direction
            difference = (cosine(gamma[:-1] + step) - cosine(gamma[:-1] - step)) / 2e-7
            np.testing.assert_allclose(np.sum(gradient * direction, axis=0), difference, rtol=2e-5, atol=2e-6)


def test_the_matrix_is_gauss_newtons_by_autodiff():
    with x64():
        q1, table, gamma = problem()
        _, diagonal, beside = normal_equations(q1, match(q1, table, gamma))
        for lane in range(LANES):
            field = lambda free, lane=lane: moved_field(table[..., lane], closed(free))  # noqa: E731
            jacobian = np.asarray(jax.jacfwd(field)(gamma[:-1, lane])).reshape(-1, N)
            dense = jacobian.T @ jacobian / (N * NODES)
            np.testing.assert_allclose(diagonal[:, lane], np.diag(dense), rtol=1e-8)
            k = np.arange(N)
            np.testing.assert_allclose(beside[:, lane], dense[k, (k + 1) % N], rtol=1e-7, atol=1e-9)
            far = dense.copy()
            far[k, k] = far[k, (k + 1) % N] = far[(k + 1) % N, k] = 0
            np.testing.assert_allclose(far, 0, atol=1e-12)


@pytest.mark.parametrize("n", [3, 16, 101])
def test_cyclic_systems_are_solved_as_dense_ones(n):
    generator = np.random.default_rng(n)
    beside = generator.normal(size=(n, 5))
    diagonal = np.abs(beside) + np.abs(np.roll(beside, 1, axis=0)) + generator.uniform(0.1, 1, size=(n, 5))
    right = generator.normal(size=(n, 5))
    with x64():
        found = np.asarray(refinement.solve_cyclic(*(jnp.asarray(x) for x in (diagonal, beside, right))))
    for lane in range(5):
        dense = np.diag(diagonal[:, lane])
        for k in range(n):
            dense[k, (k + 1) % n] += beside[k, lane]
            dense[(k + 1) % n, k] += beside[k, lane]
        np.testing.assert_allclose(found[:, lane], np.linalg.solve(dense, right[:, lane]), rtol=1e-8, atol=1e-10)


def test_refinement_never_makes_a_match_worse_and_keeps_warps_increasing():
    q1, table, gamma = problem(np.float32)
    last = np.asarray(match(q1, table, gamma).cosine)
    first = last
    for steps in (2, 20):
        found, reached = refine(q1, table, gamma, steps=steps)
        cosine = np.asarray(match(q1, table, found).cosine)
        np.testing.assert_allclose(reached, cosine, atol=1e-5)
        assert (cosine >= last - 1e-5).all()
        assert float(jnp.diff(found, axis=0).min()) > 0
        np.testing.assert_allclose(found[-1], found[0] + 1, atol=1e-5)
        last = cosine
    assert (last > first + 0.01).all()


def test_a_warped_copy_is_laid_back():
    """Refinement alone undoes a smooth warp: the distance falls to the resolution of the samples."""
    n, nodes = 64, 2
    curve = jnp.asarray(fourier(3, 2, n=n, modes=2), jnp.float32)
    bent = jnp.asarray(fourier(3, 2, n=n, modes=2, shift=0.02, bend=0.05), jnp.float32)
    first, second = (jnp.moveaxis(srvf_of(velocity(c, 2 * nodes * n)), 0, -1) for c in (curve, bent))
    q1 = first[:, 1::2].reshape(3, n, nodes, 2)
    start = nodes_like(jnp.zeros((n + 1, 2), jnp.float32))
    before = distance(q1, match(q1, second, start))
    found, _ = refine(q1, second, start, steps=30)
    after = distance(q1, match(q1, second, found))
    assert (np.asarray(before) > 0.2).all()
    assert (np.asarray(after) < 0.15 * np.asarray(before)).all()
