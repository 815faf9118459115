"""Alignments: what is forgotten, what is told apart, and that the result certifies its distance."""

import dataclasses

import jax
import numpy as np
import pytest
from elastic.shapes import certified, ellipse, fourier, kabsch, moved, rotation, x64

from curvematch_jax.elastic import Aligner, Stage, align, alignment_distance, distance_matrix, elastic_distance, to_srvf

N = 100
ACCURATE, RIGID = Aligner.accurate(), Aligner.rigid()
LEAN = Aligner(grid=24, seeds=4, slope=2, stages=(Stage(1, 8, 48),), table=24, chunk=8)
MOVE = {"shift": 0.2345, "bend": 0.08}
GENTLE = {"modes": 4, "decay": 3.0}  # curves that their samples hold well: no sharp turns


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 8, n=N).astype(np.float32)


@pytest.fixture(name="others", scope="module")
def fixture_others():
    return fourier(100, 8, n=N).astype(np.float32)


@pytest.fixture(name="found", scope="module")
def fixture_found(curves, others):
    return align(curves, others, ACCURATE)


def true_distance(n, **kind):
    """What the true rotation and the true warp of the moved copies achieve: the error of the samples alone.

    The copy at x is the curve at `h(x) = x + bend sin(2 pi x) + shift`: the warp is the inverse of h.
    """
    x = np.linspace(-2, 3, 100_001)
    gamma = np.interp(np.arange(8 * n + 1) / (8 * n), x + MOVE["bend"] * np.sin(2 * np.pi * x) + MOVE["shift"], x)
    curves, copies = fourier(0, 8, n=n, **kind), moved(fourier(0, 8, n=n, **kind, **MOVE), 1)
    return np.array([certified(*pair, rotation(1).T, gamma) for pair in zip(curves, copies, strict=True)])


def moved_distance(n, preset, **kind):
    """Distances of curves from copies that are rotated, scaled, translated, warped, and started between samples."""
    curves, copies = fourier(0, 8, n=n, **kind), moved(fourier(0, 8, n=n, **kind, **MOVE), 1)
    return np.asarray(align(curves.astype(np.float32), copies.astype(np.float32), preset).distance)


def test_rotations_are_rotations_and_warps_increase_by_one_turn(found):
    assert found.rotation.shape == (8, 3, 3)
    assert found.warp.shape == (8, ACCURATE.fineness * N + 1)
    assert found.distance.shape == (8,)
    product = np.einsum("bij,bkj->bik", found.rotation, found.rotation)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), (8, 3, 3)), atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(found.rotation), 1, atol=1e-5)
    assert np.diff(found.warp).min() >= 0
    np.testing.assert_allclose(found.warp[:, -1], found.warp[:, 0] + 1, atol=1e-6)


def test_the_distance_is_the_one_that_rotation_and_warp_achieve(found, curves, others):
    """Recomputed with sums of waves in numpy, and by `alignment_distance`."""
    plain = [certified(*pair) for pair in zip(curves, others, found.rotation, found.warp, strict=True)]
    np.testing.assert_allclose(alignment_distance(curves, others, found.rotation, found.warp), plain, atol=3e-4)
    error = np.abs(np.asarray(found.distance) - plain)
    assert np.median(error) < 1e-3
    assert error.max() < 3e-3


def test_near_distances_are_achieved_as_well():
    """Of copies of gentle curves: rotation and warp achieve what is said within 1e-3, however small it is."""
    curves = fourier(0, 8, n=N, **GENTLE).astype(np.float32)
    for copies in (moved(curves, 1).astype(np.float32), fourier(0, 8, n=N, **GENTLE, **MOVE).astype(np.float32)):
        found = align(curves, copies, ACCURATE)
        plain = [certified(*pair) for pair in zip(curves, copies, found.rotation, found.warp, strict=True)]
        np.testing.assert_allclose(found.distance, plain, atol=1e-3)


@pytest.mark.xfail(reason="tables of 576 tangents are too coarse for the sharpest turns of copies: off by up to 9e-3")
def test_near_distances_of_curves_with_sharp_turns_are_achieved_as_well(curves):
    copies = moved(fourier(0, 8, n=N, **MOVE), 1).astype(np.float32)
    found = align(curves, copies, ACCURATE)
    plain = [certified(*pair) for pair in zip(curves, copies, found.rotation, found.warp, strict=True)]
    np.testing.assert_allclose(found.distance, plain, atol=1e-3)


@pytest.mark.xfail(reason="where a turn is sharp or a warp races, the tables of 576 tangents are off by up to 3e-3")
def test_every_distance_is_achieved_within_a_thousandth(found, curves, others):
    plain = [certified(*pair) for pair in zip(curves, others, found.rotation, found.warp, strict=True)]
    np.testing.assert_allclose(found.distance, plain, atol=1e-3)


def test_both_orders_give_one_distance_and_both_are_certified(found, curves, others):
    back = align(others, curves, ACCURATE)
    np.testing.assert_array_equal(back.distance, found.distance)
    error = np.abs(np.asarray(back.distance - alignment_distance(others, curves, back.rotation, back.warp)))
    assert np.median(error) < 1e-3
    assert error.max() < 3e-3


def test_both_orders_hold_one_alignment(found, curves, others):
    """The rotations are each other's transpose, and the warps each other's inverse, to a sample of the curves."""
    back = align(others, curves, ACCURATE)
    np.testing.assert_allclose(back.rotation, np.swapaxes(found.rotation, 1, 2), atol=1e-5)
    grid = np.linspace(0, 1, found.warp.shape[1])
    for there, again in zip(np.asarray(found.warp, float), np.asarray(back.warp, float), strict=True):
        turns = np.floor(there)
        round_trip = np.interp(there - turns, grid, again) + turns - grid
        assert np.median(np.abs(round_trip - np.round(round_trip))) < 1 / N


def test_a_copy_is_at_distance_zero(curves):
    """Moved by less than rounding."""
    assert float(align(curves, curves + np.float32(1e-12), ACCURATE).distance.max()) < 1e-3


@pytest.mark.parametrize(("dtype", "most"), [(np.float32, 1e-3), (np.float64, 1e-6)])
def test_a_copy_is_at_distance_zero_after_little_search(dtype, most):
    with x64():
        copies = fourier(0, 8, n=N).astype(dtype)
        found = align(copies, copies + dtype(1e-12), LEAN)
        assert found.distance.dtype == dtype
        assert float(found.distance.max()) < most


def test_a_moved_copy_of_a_gentle_curve_is_near():
    """At most .01 wherever the samples hold the curve to that: seven of eight."""
    floor, distance = true_distance(N, **GENTLE), moved_distance(N, ACCURATE, **GENTLE)
    assert (floor < 0.01).sum() == 7
    assert distance[floor < 0.01].max() < 0.01


def test_a_moved_copy_is_as_near_as_its_samples_say(found):
    """With sharp turns .01 is out of reach: the rotation and warp of the copy achieve .05 where they are sharpest."""
    floor, distance = true_distance(N), moved_distance(N, ACCURATE)
    assert floor.max() > 0.04
    assert (distance < floor + 0.005).all()
    assert (distance < 0.1 * np.asarray(found.distance)).all()


@pytest.mark.parametrize("move", [{}, {"shift": 0.25}, {"shift": 0.137}, {"bend": 0.08}], ids=str)
def test_each_way_to_move_a_gentle_curve_alone(move):
    curves, copies = fourier(0, 7, n=N, **GENTLE), fourier(0, 7, n=N, **GENTLE, **move)
    found = align(curves.astype(np.float32), moved(copies, 2).astype(np.float32), ACCURATE)
    assert float(found.distance.max()) < 0.01


def test_scale_and_position_are_forgotten(found, curves, others):
    np.testing.assert_allclose(align(3 * curves, others + 7, ACCURATE).distance, found.distance, atol=2e-3)
    assert float(align(3 * curves, curves, ACCURATE).distance.max()) < 5e-3


def test_rotation_and_start_point_are_forgotten(found, curves, others):
    """By as much as the search wavers."""
    turned = np.stack([np.roll(moved(c, k, 2.0), 17 * k + 5, axis=-1) for k, c in enumerate(others)])
    error = np.abs(np.asarray(align(curves, turned.astype(np.float32), ACCURATE).distance) - np.asarray(found.distance))
    assert np.median(error) < 2e-3
    assert error.max() < 0.02


def test_repeated_samples_change_nothing(curves, others, found):
    """One sample twice, and a run of twelve equal ones, in place of as many samples elsewhere."""
    short = fourier(0, 8, n=N - 12).astype(np.float32)
    run = np.insert(short, [30] * 12, short[..., 30:31], axis=-1)
    once = fourier(0, 8, n=N - 1).astype(np.float32)
    twice = np.insert(once, [N // 2], once[..., N // 2 : N // 2 + 1], axis=-1)
    for repeated in (twice, run):
        again = align(repeated, others, ACCURATE)
        assert np.diff(again.warp).min() >= 0
        np.testing.assert_allclose(again.distance, found.distance, atol=5e-3)
        assert float(align(repeated, curves, ACCURATE).distance.max()) < 0.05


def test_mirror_images_and_reversed_curves_are_told_apart(curves):
    mirror = curves * np.array([1, 1, -1], np.float32)[:, None]
    assert float(align(curves, mirror, ACCURATE).distance.min()) > 0.1
    assert float(align(curves, curves[..., ::-1], ACCURATE).distance.min()) > 0.1


def test_a_planar_curve_is_its_own_mirror_image_in_space():
    """A half turn does it: the distance is 0 in space, and not in the plane."""
    flat = fourier(3, n=N, d=2).astype(np.float32)
    mirror = flat * np.array([[1], [-1]], np.float32)
    raised = [np.concatenate([c, np.zeros((1, N), np.float32)]) for c in (flat, mirror)]
    assert float(align(*raised, ACCURATE).distance) < 0.006
    assert float(align(flat, mirror, RIGID).distance) > 0.1


def test_callers_arrays_are_never_changed(curves, others):
    doubled = curves.copy()
    doubled[..., 4] = doubled[..., 3]
    kept = doubled.copy(), others.copy()
    elastic_distance(doubled, others, RIGID)
    distance_matrix(doubled, others, RIGID)
    np.testing.assert_array_equal(doubled, kept[0])
    np.testing.assert_array_equal(others, kept[1])


def rigid_by_scan(one, other):
    """The least angle over all shifts of the arc-length samples, each with the rotation of Kabsch."""
    t1, t2 = (t / np.linalg.norm(t, axis=0) for t in (np.asarray(to_srvf(c), float) for c in (one, other)))
    gains = []
    for s in range(t1.shape[1]):
        c = t1 @ np.roll(t2, -s, axis=1).T / t1.shape[1]
        gains.append(np.sum(kabsch(c) * c))
    return np.arccos(max(gains))


@pytest.mark.parametrize("d", [2, 3, 4])
def test_rigid_alignment_is_the_best_of_all_shifts(d):
    curves, others = (fourier(s, 4, n=N, d=d, modes=2).astype(np.float32) for s in (0, 1))
    found = align(curves, others, RIGID)
    expected = [rigid_by_scan(*pair) for pair in zip(curves, others, strict=True)]
    np.testing.assert_allclose(found.distance, expected, atol=0.01)
    np.testing.assert_allclose(np.linalg.det(found.rotation), 1, atol=1e-5)


@pytest.mark.parametrize("n", [17, 1024])
def test_any_number_of_samples(n):
    curves, others = (fourier(s, 3, n=n, modes=2).astype(np.float32) for s in (0, 1))
    found = align(curves, others, RIGID)
    fine = align(*(fourier(s, 3, n=N, modes=2).astype(np.float32) for s in (0, 1)), RIGID)
    np.testing.assert_allclose(found.distance, fine.distance, atol=0.1 if n < 20 else 0.01)
    assert np.diff(found.warp).min() > 0


@pytest.mark.parametrize(("d", "n"), [(2, 16), (4, 400)])
def test_planar_and_four_dimensional_curves(d, n):
    curves, others = (fourier(s, 4, n=n, d=d).astype(np.float32) for s in (0, 1))
    found = align(curves, others, LEAN)
    assert (np.asarray(found.distance) <= np.asarray(align(curves, others, RIGID).distance) + 5e-3).all()
    plain = [certified(*pair) for pair in zip(curves, others, found.rotation, found.warp, strict=True)]
    np.testing.assert_allclose(found.distance, plain, atol=0.01)
    np.testing.assert_allclose(np.linalg.det(found.rotation), 1, atol=1e-5)
    np.testing.assert_array_equal(align(others, curves, LEAN).distance, found.distance)


def test_space_holds_the_plane():
    """Curves of the plane are as far apart in space, or nearer: rotations of space can turn them over."""
    curves, others = (fourier(s, 4, n=50, d=2).astype(np.float32) for s in (0, 1))
    raise_ = lambda c: np.concatenate([c, 0 * c[:, :1]], axis=1)  # noqa: E731
    plane = np.asarray(align(curves, others, RIGID).distance)
    assert (np.asarray(align(raise_(curves), raise_(others), RIGID).distance) <= plane + 1e-3).all()


def test_a_curve_there_and_back_has_finite_distances(curves):
    straight = ellipse(N, 2.0, 1e-4).astype(np.float32)
    line = np.stack([np.abs(np.arange(N) - N / 2), np.zeros(N), np.zeros(N)]).astype(np.float32)
    for curve in (straight, line):
        found = align(curve, curves, ACCURATE)
        assert all(np.isfinite(x).all() for x in found)
        assert np.diff(found.warp).min() >= 0
    assert np.isfinite(align(line, straight, ACCURATE).distance)


def test_a_better_search_does_not_lose(found, curves, others):
    rigid = align(curves, others, RIGID)
    assert (np.asarray(found.distance) < np.asarray(rigid.distance)).all()
    lean = align(curves, others, LEAN)
    assert (np.asarray(found.distance) < np.asarray(lean.distance) + 1e-3).all()


def test_no_stage_of_refinement_leaves_the_search_as_it_is(curves, others):
    """A dynamic programming alone is an alignment too, and refinement lowers its distance."""
    plain = align(curves, others, dataclasses.replace(LEAN, stages=()))
    refined = align(curves, others, LEAN)
    certificate = alignment_distance(curves, others, plain.rotation, plain.warp)
    error = np.abs(np.asarray(plain.distance - certificate))
    assert np.median(error) < 1e-3
    assert error.max() < 0.05
    assert np.median(np.asarray(plain.distance) - np.asarray(refined.distance)) > 0.01


def test_batches_broadcast(curves, others):
    grid = align(curves[:2, None], others[None, :3], RIGID)
    assert grid.rotation.shape == (2, 3, 3, 3)
    assert grid.warp.shape == (2, 3, RIGID.fineness * N + 1)
    for i in range(2):
        row = align(curves[i], others[:3], RIGID)
        np.testing.assert_allclose(grid.distance[i], row.distance, atol=1e-5)
    single = align(curves[0], others[0], RIGID)
    assert single.distance.shape == ()
    np.testing.assert_allclose(single.rotation, grid.rotation[0, 0], atol=1e-4)


def test_large_batches_go_in_chunks(curves, others):
    """More pairs than a chunk holds, and not a multiple of it, traced and not."""
    aligner = Aligner(slope=0, chunk=9)
    one, other = (np.concatenate([c] * 3)[:20, :, ::4] for c in (curves, others))
    found = align(one, other, aligner)
    np.testing.assert_allclose(found.distance[8:16], found.distance[:8], atol=1e-6)
    traced = jax.jit(lambda a, b: align(a, b, aligner))(one, other)
    for concrete, abstract in zip(found, traced, strict=True):
        np.testing.assert_allclose(concrete, abstract, atol=2e-4)


def test_empty_batches_stay_empty():
    found = align(np.zeros((0, 3, 20), np.float32), fourier(0, n=20).astype(np.float32), RIGID)
    assert found.distance.shape == (0,)
    assert found.warp.shape == (0, RIGID.fineness * 20 + 1)


def test_dtypes_are_promoted_to_floats(curves):
    assert align(curves[0], curves[1], RIGID).distance.dtype == np.float32
    square = np.array([[0, 1, 2, 2, 2, 1, 0, 0], [0, 0, 0, 1, 2, 2, 2, 1]])
    np.testing.assert_allclose(align(square, 3 * square[::-1, ::-1], RIGID).distance, 0, atol=0.02)


def test_the_rotation_lays_the_second_curve_onto_the_first(curves):
    turn = rotation(5)
    copies = np.einsum("ij,bjn->bin", turn, curves).astype(np.float32)
    found = align(curves, copies, RIGID)
    np.testing.assert_allclose(found.rotation, np.broadcast_to(turn.T, (8, 3, 3)), atol=5e-3)
    shifted = align(curves, np.roll(curves, -10, axis=-1), RIGID)
    start = (np.asarray(shifted.warp[:, 0]) + 0.1 + 0.5) % 1 - 0.5
    np.testing.assert_allclose(start, 0, atol=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("preset", [Aligner.fast(), ACCURATE], ids=["fast", "accurate"])
def test_the_distance_of_moved_copies_falls_with_the_samples(preset):
    """From 50 to 100 to 200 samples, in the median of eight curves."""
    coarse, middle, fine = (np.median(moved_distance(n, preset)) for n in (50, 100, 200))
    assert middle < 0.7 * coarse
    assert fine < 0.8 * middle


@pytest.mark.slow
def test_the_distance_of_every_moved_copy_falls_to_what_the_samples_say():
    assert (moved_distance(400, ACCURATE) < true_distance(400) + 0.005).all()


@pytest.mark.slow
@pytest.mark.parametrize("n", [16, 400])
def test_few_and_many_samples_are_aligned_accurately(n):
    curves, others = (fourier(s, 4, n=n, modes=2).astype(np.float32) for s in (0, 100))
    found = align(curves, others, ACCURATE)
    plain = [certified(*pair) for pair in zip(curves, others, found.rotation, found.warp, strict=True)]
    np.testing.assert_allclose(found.distance, plain, atol=5e-3 if n == 16 else 1e-3)
    assert np.diff(found.warp).min() >= 0
