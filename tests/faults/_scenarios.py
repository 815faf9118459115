"""Commands that are stopped: killed at any moment, or on a disk that is full or read-only; and what is left then."""

from __future__ import annotations

import dataclasses
import os
import random
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import trimesh

from curvematch_jax import creature, extract_parts, save_parts

_ROOT = Path(__file__).resolve().parents[2]
_KINDS = ("hand", "snake", "spider")
_VERTICES = 400
# Objects of the matrix: 5 blocks, 15 pairs of blocks.
_OBJECTS = 130

Tree = dict[str, bytes]
Marks = dict[str, tuple[int, int]]


@dataclass(frozen=True)
class Scenario:
    """A command that can be stopped.

    Attributes:
        arguments: of the command line, but for `--out`.
        whole: the files, among those that there are, that hold finished results.
    """

    name: str
    arguments: tuple[str, ...]
    whole: Callable[[set[str]], set[str]]

    def command(self, out: Path) -> list[str]:
        return [sys.executable, "-m", "curvematch_jax.cli", *self.arguments, "--out", str(out), "--quiet", "--json"]


@dataclass
class Campaign:
    """What came of killing one command again and again."""

    name: str
    seconds: float
    kills: int = 0
    starts: int = 0
    ends: int = 0
    same_bytes: int = 0
    kept: int = 0
    written_again: int = 0

    @property
    def sound(self) -> bool:
        return self.ends > 0 and self.same_bytes == self.ends and self.written_again == 0


def matrix_scenario(folder: Path, objects: int = _OBJECTS) -> Scenario:
    """A matrix of the few parts of a snake, many times with other lengths: a pair of blocks takes a moment."""
    parts = [extract_parts(creature("snake", pose, vertices=_VERTICES).mesh) for pose in range(3)]
    for k in range(objects):
        one = parts[k % len(parts)]
        changed = dataclasses.replace(one, name=f"{k:03d}", lengths=one.lengths * (1 + 0.001 * k))
        save_parts(changed, folder / "objects" / f"{k:03d}.npz")

    def whole(files: set[str]) -> set[str]:
        pairs = {tuple(name.split("/")[-3::2]): name for name in files if name.startswith("distances/c/")}
        done = {name for (row, column), name in pairs.items() if (column, row) in pairs}
        return {name for name in done if name.rpartition("/")[2].isdigit()}

    return Scenario("matrix", ("matrix", str(folder / "objects")), whole)


def parts_scenario(folder: Path, poses: int = 4) -> Scenario:
    """The parts of a few creatures."""
    for kind in _KINDS:
        for pose in range(poses):
            mesh = creature(kind, pose, vertices=_VERTICES).mesh
            (folder / "meshes").mkdir(exist_ok=True)
            off = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="off")
            (folder / "meshes" / f"{kind}{pose}.off").write_text(str(off))

    def whole(files: set[str]) -> set[str]:
        return {name for name in files if name.endswith(".npz")}

    return Scenario("parts", ("parts", str(folder / "meshes"), "--vertices", str(_VERTICES)), whole)


def kill_again_and_again(scenario: Scenario, folder: Path, kills: int, seed: int) -> Campaign:
    """Kill and start again until there were enough kills and the last run has come to its end."""
    moments = random.Random(seed)
    run(scenario, folder / "warm")  # Compiles, which later runs need not.
    started = time.perf_counter()
    expected = tree(require_end(run(scenario, folder / "whole"), folder / "whole"))
    found = Campaign(scenario.name, round(time.perf_counter() - started, 2))
    while found.kills < kills:
        out, ended = folder / f"killed-{found.ends}", False
        before: Marks = {}
        while not ended:
            # Most of the first third is the start of Python.
            delay = moments.uniform(0.3, 1.0) * found.seconds if found.kills < kills else None
            ended = killed_after(scenario, out, delay)
            found.starts += 1
            found.kills += not ended
            after = marks(scenario, out)
            found.kept += len(before)
            found.written_again += sum(after.get(name) != mark for name, mark in before.items())
            before = after
        found.ends += 1
        found.same_bytes += tree(out) == expected
        shutil.rmtree(out)
    return found


def killed_after(scenario: Scenario, out: Path, delay: float | None) -> bool:
    """Start the command and kill it after so many seconds; whether it came to its end before."""
    process = start(scenario, out)
    try:
        message = process.communicate(timeout=delay)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return False
    if process.returncode:
        raise RuntimeError(f"{scenario.name} ended with status {process.returncode}: {message.decode()}")
    return True


def faulty_disks(scenario: Scenario, folder: Path) -> dict[str, str]:
    """A disk that is full, and one that must not be written to: a sentence, status 2, and the same command goes on."""
    expected = tree(require_end(run(scenario, folder / "whole"), folder / "whole"))
    found = {"files too large": _too_large(scenario, folder / "large", expected)}
    size = sum(len(content) for content in expected.values())
    with small_disk(folder / "disk", size // 2) as mounted:
        if not mounted:
            return found | {"disk full": "skipped", "read-only": "skipped"}
        out = folder / "disk" / "out"
        failed = run(scenario, out)
        found["disk full"] = _verdict(scenario, out, failed, expected, lambda: remount(folder / "disk", "size=1g"))
        shutil.rmtree(out)
        out.mkdir()
        remount(folder / "disk", "ro")
        failed = run(scenario, out)
        found["read-only"] = _verdict(scenario, out, failed, expected, lambda: remount(folder / "disk", "rw"))
    return found


def _too_large(scenario: Scenario, out: Path, expected: Tree) -> str:
    """A limit on the size of files, which needs no rights: below that of the largest result."""
    limit = max(len(content) for content in expected.values()) - 1
    process = start(scenario, out, limit)
    message = process.communicate()[1].decode()
    done = subprocess.CompletedProcess([], process.returncode, "", message)
    return _verdict(scenario, out, done, expected, lambda: None)


def _verdict(
    scenario: Scenario, out: Path, failed: subprocess.CompletedProcess, expected: Tree, repair: Callable[[], None]
) -> str:
    if "Traceback" in failed.stderr or failed.returncode != 2:
        return f"status {failed.returncode}: {failed.stderr}"
    repair()
    again = run(scenario, out)
    if again.returncode:
        return f"not gone on with: {again.stderr}"
    return "sound" if tree(out) == expected else "other bytes"


def start(scenario: Scenario, out: Path, largest: int | None = None) -> subprocess.Popen[bytes]:
    """The command in a process of its own; `largest` is a limit on the bytes of a file."""
    environment = os.environ | {"PYTHONPATH": str(_ROOT)}
    process = subprocess.Popen(scenario.command(out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
    if largest is not None:  # Long before it writes anything: it has just begun to load Python.
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (largest, largest))
    return process


def run(scenario: Scenario, out: Path) -> subprocess.CompletedProcess:
    """The command to its end."""
    process = start(scenario, out)
    printed, message = process.communicate()
    return subprocess.CompletedProcess(process.args, process.returncode, printed.decode(), message.decode())


def require_end(done: subprocess.CompletedProcess, out: Path) -> Path:
    if done.returncode:
        raise RuntimeError(f"a run that nobody stopped ended with status {done.returncode}: {done.stderr}")
    return out


def tree(folder: Path) -> Tree:
    """Every file and its bytes; folders as well, without."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b"" for path in folder.rglob("*")}


def marks(scenario: Scenario, out: Path) -> Marks:
    """What changes when a finished result is written again."""
    files = {str(path.relative_to(out)): path.stat() for path in out.rglob("*") if path.is_file()}
    return {name: (files[name].st_ino, files[name].st_mtime_ns) for name in scenario.whole(set(files))}


@contextmanager
def small_disk(folder: Path, size: int) -> Iterator[bool]:
    """A file system of its own, of so many bytes; False where this user may not mount one."""
    folder.mkdir(parents=True)
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        mounted = False
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", str(folder)], check=True)


def remount(folder: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True, capture_output=True)
