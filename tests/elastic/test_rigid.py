"""Rigid alignment: the best of all shifts, each with its best rotation."""

import dataclasses

import numpy as np
import pytest
from elastic.aligners import RIGID
from elastic.shapes import certified, fourier, kabsch, rotation

from curvematch_jax.elastic import Aligner, Rigid, align, pair_distances, to_srvf

N = 100


def by_scan(one, other):
    """The least angle over all shifts of the arc-length samples, each with the rotation of Kabsch."""
    t1, t2 = (t / np.linalg.norm(t, axis=0) for t in (np.asarray(to_srvf(c), float) for c in (one, other)))
    gains = []
    for s in range(t1.shape[1]):
        c = t1 @ np.roll(t2, -s, axis=1).T / t1.shape[1]
        gains.append(np.sum(kabsch(c) * c))
    return np.arccos(max(gains))


@pytest.mark.parametrize("d", [2, 3, 4])
def test_rigid_alignment_is_the_best_of_all_shifts(d):
    curves, others = (fourier(s, 8, n=N, d=d, modes=2).astype(np.float32) for s in (0, 1))
    found = align(curves, others, RIGID)
    expected = [by_scan(*pair) for pair in zip(curves, others, strict=True)]
    np.testing.assert_allclose(found.distance, expected, atol=0.01)
    np.testing.assert_allclose(np.linalg.det(found.rotation), 1, atol=1e-5)
    plain = [certified(c, o, *x) for c, o, x in zip(curves, others, zip(*found[:3], strict=True), strict=True)]
    np.testing.assert_allclose(found.distance, plain, atol=2e-3)


def test_both_curves_go_by_arc_length():
    """Those that are sampled by it keep their parameters, but for the start."""
    found = align(*(fourier(s, 8, n=N, modes=2).astype(np.float32) for s in (0, 1)), RIGID)
    for warp in (found.warp1, found.warp2):
        even = np.asarray(warp) - np.asarray(warp)[:, :1] - np.linspace(0, 1, warp.shape[1])
        np.testing.assert_allclose(even, 0, atol=0.01)


def test_the_rotation_lays_the_second_curve_onto_the_first():
    curves, turn = fourier(0, 8, n=N, modes=2).astype(np.float32), rotation(5)
    copies = np.einsum("ij,bjn->bin", turn, curves).astype(np.float32)
    found = align(curves, copies, RIGID)
    np.testing.assert_allclose(found.rotation, np.broadcast_to(turn.T, (8, 3, 3)), atol=5e-3)
    shifted = align(curves, np.roll(curves, -25, axis=-1), RIGID)
    start = (np.asarray(shifted.warp2 - shifted.warp1)[:, 0] + 0.25 + 0.5) % 1 - 0.5
    np.testing.assert_allclose(start, 0, atol=5e-3)


def test_estimates_are_near_what_is_measured():
    """Of smooth curves; they are symmetric, and 0 for a curve and itself."""
    curves, pairs = fourier(0, 9, n=N, modes=2).astype(np.float32), np.argwhere(np.ones((9, 9), bool))
    estimate = Rigid(chunk=8, measured=False)
    found, measured = (pair_distances(curves, curves, pairs, a).reshape(9, 9) for a in (estimate, RIGID))
    np.testing.assert_allclose(found, measured, atol=0.02)
    np.testing.assert_allclose(found, found.T, atol=1e-6)
    np.testing.assert_allclose(np.diag(found), 0, atol=1e-3)


def test_what_only_estimates_does_not_align():
    curves = fourier(0, 2, n=N).astype(np.float32)
    with pytest.raises(ValueError, match=r"estimates distances only: use Rigid\(\) to align"):
        align(curves, curves, Rigid(measured=False))


@pytest.mark.parametrize(("name", "value"), [("grid", 4), ("chunk", 0)])
def test_settings_below_the_least_are_refused(name, value):
    with pytest.raises(ValueError, match=f"Rigid.{name} = {value}"):
        Rigid(**{name: value})


def test_a_grid_has_to_divide_the_tables():
    curves = fourier(0, 2, n=N).astype(np.float32)
    with pytest.raises(ValueError, match=r"Rigid.grid = 60: it has to divide"):
        align(curves, curves, Rigid(grid=60))


def test_the_preset_is_the_default():
    assert Aligner.rigid() == Rigid()
    assert not Rigid.warps
    assert hash(Rigid()) == hash(dataclasses.replace(Rigid(grid=32), grid=64))
