"""Small valid files in every format that is read: what the fuzz harness starts from."""

from __future__ import annotations

import base64
import functools as ft
import json
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from curvematch_jax import Extraction, extract_parts, save_matrix, save_parts
from curvematch_jax.retrieval import SavedMatrix
from curvematch_jax.surface import Mesh

SETTINGS = Extraction(vertices=200, levels=5, samples=16)

# A file, or a folder as its files by their relative path.
Content = bytes | dict[str, bytes]


@ft.cache
def meshes() -> tuple[Mesh, ...]:
    """A tetrahedron, a cube, two balls, a torus, two components, and a cube that lacks a face."""
    import trimesh

    def made(solid: trimesh.Trimesh, name: str) -> Mesh:
        return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces), name)

    tetrahedron = Mesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), "t")
    cube = made(trimesh.creation.box(), "cube")
    ball = made(trimesh.creation.icosphere(subdivisions=2), "ball")
    two = Mesh(np.vstack([ball.vertices, cube.vertices + 3]), np.vstack([ball.faces, cube.faces + 162]), "two")
    return (
        tetrahedron,
        cube,
        ball,
        made(trimesh.creation.icosphere(subdivisions=1), "small ball"),
        made(trimesh.creation.torus(1.0, 0.4, major_sections=16, minor_sections=10), "torus"),
        two,
        made(trimesh.creation.torus(1.0, 0.4, major_sections=40, minor_sections=30), "fine torus"),
        Mesh(cube.vertices, cube.faces[1:], "open cube"),
    )


def off(mesh: Mesh) -> bytes:
    head = f"OFF\n{len(mesh.vertices)} {len(mesh.faces)} 0\n"
    return (head + _rows(mesh.vertices) + _rows(_counted(mesh.faces))).encode()


def obj(mesh: Mesh) -> bytes:
    """With texture coordinates, normals, and materials of a file that is not there."""
    corners = [" ".join(f"{v}/1/{v}" for v in face) for face in (mesh.faces + 1).tolist()]
    lines = [
        "# by hand",
        "mtllib materials.mtl",
        "o thing",
        *("v " + line for line in _rows(mesh.vertices).splitlines()),
        "vt 0 0",
        *("vn " + line for line in _rows(mesh.vertices).splitlines()),
        "usemtl paint",
        *("f " + line for line in corners),
    ]
    return ("\n".join(lines) + "\n").encode()


def ply(mesh: Mesh, encoding: str) -> bytes:
    head = (
        f"ply\nformat {encoding} 1.0\ncomment TextureFile paint.png\nelement vertex {len(mesh.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if encoding == "ascii":
        return head + (_rows(mesh.vertices) + _rows(_counted(mesh.faces))).encode()
    order = ">" if "big" in encoding else "<"
    faces = np.zeros(len(mesh.faces), dtype=[("count", "u1"), ("corners", f"{order}i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    return head + _single(mesh.vertices, order).tobytes() + faces.tobytes()


def stl_text(mesh: Mesh) -> bytes:
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    corners = mesh.vertices[mesh.faces]
    lines = ["".join(f"vertex {x} {y} {z}\n" for x, y, z in corner.tolist()) for corner in corners]
    return ("solid thing\n" + "".join(facet.format(line) for line in lines) + "endsolid thing\n").encode()


def stl(mesh: Mesh) -> bytes:
    facets = np.zeros(len(mesh.faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
    facets["corners"] = _single(mesh.vertices)[mesh.faces]
    return b"\0" * 80 + struct.pack("<I", len(mesh.faces)) + facets.tobytes()


def gltf_tree(mesh: Mesh) -> tuple[dict, bytes]:
    """The JSON of a scene with two placed copies, and its one buffer."""
    points, faces = _single(mesh.vertices).tobytes(), mesh.faces.astype("<u4").tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1, 2]},
            {"mesh": 0, "translation": [4, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]},
            {"mesh": 0, "matrix": np.eye(4).ravel().tolist()},
        ],
        "meshes": [{"name": "thing", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
        "accessors": [
            {"bufferView": 0, "byteOffset": 0, "componentType": 5126, "count": len(mesh.vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 3 * len(mesh.faces), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points), "byteStride": 12},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(faces)},
        ],
        "buffers": [{"byteLength": len(points) + len(faces)}],
    }
    return tree, points + faces


def glb_from(text: bytes, buffer: bytes) -> bytes:
    """The container around a JSON text and a buffer."""
    text, buffer = text + b" " * (-len(text) % 4), buffer + b"\0" * (-len(buffer) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf_from(tree: dict, buffer: bytes) -> dict:
    """The tree with its buffer inside."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    return tree | {"buffers": [{"byteLength": len(buffer), "uri": uri}]}


def glb(mesh: Mesh) -> bytes:
    tree, buffer = gltf_tree(mesh)
    return glb_from(json.dumps(tree).encode(), buffer)


def gltf(mesh: Mesh) -> bytes:
    return json.dumps(gltf_from(*gltf_tree(mesh))).encode()


@ft.cache
def parts_file() -> bytes:
    """What `save_parts` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p.npz"
        save_parts(extract_parts(meshes()[2], SETTINGS), path)
        return path.read_bytes()


@ft.cache
def _matrix_folder() -> dict[str, bytes]:
    values = np.linspace(0, 1, 9, dtype=np.float32).reshape(3, 3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "D.zarr"
        save_matrix(SavedMatrix(values, ("a", "b", "c"), {"extraction": {}, "matching": {}}, ("a remark",)), path)
        return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}


# Suffix, and the writer, of each kind of mesh file.
WRITERS: dict[str, tuple[str, Callable[[Mesh], bytes]]] = {
    "off": ("off", off),
    "obj": ("obj", obj),
    "ply_ascii": ("ply", ft.partial(ply, encoding="ascii")),
    "ply_little": ("ply", ft.partial(ply, encoding="binary_little_endian")),
    "ply_big": ("ply", ft.partial(ply, encoding="binary_big_endian")),
    "stl_ascii": ("stl", stl_text),
    "stl": ("stl", stl),
    "glb": ("glb", glb),
    "gltf": ("gltf", gltf),
}
FORMATS = (*WRITERS, "npz", "zarr")


def suffix_of(kind: str) -> str:
    return WRITERS[kind][0] if kind in WRITERS else kind


def seed_content(kind: str, random: np.random.Generator) -> Content:
    """A valid file of this kind."""
    if kind == "npz":
        return parts_file()
    if kind == "zarr":
        return dict(_matrix_folder())
    return WRITERS[kind][1](some_mesh(random))


def some_mesh(random: np.random.Generator) -> Mesh:
    return meshes()[random.integers(len(meshes()))]


def _single(values: np.ndarray, order: str = "<") -> np.ndarray:
    with np.errstate(over="ignore"):
        return values.astype(f"{order}f4")


def _rows(values: np.ndarray) -> str:
    return "".join(" ".join(map(repr, row)) + "\n" for row in values.tolist())


def _counted(faces: np.ndarray) -> np.ndarray:
    return np.insert(faces, 0, 3, axis=1)
