"""Files that were made to do harm, or might as well have been: what `python -m tests.fuzz` has found, and its like."""

import base64
import json
import struct
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import trimesh
from surface.shapes import cube, joined, limbed, moved, sphere

from curvematch_jax.surface import Extraction, Mesh, MeshError, clean, extract_parts, load_mesh
from curvematch_jax.surface._levels import LevelSets
from curvematch_jax.surface._mesh import MeshIndexError

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
SMALL = Extraction(vertices=200, levels=5, samples=16)


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def refused(path: Path, reason: str, seconds: float = 5.0, peak: float = 2e8) -> MeshError:
    """Loading is refused in one sentence that names the file, soon, and without much memory."""
    tracemalloc.start()
    start = time.thread_time()
    try:
        with pytest.raises(MeshError, match=reason) as caught:
            load_mesh(path)
        took, (_, most) = time.thread_time() - start, tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert str(caught.value).startswith(f"{path}: ")
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < len(str(path)) + 250
    assert took < seconds
    assert most < peak
    return caught.value


def document(mesh: Mesh | None = None, **changes) -> dict:
    """A glTF file with its buffer inside; without a mesh that of a tetrahedron."""
    mesh = mesh or Mesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    points, faces = mesh.vertices.astype("<f4").tobytes(), mesh.faces.astype("<u2").tobytes()
    return {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(mesh.vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": mesh.faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(faces)},
        ],
        "buffers": [
            {
                "byteLength": len(points + faces),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(points + faces).decode(),
            }
        ],
        **changes,
    }


def points_accessor(**changes) -> dict:
    plain = document()
    return document(accessors=[plain["accessors"][0] | changes, plain["accessors"][1]])


# Text


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n{'9' * 5000} 4 6\n",
        f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{'9' * 5000} 0 1 2\n",
        f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 x{'y' * 5000} 0\n3 0 1 2\n",
        f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {'9' * 5000}\n",
    ],
)
def test_off_with_endless_numbers(tmp_path, text):
    refused(written(tmp_path, "a.off", text), "malformed OFF")


def test_obj_with_a_material_for_each_face_is_read_in_no_time(tmp_path):
    faces = "".join(f"usemtl m{k}\no part\nf 1 2 3\n" for k in range(20_000))
    start = time.thread_time()
    assert len(load_mesh(written(tmp_path, "a.obj", TETRAHEDRON + faces)).faces) == 20_000
    assert time.thread_time() - start < 5


@pytest.mark.parametrize("line", ["f 1 2 0", "f 1 2 -5"])
def test_obj_index_of_no_vertex(tmp_path, line):
    error = refused(written(tmp_path, "a.obj", f"{TETRAHEDRON}{line}\n"), f"line 5 reads '{line}'")
    assert isinstance(error, MeshIndexError)


@pytest.mark.parametrize("line", ["f 1 2 x", f"f 1 2 {'9' * 5000}", "v 1 2", "v 1 2 x", "f 1 2 ١"])
def test_obj_malformed_line(tmp_path, line):
    refused(written(tmp_path, "a.obj", f"{TETRAHEDRON}{line}\n"), f"malformed OBJ: line 5 reads '{line[:20]}")


def test_obj_negative_indices_count_from_their_line_and_comments_and_continued_lines_are_read(tmp_path):
    text = "v 0 0 0 # one\nv 1 0 0\nv 0 1 0\nf -3 -2 \\\n-1\nv 0 0 1\nf -1/1/1 -4//2 -3 # two\n"
    assert load_mesh(written(tmp_path, "a.obj", text)).faces.tolist() == [[0, 1, 2], [3, 0, 1]]


@pytest.mark.parametrize(
    "head", ["mtllib ../../etc/passwd\nusemtl x\n", "call ../x.obj\n", "maplib /etc/passwd\n", "\ufeff"]
)
def test_obj_lines_that_name_files_are_skipped(tmp_path, head):
    assert len(load_mesh(written(tmp_path, "a.obj", head + TETRAHEDRON + "f 1 2 3\n")).faces) == 1


# PLY and STL


def ply(elements: str, body: str | bytes, encoding: str = "ascii") -> bytes:
    head = f"ply\nformat {encoding} 1.0\n{elements}end_header\n".encode()
    return head + (body.encode() if isinstance(body, str) else body)


POINTS = "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face {}\nproperty list uchar int vertex_indices\n"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (ply(POINTS.format(4_000_000_000), "0 0 0\n"), "announces 4000000000 lines of data, and 1 follow"),
        (ply(POINTS.format(4_000_000_000), b"\0" * 12, "binary_little_endian"), "announces 48000000000 bytes"),
        (ply(POINTS.format(3) + FACES.format(2), "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "announces 5 lines of data, and 4"),
        (ply(POINTS.format(3) + FACES.format(-1), b"\0" * 36, "binary_big_endian"), "'element face -1'"),
        (ply(POINTS.format("9" * 5000), "0 0 0\n"), "'element vertex 9999"),
        (
            ply("element vertex 3\n" + "".join(f"property list int int p{k}\n" for k in range(8000)), ""),
            "too many|header",
        ),
        (ply("property float x\n", ""), "'property float x'"),
        (b"ply\n" + b"comment x\n" * 50_000, "no header from ply to end_header"),
    ],
)
def test_ply_that_announces_more_than_it_has(tmp_path, content, reason):
    refused(written(tmp_path, "a.ply", content), reason)


def test_ply_texture_outside_is_not_followed(tmp_path):
    body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    path = written(
        tmp_path, "a.ply", ply("comment TextureFile /etc/passwd\n" + POINTS.format(3) + FACES.format(1), body)
    )
    assert len(load_mesh(path).faces) == 1


def test_stl_of_thousands_of_solids(tmp_path):
    solid = "solid a\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendsolid a\n"
    assert len(load_mesh(written(tmp_path, "a.stl", solid * 4000)).faces) == 4000


def test_stl_with_a_word_that_is_no_number_is_not_cut_off_there(tmp_path):
    facets = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n" * 2 + "vertex x 0 0\n" + "vertex 0 0 0\n" * 3
    refused(written(tmp_path, "a.stl", f"solid a\n{facets}endsolid a\n"), "not a readable STL file")


# glTF


@pytest.mark.parametrize(
    "uri", ["../../../etc/passwd", "file:///etc/passwd", "http://127.0.0.1:9/a.bin", "data:,x", "/etc/passwd", ""]
)
def test_gltf_buffers_elsewhere_are_not_followed(tmp_path, uri):
    path = written(tmp_path, "a.gltf", json.dumps(document(buffers=[{"byteLength": 72, "uri": uri}])))
    refused(path, "in another file")


@pytest.mark.parametrize(
    ("tree", "reason"),
    [
        (
            points_accessor(count=4_000_000_000),
            "an accessor of 4000000000 elements does not fit its buffer of 48 bytes",
        ),
        (points_accessor(count=-1), "count is -1"),
        (points_accessor(count=1e300), "count is 1e"),
        (points_accessor(byteOffset=4), "does not fit"),
        (points_accessor(byteOffset=2**80), "does not fit"),
        (points_accessor(sparse={"count": 1}), "sparse or compressed"),
        (points_accessor(type="VEC2"), "'VEC2'"),
        (points_accessor(componentType=7), "malformed glTF: 7"),
        (points_accessor(bufferView=9), "there is no entry 9 in bufferViews"),
        (points_accessor(bufferView=-1), "there is no entry -1 in bufferViews"),
        (document(bufferViews=[{"buffer": 0, "byteLength": 48, "byteStride": 1}] * 2), "does not fit"),
        (document(bufferViews=[{"buffer": 0, "byteLength": 10**12}] * 2), "a buffer view ends at 1000000000000"),
        (document(buffers=[{"uri": "data:;base64,@"}]), "not base64|ends at"),
        (document(nodes=[{"mesh": 0, "children": [0]}]), "node 0 has two places"),
        (document(nodes=[{"children": [1, 1]}, {"mesh": 0}]), "node 1 has two places"),
        (document(nodes=[{"mesh": 0, "matrix": [1] * 15}]), "malformed glTF"),
        (document(nodes=[{"mesh": 0, "rotation": [1]}]), "malformed glTF"),
        (document(scene=3), "there is no entry 3 in scenes"),
        (document(asset={"version": "1.0"}), "version '1.0' is not supported"),
        (document(nodes=[]), "there is no entry 0 in nodes"),
        (document(scenes=[{}]), "its scene shows no triangles"),
        (document(meshes=[{"primitives": [{"attributes": {}}]}]), "malformed glTF"),
        (document(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 9}]}]), "mode 9"),
        ([], "malformed glTF"),
    ],
)
def test_gltf_that_contradicts_itself(tmp_path, tree, reason):
    refused(written(tmp_path, "a.gltf", json.dumps(tree)), reason)


def test_gltf_index_out_of_range(tmp_path):
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    tree = document(mesh)
    tree["accessors"][0]["count"] = 2
    refused(written(tmp_path, "a.gltf", json.dumps(tree)), "names none of its mesh's 2 vertices")


@pytest.mark.parametrize("text", ["[" * 200_000, '{"a":' * 100_000, "{", b"\xff\xfe", "1" * 5000])
def test_gltf_json_bombs(tmp_path, text):
    refused(written(tmp_path, "a.gltf", text), "malformed glTF")


def test_gltf_that_places_a_mesh_ever_again(tmp_path):
    ball = sphere(3)
    many = document(ball, nodes=[{"mesh": 0}] * 20_000, scenes=[{"nodes": list(range(20_000))}])
    refused(written(tmp_path, "a.gltf", json.dumps(many)), "far more triangles", peak=8e8)
    once = document(ball, meshes=[{"primitives": document()["meshes"][0]["primitives"] * 20_000}])
    refused(written(tmp_path, "b.gltf", json.dumps(once)), "far more triangles", peak=8e8)
    few = document(ball, nodes=[{"mesh": 0}, {"mesh": 0, "translation": [9, 0, 0]}], scenes=[{"nodes": [0, 1]}])
    assert len(load_mesh(written(tmp_path, "c.gltf", json.dumps(few))).faces) == 2 * len(ball.faces)


def test_gltf_deep_chain_of_nodes(tmp_path):
    nodes = [{"children": [k + 1], "translation": [1, 0, 0]} for k in range(5000)] + [{"mesh": 0}]
    mesh = load_mesh(written(tmp_path, "a.gltf", json.dumps(document(nodes=nodes))))
    assert mesh.vertices.min(axis=0).tolist() == [5000, 0, 0]


def test_gltf_places_parts_as_trimesh_does(tmp_path):
    scene = trimesh.Scene()
    solid = trimesh.Trimesh(limbed(subdivisions=1).vertices, limbed(subdivisions=1).faces, process=False)
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]) @ np.diag([1.0, 2, 3, 1])
    scene.add_geometry(solid, node_name="a", transform=turn)
    scene.add_geometry(
        solid, node_name="b", parent_node_name="a", transform=trimesh.transformations.scale_and_translate(2, [5, 6, 7])
    )
    data = scene.export(file_type="glb")
    theirs = trimesh.load_scene(trimesh.util.wrap_as_stream(data), file_type="glb").to_mesh()
    ours = load_mesh(written(tmp_path, "a.glb", data))
    assert ours.faces.shape == theirs.faces.shape
    np.testing.assert_allclose(
        np.sort(ours.vertices[ours.faces].mean(axis=1), axis=0), np.sort(theirs.triangles_center, axis=0), atol=1e-5
    )


@pytest.mark.parametrize(("mode", "faces"), [(5, [[0, 1, 2], [3, 2, 1]]), (6, [[0, 1, 2], [0, 2, 3]])])
def test_gltf_strips_and_fans(tmp_path, mode, faces):
    primitive = {"attributes": {"POSITION": 0}, "mode": mode}
    path = written(tmp_path, "a.gltf", json.dumps(document(meshes=[{"primitives": [primitive]}])))
    assert load_mesh(path).faces.tolist() == faces


def test_glb_with_chunks_longer_than_the_file(tmp_path):
    head = struct.pack("<4sII", b"glTF", 2, 60)
    refused(
        written(tmp_path, "a.glb", head + struct.pack("<I4s", 2**32 - 1, b"JSON") + b"{}" * 20),
        "longer than what is left",
    )
    refused(written(tmp_path, "b.glb", head + struct.pack("<I4s", 40, b"BIN\0") + b"{}" * 20), "no JSON chunk")
    refused(written(tmp_path, "c.glb", head + b"{}" * 10), "announces 60 bytes and has 32")


# Surfaces


@pytest.mark.parametrize("scale", [1e-200, 1e-20, 1e20, 1e154, 1e300])
def test_sizes_whose_squares_overflow_are_refused(scale):
    with pytest.raises(MeshError, match=r"^sphere: it is \S+ units wide; scale it"):
        extract_parts(moved(sphere(2), scale=scale), SMALL)


@pytest.mark.parametrize("scale", [1e-14, 1e14])
def test_parts_do_not_depend_on_the_unit(scale):
    one, other = (
        extract_parts(moved(limbed(subdivisions=3), scale=s), Extraction(vertices=640, levels=5, samples=16))
        for s in (1.0, scale)
    )
    np.testing.assert_allclose(other.lengths, one.lengths, rtol=1e-3, atol=1e-3)
    assert other.diameter == pytest.approx(one.diameter * scale, rel=1e-4)


def test_a_mesh_too_far_from_the_origin_is_refused():
    with pytest.raises(MeshError, match="too far for its size"):
        clean(moved(sphere(2), offset=(1e12, 0, 0)))


@pytest.mark.parametrize(("scale", "reason"), [(1e-300, "units wide; scale it"), (1e-10, "too far for its size")])
def test_what_is_left_without_degenerate_faces_is_held_to_the_same_sizes(scale, reason):
    speck = moved(sphere(2), offset=(1, 0, 0) if scale > 1e-20 else (0, 0, 0), scale=scale)
    corners = np.concatenate([speck.vertices, [[1.0, 1, 1], [0, 0, 1]]])
    far = [[0, len(corners) - 2, len(corners) - 2], [1, len(corners) - 1, len(corners) - 1]]
    with pytest.raises(MeshError, match=reason):
        extract_parts(Mesh(corners, np.concatenate([speck.faces, far])), SMALL)


@pytest.mark.parametrize("scale", [1e-6, 1e-12])
def test_faces_far_away_that_are_dropped_do_not_matter(scale):
    mesh = moved(sphere(2), scale=scale)
    corners = np.concatenate([mesh.vertices, [[1.0, 1, 1]]])
    cleaned, _ = clean(Mesh(corners, np.concatenate([mesh.faces, [[0, 162, 162]]])), vertices=200)
    np.testing.assert_allclose(cleaned.vertices[:162], mesh.vertices, rtol=1e-3, atol=1e-3 * scale)


def test_an_unused_vertex_at_the_end_of_the_world_does_not_matter():
    mesh = sphere(2)
    cleaned, report = clean(Mesh(np.vstack([mesh.vertices, [[1e308, -1e308, 0]]]), mesh.faces), vertices=200)
    assert report.messages == ("1 unused vertices dropped",)
    np.testing.assert_array_equal(cleaned.vertices, mesh.vertices)


def test_lines_and_needles_are_refused_soon():
    flat, thin = np.array([1.0, 0, 0]), np.array([1.0, 1e-9, 1e-9])
    for factors in (flat, thin):
        for mesh in (cube(4), joined(*(moved(cube(2), (3 * k, 0, 0)) for k in range(9)))):
            holed = Mesh(mesh.vertices * factors, mesh.faces[1:], "needle")
            start = time.thread_time()
            with pytest.raises(MeshError, match=r"^needle: "):
                extract_parts(holed, SMALL)
            assert time.thread_time() - start < 5


def test_specks_far_apart_are_refused_soon():
    speck = Mesh(np.eye(3) * 1e-5, np.array([[0, 1, 2]]))
    mesh = joined(*(moved(speck, (k % 5, k // 5, k % 3)) for k in range(20)))
    with pytest.raises(MeshError, match="mostly needles"):
        clean(mesh, vertices=200)


def test_hundreds_of_patches_are_refused_soon():
    patch = Mesh(np.array([[0, 0, 0], [0.9, 0, 0], [0.9, 0.9, 0], [0, 0.9, 0.1]]), np.array([[0, 1, 2], [0, 2, 3]]))
    mesh = joined(*(moved(patch, (k % 30, k // 30, 0)) for k in range(900)))
    start = time.thread_time()
    with pytest.raises(MeshError, match="900 holes with 3600 border edges are too many to close"):
        clean(mesh)
    assert time.thread_time() - start < 5


@pytest.mark.parametrize("seed", range(12))
def test_a_cloud_of_torn_triangles_ends_in_parts_or_one_sentence(seed):
    mesh = Mesh(cube().vertices, np.random.default_rng(seed).integers(0, 8, (40, 3)), "cloud")
    try:
        parts = extract_parts(mesh, SMALL)
    except MeshError as error:
        message = str(error)
    else:
        message = "cloud: "
        assert np.isfinite(parts.lengths).all()
        assert np.isfinite(parts.feature_distances).all()
    assert message.startswith("cloud: ")


def test_level_sets_pass_by_faces_that_are_level():
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), np.array([[0, 1, 2], [1, 3, 2]]))
    level = np.array([0.0, 1, 1, 1])
    np.testing.assert_allclose(LevelSets(mesh, level, np.array([0.5])).level_set_lengths, [np.sqrt(0.5)])
