"""Refinement: its chord, its equations and its steps against definitions, finite differences and copies."""

import functools as ft

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import fourier, kabsch, lift, paths, rotation, x64

from curvematch_jax.elastic import _refine as refinement
from curvematch_jax.elastic._rotation import cayley
from curvematch_jax.elastic._tables import tabulate

KNOTS, LANES = 32, 2
FEW_AND_MANY = 2, 6  # steps: each number is compiled once
state_of = jax.jit(lambda first, second, u, turn: refinement._state(first, second, None, u, turn))
refine = jax.jit(refinement.refine, static_argnames="steps")
warps_of = jax.jit(refinement.warps_of)


@ft.cache
def pair(d=3, dtype=np.float64, decay=1.0):
    """Tables of two batches of smooth curves: entries so dense that what is linear between them is smooth."""
    return tuple(tabulate(jnp.asarray(fourier(s, LANES, n=200, d=d, modes=2, decay=decay), dtype)) for s in (0, 1))


def somewhere(seed, d=3, dtype=np.float64, steep=0.6):
    turns = np.stack([rotation(seed + k, d) for k in range(LANES)], axis=-1)
    return jnp.asarray(paths(seed, LANES, KNOTS, steep), dtype), jnp.asarray(turns, dtype)


def residual_of(first, second, u, turn):
    time = jnp.arange(KNOTS, dtype=u.dtype)[None] / KNOTS
    at2 = refinement._turned(refinement._sampled(second, time + u), turn)
    return refinement._vectors(refinement._sampled(first, time - u), at2)[0]


def carried(table, warp):
    """What each piece of a warp carries, from the integral of the table's entries, curve by curve: `(l, d, m)`."""
    count = int(table.count[0])
    fields = []
    for srvf, way in zip(np.asarray(table.srvf)[..., :count], np.asarray(warp), strict=True):
        several = np.concatenate([srvf, srvf, srvf, srvf[:, :1]], axis=1)
        steps = (several[:, 1:] + several[:, :-1]) / (2 * count)
        sums = np.concatenate([np.zeros((len(srvf), 1)), np.cumsum(steps, axis=1)], axis=1)
        place = np.arange(3 * count + 1) / count - 1
        integral = np.stack([np.interp(way, place, row) for row in sums])
        fields.append(np.diff(integral, axis=1) / np.sqrt(np.diff(way) / KNOTS))
    return np.stack(fields)


def chord_of(first, second, u, turn):
    """The squared chord between the unit fields of means over pieces."""
    warp1, warp2 = (np.asarray(warp) for warp in warps_of(first, second, u))
    v1, v2 = carried(first, warp1), np.einsum("ijl,ljm->lim", np.asarray(turn), carried(second, warp2))
    inner = lambda a, b: np.mean(np.sum(a * b, axis=1), axis=1)  # noqa: E731
    return 2 - 2 * inner(v1, v2) / np.sqrt(inner(v1, v1) * inner(v2, v2))


def steepness(u):
    return np.abs(np.roll(u, -1, axis=1) - u).max() * u.shape[1]


@pytest.mark.parametrize("d", [2, 3, 4])
def test_the_chord_is_that_between_means_over_pieces(d):
    with x64():
        u, turn = somewhere(2, d)
        np.testing.assert_allclose(state_of(*pair(d), u, turn).chord, chord_of(*pair(d), u, turn), rtol=1e-9)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_the_gradient_is_that_of_the_residual_by_finite_differences(d):
    """In the path, and in the rotation: of half of the mean square residual."""
    with x64():
        u, turn = somewhere(3, d)
        first, second = pair(d)

        here, size = state_of(first, second, u, turn), 1e-6

        @jax.jit
        def half(u, turn):
            residual = residual_of(first, second, u, turn)
            return jnp.mean(jnp.sum(residual**2, axis=0), axis=-1) / 2

        direction = jnp.asarray(np.random.default_rng(0).normal(size=u.shape)) / KNOTS
        ahead, behind = (half(u + s * size * direction, turn) for s in (1, -1))
        np.testing.assert_allclose(
            jnp.sum(here.gradient * direction, axis=1), (ahead - behind) / 2 / size, rtol=1e-4, atol=1e-7
        )
        axis = jnp.asarray(np.random.default_rng(1).normal(size=here.turning.shape))
        sides = (jnp.einsum("ijl,jkl->ikl", cayley(s * size * axis, d), turn) for s in (1, -1))
        ahead, behind = (half(u, side) for side in sides)
        np.testing.assert_allclose(
            -jnp.sum(here.turning * axis, axis=0), (ahead - behind) / 2 / size, rtol=1e-5, atol=1e-8
        )


def test_the_matrix_is_gauss_newtons_by_autodiff():
    """Of the residual in path and rotation: cyclic tridiagonal, its border, its corner; nothing else."""
    with x64():
        u, turn = somewhere(4)
        first, second = (jax.tree.map(lambda x: x[:1], table) for table in pair())
        here = state_of(first, second, u[:1], turn[..., :1])
        g = len(here.turning)

        def residual(unknowns):
            moved = jnp.einsum("ijl,jkl->ikl", cayley(unknowns[KNOTS:, None], 3), turn[..., :1])
            return residual_of(first, second, unknowns[None, :KNOTS], moved).ravel()

        jacobian = np.asarray(jax.jit(jax.jacfwd(residual))(jnp.concatenate([u[0], jnp.zeros(g)])))
        dense = jacobian.T @ jacobian / KNOTS
        k, size = np.arange(KNOTS), np.abs(dense).max()
        np.testing.assert_allclose(here.diagonal[0], np.diag(dense)[:KNOTS], rtol=1e-6)
        np.testing.assert_allclose(here.beside[0], dense[k, (k + 1) % KNOTS], atol=1e-6 * size)
        np.testing.assert_allclose(-here.border[:, 0], dense[KNOTS:, :KNOTS], atol=1e-6 * size)
        np.testing.assert_allclose(here.corner[..., 0], dense[KNOTS:, KNOTS:], atol=1e-6 * size)
        path = dense[:KNOTS, :KNOTS].copy()
        path[k, k] = path[k, (k + 1) % KNOTS] = path[(k + 1) % KNOTS, k] = 0
        np.testing.assert_allclose(path, 0, atol=1e-9 * size)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("steep", [0.2, 0.97])
def test_refinement_never_makes_a_path_worse_and_keeps_both_curves_moving(dtype, steep):
    with x64():
        u, turn = somewhere(5, dtype=dtype, steep=steep)
        tables, before = pair(dtype=dtype), np.asarray(state_of(*pair(dtype=dtype), u, turn).chord)
        last = before
        for steps in FEW_AND_MANY:
            found = refine(*tables, u, turn, steps, None)
            assert found.u.dtype == dtype
            np.testing.assert_allclose(found.chord, state_of(*tables, found.u, found.rotation).chord, rtol=1e-3)
            assert (np.asarray(found.chord) <= last * (1 + 1e-5)).all()
            assert steepness(np.asarray(found.u)) < 1
            turns = np.moveaxis(np.asarray(found.rotation), -1, 0)
            np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-5)
            last = np.asarray(found.chord)
        assert (last < before).all()


@pytest.mark.parametrize("d", [pytest.param(2, marks=pytest.mark.slow), 3, pytest.param(4, marks=pytest.mark.slow)])
def test_steps_converge_quadratically_on_a_moved_copy(d):
    """The same gentle curve, turned, and warped by a path that the knots can hold: the residual falls to nothing.

    A linear method that gains ten to a step would leave a millionth of the chord after six.
    """
    with x64():
        table = pair(d, decay=3.0)[0]
        spin = jnp.asarray(rotation(6, d))
        spun = (jnp.einsum("ij,bjk->bik", spin, field) for field in (table.srvf, table.sums))
        copy = table._replace(**dict(zip(("srvf", "sums"), spun, strict=True)))
        turn = jnp.broadcast_to(spin.T[..., None], (d, d, LANES))
        bump = 2e-3 * np.sin(2 * np.pi * np.arange(KNOTS)[None] / KNOTS + np.arange(LANES)[:, None])
        tilt = jnp.full((d * (d - 1) // 2, LANES), 0.02)
        start = jnp.asarray(bump), jnp.einsum("ijl,jkl->ikl", cayley(tilt, d), turn)
        before = np.sqrt(state_of(table, copy, *start).chord)
        two, six = (np.sqrt(refine(table, copy, *start, k, None).chord) for k in FEW_AND_MANY)
        assert (before > 1e-2).all()
        assert (two < 0.05 * before).all()
        assert (six < 1e-8).all()


def test_the_rotation_is_found_with_the_path():
    """At the end no other rotation is better: that of Kabsch is the one found."""
    with x64():
        u, turn = somewhere(7, steep=0.2)
        first, second = pair()
        start = state_of(first, second, u, turn)
        found = start
        for _ in range(5):
            found = refine(first, second, found.u, found.rotation, FEW_AND_MANY[1], None)
        assert (found.chord < start.chord).all()
        fields = (carried(table, warp) for table, warp in zip(pair(), warps_of(*pair(), found.u), strict=True))
        for lane, (field1, field2) in enumerate(zip(*fields, strict=True)):
            overlap = field1 @ field2.T / KNOTS
            assert np.sum((kabsch(overlap) - np.asarray(found.rotation)[..., lane]) * overlap) < 3e-3


def test_a_copy_stays_where_it_is():
    for dtype, atol in ((np.float32, 1e-4), (np.float64, 1e-9)):
        with x64():
            table = pair(dtype=dtype)[0]
            one = jnp.broadcast_to(jnp.eye(3, dtype=dtype)[..., None], (3, 3, LANES))
            found = refine(table, table, jnp.zeros((LANES, KNOTS), dtype), one, 2, None)
            np.testing.assert_allclose(found.u, 0, atol=atol)
            np.testing.assert_allclose(found.chord, 0, atol=atol**2)


def test_kept_apart_or_not_the_steps_are_the_same():
    u, turn = somewhere(9, dtype=np.float32)
    tables = pair(dtype=np.float32)
    plain, apart = (refine(*tables, u, turn, 2, true) for true in (None, tables[0].count[0] > 0))
    np.testing.assert_allclose(plain.u, apart.u, atol=1e-4)
    np.testing.assert_allclose(plain.chord, apart.chord, rtol=1e-3)


def test_warps_become_paths_and_come_back():
    """Through arc lengths: `gamma2` as a function of `gamma1` is the same."""
    time = np.arange(KNOTS + 1) / KNOTS
    u = paths(10, LANES, KNOTS)
    u = u - np.mean(u, axis=1, keepdims=True)
    closed = np.concatenate([u, u[:, :1]], axis=1)
    with x64():
        warps = jnp.asarray(time - closed + 0.3), jnp.asarray(time + closed + 0.3)
        found = refinement.from_warps(*warps, KNOTS)
        np.testing.assert_allclose(refinement.from_warps(warps[0], warps[1] + 2, KNOTS), found, atol=1e-12)
    for lane in range(LANES):
        expected = np.interp((np.arange(KNOTS) / KNOTS - 0.3) % 1, time, closed[lane])
        np.testing.assert_allclose(found[lane], expected, atol=1e-12)


def test_the_path_is_given_in_the_curves_own_parameters():
    with x64():
        first, second = pair()
        u, _ = somewhere(11)
        for warp, table, sign in zip(warps_of(first, second, u), pair(), (-1, 1), strict=True):
            assert warp.shape == (LANES, KNOTS + 1)
            assert np.diff(warp).min() > 0
            np.testing.assert_allclose(warp[:, -1], warp[:, 0] + 1, atol=1e-12)
            grid = np.linspace(0, 1, table.times.shape[1])
            for lane in range(LANES):
                expected = lift(
                    np.arange(KNOTS) / KNOTS + sign * np.asarray(u[lane]), grid, np.asarray(table.times[lane])
                )
                np.testing.assert_allclose(warp[lane, :-1], expected, atol=1e-12)
