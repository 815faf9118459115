"""The triangle mesh that everything else in `surface` takes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import _laplacian, _topology

_DIGITS = 18


class MeshError(ValueError):
    """A mesh, or a mesh file, that cannot be used; the message says what was found and what to do."""


class MeshIndexError(MeshError, IndexError):
    """A face that names a vertex which does not exist."""


def number_of(word: str) -> int:
    """The integer that a file writes; `ValueError` for anything but a sign and up to 18 digits, which int64 holds."""
    digits = word[1:] if word[:1] in ("+", "-") else word
    if len(digits) > _DIGITS or not (digits.isascii() and digits.isdigit()):
        raise ValueError(f"{word[:40]!r} is not a number")
    return int(word)


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh, checked when it is made; its arrays are read-only copies.

    Args:
        vertices: `(v, 3)`, any finite numbers; the unit is the caller's (everything here is scale-free).
        faces: `(f, 3)` vertex indices, from 0.
        name: what messages call the mesh.

    Raises:
        MeshError: wrong shapes, no face, or coordinates that are not finite. An index out of range
            raises a `MeshError` that is an `IndexError` too.
    """

    vertices: np.ndarray
    faces: np.ndarray
    name: str = ""

    def __post_init__(self) -> None:
        label = self.name or "mesh"
        object.__setattr__(self, "vertices", _checked_vertices(self.vertices, label))
        object.__setattr__(self, "faces", _checked_faces(self.faces, len(self.vertices), label))

    @cached_property
    def edges(self) -> _topology.Edges:
        """Every edge once, and the half-edges on it."""
        return _topology.edges(self.faces)

    @cached_property
    def face_areas(self) -> np.ndarray:
        """Area of each face `(f,)`, in squared mesh units."""
        return _topology.face_areas(self.vertices, self.faces)

    @cached_property
    def laplacian(self) -> _laplacian.Laplacian:
        """The Laplacian of the surface, scaled to unit area."""
        return _laplacian.laplacian(self.vertices, self.faces, self.area)

    @property
    def area(self) -> float:
        """Of the surface, in squared mesh units."""
        return float(self.face_areas.sum())


def _checked_vertices(vertices: np.ndarray, label: str) -> np.ndarray:
    vertices = np.array(vertices, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
        raise MeshError(f"{label}: vertices must have shape (v, 3) with v >= 1, found {vertices.shape}")
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(bad):
        raise MeshError(f"{label}: {len(bad)} vertices are not finite, the first is vertex {bad[0]}; remove them first")
    vertices.setflags(write=False)
    return vertices


def _checked_faces(faces: np.ndarray, count: int, label: str) -> np.ndarray:
    given = np.asarray(faces)
    if given.ndim != 2 or given.shape[1] != 3 or not len(given):
        raise MeshError(f"{label}: faces must have shape (f, 3) with f >= 1, found {given.shape}")
    if given.dtype.kind not in "iu":
        raise MeshError(f"{label}: faces must hold integers, found {given.dtype}")
    outside = np.flatnonzero((given < 0).any(axis=1) | (given >= count).any(axis=1))
    if len(outside):
        row = outside[0]
        raise MeshIndexError(
            f"{label}: face {row} is {given[row].tolist()}, but the vertices are numbered 0 to {count - 1}"
        )
    checked = given.astype(np.int64)
    checked.setflags(write=False)
    return checked
