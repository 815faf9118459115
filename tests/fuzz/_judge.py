"""One hostile file, read in a worker process that watches what happens."""

from __future__ import annotations

import functools as ft
import os
import resource
import sys
import sysconfig
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from curvematch_jax import Parts, extract_parts, load_matrix, load_mesh, load_parts
from curvematch_jax.retrieval import SavedMatrix
from curvematch_jax.surface import MeshError

from ._mutations import hostile
from ._seeds import FORMATS, SETTINGS, WRITERS, Content, meshes, seed_content, suffix_of

SECONDS = 10.0
MEMORY = 1 << 30
_LONGEST_MESSAGE = 600

# Reading below these is Python's own business: modules, time zones, the processor's caches.
_SYSTEM = tuple(
    {os.path.realpath(path) for path in (sys.prefix, sys.base_prefix, *sysconfig.get_paths().values())}
    | {"/proc", "/sys", "/dev/urandom", "/dev/null", "/usr", "/lib", "/lib64", str(Path(__file__).parents[2])}
)
_FORBIDDEN = (
    "socket.",
    "subprocess.",
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.fork",
    "pickle.",
    "urllib.",
    "ftplib.",
)
_PLACES = (
    "os.listdir",
    "os.scandir",
    "os.mkdir",
    "os.remove",
    "os.rmdir",
    "os.rename",
    "os.link",
    "os.symlink",
    "os.chmod",
)
_PLACES += ("os.truncate", "os.utime", "shutil.", "glob.", "tempfile.mk")
_OURS = (MeshError, ValueError, FileNotFoundError, ImportError)


@dataclass(frozen=True)
class Case:
    """A hostile file: what it follows from, or its content itself."""

    kind: str
    seed: tuple[int, ...]
    content: Content | None = None

    def made(self) -> Content:
        if self.content is not None:
            return self.content
        return hostile(self.kind, suffix_of(self.kind), np.random.default_rng(self.seed))


@dataclass(frozen=True)
class Verdict:
    """What became of a file.

    Attributes:
        outcome: `"loaded"`, `"refused"` by the loader, or `"unusable"`: a mesh that extraction refused.
        violations: kinds, each with its detail.
        seconds: of the stages `"load"` and `"extract"`.
        message: of the refusal.
        memory: by how many bytes the peak of memory grew.
    """

    outcome: str = "loaded"
    violations: tuple[tuple[str, str], ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    message: str = ""
    memory: int = 0


class _Watch:
    """What the process does while a file is read: an audit hook can't be removed, so there is one, and it can rest."""

    def __init__(self) -> None:
        self.folder: str | None = None
        self.found: list[tuple[str, str]] = []
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: tuple) -> None:
        if self.folder is None:
            return
        if event.startswith(_FORBIDDEN):
            self.found.append(("forbidden", f"{event} {arguments!r:.200}"))
        elif event == "open" or event.startswith(_PLACES):
            path = arguments[0] if arguments else None
            if isinstance(path, str | bytes | os.PathLike) and not self._allowed(event, os.fsdecode(path), arguments):
                self.found.append(("outside", f"{event} {arguments!r:.200}"))

    def _allowed(self, event: str, path: str, arguments: tuple) -> bool:
        place = os.path.realpath(path)
        if event == "open":
            reads = not (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        else:
            reads = event.startswith(("os.listdir", "os.scandir", "glob."))
        return reads and (place == self.folder or place.startswith((f"{self.folder}/", *_SYSTEM)))


def judge(case: Case) -> Verdict:
    """Read a hostile file as a user would, and go on to parts."""
    bench = _bench()
    content = case.made()
    with tempfile.TemporaryDirectory(dir=bench.folder) as folder:
        path = _written(content, Path(folder) / f"given.{suffix_of(case.kind)}")
        return bench.judged(case.kind, path)


@ft.cache
def _bench() -> _Bench:
    return _Bench()


class _Bench:
    """What a worker process keeps: the hook, and the places of its outputs."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
        self.output = [os.open(self.folder / name, os.O_RDWR | os.O_CREAT) for name in ("stdout", "stderr")]
        sys.stdout.flush()
        for kept, descriptor in zip(self.output, (1, 2), strict=True):
            os.dup2(kept, descriptor)
        for kind in FORMATS:  # Modules are loaded, and threads started, before anything is watched.
            content = WRITERS[kind][1](meshes()[2]) if kind in WRITERS else seed_content(kind, np.random.default_rng(0))
            path = _written(content, self.folder / f"warm-{kind}.{suffix_of(kind)}")
            _read(kind, path, {})
        self.watch = _Watch()

    def judged(self, kind: str, path: Path) -> Verdict:
        seconds: dict[str, float] = {}
        found: list[tuple[str, str]] = []
        outcome, message = "loaded", ""
        with self._measured(path.parent, found) as memory, warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                result = _read(kind, path, seconds)
            except BaseException as error:
                outcome = "unusable" if "load" in seconds else "refused"
                message = f"{type(error).__name__}: {error}"
                found += _faults_of(error, path)
            else:
                found += _faults_in(result)
        found += [("warning", str(w.message)[:200]) for w in warned]
        found += [("slow", f"{stage} took {value:.1f} s") for stage, value in seconds.items() if value > SECONDS]
        if memory[0] > MEMORY:
            found.append(("memory", f"{memory[0] / 2**30:.2f} GiB"))
        return Verdict(outcome, tuple(found), seconds, message[:_LONGEST_MESSAGE], memory[0])

    @contextmanager
    def _measured(self, folder: Path, found: list[tuple[str, str]]) -> Iterator[list[int]]:
        """Watch files, outputs and memory; as much as is allowed may be allocated, and a little more."""
        memory = [0]
        Path("/proc/self/clear_refs").write_text("5")
        before = _status("VmHWM")
        soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (_status("VmData") + MEMORY + (64 << 20), hard))
        self.watch.found, self.watch.folder = found, os.path.realpath(folder)
        try:
            yield memory
        finally:
            self.watch.folder = None
            resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
            memory[0] = _status("VmHWM") - before
            sys.stdout.flush()
            for name, descriptor in zip(("stdout", "stderr"), self.output, strict=True):
                if size := os.fstat(descriptor).st_size:
                    found.append((name, os.pread(descriptor, min(size, 200), 0).decode(errors="replace")))
                    os.ftruncate(descriptor, 0)
                    os.lseek(descriptor, 0, os.SEEK_SET)


def _status(name: str) -> int:
    """Bytes, from what Linux says of this process."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) * 1024
    raise KeyError(name)


def _written(content: Content, path: Path) -> Path:
    files = {path: content} if isinstance(content, bytes) else {path / name: data for name, data in content.items()}
    for file, data in files.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(data)
    return path


def _read(kind: str, path: Path, seconds: dict[str, float]) -> Any:
    """The function under test; seconds are this thread's own, since workers share the processor."""

    def timed(stage: str, call: Callable[[], Any]) -> Any:
        start = time.thread_time()
        try:
            result = call()
        except BaseException:
            seconds[f"{stage} refused"] = time.thread_time() - start
            raise
        seconds[stage] = time.thread_time() - start
        return result

    if kind == "npz":
        return timed("load", lambda: load_parts(path))
    if kind == "zarr":
        return timed("load", lambda: load_matrix(path))
    mesh = timed("load", lambda: load_mesh(path, str(path)))
    return timed("extract", lambda: extract_parts(mesh, SETTINGS))


def _faults_of(error: BaseException, path: Path) -> list[tuple[str, str]]:
    """What is wrong with a refusal."""
    text = str(error)
    detail = f"{type(error).__name__}: {text[:300]}"
    if isinstance(error, MemoryError) or "MemoryError" in text or "llocate" in text:
        return [("memory", detail)]
    if isinstance(error, UnicodeError) or type(error).__name__ == "JSONDecodeError" or not isinstance(error, _OURS):
        return [("exception", detail)]
    faults = []
    if "\n" in text or not text.isprintable():
        faults.append(("message of many lines", detail))
    if str(path) not in text:
        faults.append(("message without the file", detail))
    if len(text) > _LONGEST_MESSAGE:
        faults.append(("long message", detail))
    return faults


def _faults_in(result: Any) -> list[tuple[str, str]]:
    """What is wrong with a result."""
    if isinstance(result, SavedMatrix):
        values, count = result.dissimilarity, len(result.names)
        sound = values.shape == (count, count) and values.dtype.kind == "f" and not np.isinf(values).any()
        texts = all(isinstance(text, str) for text in (*result.names, *result.notes))
        return [] if sound and texts else [("unsound", f"{values.dtype} {values.shape}, names {result.names!r:.100}")]
    assert isinstance(result, Parts)
    points, levels, samples = len(result.points), result.settings.levels, result.settings.samples
    shapes = {
        "curves": (points, levels, 3, samples),
        "mask": (points, levels),
        "lengths": (points, levels),
        "level_set_lengths": (points, levels),
        "centres": (points, levels, 3),
        "areas": (points,),
        "points": (points, 3),
        "feature_distances": (points, points),
    }
    faults = [
        ("unsound", f"{n} {getattr(result, n).shape}") for n, s in shapes.items() if getattr(result, n).shape != s
    ]
    faults += [("unsound", f"{n} is not finite") for n in shapes if not np.isfinite(getattr(result, n)).all()]
    if not (np.isfinite(result.area) and np.isfinite(result.diameter) and result.area > 0 and result.diameter > 0):
        faults.append(("unsound", f"area {result.area}, diameter {result.diameter}"))
    if not faults and ((result.lengths > 0) != result.mask).any():
        faults.append(("unsound", "lengths do not fit the mask"))
    return faults


def smaller(case: Case, seconds: float = 30.0) -> Case:
    """The case without what its violations do not need: pieces are left out, ever smaller ones, until time is up."""
    end = time.monotonic() + seconds
    content, kinds = case.made(), _kinds(judge(case))
    if isinstance(content, dict):
        return replace(case, content=content)
    size = len(content) // 2
    while size:
        place = 0
        while place < len(content) and time.monotonic() < end:
            shorter = content[:place] + content[place + size :]
            if kinds <= _kinds(judge(replace(case, content=shorter))):
                content = shorter
            else:
                place += size
        size //= 2
    return replace(case, content=content)


def _kinds(verdict: Verdict) -> set[str]:
    return {kind for kind, _ in verdict.violations}
