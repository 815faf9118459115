"""Files and folders that appear whole or not at all, and what is said when they are not."""

from __future__ import annotations

import os
import re
import shutil
import socket
import tempfile
import time
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TextIO

try:
    import fcntl
except ImportError:  # Not on Windows.
    fcntl = None

# The files that outlines are read from, and that labels may name.
IMAGE_SUFFIXES = (".png", ".tif", ".tiff")

# `.curvematch-<host>-<process>-<random>`: hidden, so that nobody takes it for a result, and known to be ours.
_TEMPORARY = re.compile(r"\.curvematch-([0-9a-f]{8})-(\d+)-\w+")
_LONG_AGO = 24 * 3600.0


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to, a file or a folder of the same name, that takes the place of `path` if all goes well and
    vanishes if not."""
    path.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".curvematch-{_host()}-{os.getpid()}-"
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=prefix) as folder:
        temporary = Path(folder) / path.name
        yield temporary
        if path.is_dir():
            # A folder can't be renamed onto one that is not empty.
            path.rename(Path(folder) / f"{path.name}.old")
        os.replace(temporary, path)


@contextmanager
def writing(path: Path | None) -> Iterator[None]:
    """Says in one sentence that there is no room, or no permission, where something was to be written: `ValueError`."""
    try:
        yield
    except OSError as error:
        raise ValueError(
            f"{path}: cannot be written ({error.strerror or error}): free some space or choose another place, and run "
            "the same command again; what was written before is intact"
        ) from error


def vacant(path: Path) -> bool:
    """Whether there is nothing at a path, or an empty folder: something may be made there."""
    return not path.exists() or (path.is_dir() and not any(path.iterdir()))


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keeps other processes that ask out of `path` while the block runs; ends with the process, whatever ends it.

    Raises:
        ValueError: when another process is in it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = path.with_name(f".{path.name}.lock")
    with ExitStack() as held:
        if fcntl is not None:
            held.enter_context(_held(lock, path))
            held.callback(lock.unlink, missing_ok=True)  # Before it is let go.
        yield


def _held(lock: Path, path: Path) -> TextIO:
    """The lock file, locked.

    The process that held it before may have removed it after it was opened here: then it keeps nobody out, and another
    one is opened.
    """
    assert fcntl is not None
    while True:
        with writing(lock):
            file = lock.open("w")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(file.fileno()), lock.stat()):
                return file
        except BlockingIOError as error:
            file.close()
            raise ValueError(f"{path}: another process is using it: wait until it has finished") from error
        except FileNotFoundError:
            pass
        file.close()


def remove_leftovers(folder: Path) -> None:
    """Remove what killed processes have left unfinished in a folder and its folders.

    The process that was writing is in the name: on this host it has to be gone, so that the next start can clean up at
    once and a run beside it is not disturbed. Of other hosts' processes only the age is known: a day.
    """
    for path in list(folder.rglob(".curvematch-*")):
        if _left_over(path):
            shutil.rmtree(path, ignore_errors=True)


def because(error: Exception) -> str:
    """In brackets what the system says of a file that cannot be read, or a plain `ValueError`; nothing of others."""
    said = str(error) if type(error) is ValueError else isinstance(error, OSError) and error.strerror
    return f" ({_printable(said)})" if said else ""


def short(error: Exception) -> str:
    """An error's type and message, which may quote any length of what a file holds."""
    return f"{type(error).__name__}: {_printable(str(error))}"


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in " ".join(text.split())[:160])


def _left_over(path: Path) -> bool:
    match = _TEMPORARY.fullmatch(path.name)
    if match is None:
        return False
    if match[1] == _host() and os.name == "posix":
        return not _runs(int(match[2]))
    try:
        return time.time() - path.stat().st_mtime > _LONG_AGO
    except FileNotFoundError:
        return False


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)  # Signal 0 only asks.
    except PermissionError:
        return True
    except (ProcessLookupError, OverflowError):
        return False
    return True


def _host() -> str:
    return f"{zlib.crc32(socket.gethostname().encode()):08x}"
