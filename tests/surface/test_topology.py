import numpy as np
import pytest
from surface.shapes import cube, joined, moved, soup, sphere, torus, without

from curvematch_jax.surface import _topology as topology


def test_edges_of_a_closed_surface_count_two_faces_and_satisfy_euler():
    for mesh, euler in ((sphere(2), 2), (cube(3), 2), (torus(), 0)):
        table = topology.edges(mesh.faces)
        assert (table.count == 2).all()
        assert len(mesh.vertices) - len(table.ends) + len(mesh.faces) == euler
        heads = mesh.faces[:, [1, 2, 0]].T.ravel()
        tails = mesh.faces.T.ravel()
        expected = np.sort(np.stack([tails, heads], axis=1), axis=1)
        assert (table.ends[table.of_halfedge] == expected).all()
        assert (table.forward == (tails < heads)).all()


def test_weld_undoes_a_soup():
    ball = sphere(2)
    vertices, faces, merged = topology.weld(*_arrays(soup(ball)))
    assert len(vertices) == len(ball.vertices)
    assert merged == 3 * len(ball.faces) - len(ball.vertices)
    assert (vertices[faces] == ball.vertices[ball.faces]).all()


def test_weld_takes_minus_zero_for_zero():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, 0, 0]])
    _, faces, merged = topology.weld(vertices, np.array([[0, 1, 2], [3, 2, 1]]))
    assert merged == 1
    assert faces.tolist() == [[0, 1, 2], [0, 2, 1]]


def test_bow_tie_vertex_is_split_in_two():
    first, second = cube(), moved(cube(), (1, 1, 1))
    vertices, faces, merged = topology.weld(*_arrays(joined(first, second)))
    assert merged == 1
    assert not topology.is_closed_manifold(vertices, faces)
    vertices, faces, added = topology.split_nonmanifold(vertices, faces)
    assert added == 1
    assert topology.is_closed_manifold(vertices, faces)


def test_edge_of_four_faces_is_cut():
    vertices, faces, _ = topology.weld(*_arrays(joined(cube(), moved(cube(), (1, 1, 0)))))
    vertices, faces, added = topology.split_nonmanifold(vertices, faces)
    assert added > 0
    assert topology.edges(faces).count.max() <= 2


def test_orientation_is_made_consistent_with_the_fewest_flips():
    ball = sphere(3)
    turned = np.random.default_rng(0).choice(len(ball.faces), 200, replace=False)
    faces = ball.faces.copy()
    faces[turned] = faces[turned, ::-1]
    oriented, flipped, two_sided = topology.orient(faces, topology.edges(faces))
    assert two_sided
    assert flipped == 200
    assert topology.signed_volume(ball.vertices, oriented) == pytest.approx(
        topology.signed_volume(ball.vertices, ball.faces)
    )


def test_moebius_strip_has_one_side():
    count = 12
    ring = np.arange(count)
    low, high = 2 * ring, 2 * ring + 1
    next_low, next_high = np.roll(low, -1), np.roll(high, -1)
    next_low[-1], next_high[-1] = next_high[-1], next_low[-1]
    faces = np.concatenate([np.stack([low, high, next_low], axis=1), np.stack([high, next_high, next_low], axis=1)])
    assert not topology.orient(faces, topology.edges(faces))[2]


def test_components():
    number, label = topology.face_components(joined(sphere(1), moved(sphere(1), (3, 0, 0)), cube()).faces)
    assert number == 3
    assert np.bincount(label).tolist() == [80, 80, 12]


def test_areas_and_volume():
    box = cube(4)
    assert topology.face_areas(box.vertices, box.faces).sum() == pytest.approx(6)
    assert topology.signed_volume(box.vertices, box.faces) == pytest.approx(1)
    assert topology.signed_volume(box.vertices, box.faces[:, ::-1]) == pytest.approx(-1)


def test_surface_with_a_hole_is_not_closed():
    ball = without(sphere(2), np.array([0]))
    assert not topology.is_closed_manifold(ball.vertices, ball.faces)


def _arrays(mesh):
    return mesh.vertices, mesh.faces
