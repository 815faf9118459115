import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import limbed, moved, sphere

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
    found = rsh.reach_magnitudes(moved(ball, (0, 0, shift)).vertices[ball.faces])
    assert found[1] == pytest.approx(shift * np.sqrt(4 * np.pi / 3), rel=0.02)
    assert found[2:].max() < 2e-3


def test_turned_and_scaled_is_the_same():
    star = limbed(np.array([[1, 0, 0], [0, 1, 0.5], [0.3, -1, 1]]), subdivisions=3)
    turned = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).apply(3 * star.vertices)
    first, second = rsh.describe(star), rsh.describe(Mesh(turned, star.faces))
    assert rsh.compare([first], [second])[0, 0] < 1e-9
