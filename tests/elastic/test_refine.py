"""Refinement: its chord, its equations and its solver against autodiff, finite differences and dense algebra."""

import functools as ft

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import kabsch, paths, unit_tangents, x64
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import _refine as refinement
from curvematch_jax.elastic._table import pack

KNOTS, NODES, LANES, T = 24, 2, 4, 480
state = jax.jit(refinement._state, static_argnames="nodes")
rotation_of = jax.jit(refinement.rotation_of, static_argnames="nodes")
refine = jax.jit(refinement.refine, static_argnames=("steps", "nodes"))


def tangents(d=3, t=T):
    """Unit tangents at equal arc lengths of two batches of smooth curves, in numpy."""
    return tuple(unit_tangents(s, LANES, t, d) for s in (0, 1))


def packed(d=3, t=T, dtype=np.float64):
    return tuple(pack(jnp.asarray(x, dtype)) for x in tangents(d, t))


def at(table, x):
    """Linear interpolation of `(d, t)` at `(k,)`, in jax.numpy for autodiff."""
    nodes = jnp.arange(table.shape[1] + 1, dtype=x.dtype) / table.shape[1]
    return jnp.stack([jnp.interp(x % 1, nodes, jnp.append(row, row[0])) for row in table])


def fields(t1, t2, u):
    """`q1(gamma1) sqrt(gamma1')` and `q2(gamma2) sqrt(gamma2')`, `(d, knots nodes)` each, of one lane."""
    knots = u.shape[0]
    share = (jnp.arange(NODES, dtype=u.dtype) + 0.5) / NODES
    rise = jnp.roll(u, -1) - u
    middle = (u[:, None] + share[None] * rise[:, None]).ravel()
    time = ((jnp.arange(knots, dtype=u.dtype)[:, None] + share[None]) / knots).ravel()
    slope = jnp.repeat(rise * knots, NODES)
    q1, q2 = at(t1, time - middle), at(t2, time + middle)
    return q1 * jnp.sqrt(1 - slope)[None], q2 * jnp.sqrt(1 + slope)[None]


def best_cosine(t1, t2, u):
    """`<q1, R q2>` with the best rotation, of one lane, and R."""
    c = np.matmul(*(np.asarray(q) if k == 0 else np.asarray(q).T for k, q in enumerate(fields(t1, t2, u))))
    c /= KNOTS * NODES
    turn = kabsch(c)
    return np.sum(turn * c), turn


def lanes_of(d=3):
    return [[jnp.asarray(t[..., lane]) for t in tangents(d)] for lane in range(LANES)]


def steepness(u):
    return np.abs(np.roll(u, -1, axis=0) - u) * len(u)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_the_chord_is_the_one_at_the_best_rotation(d):
    """`1 - chord^2 / 2` is the cosine, but for tangents between those in the table, which are a little short."""
    with x64():
        u = jnp.asarray(paths(2, LANES, KNOTS))
        here, rotation = state(*packed(d), u, nodes=NODES), rotation_of(*packed(d), u, nodes=NODES)
        for lane, tables in enumerate(lanes_of(d)):
            cosine, turn = best_cosine(*tables, u[:, lane])
            q1, q2 = (np.asarray(q) for q in fields(*tables, u[:, lane]))
            short = 2 - np.sum(q1**2 + q2**2) / (KNOTS * NODES)
            np.testing.assert_allclose(rotation[..., lane], turn, atol=1e-6)
            np.testing.assert_allclose(1 - here.chord[lane] / 2, cosine, atol=short + 1e-8)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_the_gradient_is_that_of_the_cosine_by_finite_differences(d):
    """Rotation included: at the best one its own derivative plays no part."""
    with x64():
        u = jnp.asarray(paths(3, LANES, KNOTS))
        gradient = np.asarray(state(*packed(d), u, nodes=NODES).gradient)
        for lane, tables in enumerate(lanes_of(d)):
            direction = np.random.default_rng(lane).normal(size=KNOTS)
            ahead, behind = (best_cosine(*tables, u[:, lane] + s * direction)[0] for s in (1e-7, -1e-7))
            found = np.sum(gradient[:, lane] * direction)
            np.testing.assert_allclose(found, (ahead - behind) / 2e-7, rtol=1e-4, atol=1e-5)


def test_the_matrix_is_gauss_newtons_by_autodiff():
    """Of the residual at fixed rotation. Tangents between those in a table are a little short: to the third digit."""
    with x64():
        u = jnp.asarray(paths(4, LANES, KNOTS))
        here, rotation = state(*packed(t=16000), u, nodes=NODES), rotation_of(*packed(t=16000), u, nodes=NODES)
        for lane in range(LANES):
            t1, t2 = (jnp.asarray(t[..., lane]) for t in tangents(t=16000))

            def residual(u, turn=rotation[..., lane], t1=t1, t2=t2):
                q1, q2 = fields(t1, t2, u)
                return (q1 - turn @ q2).ravel()

            jacobian = np.asarray(jax.jacfwd(residual)(u[:, lane]))
            dense = jacobian.T @ jacobian / (KNOTS * NODES)
            k = np.arange(KNOTS)
            size = np.abs(dense).max()
            np.testing.assert_allclose(here.diagonal[:, lane], np.diag(dense), rtol=3e-3)
            np.testing.assert_allclose(here.beside[:, lane], dense[k, (k + 1) % KNOTS], atol=2e-3 * size)
            dense[k, k] = dense[k, (k + 1) % KNOTS] = dense[(k + 1) % KNOTS, k] = 0
            np.testing.assert_allclose(dense, 0, atol=1e-12)


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


def test_steps_improve_what_is_near_the_best():
    """A copy, from a small perturbation of the path 0: one step takes half of the loss away, twelve nearly all."""
    with x64():
        table = packed(t=16000)[0]
        u = jnp.asarray(1e-2 * paths(5, LANES, KNOTS))
        loss = [np.asarray(refine(table, table, u, steps=k, nodes=NODES)[1]) / 2 for k in (0, 1, 12)]
    assert (loss[0] > 3e-5).all()
    assert (loss[1] < 0.5 * loss[0]).all()
    assert (loss[2] < 0.03 * loss[0]).all()


@settings(max_examples=10, deadline=None, derandomize=True)
@given(st.integers(0, 100_000), st.floats(0.0, 0.98))
def test_refinement_never_makes_a_path_worse_and_keeps_both_curves_moving(seed, steep):
    tables = packed(dtype=np.float32)
    u = jnp.asarray(paths(seed, LANES, KNOTS, steep), jnp.float32)
    last = np.asarray(state(*tables, u, nodes=NODES).chord)
    for steps in (0, 1, 12):
        found, reached = refine(*tables, u, steps=steps, nodes=NODES)
        np.testing.assert_allclose(reached, state(*tables, found, nodes=NODES).chord, atol=1e-5)
        assert (reached <= last + 1e-6).all()
        assert steepness(np.asarray(found)).max() < 1
        last = np.asarray(reached)


def test_refinement_gains_from_random_paths():
    tables, u = packed(dtype=np.float32), jnp.asarray(paths(6, LANES, KNOTS), jnp.float32)
    before = np.asarray(state(*tables, u, nodes=NODES).chord)
    assert (np.asarray(refine(*tables, u, steps=12, nodes=NODES)[1]) < before - 0.1).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_copy_stays_where_it_is(dtype):
    """From the path 0, whose residual is 0, no step leads away."""
    with x64():
        table = packed(dtype=dtype)[0]
        found, chord = refine(table, table, jnp.zeros((KNOTS, LANES), dtype), steps=4, nodes=NODES)
        np.testing.assert_allclose(found, 0, atol=1e-4 if dtype == np.float32 else 1e-8)
        np.testing.assert_allclose(chord, 0, atol=1e-9)


def test_exchanged_curves_take_mirrored_steps():
    """The path treats both alike: with curves exchanged, u is refined to -u."""
    with x64():
        (one, two), u = packed(), jnp.asarray(paths(7, LANES, KNOTS))
        run = ft.partial(refine, steps=3, nodes=NODES)
        (there, first), (back, second) = run(one, two, u), run(two, one, -u)
        np.testing.assert_allclose(there, -back, atol=1e-7)
        np.testing.assert_allclose(first, second, atol=1e-9)


def test_a_warped_copy_is_laid_back():
    """Refinement alone undoes a smooth warp: of the angle, a twentieth is left."""
    x = np.arange(T) / T
    bent = (x + 0.05 * np.sin(2 * np.pi * x) + 0.02) * T  # a warp of one curve against itself, not by arc length
    original = unit_tangents(3, LANES, T)
    low = np.floor(bent).astype(int)
    moved = original[:, low % T] + (original[:, (low + 1) % T] - original[:, low % T]) * (bent - low)[None, :, None]
    moved /= np.linalg.norm(moved, axis=0)
    tables = [pack(jnp.asarray(t, jnp.float32)) for t in (original, moved)]
    start = jnp.zeros((48, LANES), jnp.float32)
    gap = [np.asarray(refine(*tables, start, steps=k, nodes=NODES)[1]) / 2 for k in (0, 20)]
    best = np.mean(np.sqrt(1 + 0.1 * np.pi * np.cos(2 * np.pi * x)))  # the warp's own cosine: its slope is not 1
    assert (gap[0] > 0.02).all()
    assert (gap[1] < 1 - best + 1e-3).all()
