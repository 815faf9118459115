"""Alignments: what is forgotten, what is told apart, and that the result certifies its distance."""

import contextlib
import dataclasses
import logging
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import COARSE, FAST, LEAN, RIGID, StartOnly
from elastic.shapes import certified, ellipse, fourier, moved, polygon, x64

from curvematch_jax.elastic import (
    Aligner,
    align,
    alignment_distance,
    distance_matrix,
    elastic_distance,
)
from curvematch_jax.elastic._align import _align_tables

N = 100
ACCURATE = Aligner.accurate()
GENTLE = {"modes": 4, "decay": 3.0}  # curves that their samples hold well: no sharp turns
MOVE = {"shift": 0.2345, "bend": 0.08}
BIG = {"_align_tables", "_distance_chunk", "_tables"}  # what takes seconds to compile
PRESETS = [
    pytest.param(RIGID, id="rigid"),
    pytest.param(FAST, id="fast"),
    pytest.param(ACCURATE, id="accurate", marks=pytest.mark.slow),
]


def of(dtype):
    """Where arrays may have that dtype: float32 shares its compiled code with the other tests."""
    return x64() if dtype == np.float64 else contextlib.nullcontext()


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 8, n=N).astype(np.float32)


@pytest.fixture(name="others", scope="module")
def fixture_others():
    return fourier(100, 8, n=N).astype(np.float32)


@pytest.fixture(name="found", scope="module")
def fixture_found(curves, others):
    return align(curves, others, LEAN)


def raised(curve):
    """A curve of the plane `(2, n)` in space: alignment is compiled for space anyway."""
    return np.concatenate([curve, np.zeros_like(curve[:1])])


def recomputed(curves, others, found):
    return np.asarray(alignment_distance(curves, others, found.rotation, found.warp1, found.warp2))


def sound(found, batch, d=3, dtype=np.float32, atol=1e-5):
    """Rotations, and lifted warps that never fall."""
    assert found.rotation.shape == (*batch, d, d)
    assert found.warp1.shape == found.warp2.shape
    assert found.warp1.shape[:-1] == found.distance.shape == batch
    assert {x.dtype for x in found} == {np.dtype(dtype)}
    turns = np.asarray(found.rotation)
    np.testing.assert_allclose(turns @ turns.swapaxes(-1, -2), np.broadcast_to(np.eye(d), turns.shape), atol=atol)
    np.testing.assert_allclose(np.linalg.det(turns), 1, atol=atol)
    for warp in (found.warp1, found.warp2):
        assert np.diff(warp).min() >= 0
        assert ((warp[..., 0] >= 0) & (warp[..., 0] <= 1)).all()
        np.testing.assert_allclose(warp[..., -1], warp[..., 0] + 1, atol=1e-6)


def test_rotations_are_rotations_and_warps_grow_by_one_turn(found):
    sound(found, (8,))


def test_the_distance_is_the_one_that_the_path_achieves(curves, others):
    """Recomputed with sums of waves in numpy, and by `alignment_distance`."""
    found = align(curves, others, FAST)
    sound(found, (8,))
    plain = [certified(*case) for case in zip(curves, others, *found[:3], strict=True)]
    np.testing.assert_allclose(recomputed(curves, others, found), plain, atol=5e-4)
    np.testing.assert_allclose(found.distance, plain, atol=2e-3)


@pytest.mark.parametrize("aligner", PRESETS)
def test_distances_of_smooth_curves_are_achieved_within_a_thousandth(aligner):
    curves, others = (fourier(s, 8, n=N, modes=2).astype(np.float32) for s in (0, 100))
    found = align(curves, others, aligner)
    np.testing.assert_allclose(found.distance, recomputed(curves, others, found), atol=1e-3)


@pytest.mark.parametrize("aligner", PRESETS)
def test_the_distance_of_a_circle_and_a_square_is_achieved(aligner):
    circle, square = (c[None].astype(np.float32) for c in (ellipse(400, 1, 1), raised(polygon(400))))
    found = align(circle, square, aligner)
    np.testing.assert_allclose(found.distance, recomputed(circle, square, found), atol=2e-3)


@pytest.mark.parametrize("aligner", [RIGID, LEAN, StartOnly()], ids=["rigid", "lean", "other"])
def test_exchanged_curves_have_exchanged_warps(aligner, curves, others):
    there, back = align(curves, others, aligner), align(others, curves, aligner)
    np.testing.assert_allclose(there.distance, back.distance, atol=1e-6)
    np.testing.assert_allclose(there.rotation, np.swapaxes(back.rotation, 1, 2), atol=1e-6)
    np.testing.assert_allclose(there.warp1, back.warp2, atol=1e-6)
    np.testing.assert_allclose(there.warp2, back.warp1, atol=1e-6)


@pytest.mark.parametrize("aligner", [RIGID, LEAN, *PRESETS[1:]])
def test_a_curve_is_at_distance_zero_from_itself(aligner, curves):
    found = align(curves, curves, aligner)
    assert float(found.distance.max()) <= 1e-6
    np.testing.assert_allclose(found.rotation, np.broadcast_to(np.eye(3), (8, 3, 3)), atol=1e-4)
    apart = np.asarray(found.warp2 - found.warp1)
    np.testing.assert_allclose(apart - np.round(apart), 0, atol=1e-4)


@pytest.mark.parametrize(("aligner", "dtype", "most"), [(LEAN, np.float32, 1e-3), (COARSE, np.float64, 1e-6)])
def test_a_copy_is_at_distance_zero_after_little_search(aligner, dtype, most):
    """Moved by less than rounding."""
    with of(dtype):
        copies = fourier(0, 8, n=N).astype(dtype)
        found = align(copies, copies + dtype(1e-12), aligner)
        assert found.distance.dtype == dtype
        assert float(found.distance.max()) < most


def rolled(curve, aligner, dtype):
    n = curve.shape[-1]
    copies = np.stack([np.roll(curve, k, axis=-1) for k in (1, 2, n // 7, n // 3, n // 2 + 3, n - 1)])
    with of(dtype):
        found = align(curve.astype(dtype), copies.astype(dtype), aligner)
        return np.asarray(found.distance), recomputed(curve.astype(dtype), copies.astype(dtype), found)


ROLLED = [
    pytest.param(raised(polygon(400)), id="square"),
    pytest.param(raised(fourier(7, n=N, d=2, modes=5)), id="five modes"),
]


@pytest.mark.parametrize("aligner", PRESETS[1:])
@pytest.mark.parametrize("curve", ROLLED)
def test_a_curve_is_near_its_roll(curve, aligner):
    for distance in rolled(curve, aligner, np.float32):
        assert distance.max() <= 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("aligner", PRESETS[1:])
@pytest.mark.parametrize("curve", ROLLED)
def test_a_curve_is_nearer_its_roll_in_float64(curve, aligner):
    for distance in rolled(curve, aligner, np.float64):
        assert distance.max() <= 1e-5


@pytest.mark.parametrize("move", [{}, {"shift": 0.25}, {"shift": 0.137}, {"bend": 0.08}, MOVE], ids=str)
def test_each_way_to_move_a_gentle_curve(move):
    """Rotated, scaled and translated as well; from a start on the samples, between them, warped, and all at once."""
    curves, copies = fourier(0, 7, n=N, **GENTLE), fourier(0, 7, n=N, **GENTLE, **move)
    found = align(curves.astype(np.float32), moved(copies, 2).astype(np.float32), FAST)
    assert float(found.distance.max()) < 0.012


def test_scale_and_position_are_forgotten(curves, others):
    """To rounding; and by as much as a search wavers that may take the two in the other order."""
    for aligner, most in ((RIGID, 2e-3), (FAST, 0.03)):
        plain, moved_ = (
            np.asarray(align(*pair, aligner).distance) for pair in ((curves, others), (3 * curves, others + 7))
        )
        assert np.median(np.abs(plain - moved_)) < 1e-3
        np.testing.assert_allclose(moved_, plain, atol=most)
        assert float(align(3 * curves, curves, aligner).distance.max()) < 1e-4


def test_repeated_samples_change_nothing(curves, others):
    """One sample twice, and a run of twelve equal ones: the warps are those of the curves as given."""
    short, once = fourier(0, 8, n=N - 12).astype(np.float32), fourier(0, 8, n=N - 1).astype(np.float32)
    run = np.insert(short, [30] * 12, short[..., 30:31], axis=-1)
    twice = np.insert(once, [N // 2], once[..., N // 2 : N // 2 + 1], axis=-1)
    plain = align(curves, others, RIGID)
    for repeated in (twice, run):
        again = align(repeated, others, RIGID)
        sound(again, (8,))
        np.testing.assert_allclose(again.distance, plain.distance, atol=0.01)
        assert float(align(repeated, curves, FAST).distance.max()) < 0.05


def test_mirror_images_and_reversed_curves_are_told_apart(curves):
    mirror = curves * np.array([1, 1, -1], np.float32)[:, None]
    assert float(align(curves, mirror, FAST).distance.min()) > 0.1
    assert float(align(curves, curves[..., ::-1], FAST).distance.min()) > 0.1


def test_a_planar_curve_is_its_own_mirror_image_in_space():
    """A half turn does it: the distance is 0 in space, and not in the plane."""
    flat = fourier(3, n=N, d=2).astype(np.float32)
    mirror = flat * np.array([[1], [-1]], np.float32)
    raised = [np.concatenate([c, np.zeros((1, N), np.float32)]) for c in (flat, mirror)]
    assert float(align(*raised, LEAN).distance) < 1e-3
    assert float(align(flat, mirror, RIGID).distance) > 0.1


def test_space_holds_the_plane():
    """Curves of the plane are as far apart in space, or nearer: rotations of space can turn them over."""
    curves, others = (fourier(s, 8, n=50, d=2).astype(np.float32) for s in (0, 1))
    raise_ = lambda c: np.concatenate([c, 0 * c[:, :1]], axis=1)  # noqa: E731
    plane = np.asarray(align(curves, others, RIGID).distance)
    assert (np.asarray(align(raise_(curves), raise_(others), RIGID).distance) <= plane + 2e-3).all()


def test_callers_arrays_are_never_changed(curves, others):
    doubled = curves.copy()
    doubled[..., 4] = doubled[..., 3]
    kept = doubled.copy(), others.copy()
    elastic_distance(doubled, others, RIGID)
    distance_matrix(doubled, others, RIGID)
    np.testing.assert_array_equal(doubled, kept[0])
    np.testing.assert_array_equal(others, kept[1])


@pytest.mark.parametrize(
    ("d", "n"), [(2, 16), (2, 1024), (3, 17), (3, 1024), pytest.param(4, 400, marks=pytest.mark.slow)]
)
def test_any_dimension_and_number_of_samples(d, n):
    curves, others = (fourier(s, 8, n=n, d=d, modes=2).astype(np.float32) for s in (0, 1))
    for aligner in (RIGID, LEAN):
        found = align(curves, others, aligner)
        sound(found, (8,), d)
        np.testing.assert_array_equal(align(others, curves, aligner).distance, found.distance)
    found, fine = (
        align(*(fourier(s, 8, n=k, d=d, modes=2).astype(np.float32) for s in (0, 1)), RIGID).distance for k in (n, N)
    )
    np.testing.assert_allclose(found, fine, atol=0.1 if n < 20 else 0.01)


@pytest.mark.parametrize("aligner", PRESETS[1:])
def test_elastic_distances_are_never_above_rigid_ones(aligner, curves, others):
    rigid = np.asarray(align(curves, others, RIGID).distance)
    assert (np.asarray(align(curves, others, aligner).distance) <= rigid + 2e-3).all()


def test_a_curve_there_and_back_has_finite_distances(curves):
    straight = ellipse(N, 2.0, 1e-4).astype(np.float32)
    line = np.stack([np.abs(np.arange(N) - N / 2), np.zeros(N), np.zeros(N)]).astype(np.float32)
    for aligner in (LEAN, FAST):
        for curve in (straight, line):
            found = align(curve, curves, aligner)
            assert all(np.isfinite(x).all() for x in found)
            sound(found, (8,), atol=1e-4)
    assert np.isfinite(align(line, straight, LEAN).distance)


@pytest.mark.parametrize("aligner", [RIGID, LEAN], ids=["rigid", "lean"])
@pytest.mark.parametrize("broken", [0, 3])
def test_a_pair_of_nan_leaves_the_others_as_they_are(aligner, broken, curves, others):
    """Nothing checks the numbers in the core: it is given tables with NaN."""
    first, second = aligner.tabulate(jnp.asarray(curves)), aligner.tabulate(jnp.asarray(others))
    swap = jnp.zeros(8, bool)
    plain = _align_tables(aligner, first, second, swap)
    poisoned = jax.tree.map(lambda x: x.at[broken].set(jnp.nan) if x.dtype == jnp.float32 else x, first)
    rest = np.arange(8) != broken
    for tables in ((poisoned, second), (second, poisoned)):
        expected = plain if tables[1] is second else _align_tables(aligner, second, first, swap)
        found = _align_tables(aligner, *tables, swap)
        for before, after in zip(expected, found, strict=True):
            np.testing.assert_array_equal(after[rest], before[rest])


def test_batches_broadcast(curves, others):
    grid = align(curves[:2, None], others[None, :3], RIGID)
    sound(grid, (2, 3))
    for i in range(2):
        row = align(curves[i], others[:3], RIGID)
        np.testing.assert_allclose(grid.distance[i], row.distance, atol=1e-5)
    single = align(curves[0], others[0], RIGID)
    assert single.distance.shape == ()
    np.testing.assert_allclose(single.rotation, grid.rotation[0, 0], atol=1e-4)
    np.testing.assert_allclose(recomputed(curves[:2, None], others[None, :3], grid), grid.distance, atol=2e-3)


@pytest.mark.parametrize(
    "aligner", [pytest.param(RIGID, id="rigid", marks=pytest.mark.slow), pytest.param(StartOnly(), id="other")]
)
def test_large_batches_go_in_chunks(aligner, curves, others):
    """More pairs than a chunk holds, and not a multiple of it, traced and not."""
    aligner = dataclasses.replace(aligner, chunk=9)
    one, other = (np.concatenate([c] * 3)[:20, :, ::4] for c in (curves, others))
    found = align(one, other, aligner)
    np.testing.assert_allclose(found.distance[8:16], found.distance[:8], atol=1e-6)
    traced = jax.jit(lambda a, b: align(a, b, aligner))(one, other)
    for concrete, abstract in zip(found, traced, strict=True):
        np.testing.assert_allclose(concrete, abstract, atol=1e-3)


def test_empty_batches_stay_empty():
    found = align(np.zeros((0, 3, 20), np.float32), fourier(0, n=20).astype(np.float32), RIGID)
    assert found.distance.shape == (0,)
    assert found.warp1.shape[0] == 0


def test_dtypes_are_promoted_to_floats(curves):
    assert align(curves[0], curves[1], RIGID).distance.dtype == np.float32
    square = np.array([[0, 1, 2, 2, 2, 1, 0, 0], [0, 0, 0, 1, 2, 2, 2, 1]])
    np.testing.assert_allclose(align(square, 3 * square[::-1, ::-1], RIGID).distance, 0, atol=0.02)


def test_a_third_aligner_is_one_like_the_others(curves, others):
    """A frozen dataclass that a user wrote: start points alone."""
    aligner = StartOnly()
    found = align(curves, others, aligner)
    sound(found, (8,))
    np.testing.assert_allclose(found.distance, recomputed(curves, others, found), atol=0.02)
    np.testing.assert_array_equal(elastic_distance(curves, others, aligner), found.distance)
    matrix = distance_matrix(curves, others, aligner)
    np.testing.assert_allclose(np.diag(matrix), found.distance, atol=1e-5)
    assert (np.asarray(found.distance) >= np.asarray(align(curves, others, RIGID).distance) - 0.02).all()
    copied = align(curves, np.roll(curves, -25, axis=-1), aligner)
    start = (np.asarray(copied.warp2 - copied.warp1)[:, 0] + 0.25 + 0.5) % 1 - 0.5
    np.testing.assert_allclose(start, 0, atol=1 / 64)


def compiled_by(caplog, run):
    """The names of the functions that are compiled, in any thread."""
    caplog.clear()
    jax.config.update("jax_log_compiles", True)
    try:
        with caplog.at_level(logging.WARNING):
            run()
    finally:
        jax.config.update("jax_log_compiles", False)
    names = (re.match(r"Compiling (?:jit\()?([\w<>]+)", record.getMessage()) for record in caplog.records)
    return {name.group(1).removeprefix("jit_") for name in names if name}


@pytest.mark.parametrize("aligner", [RIGID, COARSE], ids=["rigid", "coarse"])
def test_another_number_of_samples_or_pairs_compiles_nothing_big(aligner, curves, caplog):
    jax.clear_caches()
    first = compiled_by(
        caplog, lambda: (elastic_distance(curves, curves, aligner), distance_matrix(curves, aligner=aligner))
    )
    assert first >= BIG
    for n in (33, 60):
        some = fourier(0, 5, n=n).astype(np.float32)
        again = compiled_by(
            caplog,
            lambda some=some: (elastic_distance(some[:4], some[1:], aligner), distance_matrix(some, aligner=aligner)),
        )
        assert not again & BIG
    few = compiled_by(caplog, lambda: [distance_matrix(curves[:k], curves[:2], aligner) for k in (1, 3, 7)])
    assert not few & BIG


@pytest.mark.slow
def test_the_distance_of_moved_copies_falls_with_the_samples():
    """From 50 to 100 to 200 samples, in the median of eight curves."""

    def distance(n):
        curves, copies = fourier(0, 8, n=n), moved(fourier(0, 8, n=n, **MOVE), 1)
        return float(np.median(align(curves.astype(np.float32), copies.astype(np.float32), ACCURATE).distance))

    coarse, middle, fine = (distance(n) for n in (50, 100, 200))
    assert middle < 0.7 * coarse
    assert fine < 0.8 * middle


@pytest.mark.slow
@pytest.mark.parametrize("n", [16, 400])
def test_few_and_many_samples_are_aligned_accurately(n):
    curves, others = (fourier(s, 4, n=n, modes=2).astype(np.float32) for s in (0, 100))
    found = align(curves, others, ACCURATE)
    sound(found, (4,))
    np.testing.assert_allclose(found.distance, recomputed(curves, others, found), atol=1e-3)
