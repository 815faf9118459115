"""Alignment with mirror images: which one is taken, and that everything else holds for them too."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import FAST, LEAN, RIGID
from elastic.shapes import certified, fourier, moved, x64

from curvematch_jax.elastic import (
    align,
    aligned_curve,
    alignment_distance,
    distance_matrix,
    elastic_distance,
    geodesic,
    matched_points,
    mirror_image,
    warp_onto,
)

MIRROR = dataclasses.replace(FAST, mirror=True)
RIGID_MIRROR = dataclasses.replace(RIGID, mirror=True)
BOTH = pytest.mark.parametrize("aligner", [MIRROR, RIGID_MIRROR], ids=["elastic", "rigid"])


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 8).astype(np.float32)


@pytest.fixture(name="others", scope="module")
def fixture_others(curves):
    """Other curves; the last two are mirror images of the first of `curves`, moved."""
    images = moved(mirror_image(curves[6:]), 3)
    return np.concatenate([fourier(100, 6), np.roll(images, 17, axis=-1)]).astype(np.float32)


@pytest.fixture(name="found", scope="module", params=[MIRROR, RIGID_MIRROR], ids=["elastic", "rigid"])
def fixture_found(request, curves, others):
    return align(curves, others, request.param)


def mirrored(found):
    return np.asarray(found.warp2[:, -1] < found.warp2[:, 0])


def test_the_image_of_an_outline_runs_the_same_way():
    area = lambda c: (c[0] * np.roll(c[1], -1) - c[1] * np.roll(c[0], -1)).sum() / 2  # noqa: E731
    outline = fourier(0, d=2)
    image = mirror_image(outline)
    np.testing.assert_allclose(area(image), area(outline), rtol=1e-6)
    np.testing.assert_allclose(image[:, 0], outline[:, 0] * [-1, 1], rtol=1e-6)
    np.testing.assert_array_equal(mirror_image(image), outline.astype(np.float32))
    np.testing.assert_array_equal(jax.jit(mirror_image)(outline), image)


def test_reflections_are_of_paths_that_fall_and_the_distance_is_achieved(curves, others, found):
    """Recomputed by `alignment_distance`, and with sums of waves in numpy from the image itself."""
    back = mirrored(found)
    assert 2 <= back.sum() < 8
    assert back[6:].all()
    np.testing.assert_allclose(np.linalg.det(found.rotation), np.where(back, -1, 1), atol=1e-5)
    assert np.diff(found.warp1).min() >= 0
    assert (np.diff(found.warp2) * np.where(back, -1, 1)[:, None]).min() >= 0
    np.testing.assert_allclose(found.warp2[:, -1] - found.warp2[:, 0], np.where(back, -1, 1), atol=1e-6)
    np.testing.assert_allclose(alignment_distance(curves, others, *found[:3]), found.distance, atol=2e-3)
    for k in np.flatnonzero(back):
        rotation = np.asarray(found.rotation[k]) * [-1, 1, 1]
        again = certified(curves[k], mirror_image(others[k]), rotation, found.warp1[k], -found.warp2[k])
        np.testing.assert_allclose(again, found.distance[k], atol=2e-3)


def test_the_image_of_a_curve_is_at_distance_zero(found):
    assert float(found.distance[6:].max()) < 2e-3


def test_rigid_distances_are_the_smaller_of_two(curves, others):
    """Estimates depend a little on which of the two is mirrored."""
    for plain, most in ((RIGID, 1e-3), (dataclasses.replace(RIGID, measured=False), 0.02)):
        both = np.minimum(*(distance_matrix(curves, b, plain) for b in (others, mirror_image(others))))
        found = distance_matrix(curves, others, dataclasses.replace(plain, mirror=True))
        np.testing.assert_allclose(found, both, atol=most)
        assert np.median(np.abs(found - both)) < 1e-4


def test_elastic_distances_are_near_the_smaller_of_two(curves, others):
    """Half of the paths are searched: some are not found."""
    both = np.minimum(*(align(curves, b, FAST).distance for b in (others, mirror_image(others))))
    apart = np.asarray(align(curves, others, MIRROR).distance) - both
    assert np.abs(apart).max() < 0.05
    assert np.median(np.abs(apart)) < 1e-3


@BOTH
def test_exchanged_curves_have_exchanged_paths_run_through_as_curve1_is(aligner, curves, others):
    there, back = align(curves, others, aligner), align(others, curves, aligner)
    np.testing.assert_allclose(there.distance, back.distance, atol=1e-6)
    np.testing.assert_allclose(there.rotation, np.swapaxes(back.rotation, 1, 2), atol=1e-6)
    falls = mirrored(there)[:, None]
    for mine, other in ((there.warp1, back.warp2), (there.warp2, back.warp1)):
        apart = np.where(falls, np.asarray(mine)[:, ::-1], mine) - other
        np.testing.assert_allclose(apart - np.round(apart), 0, atol=1e-6)


def test_images_may_take_the_place_of_either_curve(curves, others):
    plain = align(curves, others, MIRROR).distance
    np.testing.assert_allclose(align(mirror_image(curves), others, MIRROR).distance, plain, atol=0.02)
    np.testing.assert_allclose(align(curves, mirror_image(others), MIRROR).distance, plain, atol=0.02)


def test_matched_points_and_aligned_curves_of_an_image_are_those_of_the_curve(curves, others, found):
    points1, points2 = (np.asarray(p)[6:] for p in matched_points(curves, others, found))
    centred = lambda p: p - p.mean(axis=-1, keepdims=True)  # noqa: E731
    turned = np.asarray(found.rotation)[6:] @ centred(points2) / 3  # `moved` scales by 3
    assert np.abs(turned - centred(points1)).max() < 0.02 * np.ptp(points1)
    laid = np.asarray(aligned_curve(curves, others, found))[6:]
    assert np.abs(centred(laid) / 3 - centred(curves[6:])).max() < 0.02 * np.ptp(curves[6:])
    warp = np.asarray(warp_onto(found, 50))[6:]
    assert np.diff(warp).max() <= 0
    np.testing.assert_allclose(warp[:, -1], warp[:, 0] - 1, atol=1e-6)


def test_repeated_samples_change_nothing(curves, others):
    plain = align(curves[6:], others[6:], MIRROR)
    stopped = np.insert(others[6:], [9] * 4, others[6:, :, [9]], axis=2)
    curve = np.insert(curves[6:], [30] * 4, curves[6:, :, [30]], axis=2)
    found = align(curve, stopped, MIRROR)
    assert mirrored(found).all()
    assert (np.diff(found.warp2) <= 0).all()
    np.testing.assert_allclose(found.distance, plain.distance, atol=0.02)
    np.testing.assert_allclose(alignment_distance(curve, stopped, *found[:3]), found.distance, atol=2e-3)


def test_geodesics_reach_the_image(curves, others):
    way = geodesic(curves[6:], others[6:], aligner=MIRROR)
    assert float(way.length.max()) < 0.01


def test_matrices_are_symmetric(curves, others):
    matrix = distance_matrix(np.concatenate([curves, others]), aligner=RIGID_MIRROR)
    np.testing.assert_array_equal(matrix, matrix.T)
    np.testing.assert_allclose(np.diag(matrix[:8, 8:]), align(curves, others, RIGID_MIRROR).distance, atol=1e-4)


def test_gradients_are_those_with_the_alignment_held():
    aligner = dataclasses.replace(LEAN, mirror=True)
    curve = fourier(1)
    with x64():
        other = np.asarray(mirror_image(curve + 0.1 * fourier(2)))
        found = align(curve, other, aligner)
        assert float(found.warp2[-1]) < float(found.warp2[0])
        slope, way = jax.grad(lambda c: elastic_distance(c, other, aligner))(jnp.asarray(curve)), fourier(3)
        ahead, behind = (alignment_distance(curve + step * way, other, *found[:3]) for step in (1e-5, -1e-5))
        np.testing.assert_allclose(np.sum(np.asarray(slope) * way), (ahead - behind) / 2e-5, rtol=1e-4)


def test_what_is_no_curve_has_no_image():
    with pytest.raises(ValueError, match="curve has shape"):
        mirror_image(np.zeros(5))
