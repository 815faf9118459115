import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import cube, limbed, moved, sphere

from benchmarks.baselines import descriptors
from curvematch_jax.surface import Mesh


def test_density_of_the_sphere_rises_linearly():
    found = descriptors.d2(sphere(3))
    step = descriptors.REACH / (descriptors.KNOTS - 1)
    scaled = step * np.arange(descriptors.KNOTS) * 4 / 3  # the mean is 4/3 radii, the density of r is r/2 up to 2
    exact = np.where(scaled < 2, scaled / 2, 0) * step * 4 / 3
    inside = scaled < 1.9
    np.testing.assert_allclose(found[inside][1:], exact[inside][1:], rtol=0.06, atol=3e-4)
    assert found.sum() == pytest.approx(1)


def test_d2_place_and_scale_do_not_matter():
    ball, same = descriptors.d2(cube(4)), descriptors.d2(moved(cube(4), (1, 2, 3), 7.0))
    assert descriptors.l1([ball], [same])[0, 0] < 1e-3


def test_d2_limbs_are_told_from_none():
    ball, star = descriptors.d2(sphere(3)), descriptors.d2(limbed(subdivisions=3))
    assert descriptors.l1([ball], [star])[0, 0] > 0.2


def test_faces_hold_points_by_their_area():
    box = cube()
    points = descriptors.uniform_points(box, 6000, np.random.default_rng(0))
    on_side = np.isclose(points[:, :, None], [0.0, 1.0]).sum(axis=0)
    assert on_side.tolist() == pytest.approx(np.full((3, 2), 1000), abs=4)


def test_weights_count_like_repetitions():
    distances = np.array([1.0, 2.0, 2.0, 3.0])
    weighted = descriptors.density(distances[[0, 1, 3]], np.array([1.0, 2.0, 1.0]))
    np.testing.assert_allclose(weighted, descriptors.density(distances))


def test_density_of_the_sphere_is_that_of_angles():
    found = descriptors.geodesic_d2(sphere(3))
    step = descriptors.REACH / (descriptors.KNOTS - 1)
    angles = step * np.arange(descriptors.KNOTS) * np.pi / 2  # the mean is pi/2, the density of the angle a is sin(a)/2
    exact = np.where(angles < np.pi, np.sin(angles) / 2, 0) * step * np.pi / 2
    assert np.abs(found - exact).sum() < 0.1


def tube(bend: float) -> Mesh:
    """A closed tube six long, its middle line bent into an arc of `bend` radians in all: nearly isometric."""
    ball = sphere(3).vertices
    along, around = 3 * ball[:, 2], 0.5 * ball[:, :2]
    angle = along * bend / 6
    radius = 6 / bend - around[:, 0]
    arc = np.stack([radius * np.sin(angle), around[:, 1], 6 / bend - radius * np.cos(angle)], axis=1)
    return Mesh(arc, sphere(3).faces, "tube")


def test_bending_and_scale_hardly_matter():
    straight, bent = tube(0.01), moved(tube(3.0), (1, 2, 3), 7.0)
    geodesic, euclidean = (
        descriptors.l1([method(straight)], [method(bent)])[0, 0] for method in (descriptors.geodesic_d2, descriptors.d2)
    )
    assert geodesic < 0.08  # nearly isometric: exact distances give .073
    assert euclidean > 1.5 * geodesic


def test_coefficients_of_the_sphere():
    found = descriptors.rsh(sphere(4))
    assert found.shape == (136,)
    assert found[0] == pytest.approx(np.sqrt(4 * np.pi), rel=1e-3)
    assert found[1:].max() < 2e-3


def test_coefficients_of_a_shifted_sphere():
    """Seen from near its centre, a sphere reaches about 1 + e cos, which is of degree 1 and order 0."""
    ball, shift = sphere(4), 0.02
    found = descriptors.reach_magnitudes(moved(ball, (0, 0, shift)).vertices[ball.faces])
    assert found[1] == pytest.approx(shift * np.sqrt(4 * np.pi / 3), rel=0.02)
    assert found[2:].max() < 2e-3


def test_turned_and_scaled_is_the_same_to_rsh():
    star = limbed(np.array([[1, 0, 0], [0, 1, 0.5], [0.3, -1, 1]]), subdivisions=3)
    turned = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).apply(3 * star.vertices)
    first, second = descriptors.rsh(star), descriptors.rsh(Mesh(turned, star.faces))
    assert descriptors.l1([first], [second])[0, 0] < 1e-9


def test_numbers_of_each_kind():
    found = descriptors.dsr(sphere(3))
    assert found.shape == (186 + 150 + 136,)
    sums = [part.sum() for part in np.split(found, [186, 186 + 150])]
    assert sums == pytest.approx(np.ones(3))


def test_turned_and_scaled_is_the_same_to_dsr():
    star = limbed(np.array([[1, 0, 0], [0, 1, 0.5], [0.3, -1, 1]]), subdivisions=3)
    turned = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).apply(3 * star.vertices)
    first, second = descriptors.dsr(star), descriptors.dsr(Mesh(turned, star.faces))
    assert descriptors.l1([first], [second])[0, 0] < 1e-3
    assert descriptors.l1([first], [descriptors.dsr(sphere(3))])[0, 0] > 0.5


def test_image_of_one_wave():
    wave = np.cos(2 * np.pi * (2 * np.arange(16)[:, None] - np.arange(16)) / 16)
    found = descriptors.image_magnitudes(wave)
    assert found.shape == (31,)
    assert np.sort(found)[-2:] == pytest.approx([0, 0.5])


def silhouette_of_disc(radius: float, middle: float) -> np.ndarray:
    places = ((np.arange(descriptors.PIXELS) + 0.5) * 2 / descriptors.PIXELS - 1) * descriptors.WINDOW
    return (places[:, None] - middle) ** 2 + places**2 < radius**2


def test_contour_of_a_disc():
    found = descriptors.contour_magnitudes(silhouette_of_disc(1.0, 0.0) | silhouette_of_disc(0.2, 1.5))
    assert found[0] == pytest.approx(1, rel=0.01)
    assert found[1:].max() < 0.01


def test_contour_closes_where_the_window_cuts():
    contour = descriptors.longest_contour(silhouette_of_disc(1.0, 2.0))
    assert contour is not None
    np.testing.assert_array_equal(contour[0], contour[-1])


def test_nothing_to_be_seen():
    assert not descriptors.contour_magnitudes(np.zeros((descriptors.PIXELS, descriptors.PIXELS), dtype=bool)).any()


def test_eigenvalues_of_the_sphere():
    degrees = np.repeat([1, 2, 3], [3, 5, 7])
    found = descriptors.shape_dna(moved(sphere(4), (1, 2, 3), 10.0))
    np.testing.assert_allclose(found, 4 * np.pi * degrees * (degrees + 1), rtol=0.01)


def test_comparison_is_relative_and_symmetric():
    first, second = np.array([1.0, 10.0]), np.array([3.0, 10.0])
    found = descriptors.relative([first, second], [first, second, 2 * first])
    assert found[0, 1] == found[1, 0] == pytest.approx(2 / 2)
    assert found[0, 2] == pytest.approx(np.sqrt(2) * 2 / 3)


def test_shape_dna_limbs_are_told_from_none():
    ball, star = descriptors.shape_dna(sphere(3)), descriptors.shape_dna(limbed(subdivisions=3))
    assert descriptors.relative([ball], [star])[0, 0] > 1
