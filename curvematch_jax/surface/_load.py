"""Mesh files in, `Mesh` out."""

import io
import logging
import warnings
from pathlib import Path

import numpy as np

from ._mesh import Mesh, MeshError, MeshIndexError
from ._off import parse_off
from ._topology import weld


def load_mesh(path: str | Path, name: str | None = None) -> Mesh:
    """Read a mesh file: OFF, OBJ, PLY, STL, GLB and whatever else trimesh reads.

    Only the file itself is opened: materials, textures and buffers that it names are not followed.
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
    if suffix == "off":
        return parse_off(data.decode("utf-8", errors="replace"))
    return _read_with_trimesh(data, suffix)


def _read_with_trimesh(data: bytes, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    import trimesh
    from trimesh.exchange.load import mesh_loaders

    if suffix not in mesh_loaders:
        known = ", ".join(sorted(mesh_loaders))
        raise MeshError(f"the suffix {'.' + suffix if suffix else '(none)'} names no mesh format; known are {known}")
    log = logging.getLogger("trimesh")
    level = log.level
    log.setLevel(logging.CRITICAL)  # what it logs about broken files comes back as the exception below
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # A stream without a name leaves trimesh no folder in which to look for materials or buffers.
            scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix, process=False, skip_materials=True)
            mesh = scene.to_mesh()
    except Exception as error:  # the parsers raise whatever their input provokes, KeyError to struct.error
        kind = MeshIndexError if isinstance(error, IndexError) else MeshError
        raise kind(f"not a readable {suffix.upper()} file ({_one_line(error)})") from None
    finally:
        log.setLevel(level)
    if not len(mesh.faces):
        raise MeshError(f"no faces in this {suffix.upper()} file: it holds something else, or is truncated or damaged")
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _one_line(error: Exception) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text[:120]}" if text else type(error).__name__
