import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import cube, limbed, moved, sphere

from benchmarks.baselines import rsh
from curvematch_jax.surface import Mesh


def test_coefficients_of_the_sphere():
    found = rsh.describe(sphere(4))
    assert found.shape == (136,)
    assert found[0] == pytest.approx(np.sqrt(4 * np.pi), rel=1e-3)
    assert found[1:].max() < 2e-3


def test_coefficients_of_a_shifted_sphere():
    """Seen from near its centre, a sphere reaches about 1 + e cos, which is of degree 1 and order 0."""
    ball, shift = sphere(4), 0.02
    found = rsh.magnitudes(moved(ball, (0, 0, shift)).vertices[ball.faces])
    assert found[1] == pytest.approx(shift * np.sqrt(4 * np.pi / 3), rel=0.02)
    assert found[2:].max() < 2e-3


def test_turned_and_scaled_is_the_same():
    star = limbed(np.array([[1, 0, 0], [0, 1, 0.5], [0.3, -1, 1]]), subdivisions=3)
    turned = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).apply(3 * star.vertices)
    first, second = rsh.describe(star), rsh.describe(Mesh(turned, star.faces))
    assert rsh.compare([first], [second])[0, 0] < 1e-9


def test_reach_is_the_farthest_intersection_on_that_side():
    boxes = np.concatenate([(cube().vertices + offset)[cube().faces] for offset in ([1, -0.3, -0.4], [4, -0.3, -0.4])])
    directions = np.array([[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0.96, 0.28, 0]])
    np.testing.assert_allclose(rsh.reach(boxes, directions), [5, 0, 0, 2 / 0.96])


def test_rays_through_edges_and_corners_meet_the_surface():
    box = cube(2).vertices - 0.5
    directions = box / np.linalg.norm(box, axis=1, keepdims=True)
    np.testing.assert_allclose(rsh.reach(box[cube(2).faces], directions), np.linalg.norm(box, axis=1))
