"""Mutations of parts files, most of them sealed again, so that more than the checksum is put to the test."""

from __future__ import annotations

import hashlib
import io
import json
import pickle
import zipfile

import numpy as np

_DIGEST = 64


class _Caught:
    """Unpickling it would be found."""

    def __reduce__(self):
        return print, ("unpickled",)


def mutated_npz(data: bytes, random: np.random.Generator) -> bytes:
    """A parts file with a member or a few bytes changed."""
    way = random.random()
    if way < 0.3:
        changed = bytearray(data)
        for place in random.integers(0, len(data), random.integers(1, 6)).tolist():
            changed[place : place + 1] = random.bytes(1)
        return resealed(bytes(changed)) if random.random() < 0.8 else bytes(changed)
    if way < 0.4:
        return data[: random.integers(len(data))]
    members = _members(data)
    for _ in range(random.integers(1, 4)):
        _change(members, random)
    kind = zipfile.ZIP_DEFLATED if random.random() < 0.05 else zipfile.ZIP_STORED
    return _zipped(members, data, kind)


def resealed(data: bytes) -> bytes:
    """With the digest that its content has."""
    content = data[:-_DIGEST]
    return content + hashlib.sha256(content).hexdigest().encode()


def _members(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _change(members: dict[str, bytes], random: np.random.Generator) -> None:
    names = sorted(members)
    name = names[random.integers(len(names))]
    way = random.integers(8)
    if way == 0:
        del members[name]
        members.setdefault("format.npy", _npy(np.array(3)))
    elif way == 1:
        members[name] = members[names[random.integers(len(names))]]
    elif way == 2:
        members[name] = _nasty_header(members[name], random)
    elif way == 3:
        members[name] = _nasty_values(members[name], random)
    elif way == 4:
        members["settings.npy"] = _npy(np.array(_nasty_text(members.get("settings.npy", b""), random)))
    elif way == 5:
        members["notes.npy"] = _npy(
            np.array(("[1]", "{}", '["a', "[" * 100_000, '"x"', "[[]]", "null")[random.integers(7)])
        )
    elif way == 6:
        members[name] = _npy(np.array([_Caught()], dtype=object))
    else:
        members[("../evil.npy", "/tmp/evil.npy", "x" * 60_000, "é.npy", "pickle")[random.integers(5)]] = pickle.dumps(
            _Caught()
        )


def _nasty_header(member: bytes, random: np.random.Generator) -> bytes:
    shapes = ("(4000000000, 4000000000)", "(-1,)", "(0,)", "()", "(2**40,)", "(" + "1," * 70 + ")", "(1.5,)", "None")
    types = ("<f8", "|O", "|V0", ">f4", "<U1000000000", "|b1", "M8", "<i4", "[('a','<f4')]")
    header = (
        f"{{'descr': {types[random.integers(len(types))]!r}, 'fortran_order': {bool(random.random() < 0.1)}, "
        f"'shape': {shapes[random.integers(len(shapes))]}, }}\n"
    ).encode()
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + member[128:]


def _nasty_values(member: bytes, random: np.random.Generator) -> bytes:
    try:
        values = np.load(io.BytesIO(member), allow_pickle=False)
    except Exception:
        return member
    if values.dtype.kind == "f" and values.size:
        flat = values.reshape(-1).copy()
        nasty = (np.nan, np.inf, -np.inf, 3e38, -1.0, 0.0, 1e-45)[random.integers(7)]
        flat[random.integers(flat.size, size=3)] = nasty
        values = flat.reshape(values.shape)
    way = random.integers(4)
    if way == 0:
        with np.errstate(all="ignore"):
            values = (
                values.astype(("<f8", "<f2", "<i8", "<c8")[random.integers(4)]) if values.dtype.kind in "fb" else values
            )
    elif way == 1:
        values = np.concatenate([values, values]) if values.ndim else values.reshape(1)
    elif way == 2:
        values = values[:0] if values.ndim else values
    return _npy(values)


def _nasty_text(member: bytes, random: np.random.Generator) -> str:
    try:
        settings = json.loads(str(np.load(io.BytesIO(member), allow_pickle=False)))
        key = sorted(settings)[random.integers(len(settings))]
    except Exception:
        return "{" * int(random.integers(1, 50_000))
    values = (-1, 0, 10**9, 10**30, float("nan"), float("inf"), "x", None, True, [], 1.5, "9" * 1000, {"a": 1}, 5, 16)
    settings[key] = values[random.integers(len(values))]
    if random.random() < 0.2:
        settings["other"] = 1
    return json.dumps(settings)


def _npy(values: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, values, version=(1, 0), allow_pickle=True)
    return file.getvalue()


def _zipped(members: dict[str, bytes], data: bytes, kind: int) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression=kind) as archive, zipfile.ZipFile(io.BytesIO(data)) as original:
        for name, content in members.items():
            # Without the time, so that a case is the same bytes whenever it is made.
            archive.writestr(zipfile.ZipInfo(name), content, compress_type=kind)
        archive.comment = original.comment
    return resealed(file.getvalue())


def zip_bomb(megabytes: int) -> bytes:
    """An archive of one array of zeros, compressed a thousand times."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression=zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("format.npy", _npy(np.array(3)))
        archive.writestr("curves.npy", _npy(np.zeros(megabytes << 17)))
    return file.getvalue()
