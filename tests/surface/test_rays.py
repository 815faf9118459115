import numpy as np
import pytest
from surface.shapes import cube, sphere

from curvematch_jax.surface._rays import depths, reach


def test_reach_is_the_farthest_intersection_on_that_side():
    boxes = np.concatenate([(cube().vertices + offset)[cube().faces] for offset in ([1, -0.3, -0.4], [4, -0.3, -0.4])])
    directions = np.array([[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0.96, 0.28, 0]])
    np.testing.assert_allclose(reach(boxes, directions), [5, 0, 0, 2 / 0.96])


def test_rays_through_edges_and_corners_meet_the_surface():
    box = cube(2).vertices - 0.5
    directions = box / np.linalg.norm(box, axis=1, keepdims=True)
    np.testing.assert_allclose(reach(box[cube(2).faces], directions), np.linalg.norm(box, axis=1))


def test_depths_of_the_sphere():
    ball = sphere(4)
    low, high = depths(ball.vertices[ball.faces], 1.25, 50)
    x, y = np.meshgrid(*2 * [(np.arange(50) + 0.5) / 20 - 1.25], indexing="ij")
    inside = x**2 + y**2 < 0.95
    np.testing.assert_allclose(high[inside], np.sqrt((1 - x**2 - y**2)[inside]), atol=0.02)
    np.testing.assert_allclose(low, -high, atol=1e-9)
    assert (np.isfinite(high) == (x**2 + y**2 < 1)).mean() > 0.99


def test_depths_beyond_the_window_are_cut_off():
    box = cube(2).vertices * [10, 1, 1] + [-5, 0, 2]
    low, high = depths(box[cube(2).faces], 2.0, 8)
    covered = np.broadcast_to((np.arange(8) >= 4) & (np.arange(8) < 6), (8, 8))
    assert (np.isfinite(low) == covered).all()
    assert (low[covered], high[covered]) == (pytest.approx(2), pytest.approx(3))
