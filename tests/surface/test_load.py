import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import trimesh
from surface.shapes import cube, limbed, sphere

from curvematch_jax.surface import Mesh, MeshError, clean, load_mesh
from curvematch_jax.surface._topology import is_closed_manifold

TETRAHEDRON = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
CORNERS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
QUADS = "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"


def as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 4 6\n{TETRAHEDRON}",
        f"OFF 4 4 6\n{TETRAHEDRON}",
        f"OFF4 4 6\n{TETRAHEDRON}",
        f"COFF4 4 6\n{TETRAHEDRON}",
        f"OFF4 4\n\n{TETRAHEDRON}",
        f"OFF\n4 4\n{TETRAHEDRON}",
        f"# made by hand\n\nOFF # the keyword\n# counts\n4 4 6\n\n{TETRAHEDRON}# the end\n",
        f"OFF\r\n4 4 6\r\n{TETRAHEDRON}".replace("\n", "\r\n").replace("\r\r", "\r"),
        "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3 0.5 0.5 0.5 1.0\n3 0 3 2 7\n3 1 2 3\n",
        "COFF\n4 4 6\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n0 0 1 1 0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
        "NOFF\n4 4 6\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n0 0 1 0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
    ],
    ids=[
        "plain",
        "counts on the first line",
        "without a space",
        "COFF without a space",
        "two counts without a space",
        "two counts",
        "comments",
        "CRLF",
        "face colours",
        "COFF",
        "NOFF",
    ],
)
def test_off_variants_hold_the_same_tetrahedron(tmp_path, text):
    mesh = load_mesh(written(tmp_path, "t.off", text))
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert mesh.faces.tolist() == [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    assert mesh.name == "t"


def test_off_polygons_become_fans_in_the_order_of_the_file(tmp_path):
    text = "OFF\n5 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n4 0 3 2 1\n3 0 1 4\n5 0 1 2 3 4\n"
    mesh = load_mesh(written(tmp_path, "p.off", text))
    assert mesh.faces.tolist() == [[0, 3, 2], [0, 2, 1], [0, 1, 4], [0, 1, 2], [0, 2, 3], [0, 3, 4]]


def test_off_quads_make_a_closed_cube(tmp_path):
    mesh = load_mesh(written(tmp_path, "q.off", f"OFF\n8 6 12\n{CORNERS}{QUADS}"))
    assert is_closed_manifold(mesh.vertices, mesh.faces)


def test_off_zero_area_faces_and_points_survive_loading_and_are_cleaned(tmp_path):
    ball = sphere(3)
    faces = [*ball.faces.tolist(), [0, 0, 1], [5, 5, 5]]
    lines = [f"OFF {len(ball.vertices)} {len(faces) + 1} 0", *(" ".join(map(repr, v)) for v in ball.vertices.tolist())]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces] + ["2 0 1"]
    mesh = load_mesh(written(tmp_path, "z.off", "\n".join(lines)))
    assert len(mesh.faces) == len(faces)
    cleaned, report = clean(mesh, vertices=600)
    assert report.messages == ("2 degenerate or duplicate faces dropped",)
    assert len(cleaned.faces) == len(ball.faces)


@pytest.mark.parametrize("suffix", ["off", "obj", "ply", "stl", "glb"])
def test_formats_agree(tmp_path, suffix):
    mesh = limbed(subdivisions=2)
    as_trimesh(mesh).export(path := tmp_path / f"m.{suffix}")
    loaded = load_mesh(path)
    assert len(loaded.vertices) == len(mesh.vertices)
    assert len(loaded.faces) == len(mesh.faces)
    assert is_closed_manifold(loaded.vertices, loaded.faces)
    np.testing.assert_allclose(np.sort(loaded.vertices, axis=0), np.sort(mesh.vertices, axis=0), atol=1e-6)


def test_obj_with_a_normal_for_each_corner_is_welded(tmp_path):
    vertices = "".join(f"v {line}\n" for line in CORNERS.splitlines())
    normals = "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 1 0 0\nvn 0 1 0\nvn -1 0 0\n"
    quads = [line.split()[1:] for line in QUADS.splitlines()]
    faces = "".join("f " + " ".join(f"{int(c) + 1}//{k + 1}" for c in quad) + "\n" for k, quad in enumerate(quads))
    mesh = load_mesh(written(tmp_path, "n.obj", vertices + normals + faces))
    assert len(mesh.vertices) == 8
    assert is_closed_manifold(mesh.vertices, mesh.faces)


def test_ply_with_a_normal_for_each_corner_is_welded(tmp_path):
    box = as_trimesh(cube())
    box.unmerge_vertices()
    box.export(path := tmp_path / "n.ply", vertex_normal=True)
    assert len(box.vertices) == 36
    assert len(load_mesh(path).vertices) == 8


def test_materials_outside_the_file_are_not_followed(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    image = written(outside, "secret.png", b"not an image")
    material = written(tmp_path, "m.mtl", f"newmtl a\nmap_Kd {image}\n")
    vertices = "".join(f"v {line}\n" for line in CORNERS.splitlines()[:4])
    path = written(tmp_path, "m.obj", f"mtllib m.mtl\n{vertices}usemtl a\nf 1 2 3\nf 1 3 4\n")
    for blocked in (material, image):
        blocked.unlink()
        blocked.mkdir()  # opening it would fail
    assert len(load_mesh(path).faces) == 2


def test_gltf_with_a_buffer_outside_is_refused(tmp_path):
    tree = trimesh.exchange.gltf.export_gltf(trimesh.Scene(as_trimesh(cube())))
    for name, content in tree.items():
        written(tmp_path, name, content)
    assert any(name.endswith(".bin") for name in tree)
    with pytest.raises(MeshError, match=r"model\.gltf: it keeps its buffer in another file"):
        load_mesh(tmp_path / "model.gltf")


def binary_stl(count: int, triangles: int) -> bytes:
    return b"\0" * 80 + struct.pack("<I", count) + b"\0" * 50 * triangles


GARBAGE = np.random.default_rng(0).integers(0, 256, 4000, dtype=np.uint8).tobytes()


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.off", b"", "the file is empty"),
        ("a.stl", b"", "the file is empty"),
        ("a.obj", b" \n", "the file is empty"),
        ("a.off", f"OFF\n4 4 6\n{TETRAHEDRON[:30]}", "truncated: it announces 4 vertices and 4 faces"),
        ("a.off", "OFF\n", "counts"),
        ("a.off", "OFF\n4 four\n", "counts"),
        ("a.off", "OFF\n-4 4 6\n" + TETRAHEDRON, "counts"),
        ("a.off", f"OFF\n4 4 6\n{TETRAHEDRON.replace('1 0 0', '1 0 zero')}", "vertex 1 reads '1 0 zero'"),
        ("a.off", f"OFF\n4 4 6\n{TETRAHEDRON.replace('1 0 0', '1 0')}", "vertex 1 reads '1 0'"),
        ("a.off", f"OFF\n4 4 6\n{TETRAHEDRON.replace('3 0 1 3', '3 0 1')}", "face 1 reads '3 0 1'"),
        ("a.off", f"OFF\n4 4 6\n{TETRAHEDRON.replace('3 0 1 3', '3 0 1 x')}", "not a vertex number"),
        ("a.off", f"OFF BINARY\n{TETRAHEDRON}", "binary OFF is not supported"),
        ("a.off", "OFF\n4000000000 4000000000 0\n" + TETRAHEDRON, "truncated"),
        ("a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "faces must have shape"),
        ("a.off", GARBAGE, "not an OFF file"),
        ("a.stl", GARBAGE, "no faces in this STL file"),
        ("a.ply", GARBAGE, "not a readable PLY file"),
        ("a.glb", GARBAGE, "not a readable GLB file"),
        ("a.obj", GARBAGE, "no faces"),
        ("a.stl", binary_stl(4_000_000_000, 3), "no faces in this STL file"),
        ("a.stl", b"solid x\n" * 10, "STL"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
        ("a.xyz", "0 0 0\n1 0 0\n", r"the suffix \.xyz names no mesh format"),
        ("a.txt", "hello", r"the suffix \.txt names no mesh format"),
        ("a", "hello", r"the suffix \(none\) names no mesh format"),
    ],
)
def test_files_that_are_no_meshes_get_one_sentence(tmp_path, name, content, reason):
    path = written(tmp_path, name, content)
    tracemalloc.start()
    try:
        with pytest.raises(MeshError, match=reason) as caught:
            load_mesh(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert peak < 1e8


def test_truncated_binaries_get_one_sentence(tmp_path):
    for suffix in ("stl", "ply", "glb"):
        data = as_trimesh(sphere(2)).export(file_type=suffix)
        with pytest.raises(MeshError, match=f"{suffix.upper()} file"):
            load_mesh(written(tmp_path, f"t.{suffix}", data[: len(data) // 2]))


def test_directory_and_missing_file(tmp_path):
    with pytest.raises(MeshError, match="is a directory"):
        load_mesh(tmp_path)
    with pytest.raises(MeshError, match="no such file"):
        load_mesh(tmp_path / "none.off")


@pytest.mark.parametrize("corner", ["7", "-1"])
def test_off_index_out_of_range(tmp_path, corner):
    path = written(tmp_path, "i.off", f"OFF\n4 4 6\n{TETRAHEDRON}".replace("3 1 2 3\n", f"3 1 2 {corner}\n"))
    with pytest.raises(IndexError, match=r"face 3 is \[1, 2, -?\d\], but the vertices are numbered 0 to 3") as caught:
        load_mesh(path)
    assert isinstance(caught.value, MeshError)


@pytest.mark.parametrize(
    "content", ["v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 8\n"]
)
def test_obj_index_out_of_range(tmp_path, content):
    with pytest.raises(MeshError) as caught:
        load_mesh(written(tmp_path, "i.obj", content))
    assert isinstance(caught.value, IndexError)


def test_coordinates_that_are_not_finite_are_refused(tmp_path):
    for word in ("nan", "inf"):
        path = written(tmp_path, "f.off", f"OFF\n4 4 6\n{TETRAHEDRON.replace('1 0 0', f'1 {word} 0')}")
        with pytest.raises(MeshError, match="1 vertices are not finite, the first is vertex 1"):
            load_mesh(path)


def test_name_is_the_callers_or_the_files(tmp_path):
    path = written(tmp_path, "model.3.off", f"OFF\n4 4 6\n{TETRAHEDRON}")
    assert load_mesh(path).name == "model.3"
    assert load_mesh(str(path), name="mine").name == "mine"


def test_gltf_scene_places_its_parts(tmp_path):
    scene = trimesh.Scene()
    for k in range(2):
        scene.add_geometry(as_trimesh(cube()), transform=trimesh.transformations.translation_matrix([3 * k, 0, 0]))
    path = written(tmp_path, "s.glb", scene.export(file_type="glb"))
    assert np.ptp(load_mesh(path).vertices, axis=0).tolist() == [4, 1, 1]
