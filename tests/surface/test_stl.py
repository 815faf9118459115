import struct

import numpy as np
import pytest
import trimesh
from surface.shapes import cube, limbed

from curvematch_jax.surface import MeshError, load_mesh
from curvematch_jax.surface._stl import parse_stl


def binary(vertices: np.ndarray, header: bytes = b"") -> bytes:
    rows = [np.zeros(3, "<f4").tobytes() + corners.astype("<f4").tobytes() + b"\0\0" for corners in vertices]
    return header.ljust(80, b"\0") + struct.pack("<I", len(rows)) + b"".join(rows)


CORNERS = cube().vertices[cube().faces]


@pytest.mark.parametrize("after", [b"", b"\n", b"made by a program", bytes(500)])
@pytest.mark.parametrize("header", [b"", b"solid cube"])
def test_bytes_after_the_last_triangle_are_passed_over(after, header):
    if header and after:
        return  # it says that it is text, and its length does not say otherwise
    vertices, faces = parse_stl(binary(CORNERS, header) + after)
    assert (vertices.reshape(-1, 3, 3) == CORNERS).all()
    assert (faces.ravel() == np.arange(36)).all()


def test_text_in_capitals_with_several_solids():
    facet = "FACET NORMAL 0 0 0\nOUTER LOOP\n" + "VERTEX {} {} {}\n" * 3 + "ENDLOOP\nENDFACET\n"
    facets = "".join(facet.format(*corners) for corners in CORNERS.reshape(-1, 9).tolist())
    vertices, _ = parse_stl(f"  SOLID one\n{facets}ENDSOLID one\nsolid two\n{facets}endsolid two\n".encode())
    assert (vertices.reshape(2, -1, 3, 3) == CORNERS).all()


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_what_trimesh_writes(tmp_path, kind):
    mesh = limbed(subdivisions=2)
    data = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type=kind)
    (tmp_path / "m.stl").write_bytes(data.encode() if isinstance(data, str) else data)
    loaded = load_mesh(tmp_path / "m.stl")
    assert len(loaded.vertices) == len(mesh.vertices)
    assert len(loaded.faces) == len(mesh.faces)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (binary(CORNERS)[:-1], "announces 12 triangles, and 11 follow"),
        (binary(CORNERS[:0]), "no faces in this STL file"),
        (b"solid a\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", "truncated STL file: it ends after 3 corners"),
        (b"solid a\nvertex 0 0 0\nvertex 1 0 0\nendsolid", "truncated STL file: it ends after 2 corners"),
        (b"solid a\nvertex 0 0 0\nvertex 1 0\n", "line 3 reads 'vertex 1 0'"),
    ],
)
def test_what_is_no_stl_gets_one_sentence(data, reason):
    with pytest.raises(MeshError, match=reason):
        parse_stl(data)
