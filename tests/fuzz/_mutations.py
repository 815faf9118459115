"""Mutations that know the structure of what they break: bytes, lines and tokens of text, JSON, and the formats."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from ._bombs import bomb
from ._degenerate import degenerate
from ._npz import mutated_npz
from ._seeds import WRITERS, Content, glb_from, seed_content, some_mesh

Random = np.random.Generator
T = TypeVar("T")

NASTY_WORDS = (
    *("nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e38", "1e999", "0", "-0", "-1", "1", "2", "3", "4", "255"),
    *("256", "65536", "2147483647", "2147483648", "-2147483648", "4294967295", "4294967296", "9223372036854775807"),
    *(
        "9223372036854775808",
        "1e9",
        "0x10",
        "1_000",
        "١",
        "²",
        "",
        "x",
        "1/2/3",
        "1//",
        "//",
        "9" * 5000,
        "1" + "0" * 400,
    ),
    *("é", "\x00", "\x1b[31m", "../../etc/passwd", "3 0 1 2", "0.1", "1.5", "-2"),
)
OUTSIDE = (
    *(
        "../../../../etc/passwd",
        "/etc/passwd",
        "file:///etc/passwd",
        "http://127.0.0.1:9/x.bin",
        "\\\\server\\share\\x",
    ),
    *(
        "data:application/octet-stream;base64,AAAA",
        "data:;base64,@@@",
        "data:,abc",
        "base64,AAAA",
        "~/.ssh/id_rsa",
        "%2e%2e/x",
    ),
)
NASTY_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 3, 7, 255, 2**31 - 1, 2**31, 2**32, 2**40, 2**63, -(2**31), 10**30, 0.5, 1e308),
    *(
        -1e308,
        1e-320,
        float("nan"),
        float("inf"),
        "",
        "x",
        "0",
        "é\n",
        "VEC3",
        "SCALAR",
        "MAT4",
        5120,
        5121,
        5123,
        5125,
        5126,
    ),
    *([], {}, [0], [0] * 17, [[[]]], {"0": 0}, *OUTSIDE),
)
LINES = {
    "obj": (
        *(f"mtllib {place}" for place in OUTSIDE),
        *("usemtl paint", "call ../../x.obj", "maplib ../x", "o a", "g a b", "s 1", "f", "f 1", "f 1 2", "f 1 2 3 4 5"),
        *(
            "f -1 -2 -3",
            "f 0 0 0",
            "f 1//1 2//1 3//9999999999",
            "f 1/99999999 2/1 3/1",
            "v 1 2",
            "v 1 2 3 4 5 6 7",
            "v nan 0 0",
        ),
        *(
            "f 1 2 3 \\",
            "curv 0 1 1 2",
            "l 1 2",
            "p 1",
            "vt",
            "vn nan nan nan",
            "v 1,5 2 3",
            "f 1 2 99999999999999999999",
        ),
    ),
    "ply": (
        *(f"comment TextureFile {place}" for place in OUTSIDE),
        *("element face 4000000000", "element vertex 4000000000", "element vertex -1", "element edge 4", "element x 1"),
        *(
            "property list uchar int vertex_indices",
            "property list double double vertex_indices",
            "property list int int x",
        ),
        *(
            "property float x",
            "property double nan",
            "property void x",
            "property",
            "element",
            "obj_info x",
            "end_header",
        ),
        *(
            "format binary_big_endian 1.0",
            "format ascii 1.0",
            "property list uint uint vertex_index",
            "property uchar red",
        ),
    ),
    "stl": (
        "solid",
        "endsolid",
        "vertex",
        "vertex 1 2",
        "facet normal nan nan nan",
        "solid a solid b",
        "endsolid endsolid",
    ),
    "off": (
        "OFF",
        "4 4 4",
        "3 0 1 2",
        "2 0 1",
        "5 0 1 2 3 4",
        "# x",
        "BINARY",
        "0 0 0",
        "-3 0 1 2",
        "3 0 1 2 255 0 0",
        "1 0",
    ),
}


def hostile(kind: str, suffix: str, random: Random) -> Content:
    """A file that is valid but for a few mutations; one in fifty is a bomb: small, and large once read."""
    if random.random() < 0.02:
        return bomb(kind, random)
    if kind in WRITERS and random.random() < 0.4:
        return WRITERS[kind][1](degenerate(some_mesh(random), random))
    content = seed_content(kind, random)
    if isinstance(content, dict):
        return _folder(content, random)
    if kind == "npz":
        return mutated_npz(content, random)
    for _ in range(random.geometric(0.6)):
        content = _choice(_ways(kind), random)(content, suffix, random)
    return content


def _ways(kind: str) -> tuple[Callable[[bytes, str, Random], bytes], ...]:
    if kind == "glb":
        return (_glb_json, _glb_json, _glb_json, _glb_json, _glb_head, _bytes)
    if kind == "gltf":
        return (_json, _json, _json, _json, _bytes)
    if kind == "stl":
        return (_stl_count, _floats, _floats, _bytes)
    if kind in ("ply_little", "ply_big"):
        return (_ply_head, _ply_head, _ply_body, _bytes)
    return (_word, _word, _word, _line, _line, _known_line, _bytes)


def _choice(options: Sequence[T], random: Random) -> T:
    return options[int(random.integers(len(options)))]


def _bytes(data: bytes, suffix: str, random: Random) -> bytes:
    """Truncate, flip, insert, repeat, swap: what needs no structure."""
    a, b = sorted(random.integers(0, len(data) + 1, 2).tolist())
    way = random.integers(9)
    if way == 0:
        return data[:a]
    if way == 1:
        flipped = bytearray(data)
        for place in random.integers(0, max(len(data), 1), random.integers(1, 9)).tolist():
            flipped[place : place + 1] = random.bytes(1)
        return bytes(flipped)
    if way == 2:
        return data[:a] + data[b:]
    if way == 3:
        return data[:b] + data[a:b] * int(random.integers(1, 4)) + data[b:]
    if way == 4:
        return data[b:] + data[a:b] + data[:a]
    if way == 5:
        return (
            data[:a]
            + _choice((b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\x1c", b"\xe2\x80\xa8"), random)
            + data[a:]
        )
    if way == 6:
        return data.replace(b"\n", _choice((b"\r\n", b"\r", b"\n\n", b" \n", b"\\\n"), random))
    if way == 7:
        return data[:a] + random.bytes(int(random.integers(1, 64))) + data[b:]
    return data[:a] + _choice((b"9", b" ", b"#", b"a", b"\t"), random) * int(random.integers(1, 20_000)) + data[a:]


def _word(data: bytes, suffix: str, random: Random) -> bytes:
    """One to three tokens become nasty ones."""
    words = list(re.finditer(rb"[^\s/]+", data[:4000] if random.random() < 0.3 else data))
    for match in [_choice(words, random) for _ in range(random.integers(1, 4))] if words else []:
        data = data[: match.start()] + _choice(NASTY_WORDS, random).encode() + data[match.end() :]
        words = words[:1]
    return data


def _line(data: bytes, suffix: str, random: Random) -> bytes:
    """Delete, repeat, swap, join or reverse lines."""
    lines = data.split(b"\n")
    i, j = sorted(random.integers(0, len(lines), 2).tolist())
    way = random.integers(6)
    if way == 0:
        del lines[i : min(j, i + 3) + 1]
    elif way == 1:
        lines[i:i] = [lines[j]] * int(random.integers(1, 20))
    elif way == 2:
        lines[i], lines[j] = lines[j], lines[i]
    elif way == 3:
        lines[i : i + 2] = [b" ".join(lines[i : i + 2])]
    elif way == 4:
        lines = lines[j:] + lines[:j]
    else:
        lines[i:j] = lines[i:j][::-1]
    return b"\n".join(lines)


def _known_line(data: bytes, suffix: str, random: Random) -> bytes:
    """A line that means something in this format, in any place."""
    lines = data.split(b"\n")
    lines.insert(int(random.integers(len(lines) + 1)), _choice(LINES[suffix], random).encode())
    return b"\n".join(lines)


def _ply_head(data: bytes, suffix: str, random: Random) -> bytes:
    head, mark, body = data.partition(b"end_header\n")
    return _choice((_word, _word, _line, _known_line), random)(head, suffix, random) + mark + body


def _ply_body(data: bytes, suffix: str, random: Random) -> bytes:
    head, mark, body = data.partition(b"end_header\n")
    return head + mark + _floats(body, suffix, random)


def _floats(data: bytes, suffix: str, random: Random) -> bytes:
    """Some four bytes become a nasty float or integer."""
    changed = bytearray(data)
    for place in random.integers(0, max(len(data) - 4, 1), random.integers(1, 5)).tolist():
        nasty = _choice((np.nan, np.inf, 3e38, -3e38, 1e-45, 0.0, 1e30, 1e-30), random)
        number = _choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 3, 4, 255), random)
        changed[place : place + 4] = struct.pack("<f", nasty) if random.random() < 0.6 else struct.pack("<I", number)
    return bytes(changed)


def _stl_count(data: bytes, suffix: str, random: Random) -> bytes:
    return data[:80] + struct.pack("<I", _choice((0, 1, 2, 3, 2**31, 2**32 - 1), random)) + data[84:]


def mutated_json(value: Any, random: Random) -> Any:
    """One place of a JSON value is replaced, deleted, doubled, or gets a neighbour's value."""
    places = list(_places(value))
    if not places:
        return value
    holder, key = _choice(places, random)
    way = random.random()
    if way < 0.6:
        holder[key] = _choice(NASTY_VALUES, random)
    elif way < 0.75:
        del holder[key]
    elif way < 0.85:
        other, from_key = _choice(places, random)
        if from_key in (other if isinstance(other, dict) else range(len(other))):
            holder[key] = json.loads(json.dumps(other[from_key]))
    elif isinstance(holder, list):
        holder[key:key] = [holder[key]] * int(random.integers(1, 5))
    else:
        holder[_choice(("sparse", "uri", "byteStride", "byteOffset", "extensions", "camera", "children"), random)] = (
            _choice(NASTY_VALUES, random)
        )
    return value


def _places(value: Any):
    """Every (container, key) below a JSON value."""
    keys = value.keys() if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in list(keys):
        yield value, key
        yield from _places(value[key])


def _json(data: bytes, suffix: str, random: Random) -> bytes:
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return _bytes(data, suffix, random)
    return json.dumps(mutated_json(tree, random)).encode()


def _glb_json(data: bytes, suffix: str, random: Random) -> bytes:
    length = int.from_bytes(data[12:16], "little")
    return glb_from(_json(data[20 : 20 + length], suffix, random), data[28 + length :])


def _glb_head(data: bytes, suffix: str, random: Random) -> bytes:
    """A length or a name in the headers of the file and of its chunks."""
    second = 20 + int.from_bytes(data[12:16], "little")
    place = _choice((4, 8, 12, 16, second, second + 4), random)
    number = _choice((0, 1, 4, len(data), len(data) + 1, 2**31, 2**32 - 1, 2**32 - 8), random)
    return data[:place] + struct.pack("<I", number) + data[place + 4 :]


def _folder(files: dict[str, bytes], random: Random) -> dict[str, bytes]:
    """A file of a folder is broken, lost, doubled, or swapped with another."""
    for _ in range(random.integers(1, 4)):
        name = _choice(sorted(files), random)
        way = random.random()
        if way < 0.6 and name.endswith("json"):
            files[name] = _json(files[name], "json", random)
        elif way < 0.8:
            files[name] = _bytes(files[name], "json", random)
        elif way < 0.9 and len(files) > 1:
            del files[name]
        else:
            files[name], other = files[_choice(sorted(files), random)], files[name]
            files[_choice(sorted(files), random)] = other
    return files
