"""Wavefront OBJ: points and polygons, and nothing that names another file.

Unlike trimesh's, this reader takes time in proportion to the file however many groups and materials it has, counts
negative indices from the line that they stand on, and refuses an index of 0.
"""

import numpy as np

from ._mesh import MeshError, MeshIndexError, number_of
from ._polygons import triangulated


def parse_obj(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Read the lines `v` and `f` of an OBJ file; polygons become triangles, in the order of the file.

    Lines of other kinds (texture coordinates, normals, groups, materials, curves) are skipped, and so are faces of
    fewer than three corners.

    Returns:
        vertices `(v, 3)` float64 and faces `(f, 3)` int64. Indices beyond the last vertex are not checked here.

    Raises:
        MeshError: what is malformed, with its line; or there are no faces.
    """
    points: list[list[float]] = []
    faces: list[list[int]] = []
    lines = text.replace("\\\r\n", " ").replace("\\\n", " ").splitlines()
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            if words[0] == "v":
                points.append(_point(words[1:4]))
            elif words[0] == "f":
                faces.append([_corner(word, len(points)) for word in words[1:]])
        except (ValueError, OverflowError) as error:
            kind = MeshIndexError if isinstance(error, MeshIndexError) else MeshError
            raise kind(f"malformed OBJ: line {number} reads {line.strip()[:40]!r}") from None
    vertices = np.array(points, dtype=np.float64).reshape(-1, 3)
    triangles = triangulated(vertices, faces)
    if not len(triangles):
        raise MeshError("no faces in this OBJ file: it holds something else, or is truncated or damaged")
    return vertices, triangles


def _point(words: list[str]) -> list[float]:
    x, y, z = words
    return [float(x), float(y), float(z)]


def _corner(word: str, points: int) -> int:
    """The vertex of `7`, `7/1`, `7//2` or `-1/1/2`, from 0."""
    index = number_of(word.partition("/")[0])
    if index == 0 or index < -points:
        raise MeshIndexError("no such vertex")
    return index - 1 if index > 0 else points + index
