"""Object File Format. Unlike trimesh's, this reader refuses truncated files and keeps the order of the faces."""

import re
import warnings

import numpy as np

from ._mesh import MeshError, number_of
from ._polygons import triangulated

_HEADER = re.compile(r"(?:ST)?C?N?OFF(?![A-Za-z_])", re.ASCII)


def parse_off(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Read the text of an OFF file (also COFF, NOFF, STOFF and their mixtures).

    Counts may follow the keyword on its line, even without a space; comments, colours, normals and texture coordinates
    are skipped; polygons become triangles, in the order of the file; faces of fewer than three corners are skipped.

    Returns:
        vertices `(v, 3)` float64 and faces `(f, 3)` int64. The indices are not checked here.

    Raises:
        MeshError: what is missing or malformed.
    """
    lines = _content_lines(text)
    counts, lines = _counts(lines)
    vertex_count, face_count = counts
    if len(lines) < vertex_count + face_count:
        raise MeshError(
            f"truncated: it announces {vertex_count} vertices and {face_count} faces, "
            f"but only {len(lines)} lines of data follow"
        )
    vertices = _vertices(lines[:vertex_count])
    lines = lines[vertex_count : vertex_count + face_count]
    triangles = _columns(lines, 4, np.int64)
    if triangles is not None and (triangles[:, 0] == 3).all():
        return vertices, triangles[:, 1:]
    return vertices, triangulated(vertices, _polygons(lines))


def _columns(lines: list[str], count: int, dtype: type) -> np.ndarray | None:
    """The first columns of a table of numbers, much faster than line by line; None unless every line has them."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # Older numpy reads 1.5 and 1e99 as integers, and says so.
        try:
            return np.loadtxt(lines, dtype, comments=None, usecols=range(count), ndmin=2) if lines else None
        except (ValueError, DeprecationWarning):
            return None


def _content_lines(text: str) -> list[str]:
    stripped = (line.partition("#")[0].strip() for line in text.splitlines())
    return [line for line in stripped if line]


def _counts(lines: list[str]) -> tuple[tuple[int, int], list[str]]:
    header = _HEADER.match(lines[0]) if lines else None
    if header is None:
        raise MeshError("not an OFF file: it does not start with the keyword OFF")
    rest = lines[0][header.end() :].strip()
    if "BINARY" in rest.upper():
        raise MeshError("binary OFF is not supported; convert it to text OFF, PLY or OBJ")
    lines = [rest, *lines[1:]] if rest else lines[1:]
    words = lines[0].split() if lines else []
    try:
        vertex_count, face_count, *edge_count = map(number_of, words)
    except ValueError:
        vertex_count, face_count, edge_count = -1, -1, []
    if vertex_count < 0 or face_count < 0 or len(edge_count) > 1:
        raise MeshError("malformed OFF: the counts of vertices, faces and edges do not follow the keyword")
    return (vertex_count, face_count), lines[1:]


def _vertices(lines: list[str]) -> np.ndarray:
    vertices = _columns(lines, 3, np.float64)
    if vertices is not None:
        return vertices
    rows = [line.split()[:3] for line in lines]
    try:
        return np.array(rows, dtype=np.float64).reshape(len(rows), 3)
    except ValueError:
        bad = next(i for i, row in enumerate(rows) if not _is_point(row))
        raise MeshError(f"malformed OFF: vertex {bad} reads {' '.join(rows[bad])[:40]!r}, not three numbers") from None


def _is_point(words: list[str]) -> bool:
    try:
        return len([float(word) for word in words]) == 3
    except ValueError:
        return False


def _polygons(lines: list[str]) -> list[list[int]]:
    polygons = []
    for number, line in enumerate(lines):
        words = line.split()
        try:
            count = number_of(words[0])
        except ValueError:
            count = -1
        corners = words[1 : count + 1]
        if count < 0 or len(corners) != count:
            raise MeshError(f"malformed OFF: face {number} reads {line[:40]!r}")
        try:
            polygons.append([number_of(word) for word in corners])
        except ValueError:
            raise MeshError("malformed OFF: a face has a corner that is not a vertex number") from None
    return polygons
