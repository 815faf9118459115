"""glTF 2.0, as GLB or as JSON with its buffers inside: the triangles of a scene, each where its node puts it.

Unlike trimesh's, this reader looks at nothing but geometry, never at another file, and bounds what it makes by the size
of the file: a scene can place one mesh a million times.
"""

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ._mesh import MeshError

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MODES = range(7)
# What a scene may place: so many corners and points, and for each byte of the file so many more.
_PLACED, _PLACED_EACH = 1_000_000, 4
_NODES = 100_000


def parse_glb(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a binary glTF file. Returns and raises as `parse_gltf`."""
    if len(data) < 20 or data[:4] != b"glTF":
        raise MeshError("not a readable GLB file: it does not start with glTF")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise MeshError(f"GLB of version {version} is not supported, only version 2")
    if length > len(data):
        raise MeshError(f"not a readable GLB file: truncated, it announces {length} bytes and has {len(data)}")
    chunks = dict(reversed(list(_chunks(data))))  # of chunks of one name, the first
    if b"JSON" not in chunks:
        raise MeshError("not a readable GLB file: it has no JSON chunk")
    return parse_gltf(chunks[b"JSON"], chunks.get(b"BIN\0"))


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    place = 12
    while place + 8 <= len(data):
        length, name = struct.unpack_from("<I4s", data, place)
        if place + 8 + length > len(data):
            raise MeshError("not a readable GLB file: a chunk is longer than what is left of the file")
        yield name, data[place + 8 : place + 8 + length]
        place += 8 + length


def parse_gltf(text: bytes, binary: bytes | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Read the JSON of a glTF file.

    Points, lines, materials, skins, cameras, animations and names are skipped.

    Args:
        binary: the buffer that a GLB file has beside the JSON.

    Returns:
        vertices `(v, 3)` float64 and faces `(f, 3)` int64, of all placed meshes one after the other. The indices are
        those of the file within each mesh, and are checked here.

    Raises:
        MeshError: what is missing or malformed, in another file, compressed or sparse.
    """
    try:
        tree = json.loads(text)
        with np.errstate(all="ignore"):  # what is not finite is refused by `Mesh`
            return _joined(_Document(tree, binary, len(text) + len(binary or b"")))
    except MeshError:
        raise
    except RecursionError:
        raise MeshError("malformed glTF: its JSON is nested too deeply") from None
    except UnicodeDecodeError:
        raise MeshError("malformed glTF: its JSON is not UTF-8") from None
    except json.JSONDecodeError as error:
        raise MeshError(f"malformed glTF: its JSON has an error at line {error.lineno}") from None
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        text_of = " ".join(str(error).split())[:120]
        raise MeshError(f"malformed glTF: {text_of} ({type(error).__name__})") from None


@dataclass(frozen=True)
class _Document:
    tree: dict[str, Any]
    binary: bytes | None
    size: int  # of the file, in bytes
    buffers: dict[int, bytes] = field(default_factory=dict)  # those that are decoded already

    def item(self, kind: str, index: Any) -> Any:
        """Entry `index` of a list of the document."""
        items = self.tree.get(kind, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
            raise MeshError(f"malformed glTF: there is no entry {index!r:.40} in {kind}")
        return items[index]

    def check_amount(self, count: int) -> None:
        """`MeshError` when a file of this size should not make so many points and corners."""
        if count > _PLACED + _PLACED_EACH * self.size:
            raise MeshError("it places far more triangles than a file of its size should; join its parts first")


def _joined(document: _Document) -> tuple[np.ndarray, np.ndarray]:
    version = str(document.tree["asset"]["version"])
    if version.partition(".")[0] != "2":
        raise MeshError(f"glTF of version {version[:20]!r} is not supported, only version 2")
    known: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    points, faces, count, amount = [], [], 0, 0
    for mesh, matrix in _placed(document):
        if mesh not in known:
            known[mesh] = list(_pieces(document, mesh))
        for vertices, triangles in known[mesh]:
            amount += len(vertices) + triangles.size
            document.check_amount(amount)
            points.append(vertices @ matrix[:3, :3].T + matrix[:3, 3])
            faces.append(triangles + count)
            count += len(vertices)
    if not sum(map(len, faces)):
        raise MeshError("no faces in this glTF file: its scene shows no triangles")
    return np.concatenate(points), np.concatenate(faces)


def _placed(document: _Document) -> Iterator[tuple[int, np.ndarray]]:
    """Every mesh of the scene with its 4 x 4 matrix. A node has one parent, so that none is met twice."""
    nodes = document.tree.get("nodes", [])
    if len(nodes) > _NODES:
        raise MeshError(f"{len(nodes)} nodes are more than the {_NODES} that are read; join its parts first")
    scene = document.item("scenes", document.tree.get("scene", 0))
    waiting = [(index, np.eye(4)) for index in reversed(scene.get("nodes", []))]
    met: set[int] = set()
    while waiting:
        index, above = waiting.pop()
        node = document.item("nodes", index)
        if index in met:
            raise MeshError(f"malformed glTF: node {index} has two places in the scene")
        met.add(index)
        matrix = above @ _matrix(node)
        if "mesh" in node:
            yield node["mesh"], matrix
        waiting += [(child, matrix) for child in reversed(node.get("children", []))]


def _matrix(node: dict[str, Any]) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
    matrix[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    return matrix


def _pieces(document: _Document, mesh: Any) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Vertices and triangles of each primitive of a mesh that has triangles."""
    amount = 0
    for primitive in document.item("meshes", mesh)["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in _MODES:
            raise MeshError(f"malformed glTF: a primitive has mode {mode!r:.40}")
        if mode < _TRIANGLES:
            continue
        points = _accessor(document, primitive["attributes"]["POSITION"], 3).astype(np.float64)
        if "indices" in primitive:
            corners = _accessor(document, primitive["indices"], 1).ravel()
            if corners.dtype.kind != "u" or (len(corners) and corners.max() >= len(points)):
                raise MeshError(f"malformed glTF: a face names none of its mesh's {len(points)} vertices")
        else:
            corners = np.arange(len(points))
        amount += len(points) + len(corners)
        document.check_amount(amount)
        yield points, _triangles(corners.astype(np.int64), mode)


def _triangles(corners: np.ndarray, mode: int) -> np.ndarray:
    if mode == _TRIANGLES:
        return corners.reshape(-1, 3)
    count = max(len(corners) - 2, 0)
    if mode == _FAN:
        return np.stack([np.repeat(corners[:1], count), corners[1 : count + 1], corners[2 : count + 2]], axis=1)
    faces = np.stack([corners[:count], corners[1 : count + 1], corners[2 : count + 2]], axis=1)
    faces[1::2] = faces[1::2, ::-1]
    return faces


def _accessor(document: _Document, index: Any, width: int) -> np.ndarray:
    """The rows `(count, width)` of an accessor."""
    accessor = document.item("accessors", index)
    if "sparse" in accessor or "bufferView" not in accessor:
        raise MeshError("sparse or compressed glTF is not supported; export it without compression")
    if accessor["type"] != {1: "SCALAR", 3: "VEC3"}[width]:
        raise MeshError(f"malformed glTF: an accessor of type {accessor['type']!r:.40} where another is needed")
    kind = np.dtype(_TYPES[accessor["componentType"]])
    view = document.item("bufferViews", accessor["bufferView"])
    data = _view(document, view)
    count, start = _natural(accessor, "count"), _natural(accessor, "byteOffset", 0)
    step = _natural(view, "byteStride", width * kind.itemsize)
    if count and (step < width * kind.itemsize or start + (count - 1) * step + width * kind.itemsize > len(data)):
        raise MeshError(f"malformed glTF: an accessor of {count} elements does not fit its buffer of {len(data)} bytes")
    rows = np.ndarray((count, width), kind, data, start if count else 0, (step, kind.itemsize))
    if accessor.get("normalized", False) and kind.kind != "f":
        return np.maximum(rows / np.iinfo(kind).max, -1.0)
    return rows


def _view(document: _Document, view: dict[str, Any]) -> memoryview:
    data = _buffer(document, view["buffer"])
    start, length = _natural(view, "byteOffset", 0), _natural(view, "byteLength")
    if start + length > len(data):
        raise MeshError(f"malformed glTF: a buffer view ends at {start + length}, its buffer at {len(data)}")
    return memoryview(data)[start : start + length]


def _buffer(document: _Document, index: Any) -> bytes:
    uri = document.item("buffers", index).get("uri")
    if uri is None:
        if index or document.binary is None:
            raise MeshError(f"malformed glTF: buffer {index} is not in the file")
        return document.binary
    head, comma, encoded = uri.partition(",")
    if not (head.startswith("data:") and head.endswith(";base64") and comma):
        raise MeshError(f"it keeps its buffer in another file, {uri[:60]!r}, which is not followed; export it as GLB")
    if index not in document.buffers:
        try:
            document.buffers[index] = base64.b64decode(encoded)
        except binascii.Error:
            raise MeshError(f"malformed glTF: buffer {index} is not base64") from None
    return document.buffers[index]


def _natural(holder: dict[str, Any], name: str, default: int | None = None) -> int:
    value = holder[name] if default is None else holder.get(name, default)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise MeshError(f"malformed glTF: {name} is {value!r:.40}")
    return value
