"""Worker processes: a task that fails, hangs or takes all memory does not affect others; no worker is left behind."""

import ctypes
import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from curvematch_jax.extraction._workers import in_processes

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="limits of memory and the parent's death are Linux's")


def answer(task):
    match task:
        case "error":
            raise RuntimeError("two\nlines")
        case "exit":
            os._exit(7)
        case "segfault":
            ctypes.string_at(0)
        case "hang":
            time.sleep(3600)
        case "stopped":
            os.kill(os.getpid(), signal.SIGSTOP)
        case "half an answer":
            pipe = next(fd for fd in range(3, 256) if is_socket(fd))
            os.write(pipe, (1000).to_bytes(4, "big") + b"half")
            os._exit(7)
        case "no answer":
            return lambda: None
        case "memory":
            return len([np.zeros(1 << 27) for _ in range(1 << 10)])
    return task * task


def is_socket(fd):
    try:
        return stat.S_ISSOCK(os.fstat(fd).st_mode)
    except OSError:
        return False


FAILURES = {
    "error": "RuntimeError: two lines",
    "exit": "its worker process ended with status 7",
    "half an answer": "its worker process ended with status 7",
    "segfault": "its worker process was killed by SIGSEGV",
    "hang": "took longer than 2 s",
    "stopped": "took longer than 2 s",
}
if sys.platform == "linux":
    FAILURES["memory"] = "needs more memory than the 2.5 GiB that are its worker process's share"


def test_tasks_that_fail_cost_themselves_alone(monkeypatch):
    monkeypatch.setattr("curvematch_jax.extraction._workers._memory", lambda: 5 << 30)
    tasks = [2, *FAILURES, 3, "no answer", 4, 5]
    outcomes = sorted(in_processes(answer, tasks, jobs=2, seconds=2), key=lambda outcome: outcome.task)
    assert [outcome.task for outcome in outcomes] == list(range(len(tasks)))
    by_task = dict(zip(tasks, outcomes, strict=True))
    assert {task: by_task[task].failure for task in FAILURES} == FAILURES
    assert "pickle" in by_task["no answer"].failure
    assert [by_task[task].result for task in (2, 3, 4, 5)] == [4, 9, 16, 25]
    assert list(in_processes(answer, [], jobs=2)) == []


def test_slow_consumer_costs_no_task_its_time():
    done = in_processes(answer, [1, 2, 3], jobs=1, seconds=1)
    results = []
    for outcome in done:
        time.sleep(1.1)
        results.append(outcome.result)
    assert sorted(results) == [1, 4, 9]


def hold(folder):
    Path(folder, str(os.getpid())).touch()
    ctypes.PyDLL(None).sleep(3600)  # Native code that keeps the interpreter to itself.


def running(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def until(true, seconds=60.0):
    end = time.monotonic() + seconds
    while not true() and time.monotonic() < end:
        time.sleep(0.02)
    return true()


@LINUX
def test_workers_die_with_their_parent(tmp_path):
    script = f"""
import sys
sys.path[:0] = {sys.path!r}
from curvematch_jax.extraction._workers import in_processes
from tests.extraction.test_workers import hold
if __name__ == "__main__":
    list(in_processes(hold, [{str(tmp_path)!r}], jobs=1))
"""
    (tmp_path / "parent").mkdir()
    (tmp_path / "parent" / "run.py").write_text(script)
    parent = subprocess.Popen([sys.executable, tmp_path / "parent" / "run.py"])
    assert until(lambda: len(list(tmp_path.iterdir())) == 2)
    worker = next(path.name for path in tmp_path.iterdir() if path.name != "parent")
    assert running(worker)
    parent.kill()
    parent.wait()
    assert until(lambda: not running(worker), seconds=10)
