import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import cube, limbed

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._pose import canonical_vertices


def test_turned_moved_scaled_and_mirrored_is_the_same():
    """A lopsided shape: no axis is as long as another, and each has two different sides."""
    ball = limbed(np.array([[0, 0, 1.0]]), subdivisions=3)
    lopsided = ball.vertices * [1, 1.5, 1] + 0.3 * ball.vertices[:, [1, 2, 0]] ** 2
    turn = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).as_matrix() * [1, -1, 1]
    first, second = (canonical_vertices(Mesh(v, ball.faces)) for v in (lopsided, 5 * lopsided @ turn + [1, 2, 3]))
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_vertices_do_not_count_but_the_surface_does():
    box = [1.0, 2.0, 3.0]
    fine, coarse = (canonical_vertices(Mesh(cube(n).vertices * box, cube(n).faces)) for n in (6, 1))
    longest_first = np.ptp(fine, axis=0)
    np.testing.assert_allclose(longest_first / longest_first[2], [3, 2, 1])
    np.testing.assert_allclose(longest_first, np.ptp(coarse, axis=0), rtol=0.03)


def test_sphere_has_radius_one():
    found = canonical_vertices(limbed(np.eye(3), length=0.0, subdivisions=4))
    assert np.linalg.norm(found, axis=1) == pytest.approx(1, abs=0.01)
