"""STL, binary and text: triangles, each with its own three corners.

Unlike trimesh's, this reader passes over bytes after the last triangle, and stops at a word that is no number.
"""

import numpy as np

from ._mesh import MeshError

_HEADER = 80
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])


def parse_stl(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a binary or text STL file; normals, colours and what follows the last triangle are skipped.

    A file whose length is that of the number of triangles at byte 80 is binary, whatever its first word is.

    Returns:
        vertices `(3 f, 3)`, one for each corner, and faces `(f, 3)`.

    Raises:
        MeshError: the file has no faces, ends too early, or has a corner that is not three numbers.
    """
    start = _HEADER + 4
    count = int.from_bytes(data[_HEADER:start], "little") if len(data) >= start else 0
    fits = count * _TRIANGLE.itemsize == len(data) - start
    if data[:200].lstrip().lower().startswith(b"solid") and not fits:
        vertices = _text(data)
    elif count * _TRIANGLE.itemsize > len(data) - start:
        raise MeshError(
            "no faces in this STL file: it holds something else, or is truncated or damaged "
            f"(it announces {count} triangles, and {max(len(data) - start, 0) // _TRIANGLE.itemsize} follow)"
        )
    else:
        vertices = np.frombuffer(data, _TRIANGLE, count, start)["corners"].reshape(-1, 3) if count else np.zeros((0, 3))
    if not len(vertices):
        raise MeshError("no faces in this STL file: it holds something else, or is truncated or damaged")
    with np.errstate(invalid="ignore"):  # signalling NaN
        vertices = vertices.astype(np.float64)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _text(data: bytes) -> np.ndarray:
    points: list[list[float]] = []
    ended = False
    for number, line in enumerate(data.decode("utf-8", errors="replace").splitlines(), 1):
        words = line.lower().split()
        if words[:1] == ["vertex"]:
            try:
                x, y, z = words[1:]
                points.append([float(x), float(y), float(z)])
            except ValueError:
                raise MeshError(f"not a readable STL file: line {number} reads {line.strip()[:40]!r}") from None
        ended |= words[:1] == ["endsolid"]
    if points and (len(points) % 3 or not ended):
        raise MeshError(f"truncated STL file: it ends after {len(points)} corners, without an endsolid")
    return np.array(points, dtype=np.float64).reshape(-1, 3)
