import numpy as np
import pytest
from surface.shapes import cube, joined, moved, sphere

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._fields import Geodesics, check_field

FIELDS = ("heat", "fast_marching")


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


@pytest.mark.parametrize("field", FIELDS)
def test_distances_on_the_sphere_are_angles(field):
    ball = sphere(4)
    distance = Geodesics(ball, field)(17)
    exact = np.arccos(np.clip(ball.vertices @ ball.vertices[17], -1, 1))
    assert distance[17] == 0
    assert np.abs(distance - exact).max() < 0.03 * np.pi


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e6])
def test_distances_scale_with_the_unit(field, scale):
    ball = sphere(3)
    one, other = Geodesics(ball, field)(0), Geodesics(moved(ball, (5 * scale, 0, 0), scale), field)(0)
    np.testing.assert_allclose(other, one * scale, rtol=1e-6)


@pytest.mark.parametrize("field", FIELDS)
def test_another_component_is_infinitely_far(field):
    pair = joined(sphere(2), moved(sphere(2), (3, 0, 0)))
    distance = Geodesics(pair, field)(0)
    half = len(distance) // 2
    assert np.isfinite(distance[:half]).all()
    assert np.isinf(distance[half:]).all()


@pytest.mark.parametrize("field", FIELDS)
def test_vertices_without_faces_are_infinitely_far(field):
    ball = sphere(2)
    mesh = Mesh(np.concatenate([ball.vertices, [[9, 9, 9]]]), ball.faces)
    distance = Geodesics(mesh, field)(0)
    assert np.isinf(distance[-1])
    assert np.isfinite(distance[:-1]).all()


@pytest.mark.parametrize("field", FIELDS)
def test_long_thin_strip_of_1e5_vertices_is_finite_and_monotone(field):
    length = 25_000
    distance = Geodesics(strip(length), field)(0)
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
    with pytest.raises(ValueError, match="one of heat, fast_marching, diffusion, biharmonic, commute_time, found 'ex"):
        check_field("exact")
