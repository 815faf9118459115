"""PLY and STL, which trimesh parses: what it takes on trust is checked before."""

import io
import logging
import warnings

import numpy as np

from ._mesh import MeshError, MeshIndexError, number_of

_END = b"end_header"
_LONGEST_HEADER = 100_000
_ELEMENTS, _PROPERTIES = 50, 500
_SOLIDS = 1000
_BYTES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16", "float16"), 2),
    **dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("int64", "uint64", "double", "float64"), 8),
}


def parse_stl(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a binary or text STL file.

    Returns:
        vertices `(v, 3)`, one for each corner, and faces `(f, 3)`.

    Raises:
        MeshError: what trimesh says about the file, or that it has no faces or a thousand solids.
    """
    solids = data.lower().count(b"endsolid")
    if solids > _SOLIDS:  # for each, trimesh looks through the names of those before
        raise MeshError(f"{solids} solids in this STL file are more than the {_SOLIDS} that are read; join them first")
    return _read(data, "stl")


def parse_ply(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a text or binary PLY file.

    Returns:
        vertices `(v, 3)` and faces `(f, 3)`.

    Raises:
        MeshError: what trimesh says about the file, that it has no faces, or that its header announces more than
            there is.
    """
    _check_ply(data)
    return _read(data, "ply")


def _check_ply(data: bytes) -> None:
    """Refuse a header that is endless, or announces more than follows."""
    head, mark, body = data.partition(_END)
    if not data.startswith(b"ply") or not mark or len(head) > _LONGEST_HEADER:
        raise MeshError("not a readable PLY file: it has no header from ply to end_header")
    lines = [line.split() for line in head.decode("utf-8", errors="replace").splitlines()]
    as_text = any(line[:2] == ["format", "ascii"] for line in lines)
    counts: list[int] = []
    sizes: list[int] = []  # the least bytes of a row of each element
    properties = 0
    for words in lines:
        if words[:1] == ["element"]:
            counts.append(_count(words))
            sizes.append(0)
        elif words[:1] == ["property"]:
            if len(words) < 3 or not sizes:
                raise MeshError(f"malformed PLY: the header has {' '.join(words)[:40]!r}")
            properties += 1
            sizes[-1] += _BYTES.get(words[2] if words[1] == "list" else words[1], 1)
    if len(counts) > _ELEMENTS or properties > _PROPERTIES:
        raise MeshError(f"{len(counts)} elements with {properties} properties in its PLY header are too many")
    there = len(body.splitlines()) - 1 if as_text else len(body)
    announced = sum(counts) if as_text else sum(count * size for count, size in zip(counts, sizes, strict=True))
    if announced > there:
        unit = "lines" if as_text else "bytes"
        raise MeshError(f"truncated PLY file: it announces {announced} {unit} of data, and {there} follow")


def _count(words: list[str]) -> int:
    try:
        _, _, word = words
        count = number_of(word)
    except ValueError:
        count = -1
    if count < 0:
        raise MeshError(f"malformed PLY: the header has {' '.join(words)[:40]!r}")
    return count


def _read(data: bytes, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    log = logging.getLogger("trimesh")
    level = log.level
    log.setLevel(logging.CRITICAL)  # what it logs about broken files comes back as the exception below
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # Some versions of numpy stop at a word that is no number with a warning only, and the rest would be lost.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            # A stream without a name leaves trimesh no folder in which to look for textures.
            scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix, process=False, skip_materials=True)
            mesh = scene.to_mesh()
    except MemoryError:
        raise
    except Exception as error:  # the parsers raise whatever their input provokes, KeyError to struct.error
        kind = MeshIndexError if isinstance(error, IndexError) else MeshError
        raise kind(f"not a readable {suffix.upper()} file ({_one_line(error)})") from None
    finally:
        log.setLevel(level)
    if not len(mesh.faces):
        raise MeshError(f"no faces in this {suffix.upper()} file: it holds something else, or is truncated or damaged")
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _one_line(error: Exception) -> str:
    text = "".join(c if c.isprintable() else " " for c in " ".join(str(error).split()))
    return f"{type(error).__name__}: {text[:120]}" if text else type(error).__name__
