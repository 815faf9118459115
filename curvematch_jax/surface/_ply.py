"""The Polygon File Format: points, polygons and triangle strips.

Unlike trimesh's, this reader takes lists of different lengths in binary files, and cuts concave polygons inside.
"""

from typing import NamedTuple

import numpy as np

from ._mesh import MeshError, number_of
from ._polygons import triangulated

_END = b"end_header"
_LONGEST_HEADER = 100_000
_ELEMENTS, _PROPERTIES = 50, 500
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    **{name: name[0] + str(int(name.strip("uintfloa")) // 8) for name in ("int64", "uint64", "float16")},
}
_CORNERS = ("vertex_indices", "vertex_index")


class _Property(NamedTuple):
    name: str
    kind: str  # numpy's, without the byte order
    count: str | None  # the kind of the count of a list


class _Element(NamedTuple):
    name: str
    rows: int
    properties: list[_Property]


def parse_ply(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a text or binary PLY file: its points, and its polygons and triangle strips as triangles.

    Returns:
        vertices `(v, 3)` float64 and faces `(f, 3)` int64. The indices are not checked here.

    Raises:
        MeshError: what is malformed, or that there are no faces, or less than the header announces.
    """
    order, elements, body = _header(data)
    read = _text if order == "" else _binary
    columns = read(elements, body, order)
    point = columns.get("vertex", {})
    if not all(isinstance(point.get(axis), np.ndarray) for axis in "xyz"):
        raise MeshError("malformed PLY: its vertices have no x, y and z")
    with np.errstate(invalid="ignore"):  # signalling NaN
        vertices = np.stack([point[axis] for axis in "xyz"], axis=1).astype(np.float64)
    faces = [triangulated(vertices, _lists(columns.get("face", {})))]
    faces += [_strip(strip) for strip in _lists(columns.get("tristrips", {}))]
    triangles = np.concatenate(faces)
    if not len(triangles):
        raise MeshError("no faces in this PLY file: it holds something else, or is truncated or damaged")
    return vertices, triangles


def _header(data: bytes) -> tuple[str, list[_Element], bytes]:
    head, mark, body = data.partition(_END)
    if not data.startswith(b"ply") or not mark or len(head) > _LONGEST_HEADER:
        raise MeshError("not a readable PLY file: it has no header from ply to end_header")
    order, elements, properties = None, [], 0
    for words in map(str.split, head.decode("utf-8", errors="replace").splitlines()):
        if words[:1] == ["format"]:
            order = _ORDERS.get(words[1] if len(words) > 1 else "")
        elif words[:1] == ["element"]:
            elements.append(_Element(*_named_count(words), []))
        elif words[:1] == ["property"]:
            if not elements:
                raise MeshError(f"malformed PLY: the header has {' '.join(words)[:40]!r}")
            elements[-1].properties.append(_property(words))
            properties += 1
    if order is None:
        raise MeshError("malformed PLY: its header names no format that is known")
    if len(elements) > _ELEMENTS or properties > _PROPERTIES:
        raise MeshError(f"{len(elements)} elements with {properties} properties in its PLY header are too many")
    body = body.partition(b"\n")[2]
    _require_enough(elements, body, order)
    return order, elements, body


def _named_count(words: list[str]) -> tuple[str, int]:
    try:
        _, name, word = words
        count = number_of(word)
    except ValueError:
        name, count = "", -1
    if count < 0:
        raise MeshError(f"malformed PLY: the header has {' '.join(words)[:40]!r}")
    return name, count


def _property(words: list[str]) -> _Property:
    try:
        if words[1] == "list":
            _, _, count, kind, name = words
            if _TYPES[count][0] == "f":
                raise KeyError(count)
            return _Property(name, _TYPES[kind], _TYPES[count])
        _, kind, name = words
        return _Property(name, _TYPES[kind], None)
    except (ValueError, IndexError, KeyError):
        raise MeshError(f"malformed PLY: the header has {' '.join(words)[:40]!r}") from None


def _require_enough(elements: list[_Element], body: bytes, order: str) -> None:
    if order == "":
        unit, there, announced = "lines", len(body.splitlines()), sum(element.rows for element in elements)
    else:
        least = [sum(np.dtype(p.count or p.kind).itemsize for p in element.properties) for element in elements]
        unit, there = "bytes", len(body)
        announced = sum(element.rows * size for element, size in zip(elements, least, strict=True))
    if announced > there:
        raise MeshError(f"truncated PLY file: it announces {announced} {unit} of data, and {there} follow")


def _lists(columns: dict) -> list[list[int]]:
    """The lists of corners of an element's rows."""
    found = next((columns[name] for name in _CORNERS if name in columns), [])
    if isinstance(found, np.ndarray):
        raise MeshError("malformed PLY: the corners of its faces are no lists")
    return found


def _strip(corners: list[int]) -> np.ndarray:
    """Triangles of strips that are separated by -1; every other one runs the other way round."""
    triangles, start = [], 0
    for k in range(len(corners) - 2):
        if corners[k] < 0:
            start = k + 1
        a, b, c = corners[k : k + 3]
        if min(a, b, c) >= 0 and len({a, b, c}) == 3:
            triangles.append((a, b, c) if (k - start) % 2 == 0 else (b, a, c))
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _text(elements: list[_Element], body: bytes, _: str) -> dict[str, dict]:
    lines = iter(body.decode("utf-8", errors="replace").splitlines())
    columns: dict[str, dict] = {}
    for element in elements:
        rows = [_row(next(lines).split(), element) for _ in range(element.rows)]
        columns[element.name] = {
            p.name: [row[k] for row in rows] if p.count else np.array([row[k] for row in rows], dtype=np.float64)
            for k, p in enumerate(element.properties)
        }
    return columns


def _row(words: list[str], element: _Element) -> list:
    """The numbers of a line, and the lists of whole ones."""
    values: list = []
    place = 0
    try:
        for p in element.properties:
            if p.count is None:
                values.append(float(words[place]))
                place += 1
                continue
            count = number_of(words[place])
            whole = p.kind[0] != "f"
            values.append([(number_of if whole else float)(word) for word in words[place + 1 : place + 1 + count]])
            if count < 0 or len(values[-1]) != count:
                raise IndexError
            place += 1 + count
    except (ValueError, IndexError):
        raise MeshError(f"malformed PLY: a {element.name} reads {' '.join(words)[:40]!r}") from None
    return values


def _binary(elements: list[_Element], body: bytes, order: str) -> dict[str, dict]:
    columns: dict[str, dict] = {}
    place = 0
    for element in elements:
        if any(p.count for p in element.properties):
            columns[element.name], place = _ragged(element, body, order, place)
            continue
        kinds = np.dtype([(f"p{k}", order + p.kind) for k, p in enumerate(element.properties)])
        if place + element.rows * kinds.itemsize > len(body):
            raise MeshError(f"truncated PLY file: its {element.name}s end too early")
        rows = np.frombuffer(body, kinds, element.rows, place) if kinds.itemsize else np.zeros(element.rows, kinds)
        columns[element.name] = {p.name: rows[f"p{k}"] for k, p in enumerate(element.properties)}
        place += element.rows * kinds.itemsize
    return columns


def _ragged(element: _Element, body: bytes, order: str, place: int) -> tuple[dict, int]:
    """The columns of rows with lists: all at once where all lists are as long as in the first row, or row by row."""
    sizes = _first_sizes(element, body, order, place)
    kinds = np.dtype(
        [
            entry
            for k, (p, size) in enumerate(zip(element.properties, sizes, strict=True))
            for entry in ([(f"n{k}", order + p.count)] if p.count else []) + [(f"p{k}", order + p.kind, (size,))]
        ]
    )
    if element.rows and place + element.rows * kinds.itemsize <= len(body):
        rows = np.frombuffer(body, kinds, element.rows, place)
        if all((rows[f"n{k}"] == size).all() for k, size in enumerate(sizes) if element.properties[k].count):
            columns = {
                p.name: rows[f"p{k}"].tolist() if p.count else rows[f"p{k}"][:, 0]
                for k, p in enumerate(element.properties)
            }
            return columns, place + element.rows * kinds.itemsize
    return _row_by_row(element, body, order, place)


def _first_sizes(element: _Element, body: bytes, order: str, place: int) -> list[int]:
    sizes = []
    for p in element.properties:
        sizes.append(1)
        if p.count:
            sizes[-1] = _count_at(element, body, order + p.count, place) if element.rows else 0
            place += np.dtype(p.count).itemsize
        place += sizes[-1] * np.dtype(p.kind).itemsize
    return sizes


def _count_at(element: _Element, body: bytes, kind: str, place: int) -> int:
    dtype = np.dtype(kind)
    count = int(np.frombuffer(body, dtype, 1, place)[0]) if place + dtype.itemsize <= len(body) else -1
    if not 0 <= count <= len(body) - place:
        raise MeshError(f"truncated or damaged PLY file: a list of its {element.name}s does not end in it")
    return count


def _row_by_row(element: _Element, body: bytes, order: str, place: int) -> tuple[dict, int]:
    values: list[list] = [[] for _ in element.properties]
    for _ in range(element.rows):
        for column, p in zip(values, element.properties, strict=True):
            count = 1
            if p.count:
                count = _count_at(element, body, order + p.count, place)
                place += np.dtype(p.count).itemsize
            kind = np.dtype(order + p.kind)
            if place + count * kind.itemsize > len(body):
                raise MeshError(f"truncated PLY file: its {element.name}s end too early")
            numbers = np.frombuffer(body, kind, count, place).tolist()
            column.append(numbers if p.count else numbers[0])
            place += count * kind.itemsize
    return {p.name: c if p.count else np.array(c) for c, p in zip(values, element.properties, strict=True)}, place
