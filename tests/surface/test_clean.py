import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surface.shapes import cube, joined, limbed, moved, soup, sphere, torus, without

from curvematch_jax.surface import CleanReport, Mesh, MeshError, clean
from curvematch_jax.surface._topology import (
    face_areas,
    face_components,
    is_closed_manifold,
    signed_volume,
    weld,
)


def assert_clean(mesh: Mesh, vertices: int) -> None:
    assert is_closed_manifold(mesh.vertices, mesh.faces)
    assert face_components(mesh.faces)[0] == 1
    assert signed_volume(mesh.vertices, mesh.faces) > 0
    again, report = clean(mesh, vertices=vertices)
    assert again is mesh
    assert report == CleanReport()
    assert report.messages == ()


def upper(mesh: Mesh, height: float) -> np.ndarray:
    """Faces that lie wholly above a height."""
    return np.flatnonzero(mesh.vertices[mesh.faces][:, :, 2].min(axis=1) > height)


def welded(*meshes: Mesh) -> Mesh:
    mesh = joined(*meshes)
    vertices, faces, _ = weld(mesh.vertices, mesh.faces)
    return Mesh(vertices, faces, "welded")


BALL = sphere(3)  # 642 vertices


def test_a_clean_mesh_comes_back_as_it_is():
    assert_clean(BALL, 600)
    assert_clean(torus(), 3000)


def test_a_soup_is_welded():
    cleaned, report = clean(soup(BALL), vertices=600)
    assert report == CleanReport(welded=3 * len(BALL.faces) - len(BALL.vertices))
    assert_clean(cleaned, 600)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_cracks_of_a_rounding_error_are_stitched(scale):
    torn = soup(moved(BALL, scale=scale))
    noise = 1e-8 * scale * np.random.default_rng(0).normal(size=torn.vertices.shape)
    cleaned, report = clean(Mesh(torn.vertices + noise, torn.faces), vertices=600)
    assert report.messages == (f"{3 * len(BALL.faces) - len(BALL.vertices)} vertices welded",)
    assert_clean(cleaned, 600)


def test_unused_vertices_degenerate_and_duplicate_faces_are_dropped():
    vertices = np.concatenate([[[9, 9, 9]], BALL.vertices, [[8, 8, 8]]])
    faces = np.concatenate([BALL.faces + 1, BALL.faces[:5, [1, 2, 0]] + 1, BALL.faces[:3, ::-1] + 1, [[1, 1, 2]]])
    cleaned, report = clean(Mesh(vertices, faces), vertices=600)
    assert report == CleanReport(dropped_faces=9, unused_vertices=2)
    assert (cleaned.vertices == BALL.vertices).all()
    assert (cleaned.faces == BALL.faces).all()


def test_the_largest_component_by_area_is_kept_and_the_others_reported():
    small = moved(sphere(4), (3, 0, 0), 0.2)  # more vertices, less area
    cleaned, report = clean(joined(small, BALL, moved(cube(), (9, 0, 0), 0.1)), vertices=600)
    assert (report.dropped_components, report.dropped_area) == (2, pytest.approx(0.04 + 0.06 / 13.1, abs=0.003))
    assert any(message.startswith("2 smaller components dropped, 4.") for message in report.messages)
    assert len(cleaned.vertices) == len(BALL.vertices)
    assert_clean(cleaned, 600)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_faces_are_turned_outwards(share):
    count = int(share * len(BALL.faces))
    turned = np.random.default_rng(0).choice(len(BALL.faces), count, replace=False)
    faces = BALL.faces.copy()
    faces[turned] = faces[turned, ::-1]
    cleaned, report = clean(Mesh(BALL.vertices, faces), vertices=600)
    assert report == CleanReport(flipped=count)
    assert signed_volume(cleaned.vertices, cleaned.faces) == pytest.approx(signed_volume(BALL.vertices, BALL.faces))
    assert_clean(cleaned, 600)


def test_bow_tie_is_cut_and_one_side_kept():
    pair = welded(moved(cube(10), (0, 0, 0), 2.0), moved(cube(10), (2, 2, 2)))
    cleaned, report = clean(pair, vertices=600)
    assert report == CleanReport(cut=1, dropped_components=1, dropped_area=report.dropped_area)
    assert report.dropped_area == pytest.approx(0.2)
    assert_clean(cleaned, 600)


def test_edge_of_four_faces_is_repaired():
    pair = welded(moved(cube(10), (0, 0, 0), 2.0), moved(cube(5), (2, 2, 0)))
    cleaned, report = clean(pair, vertices=600)
    assert report.cut > 0
    assert_clean(cleaned, 600)


def test_three_faces_on_one_edge_are_repaired():
    fin = np.concatenate([BALL.faces, [[*BALL.faces[0, :2], len(BALL.vertices)]]])
    cleaned, report = clean(Mesh(np.concatenate([BALL.vertices, [[0, 0, 2]]]), fin), vertices=600)
    assert report.cut > 0
    assert signed_volume(cleaned.vertices, cleaned.faces) == pytest.approx(
        signed_volume(BALL.vertices, BALL.faces), rel=0.02
    )
    assert_clean(cleaned, 600)


def test_holes_are_closed_and_reported():
    opened = without(BALL, np.concatenate([upper(BALL, 0.9), [0, len(BALL.faces) - 1]]))
    holes = 3 if 0 not in upper(BALL, 0.9) else 2
    cleaned, report = clean(opened, vertices=600)
    assert report.closed_holes == holes
    assert f"{holes} holes closed" in report.messages
    assert signed_volume(cleaned.vertices, cleaned.faces) == pytest.approx(
        signed_volume(BALL.vertices, BALL.faces), rel=0.05
    )
    assert_clean(cleaned, 600)


def test_a_surface_in_patches_stays_whole():
    """Body and limbs as open patches with gaps between them: no patch alone is the object."""
    mesh = limbed(subdivisions=4)
    radius = np.linalg.norm(mesh.vertices, axis=1)[mesh.faces]
    patches = without(mesh, np.flatnonzero((radius.min(axis=1) < 1.5) & (radius.max(axis=1) > 1.5)))
    number, _ = face_components(patches.faces)
    assert number == 7
    cleaned, report = clean(patches, vertices=2500)
    assert report.joined_patches == 7
    assert (np.ptp(cleaned.vertices, axis=0) > 0.98 * np.ptp(mesh.vertices, axis=0)).all()
    assert face_areas(cleaned.vertices, cleaned.faces).sum() == pytest.approx(
        face_areas(mesh.vertices, mesh.faces).sum(), rel=0.1
    )
    assert_clean(cleaned, 2500)


def test_loose_pieces_inside_a_closed_body_are_dropped():
    """Eyes and teeth: small closed and open pieces inside a body that is closed by itself."""
    eye = moved(sphere(2), (0.3, 0, 0), 0.1)
    tooth = moved(without(sphere(2), np.arange(40)), (0, 0.3, 0), 0.1)
    cleaned, report = clean(joined(eye, limbed(), tooth), vertices=2500)
    assert report.dropped_components == 2
    assert len(cleaned.vertices) == len(clean(limbed(), vertices=2500)[0].vertices)


TETRAHEDRON = Mesh(
    np.concatenate([np.zeros((1, 3)), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), "tetrahedron"
)


@pytest.mark.parametrize("mesh", [cube(), TETRAHEDRON], ids=lambda mesh: mesh.name)
def test_a_coarse_mesh_is_refined_and_stays_what_it_is(mesh):
    cleaned, report = clean(mesh, vertices=1000)
    assert report == CleanReport(refined=(len(mesh.vertices), len(cleaned.vertices)))
    assert report.warnings == ()
    assert 300 < len(cleaned.vertices) < 1700
    assert signed_volume(cleaned.vertices, cleaned.faces) == pytest.approx(signed_volume(mesh.vertices, mesh.faces))
    assert face_areas(cleaned.vertices, cleaned.faces).sum() == pytest.approx(
        face_areas(mesh.vertices, mesh.faces).sum()
    )
    assert_clean(cleaned, 1000)


def test_needles_are_refined():
    stretched = Mesh(sphere(4).vertices * [1, 1, 40], sphere(4).faces)
    cleaned, report = clean(stretched, vertices=2500)
    assert report == CleanReport(refined=(2562, len(cleaned.vertices)))
    assert_clean(cleaned, 2500)


def test_a_fine_mesh_stays_and_a_huge_one_is_decimated():
    assert clean(sphere(4), vertices=700)[0].vertices.shape == (2562, 3)
    cleaned, report = clean(sphere(5), vertices=600)
    assert report == CleanReport(decimated=(10242, len(cleaned.vertices)))
    assert report.warnings == ()
    assert len(cleaned.vertices) == pytest.approx(1200, rel=0.05)
    assert report.moved < 0.003
    assert_clean(cleaned, 600)


@pytest.mark.slow
def test_400000_vertices_are_decimated_first():
    huge = sphere(8)
    assert len(huge.vertices) > 400_000
    cleaned, report = clean(huge)
    assert report.messages[0].startswith("decimated from 655362 to ")
    assert_clean(cleaned, 5000)


@pytest.mark.parametrize("scale", [1e-3, 1e6])
def test_cleaning_is_scale_free_and_deterministic(scale):
    dirty = without(soup(limbed()), np.arange(30))
    cleaned, report = clean(dirty, vertices=1000)
    again, _ = clean(dirty, vertices=1000)
    assert (cleaned.vertices == again.vertices).all()
    assert (cleaned.faces == again.faces).all()
    scaled, scaled_report = clean(moved(dirty, scale=scale), vertices=1000)
    assert scaled_report.closed_holes == report.closed_holes
    assert len(scaled.vertices) == pytest.approx(len(cleaned.vertices), rel=0.03)
    assert np.ptp(scaled.vertices, axis=0) == pytest.approx(scale * np.ptp(cleaned.vertices, axis=0), rel=0.02)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_cleaning_twice_is_cleaning_once(seed):
    rng = np.random.default_rng(seed)
    mesh = limbed(rng.normal(size=(4, 3)), subdivisions=3)
    dirty = without(mesh, rng.choice(len(mesh.faces), rng.integers(0, 30), replace=False))
    faces = dirty.faces.copy()
    turned = rng.random(len(faces)) < 0.2
    faces[turned] = faces[turned, ::-1]
    dirty = joined(Mesh(dirty.vertices, faces), moved(sphere(1), (9, 9, 9), 0.1))
    cleaned, _ = clean(dirty, vertices=600)
    assert_clean(cleaned, 600)


MOEBIUS = Mesh(
    np.array([[np.cos(a), np.sin(a), z * 0.2] for a in 2 * np.pi * np.arange(12) / 12 for z in (-1, 1)]),
    np.array(
        [[2 * k, 2 * k + 1, 2 * k + 2] for k in range(11)]
        + [[2 * k + 1, 2 * k + 3, 2 * k + 2] for k in range(11)]
        + [[22, 23, 1], [23, 0, 1]]
    ),
    "strip",
)
SHEET = Mesh(
    np.array([[x, y, 0.0] for x in range(5) for y in range(5)]),
    np.array(
        [[5 * x + y, 5 * x + y + 5, 5 * x + y + 1] for x in range(4) for y in range(4)]
        + [[5 * x + y + 5, 5 * x + y + 6, 5 * x + y + 1] for x in range(4) for y in range(4)]
    ),
    "sheet",
)


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [
        (Mesh(np.eye(3), np.array([[0, 1, 2]]), "triangle"), "triangle: 1 faces cannot enclose a volume"),
        (Mesh(np.eye(4, 3), np.array([[0, 1, 2], [2, 1, 3]]), "kite"), "kite: 2 faces cannot enclose a volume"),
        (Mesh(np.eye(4, 3), np.array([[0, 0, 1]] * 5), "points"), "points: no face is left"),
        (MOEBIUS, "strip: the surface has one side only"),
        (SHEET, "sheet: the surface is flat"),
        (Mesh(cube(2).vertices * [1, 0, 0], cube(2).faces, "line"), "line: the surface is mostly needles"),
        (Mesh(np.outer(np.arange(24.0) ** 1.5, [0, 1, 0]), np.arange(24).reshape(8, 3), "lines"), "lie on one line"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_closed_surface_gets_one_sentence(mesh, reason):
    with pytest.raises(MeshError, match=reason) as caught:
        clean(mesh)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("mesh", "module"),
    [
        (without(BALL, np.array([3])), "pymeshfix"),
        (sphere(5), "fast_simplification"),
    ],
)
def test_without_the_extra_the_message_has_the_install_line(monkeypatch, mesh, module):
    for blocked in ("pymeshfix", "fast_simplification"):
        monkeypatch.setitem(sys.modules, blocked, None)
    with pytest.raises(ImportError, match=rf"needs {module}: pip install 'curvematch_jax\[prep\]'"):
        clean(mesh, vertices=600)


def test_without_the_extra_what_does_not_need_it_works(monkeypatch):
    for blocked in ("pymeshfix", "fast_simplification"):
        monkeypatch.setitem(sys.modules, blocked, None)
    assert_clean(clean(joined(soup(BALL), cube()), vertices=600)[0], 600)


def test_importing_surface_loads_no_mesh_library():
    libraries = {"trimesh", "potpourri3d", "pymeshfix", "fast_simplification"}
    code = f"import sys, curvematch_jax.surface; print(sorted({libraries} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.strip() == "[]"


def test_messages_are_empty_for_a_clean_mesh_only():
    assert CleanReport().messages == ()
    assert CleanReport(cut=2).messages == ("2 vertices added to cut non-manifold edges and vertices apart",)
