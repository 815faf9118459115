import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from surface.shapes import MADE, cube, joined, limbed, moved, sheared, sphere, torus

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._fields import Geodesics, check_field

MEDIAN, LARGEST = 0.02, 0.05


def strip(length: int) -> Mesh:
    """A closed square tube one unit thick and `length` units long, a vertex at each unit of each long edge."""
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    vertices = np.concatenate([np.insert(ring, 0, x, axis=1) for x in range(length + 1)]).astype(float)
    start = 4 * np.arange(length)[:, None] + np.arange(4)
    ahead = 4 * np.arange(length)[:, None] + (np.arange(4) + 1) % 4
    a, b = start.ravel(), ahead.ravel()
    sides = np.concatenate([np.stack([a, b, b + 4], axis=1), np.stack([a, b + 4, a + 4], axis=1)])
    caps = np.array([[0, 2, 1], [0, 3, 2]]), np.array([[0, 1, 2], [0, 2, 3]]) + 4 * length
    return Mesh(vertices, np.concatenate([sides[:, ::-1], *[cap[:, ::-1] for cap in caps]]), "strip")


def assert_agree(found: np.ndarray, exact: np.ndarray) -> None:
    away = exact > 0
    error = np.abs(found[away] / exact[away] - 1)
    assert np.median(error) <= MEDIAN
    assert error.max() <= LARGEST


def hull(points: np.ndarray) -> Mesh:
    made = trimesh.convex.convex_hull(points)
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces), "hull")


def scattered(kind: str, count: int, stretch: float, seed: int) -> Mesh:
    """The convex hull of points scattered over a sphere, a cylinder or a box, and stretched: triangles of all kinds."""
    rng = np.random.default_rng(seed)
    if kind == "ball":
        points = rng.normal(size=(count, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == "cylinder":
        angle = rng.uniform(0, 2 * np.pi, count)
        points = np.stack([np.cos(angle), np.sin(angle), rng.uniform(-1, 1, count)], axis=1)
    else:
        points = rng.uniform(-1, 1, (count, 3))
        points /= np.abs(points).max(axis=1, keepdims=True)
    return hull(points * [1, 1, stretch])


def exact_from(mesh: Mesh, source: int) -> np.ndarray:
    geodesic = pytest.importorskip("pygeodesic.geodesic")
    return geodesic.PyGeodesicAlgorithmExact(mesh.vertices, mesh.faces).geodesicDistances([source])[0]


@pytest.mark.parametrize("subdivisions", [3, 4])
def test_distances_on_the_sphere_are_angles(subdivisions):
    ball = sphere(subdivisions)
    distance = Geodesics(ball)(17)
    assert distance[17] == 0
    assert_agree(distance, np.arccos(np.clip(ball.vertices @ ball.vertices[17], -1, 1)))


@pytest.mark.parametrize("sides", [24, 60, 200])
@pytest.mark.parametrize("height", [0.5, 20])
def test_distances_on_a_cone_are_those_in_the_plane_sector(sides, height):
    angle = 2 * np.pi * np.arange(sides) / sides
    share = np.linspace(0, 1, 9)[1:]
    rings = share[:, None, None] * np.stack([np.cos(angle), np.sin(angle), np.full(sides, -height)], axis=1)
    vertices = np.concatenate([[[0, 0, 0]], rings.reshape(-1, 3)])
    k = np.arange(sides)
    ahead = (k + 1) % sides
    faces = [np.stack([np.zeros_like(k), 1 + k, 1 + ahead], axis=1)]
    for low in 1 + sides * np.arange(len(share) - 1):
        high = low + sides
        faces += [np.stack([low + k, high + k, high + ahead], axis=1)]
        faces += [np.stack([low + k, high + ahead, low + ahead], axis=1)]
    mesh = Mesh(vertices, np.concatenate(faces))  # open below
    distance = Geodesics(mesh)(1 + 3 * sides)
    edge = 2 * np.sin(np.pi / sides)
    slope = np.hypot(1, height)
    turn = 2 * np.arcsin(edge / 2 / slope)  # of one side of the cone, laid out flat
    steps = np.minimum(k, sides - k) * turn
    radius, source = slope * share, slope * share[3]
    flat = np.sqrt(radius[:, None] ** 2 + source**2 - 2 * radius[:, None] * source * np.cos(np.minimum(steps, np.pi)))
    assert_agree(distance, np.concatenate([[source], flat.ravel()]))


@pytest.mark.parametrize("sections", [12, 32, 64])
def test_the_ends_of_a_rod_are_as_far_apart_as_they_are(sections):
    made = trimesh.creation.cylinder(1, 100, sections=sections)
    rod = Mesh(np.asarray(made.vertices), np.asarray(made.faces))
    low = int(np.argmin(rod.vertices[:, 2] - 1e-3 * np.linalg.norm(rod.vertices[:, :2], axis=1)))
    distance = Geodesics(rod)(low)
    middle = np.flatnonzero((rod.vertices[:, 2] > 0) & (np.linalg.norm(rod.vertices[:, :2], axis=1) < 0.5))
    inner = np.cos(np.pi / sections) if sections % 2 else 1.0
    assert distance[middle[0]] == pytest.approx(100 + inner, rel=0.02)


@pytest.mark.parametrize("cells", [1, 2, 7, 20])
def test_opposite_corners_of_a_cube_are_root_five_apart(cells):
    box = cube(cells)
    start, end = (int(np.argmin(np.linalg.norm(box.vertices - place, axis=1))) for place in (0, 1))
    assert Geodesics(box)(start)[end] == pytest.approx(np.sqrt(5), rel=0.02)


@pytest.mark.parametrize("name", MADE)
def test_distances_on_meshes_of_cad_programs_are_exact(name):
    mesh = MADE[name]
    for source in (0, len(mesh.vertices) // 2):
        assert_agree(Geodesics(mesh)(source), exact_from(mesh, source))


@pytest.mark.parametrize(
    "mesh",
    [
        torus(),
        limbed(subdivisions=3),
        sheared(),
        moved(sphere(3), scale=1e-3),
        Mesh(sphere(3).vertices * [1, 1, 20], sphere(3).faces),
        Mesh(sphere(3).vertices * [1, 1, 0.05], sphere(3).faces),
    ],
    ids=["torus", "limbed", "sheared", "small", "cigar", "lens"],
)
def test_distances_on_smooth_surfaces_are_exact(mesh):
    for source in (0, len(mesh.vertices) // 2):
        assert_agree(Geodesics(mesh)(source), exact_from(mesh, source))


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(["ball", "cylinder", "box"]),
    st.integers(8, 400),
    st.floats(0.1, 10),
    st.integers(0, 2**32 - 1),
)
@example("cylinder", 112, 0.125, 0)  # needles, among which ways along lines too far apart are long
@example("cylinder", 239, 0.12371165378594186, 88243)
def test_distances_are_exact_on_any_triangles(kind, count, stretch, seed):
    mesh = scattered(kind, count, stretch, seed)
    assert_agree(Geodesics(mesh)(seed % len(mesh.vertices)), exact_from(mesh, seed % len(mesh.vertices)))


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e6])
def test_distances_scale_with_the_unit(scale):
    ball = sphere(3)
    one, other = Geodesics(ball)(0), Geodesics(moved(ball, (5 * scale, 0, 0), scale))(0)
    np.testing.assert_allclose(other, one * scale, rtol=1e-6)


def test_another_component_is_infinitely_far():
    pair = joined(sphere(2), moved(sphere(2), (3, 0, 0)))
    distance = Geodesics(pair)(0)
    half = len(distance) // 2
    assert np.isfinite(distance[:half]).all()
    assert np.isinf(distance[half:]).all()


def test_vertices_without_faces_are_infinitely_far():
    ball = sphere(2)
    mesh = Mesh(np.concatenate([ball.vertices, [[9, 9, 9]]]), ball.faces)
    distance = Geodesics(mesh)(0)
    assert np.isinf(distance[-1])
    assert np.isfinite(distance[:-1]).all()
    assert np.isinf(Geodesics(mesh)(len(ball.vertices))[:-1]).all()


def test_long_thin_strip_of_1e5_vertices_is_finite_and_monotone():
    length = 25_000
    distance = Geodesics(strip(length))(0)
    along = distance[0::4]
    assert len(distance) > 1e5
    assert np.isfinite(distance).all()
    assert (np.diff(along) > 0).all()
    assert along[-1] == pytest.approx(length, rel=0.01)


@pytest.mark.parametrize("source", [-1, 10_000])
def test_source_out_of_range(source):
    with pytest.raises(IndexError, match=f"source vertex {source} is not between 0 and 385"):
        Geodesics(cube(8))(source)


def test_fields_are_kept_and_read_only():
    geodesics = Geodesics(cube(8))
    assert geodesics(3) is geodesics(3)
    with pytest.raises(ValueError, match="read-only"):
        geodesics(3)[0] = 1


def test_unknown_method():
    with pytest.raises(ValueError, match="one of geodesic, diffusion, biharmonic, commute_time, found 'ex"):
        check_field("exact")
