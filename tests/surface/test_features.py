import numpy as np
import pytest
from surface.shapes import AXES, cube, limbed, moved, sphere, torus

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._features import diameter_pair, feature_points, local_extrema
from curvematch_jax.surface._fields import Geodesics
from curvematch_jax.surface._topology import edges

GRID = 9


def sheet() -> np.ndarray:
    """Ends of the edges of a GRID x GRID grid; vertex `GRID * row + column`."""
    low = (GRID * np.arange(GRID - 1)[:, None] + np.arange(GRID - 1)).ravel()
    first = np.stack([low, low + 1, low + GRID], axis=1)
    return edges(np.concatenate([first, np.stack([low + 1, low + GRID + 1, low + GRID], axis=1)])).ends


def bowl() -> np.ndarray:
    row, column = np.divmod(np.arange(GRID * GRID), GRID)
    return ((row - 4.0) ** 2 + (column - 4.0) ** 2) * 1.001**row * 1.003**column


def test_a_bowl_has_its_bottom_and_four_corners():
    corners = [0, GRID - 1, GRID * (GRID - 1), GRID * GRID - 1]
    assert local_extrema(sheet(), bowl()).tolist() == sorted([4 * GRID + 4, *corners])


def test_a_plateau_is_one_place():
    flat = np.maximum(bowl(), 3)  # a flat bottom of many vertices
    bottom = np.flatnonzero(flat == 3)
    assert len(bottom) > 5
    found = local_extrema(sheet(), flat)
    assert len(found) == 5
    assert set(found) & set(bottom) == {bottom.min()}


def test_a_terrace_is_no_extremum():
    row = np.repeat(np.arange(GRID), GRID).astype(float)
    row[(row == 4) | (row == 5)] = 4.5
    assert local_extrema(sheet(), row).tolist() == [0, GRID * (GRID - 1)]  # the two ends are plateaus themselves


def test_a_constant_has_no_extremum():
    assert len(local_extrema(sheet(), np.ones(GRID * GRID))) == 0


def test_diameter_pair_is_antipodal_on_the_sphere_and_scales():
    ball = sphere(4)
    v1, v2, diameter = diameter_pair(ball, Geodesics(ball))
    assert ball.vertices[v1] @ ball.vertices[v2] < -0.99
    assert diameter == pytest.approx(np.pi, rel=0.03)
    large = moved(ball, scale=1e3)
    assert diameter_pair(large, Geodesics(large))[2] == pytest.approx(1e3 * diameter, rel=0.005)


def test_diameter_pair_finds_the_longest_limbs():
    mesh = limbed(AXES[:4])
    stretched = Mesh(mesh.vertices * [1, 1.6, 1], mesh.faces)
    v1, v2, diameter = diameter_pair(stretched, Geodesics(stretched))
    assert np.abs(stretched.vertices[[v1, v2], 1]).max() > 2.5
    assert diameter >= 0.99 * max(Geodesics(stretched)(v).max() for v in range(0, 2562, 160))
    assert v1 != v2


@pytest.mark.parametrize("subdivisions", [4, 5])
def test_every_tip_is_found_once(subdivisions):
    mesh = limbed(subdivisions=subdivisions)
    features = feature_points(mesh, Geodesics(mesh), 0.05)
    tips = mesh.vertices[features.vertices]
    assert not features.fallback
    assert len(tips) == 6
    cosine = (tips / np.linalg.norm(tips, axis=1, keepdims=True)) @ AXES.T
    assert (cosine.max(axis=0) > 0.99).all()


def test_points_are_more_than_epsilon_apart():
    mesh = limbed(np.concatenate([AXES, np.ones((1, 3))]))
    geodesics = Geodesics(mesh)
    for epsilon in (0.02, 0.1, 0.3):
        features = feature_points(mesh, geodesics, epsilon)
        chosen = features.vertices.tolist()
        apart = [geodesics(a)[b] for a in chosen for b in chosen if a != b]
        assert not apart or min(apart) > epsilon * features.diameter


@pytest.mark.parametrize("mesh", [sphere(3), torus(), cube(10)], ids=lambda mesh: mesh.name)
def test_shapes_without_limbs_get_a_deterministic_answer(mesh):
    one, other = (feature_points(mesh, Geodesics(mesh), 0.05) for _ in range(2))
    assert len(one.vertices) >= 1
    assert one.vertices.tolist() == other.vertices.tolist()


def test_without_a_common_extremum_the_ends_of_the_diameter_stand_in(monkeypatch):
    monkeypatch.setattr("curvematch_jax.surface._features._candidates", lambda *_: np.zeros(0, dtype=np.int64))
    mesh = sphere(3)
    features = feature_points(mesh, Geodesics(mesh), 0.05)
    assert features.fallback
    assert features.vertices.tolist() == list(features.ends)
