"""Parts that are kept in a folder, one file an object, and found again by the content of their mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from ..retrieval import load_parts, remove_leftovers, require_same, save_parts, source_key, stored_source
from ..surface import Extraction, Parts

PARTS_SUFFIX = ".npz"


class Store:
    """A folder of parts made with one `Extraction`.

    A mesh whose content has parts here is not processed again, whatever its name was; a mesh that has changed, and
    one whose file is damaged, of an older format, or something else, is, and takes its file's place. Any process may
    be stopped at any time and several may write: a file is always whole.

    Attributes:
        folder: made when it is needed.
        found: the names of the objects whose parts were here.
        notes: which files could not be used, and why.
    """

    def __init__(self, folder: Path, extraction: Extraction) -> None:
        """Look at what is there: the ends of the files alone, so that many thousands are no matter.

        Raises:
            ValueError: when `folder` is a file, or the parts in it were made with other settings, naming one.
        """
        if folder.exists() and not folder.is_dir():
            raise ValueError(f"{folder}: is a file: give a folder for the parts")
        remove_leftovers(folder)
        files = [path for path in sorted(folder.rglob(f"*{PARTS_SUFFIX}")) if path.is_file()]
        _require_settings(folder, files, extraction)
        self.folder = folder
        self.found: set[str] = set()
        self.notes: list[str] = []
        self._extraction = extraction
        self._paths = {key: path for path in files if (key := _stored(path))}

    def path(self, name: str) -> Path:
        """Where the parts of the object of this name are, or would be."""
        return self.folder / f"{name}{PARTS_SUFFIX}"

    def find(self, mesh: Path, name: str) -> Parts | None:
        """The parts of a mesh file, from now on also kept under this name; None when they have to be made."""
        key, own = mesh_key(mesh, self._extraction), self.path(name)
        if not key:
            return None
        for path in dict.fromkeys([own, self._paths.get(key, own)]):
            parts = self._load(path, key)
            if parts is not None:
                break
        else:
            return None
        if path != own or parts.name != name:
            parts = dataclasses.replace(parts, name=name)
            self.keep(parts, key)
        self.found.add(name)
        return parts

    def keep(self, parts: Parts, key: str) -> None:
        """Save parts under their name, with the key of the mesh they are from."""
        save_parts(parts, self.path(parts.name), key)

    def _load(self, path: Path, key: str) -> Parts | None:
        """The parts in a file if they are from this source; a note if one can't know."""
        if not path.is_file():
            return None
        stored = _stored(path)
        if stored not in ("", key):
            return None
        try:
            parts = load_parts(path)
        except (OSError, ValueError) as error:
            self.notes.append(f"made anew: {error}")
            return None
        return parts if stored else None


def mesh_key(mesh: Path, extraction: Extraction) -> str:
    """What tells whether parts are those of a mesh file, see `source_key`; empty when it cannot be read."""
    try:
        return source_key(mesh, extraction) if mesh.is_file() else ""  # Reading a pipe could take forever.
    except OSError:
        return ""


def is_from(path: Path, mesh: Path) -> bool:
    """Whether a file holds the parts of a mesh file as it is now."""
    parts = _sound(path)
    return parts is not None and _stored(path) == (mesh_key(mesh, parts.settings) or None)


def _stored(path: Path) -> str:
    try:
        return stored_source(path)
    except OSError:
        return ""


def _require_settings(folder: Path, files: Sequence[Path], extraction: Extraction) -> None:
    """Refuse to put parts beside those of other settings."""
    present = next((parts for path in files if (parts := _sound(path))), None)
    if present is None:
        return
    what = (f"{folder} holds parts made", "and parts are asked for")
    require_same(present.settings, extraction, what, "use another folder, or the same settings")


def _sound(path: Path) -> Parts | None:
    try:
        return load_parts(path)
    except (OSError, ValueError):
        return None
