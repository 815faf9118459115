import numpy as np
import pytest
from surface.shapes import sphere

from curvematch_jax.surface import Mesh, MeshError

POINTS = np.eye(4, 3)


def test_arrays_are_read_only_copies():
    vertices, faces = POINTS.copy(), np.array([[0, 1, 2]], dtype=np.int32)
    mesh = Mesh(vertices, faces)
    vertices[0], faces[0] = 9, 3
    assert mesh.vertices[0].tolist() == [1, 0, 0]
    assert mesh.faces.tolist() == [[0, 1, 2]]
    assert mesh.faces.dtype == np.int64
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("face", [[0, 1, 4], [0, 1, -1], [0, 1, 2**40]])
def test_index_out_of_range_is_an_index_error_and_a_mesh_error(face):
    with pytest.raises(IndexError, match="vertices are numbered 0 to 3") as caught:
        Mesh(POINTS, np.array([[0, 1, 2], face]), "broken")
    assert isinstance(caught.value, MeshError)
    assert str(caught.value).startswith("broken: face 1 is ")


@pytest.mark.parametrize(
    ("vertices", "faces", "reason"),
    [
        (np.zeros((4, 2)), [[0, 1, 2]], r"vertices must have shape \(v, 3\)"),
        (np.zeros((0, 3)), [[0, 1, 2]], r"vertices must have shape \(v, 3\)"),
        (POINTS, np.zeros((0, 3), int), r"faces must have shape \(f, 3\)"),
        (POINTS, [[0, 1, 2, 3]], r"faces must have shape \(f, 3\)"),
        (POINTS, [[0.0, 1.0, 2.0]], "faces must hold integers"),
        (np.where(POINTS == 1, np.nan, POINTS), [[0, 1, 2]], "3 vertices are not finite"),
    ],
)
def test_malformed_arrays_are_refused(vertices, faces, reason):
    with pytest.raises(MeshError, match=reason):
        Mesh(np.asarray(vertices), np.asarray(faces))


def test_a_good_mesh_is_taken_as_it_is():
    ball = sphere(1)
    assert (Mesh(ball.vertices, ball.faces).faces == ball.faces).all()
