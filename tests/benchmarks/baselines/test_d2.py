import numpy as np
import pytest
from surface.shapes import cube, limbed, moved, sphere

from benchmarks.baselines import d2


def test_density_of_the_sphere_rises_linearly():
    found = d2.describe(sphere(3))
    step = d2.REACH / (d2.KNOTS - 1)
    scaled = step * np.arange(d2.KNOTS) * 4 / 3  # the mean distance is 4/3 radii, the density of r is r/2 up to 2
    exact = np.where(scaled < 2, scaled / 2, 0) * step * 4 / 3
    inside = scaled < 1.9
    np.testing.assert_allclose(found[inside][1:], exact[inside][1:], rtol=0.06, atol=3e-4)
    assert found.sum() == pytest.approx(1)


def test_place_and_scale_do_not_matter():
    ball, same = d2.describe(cube(4)), d2.describe(moved(cube(4), (1, 2, 3), 7.0))
    assert d2.compare([ball], [same])[0, 0] < 1e-3


def test_limbs_are_told_from_none():
    ball, star = d2.describe(sphere(3)), d2.describe(limbed(subdivisions=3))
    assert d2.compare([ball], [star])[0, 0] > 0.2


def test_faces_hold_points_by_their_area():
    box = cube()
    points = d2.uniform_points(box, 6000, np.random.default_rng(0))
    on_side = np.isclose(points[:, :, None], [0.0, 1.0]).sum(axis=0)
    assert on_side.tolist() == pytest.approx(np.full((3, 2), 1000), abs=4)


def test_weights_count_like_repetitions():
    distances = np.array([1.0, 2.0, 2.0, 3.0])
    weighted = d2.density(distances[[0, 1, 3]], np.array([1.0, 2.0, 1.0]))
    np.testing.assert_allclose(weighted, d2.density(distances))
