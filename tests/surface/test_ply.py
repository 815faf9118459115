import numpy as np
import pytest
import trimesh
from surface.shapes import limbed

from curvematch_jax.surface import MeshError, load_mesh
from curvematch_jax.surface._ply import parse_ply
from curvematch_jax.surface._topology import edges, face_areas

CORNERS = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 1, 0], [0, 4, 0], [2, 1, 3]], dtype=float)
POLYGONS = [[4, 3, 2, 1, 0], [0, 1, 5], [2, 3, 5, 1], [3, 4, 5], [4, 0, 5]]
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def header(encoding: str, *elements: str) -> bytes:
    return "\n".join(["ply", f"format {encoding} 1.0", "comment made", *elements, "end_header", ""]).encode()


def written_lists(lists: list[list[int]], order: str) -> bytes:
    if not order:
        return "".join(" ".join(map(str, [len(row), *row])) + "\n" for row in lists).encode()
    return b"".join(np.array(len(row), "u1").tobytes() + np.array(row, order + "i4").tobytes() for row in lists)


def written_points(points: np.ndarray, order: str) -> bytes:
    if not order:
        return "".join(" ".join(map(repr, row)) + "\n" for row in points.tolist()).encode()
    return points.astype(order + "f8").tobytes()


POINTS = ("element vertex 6", "property double x", "property double y", "property double z")


@pytest.mark.parametrize("encoding", ORDERS)
def test_polygons_of_different_sizes(encoding):
    order = ORDERS[encoding]
    head = header(encoding, *POINTS, f"element face {len(POLYGONS)}", "property list uchar int vertex_indices")
    vertices, faces = parse_ply(head + written_points(CORNERS, order) + written_lists(POLYGONS, order))
    assert (vertices == CORNERS).all()
    assert len(faces) == sum(len(polygon) - 2 for polygon in POLYGONS)
    assert face_areas(vertices, faces[:3]).sum() == pytest.approx(10)
    assert (edges(faces).count == 2).all()


@pytest.mark.parametrize("encoding", ORDERS)
def test_triangle_strips(encoding):
    order = ORDERS[encoding]
    strip = [0, 1, 2, 3, -1, 5, 4, 3]
    head = header(encoding, *POINTS, "element tristrips 1", "property list uchar int vertex_indices")
    _, faces = parse_ply(head + written_points(CORNERS, order) + written_lists([strip], order))
    assert faces.tolist() == [[0, 1, 2], [2, 1, 3], [5, 4, 3]]


def test_other_properties_and_elements_are_passed_over():
    head = header(
        "binary_little_endian",
        *POINTS,
        "property uchar red",
        "element extra 2",
        "property list uint8 float32 values",
        "property short more",
        "element face 2",
        "property uchar flags",
        "property list uchar int vertex_index",
        "property list uchar float texcoord",
    )
    body = b"".join(row.astype("<f8").tobytes() + b"\x07" for row in CORNERS)
    body += b"\x01" + np.array([1], "<f4").tobytes() + b"\0\0" + b"\0" + b"\0\0"
    for row in ([0, 1, 2], [3, 4, 5]):
        body += b"\x09\x03" + np.array(row, "<i4").tobytes() + b"\x02" + np.zeros(2, "<f4").tobytes()
    vertices, faces = parse_ply(head + body)
    assert (vertices == CORNERS).all()
    assert faces.tolist() == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_what_trimesh_writes(tmp_path, encoding):
    mesh = limbed(subdivisions=2)
    data = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="ply", encoding=encoding)
    (tmp_path / "m.ply").write_bytes(data)
    loaded = load_mesh(tmp_path / "m.ply")
    np.testing.assert_allclose(loaded.vertices, mesh.vertices, atol=1e-6)
    assert (loaded.faces == mesh.faces).all()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (header("ascii", *POINTS) + written_points(CORNERS, ""), "no faces in this PLY file"),
        (header("ascii", *POINTS[:3]) + written_points(CORNERS, ""), "its vertices have no x, y and z"),
        (header("ebcdic", *POINTS), "names no format that is known"),
        (header("ascii", *POINTS, "property list float int vertex_indices"), "'property list float int"),
        (header("ascii", *POINTS, "property matrix a"), "'property matrix a'"),
        (
            header("ascii", *POINTS, "element face 1", "property list uchar int vertex_indices")
            + written_points(CORNERS, "")
            + b"3 0 1 x\n",
            "a face reads '3 0 1 x'",
        ),
        (
            header("ascii", *POINTS, "element face 1", "property int vertex_indices")
            + written_points(CORNERS, "")
            + b"3\n",
            "the corners of its faces are no lists",
        ),
        (
            header("binary_little_endian", *POINTS, "element face 2", "property list uchar int vertex_indices")
            + written_points(CORNERS, "<")
            + written_lists([[0, 1, 2, 3]], "<")[:-2],
            "truncated",
        ),
    ],
)
def test_what_is_malformed_gets_one_sentence(data, reason):
    with pytest.raises(MeshError, match=reason) as caught:
        parse_ply(data)
    assert "\n" not in str(caught.value)
