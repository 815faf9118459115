"""Files of a few hundred kilobytes at most that are out to cost gigabytes or minutes once read."""

from __future__ import annotations

import functools as ft
import json
import struct
from collections.abc import Callable

import numpy as np

from ._npz import zip_bomb
from ._seeds import Content, glb_from, gltf_from, gltf_tree, meshes, ply, seed_content

Random = np.random.Generator

_TRIANGLE = b"0 0 0\n1 0 0\n0 1 0\n"
_FACET = b"vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"


def bomb(kind: str, random: Random) -> Content:
    """One of the bombs of this kind of file."""
    options = _BOMBS[kind]
    return options[int(random.integers(len(options)))]()


def _obj(lines: bytes) -> bytes:
    return b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + lines


def _numbered(line: str, count: int) -> bytes:
    return "".join(line.format(k) for k in range(count)).encode()


def _ply(head: bytes, body: bytes = b"", encoding: str = "ascii") -> bytes:
    return f"ply\nformat {encoding} 1.0\n".encode() + head + b"end_header\n" + body


def _points(count: int) -> bytes:
    return b"element vertex %d\nproperty float x\nproperty float y\nproperty float z\n" % count


def _gltf(binary: bool, **changes: object) -> bytes:
    tree, buffer = gltf_tree(meshes()[2])
    if not binary:
        tree = gltf_from(tree, buffer)
    text = json.dumps(tree | changes).encode()
    return glb_from(text, buffer) if binary else text


def _accessors(binary: bool, **changes: object) -> bytes:
    accessors = gltf_tree(meshes()[2])[0]["accessors"]
    return _gltf(binary, accessors=[accessors[0] | changes, *accessors[1:]])


def _unbacked(binary: bool) -> bytes:
    """Points that are all zeros, and in no buffer."""
    points = {"componentType": 5126, "count": 300_000_000, "type": "VEC3"}
    return _gltf(binary, accessors=[points, gltf_tree(meshes()[2])[0]["accessors"][1]])


def _gltf_bombs(binary: bool) -> list[Callable[[], Content]]:
    ball = gltf_tree(meshes()[2])[0]
    chain = [{"children": [k + 1], "translation": [1, 0, 0], "mesh": 0} for k in range(8_000)] + [{"mesh": 0}]
    doubling = [{"children": [k + 1, k + 1]} for k in range(2_000)] + [{"mesh": 0}]
    make = ft.partial(_gltf, binary)
    return [
        ft.partial(make, nodes=[{"mesh": 0}] * 60_000, scenes=[{"nodes": list(range(60_000))}]),
        ft.partial(make, nodes=chain),
        ft.partial(make, nodes=doubling),
        ft.partial(make, nodes=[{"children": [0, 1], "mesh": 0}, {"children": [0]}]),
        ft.partial(make, nodes=[{"mesh": 0, "children": list(range(500))}] * 500),
        ft.partial(make, meshes=[{"primitives": ball["meshes"][0]["primitives"] * 12_000}]),
        ft.partial(make, meshes=ball["meshes"] * 9_000, nodes=[{"mesh": k} for k in range(9_000)]),
        ft.partial(make, bufferViews=ball["bufferViews"] + [ball["bufferViews"][1]] * 9_000),
        ft.partial(make, accessors=ball["accessors"] + [ball["accessors"][1]] * 9_000),
        ft.partial(_unbacked, binary),
        ft.partial(_accessors, binary, count=4_000_000_000),
        ft.partial(_accessors, binary, count=-1),
        ft.partial(_accessors, binary, sparse={"count": 4_000_000_000}),
        ft.partial(make, extras=_nested(300)),
        lambda: (glb_from if binary else lambda text, _: text)(b"[" * 200_000, b""),
        lambda: (glb_from if binary else lambda text, _: text)(b'{"a":' * 100_000, b""),
    ]


def _nested(depth: int) -> object:
    value: object = 0
    for _ in range(depth):
        value = [value]
    return value


def _zarr(**changes: object) -> Content:
    files = seed_content("zarr", np.random.default_rng(0))
    assert isinstance(files, dict)
    name = "dissimilarity/zarr.json"
    files[name] = json.dumps(json.loads(files[name]) | changes).encode()
    return files


def _grid(*chunk: int) -> dict:
    return {"name": "regular", "configuration": {"chunk_shape": list(chunk)}}


_BOMBS: dict[str, list[Callable[[], Content]]] = {
    "off": [
        lambda: b"OFF\n4000000000 4000000000 0\n" + _TRIANGLE,
        lambda: b"OFF\n3 1 0\n" + _TRIANGLE + b"4000000000 0 1 2\n",
        lambda: b"OFF\n3 1 0\n" + _TRIANGLE + b"100000" + b" 0 1" * 50_000 + b"\n",
        lambda: b"OFF\n3 60000 0\n" + _TRIANGLE + b"3 0 1 2\n" * 60_000,
        lambda: b"OFF\n" + b"9" * 200_000 + b" 1 0\n" + _TRIANGLE,
        lambda: b"OFF\n3 1 0\n" + _TRIANGLE + b"9" * 200_000 + b" 0 1 2\n",
        lambda: b"OFF\n3 1 0\n0 0 " + b"9" * 200_000 + b"\n" + _TRIANGLE + b"3 0 1 2\n",
        lambda: b"OFF\n50000 1 0\n" + b"0 0 0\n" * 50_000 + b"3 0 1 2\n",
        lambda: b"OFF\n" + b"#\n" * 100_000,
    ],
    "obj": [
        lambda: _obj(_numbered("usemtl m{}\nf 1 2 3\n", 20_000)),
        lambda: _obj(_numbered("o m{}\nf 1 2 3\n", 20_000)),
        lambda: _obj(b"g a\nf 1 2 3\n" * 20_000),
        lambda: _obj(b"usemtl a\nusemtl b\n" * 10_000 + b"f 1 2 3\n"),
        lambda: _obj(b"f" + b" 1 2 3" * 40_000 + b"\n"),
        lambda: _obj(b"f 1 2 3\nf" + b" 1 2 3 4" * 30_000 + b"\n"),
        lambda: _obj(b"f 1 2 9223372036854775807\n"),
        lambda: _obj(b"f 1/9223372036854775807/1 2/1/1 3/1/1\n"),
        lambda: _obj(b"f 1 2 3\\\n" * 30_000),
        lambda: _obj(b"f 1 2 3\n" * 2_000 + b"v 0 0 0\nf -1 -2 -3\n" * 10_000),
        lambda: _obj(b"f " + b"1" * 200_000 + b" 2 3\n"),
        lambda: b"v 0 0 0\n" * 50_000 + b"f 1 2 3\n",
    ],
    "ply_ascii": [
        lambda: _ply(_points(4_000_000_000), _TRIANGLE),
        lambda: _ply(_numbered("element a{} 1\nproperty float x\n", 10_000), b"0\n" * 10_000),
        lambda: _ply(b"element vertex 3\n" + _numbered("property float a{}\n", 10_000), _TRIANGLE),
        lambda: _ply(b"element vertex 3\n" + _numbered("property list int int a{}\n", 10_000), _TRIANGLE),
        lambda: _ply(_points(3) + b"element face 1\nproperty list int int vertex_index\n", _TRIANGLE + b"2e9 0 1 2\n"),
        lambda: _ply(
            _points(3) + b"element face 1\nproperty list int int vertex_index\n", _TRIANGLE + b"3" + b" 1" * 99_999
        ),
        lambda: _ply(b"comment x\n" * 50_000),
        lambda: b"ply\n" + b"a" * 500_000,
        lambda: _ply(
            _points(3) + b"element edge 3\nproperty int vertex1\nproperty int vertex2\n", _TRIANGLE + b"0 1\n1 2\n2 0\n"
        ),
        lambda: _ply(_points(20_000) + b"element face 9\n", b"0 0 0\n" * 20_009),
    ],
    "stl_ascii": [
        lambda: (b"solid a\n" + _FACET + b"endsolid a\n") * 4_000,
        lambda: _numbered("solid a{}\n" + _FACET.decode() + "endsolid\n", 4_000),
        lambda: b"solid\n" * 80_000 + b"endsolid\n",
        lambda: b"solid a\n" + b"endsolid solid\n" * 30_000,
        lambda: b"solid " + b"vertex" * 80_000 + b"\nendsolid\n",
        lambda: b"solid a\n" + b"vertex 0 0 " + b"9" * 300_000 + b"\nendsolid\n",
        lambda: b"solid a\n" + _FACET * 8_000 + b"endsolid\n",
    ],
    "stl": [
        lambda: b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50,
        lambda: b"solid" + b"\0" * 75 + struct.pack("<I", 4_000) + b"\0" * 50 * 4_000,
        lambda: b"\0" * 80 + struct.pack("<I", 5_000) + np.random.default_rng(0).bytes(50 * 5_000),
    ],
    "glb": _gltf_bombs(True),
    "gltf": _gltf_bombs(False),
    "npz": [ft.partial(zip_bomb, 256), lambda: seed_content("npz", np.random.default_rng(0))[:-64] + b"0" * 64],  # type: ignore[operator]
    "zarr": [
        ft.partial(_zarr, shape=[60_000, 60_000]),
        ft.partial(_zarr, shape=[60_000, 60_000], chunk_grid=_grid(60_000, 60_000)),
        ft.partial(_zarr, shape=[60_000, 60_000], chunk_grid=_grid(1, 1)),
        ft.partial(_zarr, shape=[2**62, 2**62]),
        ft.partial(_zarr, chunk_grid=_grid(40_000, 40_000)),
        ft.partial(_zarr, chunk_grid=_grid(0, 0)),
        ft.partial(_zarr, chunk_grid=_grid(-1, 3)),
        ft.partial(_zarr, shape=[3, 3, 3]),
        ft.partial(_zarr, data_type="string"),
        ft.partial(_zarr, data_type="object"),
        ft.partial(_zarr, data_type={"name": "numpy.void", "configuration": {"length_bytes": 2**31}}),
        ft.partial(_zarr, codecs=[{"name": "numcodecs.pickle", "configuration": {}}]),
        ft.partial(_zarr, codecs=[{"name": "bytes"}] * 2_000),
        ft.partial(_zarr, codecs=[{"name": "sharding_indexed", "configuration": {"chunk_shape": [1, 1]}}]),
        ft.partial(_zarr, chunk_key_encoding={"name": "default", "configuration": {"separator": "/../../../../"}}),
        ft.partial(_zarr, storage_transformers=[{"name": "x"}]),
        ft.partial(_zarr, attributes=_nested(900)),
        lambda: {"zarr.json": b'{"a":' * 100_000},
    ],
}


def _wide(encoding: str) -> list[Callable[[], Content]]:
    """PLY with binary bodies."""
    make = ft.partial(_ply, encoding=encoding)
    face = b"element face 4000000000\nproperty list uchar int vertex_indices\n"
    return [
        lambda: make(_points(4_000_000_000), b"\0" * 36),
        lambda: make(_points(3) + face, b"\0" * 50),
        lambda: make(b"element vertex 3\n" + _numbered("property list int int a{}\n", 8_000), b"\0" * 99_999),
        lambda: make(b"element vertex 3\n" + _numbered("property float a{}\n", 8_000), b"\0" * 96_000),
        lambda: make(_numbered("element a{} 0\nproperty float x\n", 8_000)),
        lambda: make(
            _points(3) + b"element face -12\nproperty uchar x\nelement face2 12\nproperty uchar x\n", b"\0" * 36
        ),
        lambda: make(_points(0) + b"element face 1\nproperty list int double vertex_indices\n", b"\x7f" * 400),
        lambda: ply(meshes()[2], encoding).replace(b"face 320", b"face 320000000000000000000000"),
    ]


_BOMBS |= {"ply_little": _wide("binary_little_endian"), "ply_big": _wide("binary_big_endian")}
