import numpy as np
import pytest
import scipy.sparse as sp
from surface.shapes import limbed, moved, sphere

from curvematch_jax.surface import Extraction, Mesh, MeshError
from curvematch_jax.surface._clean import clean
from curvematch_jax.surface._features import feature_points
from curvematch_jax.surface._fields import distances_on
from curvematch_jax.surface._parts import parts_around
from curvematch_jax.surface._smooth import _smoothed_once, factors, smooth
from curvematch_jax.surface._topology import face_areas

LENGTH = Extraction().smoothing


def area(mesh: Mesh) -> float:
    return float(face_areas(mesh.vertices, mesh.faces).sum())


def rough(mesh: Mesh, amount: float) -> Mesh:
    """Every vertex moved by `amount` square roots of the area in the r.m.s."""
    steps = np.random.default_rng(0).normal(scale=amount * np.sqrt(area(mesh)), size=mesh.vertices.shape)
    return Mesh(mesh.vertices + steps, mesh.faces, mesh.name)


def test_a_wave_is_damped_as_the_equation_says():
    ball = sphere(4)
    ball = Mesh(ball.vertices / np.linalg.norm(ball.vertices, axis=1, keepdims=True), ball.faces, "ball")
    degree, length = 1, 0.08
    # Coordinates are spherical harmonics of degree 1: eigenfunctions of the Laplacian, eigenvalue l (l + 1).
    kept = 1 / (1 + (length**2 * 4 * np.pi * degree * (degree + 1)) ** 2)
    np.testing.assert_allclose(np.linalg.norm(smooth(ball, length).vertices, axis=1), kept, rtol=2e-3)


def test_roughness_goes_and_limbs_keep_their_girth():
    mesh = limbed(subdivisions=5)
    noisy = rough(mesh, 0.004)
    plain, again = smooth(mesh, LENGTH), smooth(noisy, LENGTH)
    assert np.abs(plain.vertices - mesh.vertices).max() < 0.01 * np.sqrt(area(mesh))
    assert area(plain) == pytest.approx(area(mesh), rel=0.01)
    assert area(noisy) > 1.08 * area(mesh)
    assert area(again) == pytest.approx(area(plain), rel=0.03)


def test_what_is_still_rough_is_smoothed_again_and_nothing_else_is():
    mesh = limbed(subdivisions=5)
    noisy, plain = rough(mesh, 0.006), smooth(mesh, LENGTH)
    np.testing.assert_array_equal(plain.vertices, _smoothed_once(mesh, LENGTH).vertices)
    assert area(_smoothed_once(noisy, LENGTH)) > 1.08 * area(plain)
    assert area(smooth(noisy, LENGTH)) == pytest.approx(area(plain), rel=0.04)


def test_unit_and_place_do_not_count():
    mesh = limbed()
    other = moved(mesh, scale=1e4)
    expected = moved(smooth(mesh, LENGTH), scale=1e4)
    np.testing.assert_allclose(smooth(other, LENGTH).vertices, expected.vertices, rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize("length", [1e3, 1e4])
def test_a_needle_thinner_than_the_waves_stays_as_it_is(length):
    corners = np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 1], [length, 0, 0]])
    needle, _ = clean(Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])))
    assert area(smooth(needle, LENGTH)) > 0.1 * area(needle)


def test_triangles_too_thin_for_a_system_are_refused_in_one_sentence():
    with pytest.raises(MeshError, match=r"^needle: its triangles are too thin to be measured$"):
        factors(sp.csc_array(np.zeros((2, 2))), "needle")


def test_no_length_leaves_the_mesh_as_it_is():
    mesh = limbed()
    assert smooth(mesh, 0.0) is mesh


def test_faces_without_area_do_no_harm():
    mesh = limbed()
    vertices = mesh.vertices.copy()
    vertices[mesh.faces[0, 1]] = vertices[mesh.faces[0, 0]]
    result = smooth(Mesh(vertices, mesh.faces, "pinched"), LENGTH)
    assert np.abs(result.vertices - vertices).max() < 0.05 * np.sqrt(area(mesh))


@pytest.mark.slow
def test_noise_leaves_the_lengths_of_level_curves():
    mesh = limbed(subdivisions=5)
    noisy, settings = rough(mesh, 0.003), Extraction(radius=0.4, levels=6, samples=32)
    plain = smooth(mesh, LENGTH)
    features = feature_points(plain, distances_on(plain, "geodesic"), 0.05)

    def lengths(each: Mesh) -> np.ndarray:
        parts = parts_around(each, distances_on(each, "geodesic"), features, settings)
        return parts.level_set_lengths * parts.diameter

    def off(each: Mesh) -> float:
        return float(np.abs(np.log(lengths(each) / lengths(plain))).mean())

    assert off(smooth(noisy, LENGTH)) < 0.03
    assert off(noisy) > 2 * off(smooth(noisy, LENGTH))
