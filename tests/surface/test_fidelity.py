"""What is measured is the shape that was given: CAD models, soups, scans and places far from the origin."""

from contextlib import suppress

import numpy as np
import pytest
import trimesh
from surface.shapes import MADE, cube, joined, limbed, moved, soup, sphere, without

from curvematch_jax.surface import CleanReport, Mesh, MeshError, clean, extract_parts
from curvematch_jax.surface._topology import edges, face_areas, signed_volume

SLOW = pytest.mark.slow


def area(mesh: Mesh) -> float:
    return float(face_areas(mesh.vertices, mesh.faces).sum())


def volume(mesh: Mesh) -> float:
    return signed_volume(mesh.vertices, mesh.faces)


def exact_diameter(mesh: Mesh, starts: int = 12) -> float:
    """The longest of the exact distances from corners that are spread over a mesh, and from where these end."""
    geodesic = pytest.importorskip("pygeodesic.geodesic")
    solver = geodesic.PyGeodesicAlgorithmExact(mesh.vertices, mesh.faces)
    sources = set(np.linspace(0, len(mesh.vertices) - 1, starts).astype(int).tolist())
    longest = 0.0
    for _ in range(2):
        fields = [solver.geodesicDistances([source])[0] for source in sorted(sources)]
        longest = max(longest, *(float(field.max()) for field in fields))
        sources = {int(np.argmax(field)) for field in fields} - sources
        if not sources:
            break
    return longest


def test_there_are_thirty_shapes_of_8_to_200_vertices():
    assert len(MADE) >= 30
    assert all(6 <= len(mesh.vertices) <= 200 and edges(mesh.faces).count.max() == 2 for mesh in MADE.values())


@pytest.mark.parametrize("name", MADE)
def test_cleaning_keeps_the_shape(name):
    mesh = MADE[name]
    cleaned, report = clean(mesh)
    assert volume(cleaned) == pytest.approx(volume(mesh), rel=1e-6)
    assert area(cleaned) == pytest.approx(area(mesh), rel=1e-6)
    np.testing.assert_allclose(np.ptp(cleaned.vertices, axis=0), np.ptp(mesh.vertices, axis=0), rtol=1e-9)
    assert report.warnings == ()
    assert (report.moved, report.invented) == (0, 0)
    assert report.area == pytest.approx((area(mesh), area(mesh)))
    assert report.volume == pytest.approx((volume(mesh), volume(mesh)))


@pytest.mark.slow
@pytest.mark.parametrize("name", MADE)
def test_parts_are_of_the_shape_that_was_given(name):
    mesh = MADE[name]
    parts = extract_parts(mesh)
    assert len(parts.areas) >= 4
    assert parts.mask.any(axis=1).all()
    assert parts.area == pytest.approx(area(mesh), rel=0.03)
    assert parts.diameter == pytest.approx(exact_diameter(clean(mesh)[0]), rel=0.02)


@pytest.mark.parametrize("name", ["chair", "tee"])
def test_parts_of_a_few_shapes(name):
    mesh = MADE[name]
    parts = extract_parts(mesh)
    assert parts.mask.any(axis=1).all()
    assert parts.diameter == pytest.approx(exact_diameter(clean(mesh)[0], 4), rel=0.02)


def torn(mesh: Mesh, share: float, seed: int = 0) -> Mesh:
    """Every triangle on its own, its corners moved by up to a share of the width."""
    apart = soup(mesh)
    step = share * np.ptp(mesh.vertices, axis=0).max()
    return Mesh(apart.vertices + np.random.default_rng(seed).uniform(-step, step, apart.vertices.shape), apart.faces)


@pytest.mark.parametrize("mesh", [cube(), cube(5), MADE["chair"], MADE["rod of 8 sides"], sphere(3)])
@pytest.mark.parametrize("share", [1e-7, 1e-5])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_separate_triangles_become_the_surface_that_they_are(mesh, share, scale):
    whole, report = clean(moved(torn(mesh, share), scale=scale))
    assert area(whole) == pytest.approx(scale**2 * area(mesh), rel=0.01)
    assert volume(whole) == pytest.approx(scale**3 * volume(mesh), rel=0.01)
    assert report.welded == 3 * len(mesh.faces) - len(mesh.vertices)
    assert report.invented == 0


@pytest.mark.parametrize("mesh", [pytest.param(sphere(4), marks=SLOW), limbed(), cube(10)], ids=lambda mesh: mesh.name)
@pytest.mark.parametrize("missing", [0.3, pytest.param(0.5, marks=SLOW), 0.9])
def test_what_is_invented_is_said_or_refused(mesh, missing):
    rng = np.random.default_rng(0)
    kept = without(mesh, rng.choice(len(mesh.faces), int(missing * len(mesh.faces)), replace=False))
    with suppress(MeshError):
        assert_said(kept, *clean(kept))


def assert_said(kept: Mesh, closed: Mesh, report: CleanReport) -> None:
    assert area(closed) <= 1.9 * area(kept)
    assert report.invented > 0.01
    assert any("what closes it has" in warning for warning in report.warnings)


def test_a_scan_in_open_patches_keeps_its_area():
    mesh = limbed(subdivisions=4)
    half = np.flatnonzero(mesh.vertices[mesh.faces][:, :, 0].mean(axis=1) > 0.02)
    other = np.setdiff1d(np.arange(len(mesh.faces)), half)
    patches = joined(without(mesh, half), without(mesh, other[:-40]))
    closed, report = clean(patches)
    assert area(closed) == pytest.approx(area(mesh), rel=0.1)
    assert report.invented < 0.1


def fingered(count: int) -> Mesh:
    """A palm with fingers as a scan shows them: some 40,000 vertices."""
    angle = np.linspace(-1, 1, count)
    return limbed(np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1), subdivisions=6)


@pytest.mark.parametrize("fingers", [3, 5])
@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_a_decimated_scan_keeps_its_fingers(fingers, scale):
    scan = moved(fingered(fingers), scale=scale)
    cleaned, report = clean(scan)
    assert report.decimated[0] == len(scan.vertices) == 40_962
    assert report.warnings == ()
    assert volume(cleaned) == pytest.approx(volume(scan), rel=2e-3)
    assert area(cleaned) == pytest.approx(area(scan), rel=2e-3)
    np.testing.assert_allclose(np.ptp(cleaned.vertices, axis=0), np.ptp(scan.vertices, axis=0), rtol=2e-3)
    tips = scan.vertices[np.argsort(np.linalg.norm(scan.vertices, axis=1))[-fingers:]]
    assert np.linalg.norm(cleaned.vertices[:, None] - tips, axis=2).min(axis=0).max() < 0.01 * scale


def lopsided() -> Mesh:
    """No two of its points can be taken for each other."""
    mesh = limbed(np.array([[1, 0.2, 0.1], [-0.7, 0.9, 0.3], [0.1, -0.4, 1]]), subdivisions=4)
    return Mesh(mesh.vertices * [1, 1.3, 0.8], mesh.faces, "lopsided")


@pytest.mark.parametrize(
    "place", [pytest.param((5e5, 4.6e6, 0), marks=SLOW), (-3e5, 1e5, 7e6), pytest.param((1e7, 1e7, 1e7), marks=SLOW)]
)
@pytest.mark.parametrize(
    "mesh", [lopsided(), Mesh(MADE["angle"].vertices * [1, 1.1, 1.2], MADE["angle"].faces, "angle")]
)
def test_parts_far_from_the_origin_are_the_parts_moved(mesh, place):
    here, there = extract_parts(mesh), extract_parts(moved(mesh, place))
    width = np.ptp(mesh.vertices, axis=0).max()
    apart = np.linalg.norm(here.points[:, None] - (there.points - place), axis=2)
    order = apart.argmin(axis=1)  # ties may be settled otherwise
    assert sorted(order) == list(range(len(there.points)))
    assert apart.min(axis=1).max() < 1e-6 * width
    where = here.mask & there.mask[order]
    assert where.sum() >= 0.95 * here.mask.sum()
    np.testing.assert_allclose((there.centres - place)[order][where], here.centres[where], atol=1e-3 * width)
    assert there.diameter == pytest.approx(here.diameter, rel=1e-4)


@pytest.mark.parametrize("height", [pytest.param(0.5, marks=SLOW), 20, pytest.param(100, marks=SLOW)])
def test_a_rod_is_as_long_as_it_is_whatever_its_triangles(height):
    for sections in (5, 16, 48):
        made = trimesh.creation.cylinder(1, height, sections=sections)
        parts = extract_parts(Mesh(np.asarray(made.vertices), np.asarray(made.faces), "rod"))
        finer = made.subdivide()
        fine = extract_parts(Mesh(np.asarray(finer.vertices), np.asarray(finer.faces), "rod"))
        assert parts.diameter == pytest.approx(fine.diameter, rel=0.02)
