import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import limbed, sphere

from benchmarks.baselines import dsr
from curvematch_jax.surface import Mesh


def test_numbers_of_each_kind():
    found = dsr.describe(sphere(3))
    assert found.shape == (186 + 150 + 136,)
    sums = [part.sum() for part in np.split(found, [186, 186 + 150])]
    assert sums == pytest.approx(np.ones(3))


def test_turned_and_scaled_is_the_same():
    star = limbed(np.array([[1, 0, 0], [0, 1, 0.5], [0.3, -1, 1]]), subdivisions=3)
    turned = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).apply(3 * star.vertices)
    first, second = dsr.describe(star), dsr.describe(Mesh(turned, star.faces))
    assert dsr.compare([first], [second])[0, 0] < 1e-3
    assert dsr.compare([first], [dsr.describe(sphere(3))])[0, 0] > 0.5


def test_image_of_one_wave():
    wave = np.cos(2 * np.pi * (2 * np.arange(16)[:, None] - np.arange(16)) / 16)
    found = dsr.image_magnitudes(wave)
    assert found.shape == (31,)
    assert np.sort(found)[-2:] == pytest.approx([0, 0.5])


def silhouette_of_disc(radius: float, middle: float) -> np.ndarray:
    places = ((np.arange(dsr.PIXELS) + 0.5) * 2 / dsr.PIXELS - 1) * dsr.WINDOW
    return (places[:, None] - middle) ** 2 + places**2 < radius**2


def test_contour_of_a_disc():
    found = dsr.contour_magnitudes(silhouette_of_disc(1.0, 0.0) | silhouette_of_disc(0.2, 1.5))
    assert found[0] == pytest.approx(1, rel=0.01)
    assert found[1:].max() < 0.01


def test_contour_closes_where_the_window_cuts():
    contour = dsr.longest_contour(silhouette_of_disc(1.0, 2.0))
    assert contour is not None
    np.testing.assert_array_equal(contour[0], contour[-1])


def test_nothing_to_be_seen():
    assert not dsr.contour_magnitudes(np.zeros((dsr.PIXELS, dsr.PIXELS), dtype=bool)).any()
