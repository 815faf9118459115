import functools as ft
from itertools import pairwise

import numpy as np
import potpourri3d
import pytest
import scipy.linalg
from scipy.special import eval_legendre
from surface.shapes import AXES, bridged, cube, horseshoe, joined, limbed, moved, sphere

from curvematch_jax.surface import Extraction, Mesh, Parts, extract_parts
from curvematch_jax.surface._fields import distances_on
from curvematch_jax.surface._parts import prepared
from curvematch_jax.surface._spectral import _EIGENPAIRS, _TIME, SpectralDistances, eigenpairs

FIELDS = ("diffusion", "biharmonic", "commute_time")
WEIGHTS = {"diffusion": lambda l: np.exp(-_TIME * l), "biharmonic": lambda l: 1 / l, "commute_time": lambda l: l**-0.5}


@ft.cache
def limbs(field: str, scale: float = 1.0, shift: float = 0.0) -> SpectralDistances:
    return SpectralDistances(moved(limbed(subdivisions=3), (shift, 0, 0), scale), field)


def dense(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Cotangents, and vertex areas that add up to 1."""
    stiffness = potpourri3d.cotan_laplacian(mesh.vertices, mesh.faces).toarray()
    return stiffness, np.diag(potpourri3d.vertex_areas(mesh.vertices, mesh.faces)) / mesh.area


def test_eigenvalues_of_the_sphere():
    ball = sphere(4)
    eigenvalues, _ = eigenpairs(ball, 48)
    degree = np.arange(1, 7)
    np.testing.assert_allclose(eigenvalues / (4 * np.pi), np.repeat(degree * (degree + 1), 2 * degree + 1), rtol=0.02)


@pytest.mark.parametrize("subdivisions", [2, 3], ids=["dense", "Lanczos"])
def test_eigenpairs_solve_the_generalised_problem(subdivisions):
    mesh = limbed(subdivisions=subdivisions)
    stiffness, mass = dense(mesh)
    eigenvalues, functions = eigenpairs(mesh, _EIGENPAIRS)
    exact = scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=(1, _EIGENPAIRS))
    np.testing.assert_allclose(eigenvalues, exact, rtol=1e-8)
    np.testing.assert_allclose(functions.T @ mass @ functions, np.eye(_EIGENPAIRS), atol=1e-8)
    np.testing.assert_allclose(stiffness @ functions, mass @ functions * eigenvalues, atol=1e-8 * eigenvalues[-1])


@pytest.mark.parametrize("field", FIELDS)
def test_distances_on_the_sphere_are_those_of_its_harmonics(field):
    ball = sphere(3)
    source = 17
    degree = np.arange(1, 12)
    eigenvalue = 4 * np.pi * degree * (degree + 1)  # of the sphere of area 1
    fading = 1 - eigenvalue / (4 * np.pi * 12 * 13)
    weight = (fading * WEIGHTS[field](eigenvalue)) ** 2 * (2 * degree + 1)
    cosine = np.clip(ball.vertices @ ball.vertices[source], -1, 1)
    squared = 4 * np.pi * (weight * 2 * (1 - eval_legendre(degree, cosine[:, None]))).sum(axis=1)
    distance = SpectralDistances(ball, field)(source)
    np.testing.assert_allclose(distance, np.sqrt(np.maximum(squared, 0)), atol=0.04 * distance.max())


def test_biharmonic_distance_on_the_sphere_grows_with_the_angle():
    ball = sphere(3)
    distance = SpectralDistances(ball, "biharmonic")(0)
    angle = np.arccos(np.clip(ball.vertices @ ball.vertices[0], -1, 1))
    rings = [distance[np.abs(angle - middle) < 0.06] for middle in np.arange(0.2, np.pi, 0.2)]
    assert all(inner.max() < outer.min() for inner, outer in pairwise(rings))


def test_all_eigenpairs_make_the_pseudo_inverse():
    """Commute time is the resistance between two points, biharmonic distance comes from the Green function squared."""
    mesh = limbed(subdivisions=2)
    stiffness, mass = dense(mesh)
    eigenvalues, functions = eigenpairs(mesh, len(mesh.vertices))
    assert len(eigenvalues) == len(mesh.vertices) - 1
    average = np.eye(len(mass)) - mass.sum(axis=0) / mass.sum()  # takes a function's mean on the surface off
    green = average @ np.linalg.pinv(stiffness) @ average.T
    for kernel, power in ((green, 1), (green @ mass @ green, 2)):
        exact = np.diag(kernel) + kernel[3, 3] - 2 * kernel[3]
        squared = ((functions - functions[3]) ** 2 / eigenvalues**power).sum(axis=1)
        np.testing.assert_allclose(squared, exact, atol=1e-8 * exact.max())


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_distances_scale_with_the_unit(field, scale):
    one, other = limbs(field)(0), limbs(field, scale, 5 * scale)(0)
    np.testing.assert_allclose(other, one * scale, rtol=1e-6, atol=1e-6 * scale)


@pytest.mark.parametrize("field", FIELDS)
def test_distances_are_a_metric(field):
    distances = limbs(field)
    matrix = np.stack([distances(v) for v in range(0, 642, 10)])[:, ::10]
    np.testing.assert_array_equal(matrix, matrix.T)
    assert (np.diag(matrix) == 0).all()
    assert (matrix + np.eye(len(matrix)) > 0).all()
    assert (matrix[:, None] <= matrix[:, :, None] + matrix[None] + 1e-9).all()


@pytest.mark.parametrize("field", FIELDS)
def test_distances_are_deterministic(field):
    np.testing.assert_array_equal(SpectralDistances(limbed(subdivisions=3), field)(5), limbs(field)(5))


@pytest.mark.parametrize("field", FIELDS)
def test_distances_depend_little_on_the_mesh(field):
    coarse, fine = limbs(field)(0), SpectralDistances(limbed(subdivisions=4), field)(0)[:642]  # of 2562
    np.testing.assert_allclose(coarse, fine, atol=0.1 * fine.max())


def test_a_degenerate_face_does_no_harm():
    box = cube(8)
    a, b, c = box.faces[0]
    between = len(box.vertices)
    vertices = np.concatenate([box.vertices, [(box.vertices[a] + box.vertices[b]) / 2]])
    faces = np.concatenate([box.faces[1:], [[a, between, c], [between, b, c], [b, between, a]]])
    one, other = SpectralDistances(box, "biharmonic"), SpectralDistances(Mesh(vertices, faces), "biharmonic")
    np.testing.assert_allclose(other(50)[:between], one(50), atol=0.02 * one(50).max())
    assert other(50)[between] == pytest.approx((one(50)[a] + one(50)[b]) / 2, rel=0.05)


def test_what_is_not_connected_is_refused():
    ball = sphere(2)
    for mesh in (joined(ball, moved(ball, (3, 0, 0))), Mesh(np.concatenate([ball.vertices, [[9, 9, 9]]]), ball.faces)):
        with pytest.raises(ValueError, match="spectral distances need one connected surface"):
            SpectralDistances(mesh, "biharmonic")


@pytest.mark.parametrize("field", FIELDS)
def test_every_tip_is_a_part_with_all_its_curves(field):
    mesh = limbed(subdivisions=4)
    parts = extract_parts(mesh, Extraction(radius=0.4, levels=4, samples=32, vertices=2500, field=field))
    cosine = (parts.points / np.linalg.norm(parts.points, axis=1, keepdims=True)) @ AXES.T
    assert len(parts.points) == 6
    assert (cosine.max(axis=0) > 0.99).all()
    assert parts.mask.all()
    measured, _ = prepared(mesh, parts.settings)
    area = potpourri3d.vertex_areas(measured.vertices, measured.faces).sum()
    assert parts.diameter == pytest.approx(1.5 * np.sqrt(area))
    redrawn = parts.curves[0, 0] * parts.lengths[0, 0] * parts.diameter + parts.centres[0, 0][:, None]
    nearest = np.linalg.norm(mesh.vertices[:, None] - redrawn.T, axis=2).min(axis=0)
    assert nearest.max() < 0.22


@pytest.fixture(scope="module")
def short_cut() -> tuple[Mesh, Mesh]:
    """A horseshoe, and the same with a thin bridge between its ends."""
    mesh = horseshoe()
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    first, second = (int(np.linalg.norm(centres - end - [0, 0, 0.25], axis=1).argmin()) for end in mesh.vertices[:2])
    return mesh, bridged(mesh, first, second)


def test_a_short_cut_shortens_spectral_distances_less(short_cut):
    before, after = short_cut
    left = {
        field: distances_on(after, field)(0)[1] / distances_on(before, field)(0)[1] for field in ("geodesic", *FIELDS)
    }
    assert left["geodesic"] < 0.25
    assert min(left[field] for field in FIELDS) > 0.55


def test_a_short_cut_changes_geodesic_parts_much_more(short_cut):
    """Feature points move away from the ends, and what is left around them has other curves."""
    moves, sizes = {}, {}
    for field in ("geodesic", "diffusion", "commute_time"):
        settings = Extraction(radius=0.4, levels=6, samples=40, vertices=2500, field=field)
        before, after = (extract_parts(mesh, settings) for mesh in short_cut)
        moves[field], sizes[field] = changes(before, after, short_cut[0].vertices[:2])
    for field in ("diffusion", "commute_time"):
        assert moves[field] < 0.4
        assert moves["geodesic"] > 1.4 * moves[field]
        assert sizes["geodesic"] > 2 * sizes[field]


def changes(before: Parts, after: Parts, ends: np.ndarray) -> tuple[float, float]:
    """How far the points next to the ends move, and the mean change of the logarithm of their curves' lengths."""
    one, other = (np.linalg.norm(parts.points - ends[:, None], axis=2).argmin(axis=1) for parts in (before, after))
    both = before.mask[one] & after.mask[other]
    ratio = before.lengths[one][both] / after.lengths[other][both]
    moved_by = np.linalg.norm(before.points[one] - after.points[other], axis=1)
    return float(moved_by.mean()), float(np.abs(np.log(ratio)).mean())
