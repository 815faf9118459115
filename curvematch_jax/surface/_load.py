"""Mesh files in, `Mesh` out."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ._gltf import parse_glb, parse_gltf
from ._mesh import Mesh, MeshError
from ._obj import parse_obj
from ._off import parse_off
from ._ply import parse_ply
from ._stl import parse_stl
from ._topology import weld


def load_mesh(path: str | Path, name: str | None = None) -> Mesh:
    """Read a mesh file: OFF, OBJ, PLY, STL, GLB or glTF.

    Only the file itself is opened: materials, textures and buffers that it names are not followed. What is allocated is
    bounded by the size of the file, whatever it announces.
    Vertices that coincide exactly (one copy per corner normal, STL) are welded; nothing else is repaired,
    which is the work of `clean`.

    Args:
        path: the file; its suffix tells the format.
        name: the mesh's name, by default the file's name without the suffix.

    Raises:
        MeshError: one sentence, beginning with the path, for anything that is not a usable mesh file.
            An index out of range raises a `MeshError` that is an `IndexError` too.
    """
    path = Path(path)
    try:
        vertices, faces = _read(path)
    except MeshError as error:
        raise type(error)(f"{path}: {error}") from None
    mesh = Mesh(vertices, faces, str(path))
    vertices, faces, _ = weld(mesh.vertices, mesh.faces)
    return Mesh(vertices, faces, path.stem if name is None else name)


def _read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    if path.is_dir():
        raise MeshError("is a directory, not a mesh file")
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise MeshError("no such file") from None
    except OSError as error:
        raise MeshError(f"cannot be read ({error.strerror})") from None
    if not data.strip():
        raise MeshError("the file is empty")
    suffix = path.suffix.lower().lstrip(".")
    if suffix not in _PARSERS:
        known = ", ".join(sorted(_PARSERS))
        raise MeshError(f"the suffix {'.' + suffix if suffix else '(none)'} names no mesh format; known are {known}")
    try:
        return _PARSERS[suffix](data)
    except MemoryError:
        raise MeshError("reading it needs more memory than there is") from None


def _text(data: bytes) -> str:
    return data.decode("utf-8-sig", errors="replace")


_PARSERS: dict[str, Callable[[bytes], tuple[np.ndarray, np.ndarray]]] = {
    "off": lambda data: parse_off(_text(data)),
    "obj": lambda data: parse_obj(_text(data)),
    "ply": parse_ply,
    "stl": parse_stl,
    "glb": parse_glb,
    "gltf": parse_gltf,
}
