import numpy as np
import pytest
from surface.shapes import limbed, moved, sphere

from benchmarks.baselines import shapedna


def test_eigenvalues_of_the_sphere():
    degrees = np.repeat([1, 2, 3], [3, 5, 7])
    found = shapedna.describe(moved(sphere(4), (1, 2, 3), 10.0))
    np.testing.assert_allclose(found, 4 * np.pi * degrees * (degrees + 1), rtol=0.01)


def test_comparison_is_relative_and_symmetric():
    first, second = np.array([1.0, 10.0]), np.array([3.0, 10.0])
    found = shapedna.compare([first, second], [first, second, 2 * first])
    assert found[0, 1] == found[1, 0] == pytest.approx(2 / 2)
    assert found[0, 2] == pytest.approx(np.sqrt(2) * 2 / 3)


def test_limbs_are_told_from_none():
    ball, star = shapedna.describe(sphere(3)), shapedna.describe(limbed(subdivisions=3))
    assert shapedna.compare([ball], [star])[0, 0] > 1
