"""Parts on disk: `.npz` files of plain arrays, so that reading one never runs code.

The same parts give the same bytes at any time. The file ends with a seal, the comment of the zip archive: the key of
the mesh that the parts are from, and the SHA-256 of everything before. Nothing is compressed, so that the size of a
file bounds what reading it allocates.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import os
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._files import because, replacing, short
from .._given import require_type, wrong_type
from ..surface import Extraction, Parts
from ..surface._parts import ARRAYS
from ._settings import require_same_extraction

# Also to be raised when extraction gives other parts from the same mesh: the key of a source depends on it.
PARTS_FORMAT = 8

# The kinds of dtype (`numpy.dtype.kind`) of all fields.
_KINDS = {name: "b" if name == "mask" else "f" for name in ARRAYS}
_KINDS |= {"format": "i", "name": "U", "area": "f", "diameter": "f", "settings": "U", "notes": "U"}

_NO_SOURCE = "-" * 64
_SEAL = re.compile(rb"source (-{64}|[0-9a-f]{64}) sha256 ([0-9a-f]{64})")
_DIGEST = 64
_SEAL_SIZE = len("source  sha256 ") + 64 + _DIGEST


def save_parts(parts: Parts, path: str | os.PathLike[str], source: str = "") -> None:
    """Write parts to a `.npz` file, replacing what is there; folders are made as needed.

    Args:
        source: the key of the mesh file that they are from, see `source_key`; empty when there is none.

    Raises:
        ValueError: when `parts` are something else, there is a folder at `path`, or `source` is no key.
    """
    require_type("parts", parts, Parts, "give Parts, e.g. extract_parts(mesh)")
    if Path(path).is_dir():
        raise ValueError(f"{path}: is a folder: give a file for the parts")
    data = _encoded(_fields(parts), source)
    with replacing(Path(path)) as temporary:
        temporary.write_bytes(data)


def load_parts(path: str | os.PathLike[str]) -> Parts:
    """Read parts that `save_parts` has written.

    Raises:
        FileNotFoundError: when there is no such file.
        ValueError: when the file is damaged, be it by one bit, is something else, or was written in another format.
    """
    path = Path(path)
    if path.is_dir():
        raise ValueError(f"{path}: is a folder: give one parts file")
    if path.exists() and not path.is_file():
        raise ValueError(f"{path}: is not a regular file: give a parts file")  # A pipe could have no end.
    try:
        data = path.read_bytes()
        fields = _decoded(data)
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: no such parts file") from None
    except Exception as error:  # zipfile and numpy raise what they like, tokenize.TokenError too
        raise ValueError(f"{path}: not a parts file, or a damaged one{because(error)}") from error
    if "format" not in fields or fields["format"].size != 1:
        raise ValueError(f"{path}: not a parts file: it has no format number")
    if int(fields["format"]) != PARTS_FORMAT:
        raise ValueError(
            f"{path}: parts of format {int(fields['format'])}, and this version reads format {PARTS_FORMAT}: "
            "extract them again"
        )
    if not _sealed(data):
        raise ValueError(f"{path}: damaged: its content is not what its checksum says: extract these parts again")
    missing = [name for name in _KINDS if name not in fields]
    if missing:
        raise ValueError(f"{path}: not a whole parts file: it lacks {', '.join(missing)}")
    try:
        return _parts_from(fields)
    except (TypeError, ValueError, RecursionError, SystemError) as error:
        raise ValueError(f"{path}: not a sound parts file: {short(error)}") from error


def load_collection(paths: Iterable[str | os.PathLike[str]]) -> list[Parts]:
    """Read several parts files that were made with the same settings.

    Raises:
        ValueError: as `load_parts`, and when two files were made with different settings, naming the setting.
    """
    if isinstance(paths, str | os.PathLike):
        raise wrong_type("paths", paths, "give a list of files; extract_collection([folder]) reads a folder")
    collection = [load_parts(path) for path in paths]
    require_same_extraction([(parts.name, parts.settings) for parts in collection])
    return collection


class StoredParts(Sequence[Parts]):
    """Parts files as a sequence that reads one whenever it is asked for it, and keeps none.

    Args:
        paths: of the files.
        names: that the objects go by; by default those in the files.
    """

    def __init__(self, paths: Sequence[str | os.PathLike[str]], names: Sequence[str] | None = None) -> None:
        self._paths, self._names = list(paths), names

    def __len__(self) -> int:
        return len(self._paths)

    def __getitem__(self, i: Any) -> Any:
        if isinstance(i, slice):
            return StoredParts(self._paths[i], self._names and self._names[i])
        parts = load_parts(self._paths[i])
        return dataclasses.replace(parts, name=self._names[i]) if self._names else parts


def fingerprint(parts: Parts) -> str:
    """The SHA-256, in hex, of all that comparing these parts depends on: arrays, area, diameter and settings.

    Objects of other names or notes have the same fingerprint; a file gives back parts of the fingerprint that it was
    given.
    """
    digest = hashlib.sha256()
    for name, value in _fields(parts).items():
        if name not in ("format", "name", "notes"):
            digest.update(f"{name} {value.dtype.str} {value.shape}\n".encode())
            digest.update(value.data)
    return digest.hexdigest()


def source_key(path: str | os.PathLike[str], extraction: Extraction) -> str:
    """What parts follow from, as 64 hex digits: a mesh file's bytes, its format, and the settings; not its name.

    Raises:
        OSError: when the file cannot be read.
    """
    path = Path(path)
    # The suffix tells `load_mesh` how to read the bytes.
    follows = {"format": PARTS_FORMAT, "suffix": path.suffix.lower(), "settings": dataclasses.asdict(extraction)}
    with path.open("rb") as file:
        digest = hashlib.sha256(json.dumps(follows, sort_keys=True).encode() + b"\n")
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def stored_source(path: str | os.PathLike[str]) -> str:
    """The key that a parts file was saved with; empty when there is none, or the file is no parts file.

    Only the seal is read: the file may be damaged elsewhere, which `load_parts` finds out.

    Raises:
        OSError: when the file cannot be read.
    """
    with Path(path).open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - _SEAL_SIZE, 0))
        match = _SEAL.fullmatch(file.read(_SEAL_SIZE))
    key = match[1].decode() if match else _NO_SOURCE
    return "" if key == _NO_SOURCE else key


def _fields(parts: Parts) -> dict[str, np.ndarray]:
    """What a file holds, as arrays with one layout in memory on any machine."""
    fields: dict[str, Any] = {
        "format": PARTS_FORMAT,
        "name": parts.name,
        "settings": json.dumps(dataclasses.asdict(parts.settings), sort_keys=True),
        "notes": json.dumps(parts.notes),
        "area": float(parts.area),
        "diameter": float(parts.diameter),
    }
    fields |= {name: getattr(parts, name) for name in ARRAYS}
    arrays = {name: np.asarray(value, order="C") for name, value in fields.items()}
    return {name: array.astype(array.dtype.newbyteorder("<"), copy=False) for name, array in arrays.items()}


def _encoded(fields: Mapping[str, np.ndarray], source: str) -> bytes:
    """The bytes of a file: a zip archive without times or compression, sealed."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, value in fields.items():
            member = zipfile.ZipInfo(f"{name}.npy")
            member.create_system = 3  # Python's default is the system's own.
            content = io.BytesIO()
            np.lib.format.write_array(content, value, version=(1, 0), allow_pickle=False)
            archive.writestr(member, content.getvalue())
        archive.comment = f"source {source or _NO_SOURCE} sha256 {'0' * _DIGEST}".encode()
    if not _SEAL.fullmatch(archive.comment):
        raise ValueError(f"a source is a key of 64 hex digits, found {source!r}")
    content = buffer.getvalue()[:-_DIGEST]
    return content + hashlib.sha256(content).hexdigest().encode()


def _sealed(data: bytes) -> bool:
    match = _SEAL.fullmatch(data[-_SEAL_SIZE:])
    return match is not None and match[2].decode() == hashlib.sha256(data[:-_DIGEST]).hexdigest()


def _decoded(data: bytes) -> dict[str, np.ndarray]:
    """The fields in the bytes of a file, those that parts have; of other formats, the format alone.

    What this allocates is bounded by the length of the data, whatever they claim.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
        if any(member.compress_type != zipfile.ZIP_STORED for member in members.values()):
            raise ValueError("compressed, and parts files never are")
        if sum(member.file_size for member in members.values()) > len(data):
            raise ValueError("the sizes that it claims are more than its own")
        if "format" not in members:
            return {}
        number = _array(archive.read(members["format"]), _KINDS["format"])
        wanted = _KINDS if number.size == 1 and int(number) == PARTS_FORMAT else ["format"]
        return {name: _array(archive.read(members[name]), _KINDS[name]) for name in wanted if name in members}


def _array(data: bytes, kind: str) -> np.ndarray:
    """An array from the bytes of a `.npy` file, which have to be as many as its header says."""
    file = io.BytesIO(data)
    if np.lib.format.read_magic(file) != (1, 0):
        raise ValueError("an array of another version of the npy format")
    shape, by_columns, dtype = np.lib.format.read_array_header_1_0(file)
    count = int(np.prod(shape, dtype=object))
    if dtype.kind != kind or dtype.itemsize == 0 or by_columns:
        raise ValueError(f"an array of type {dtype.str} where parts have another")
    if count < 0 or count * dtype.itemsize != len(data) - file.tell():
        raise ValueError(f"an array of shape {shape} does not fit the bytes that are there")
    values = np.frombuffer(data, dtype, count, file.tell()).reshape(shape)
    return values.astype(dtype.newbyteorder("="))  # A copy that can be written to, in this machine's byte order.


def _parts_from(fields: Mapping[str, np.ndarray]) -> Parts:
    arrays = {name: fields[name] for name in ARRAYS}
    settings = Extraction(**json.loads(_text(fields, "settings")))
    _check_arrays(fields, settings)
    return Parts(
        name=_text(fields, "name"),
        **arrays,
        area=float(fields["area"]),
        diameter=float(fields["diameter"]),
        settings=settings,
        notes=_notes(json.loads(_text(fields, "notes"))),
    )


def _text(fields: Mapping[str, np.ndarray], name: str) -> str:
    if fields[name].shape:
        raise ValueError(f"{name} has shape {fields[name].shape}, and one text was expected")
    return str(fields[name])


def _notes(notes: object) -> tuple[str, ...]:
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise ValueError("notes are not a list of texts")
    return tuple(notes)


def _check_arrays(fields: Mapping[str, np.ndarray], settings: Extraction) -> None:
    count, levels = fields["areas"].size, settings.levels
    shapes = {
        "curves": (count, levels, 3, settings.samples),
        "mask": (count, levels),
        "lengths": (count, levels),
        "level_set_lengths": (count, levels),
        "centres": (count, levels, 3),
        "areas": (count,),
        "points": (count, 3),
        "feature_distances": (count, count),
        "spectrum": (fields["spectrum"].size,),
        "views": (fields["views"].size,),
        "area": (),
        "diameter": (),
    }
    for name, shape in shapes.items():
        if fields[name].shape != shape:
            raise ValueError(f"{name} has shape {fields[name].shape}, and {shape} was expected")
        if not np.isfinite(fields[name]).all():
            raise ValueError(f"{name} holds values that are not finite")
    for name in ("lengths", "level_set_lengths", "areas", "feature_distances"):
        if (fields[name] < 0).any():
            raise ValueError(f"{name} holds negative values")
    for name, there in (("lengths", fields["lengths"] > 0), ("curves", (fields["curves"] != 0).any(axis=(2, 3)))):
        if (there != fields["mask"]).any():
            raise ValueError(f"{name} and mask disagree about which level curves there are")
    for name in ("area", "diameter"):
        if not fields[name] > 0:
            raise ValueError(f"{name} is {fields[name]}, and has to be more than 0")
