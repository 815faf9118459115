import numpy as np
import pytest
from surface.shapes import cube, limbed, sphere, torus

from benchmarks.baselines.reeb import slices


def test_slices_of_the_sphere_have_equal_areas():
    """Archimedes; also where slices are thinner than triangles."""
    ball = sphere(3)
    for count in (4, 100):
        found = slices(ball, ball.vertices[:, 2], count)
        np.testing.assert_allclose(found.area, 1 / count, rtol=0.2)
        order = np.argsort(found.spread[:, 0])
        np.testing.assert_allclose(found.spread[order, 0], np.linspace(-1, 1, count + 1)[:-1], atol=1e-9)
        np.testing.assert_array_equal(found.upwards[np.ix_(order, order)], np.eye(count, k=1, dtype=bool))


def test_slices_of_an_upright_torus():
    """Below and above the hole a slice is one piece, beside it two."""
    ring = torus()
    found = slices(ring, ring.vertices[:, 0], 16)
    at = np.round((found.spread[:, 0] + 1.3) / 2.6 * 16).astype(int)
    assert np.bincount(at).tolist() == [1] * 4 + [2] * 8 + [1] * 4
    assert found.area.sum() == pytest.approx(1)
    assert found.upwards.sum() == len(found.area)  # an Euler number of 0: one loop


def test_slices_of_a_surface_of_genus_0_are_a_tree():
    star = limbed(subdivisions=3)
    found = slices(star, star.vertices @ [0.2, 0.5, 0.9], 40)
    assert found.upwards.sum() == len(found.area) - 1


def test_flat_faces_between_slices():
    box = cube(4)
    found = slices(box, box.vertices[:, 2], 4)
    assert found.area.sum() == pytest.approx(1)
    np.testing.assert_allclose(np.sort(found.area)[-2:], 1 / 6 + 1 / 6, atol=0.2)
    assert np.ptp(found.spread) == 1


def test_united_regions():
    ball = sphere(2)
    found = slices(ball, ball.vertices[:, 2], 6)
    order = np.argsort(np.argsort(found.spread[:, 0]))
    halves = found.united(order // 3)
    np.testing.assert_allclose(halves.area, 0.5)
    np.testing.assert_allclose(halves.spread, [[-1, 0], [0, 1]], atol=1e-9)
    assert halves.upwards.tolist() == [[False, True], [False, False]]
