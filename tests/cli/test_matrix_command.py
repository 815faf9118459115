"""`curvematch matrix` again and again: it goes on, adds what is new, says how far it is, and uses a cluster."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from retrieval.conftest import synthetic_parts as make_parts

from curvematch_jax.cli._app import run
from curvematch_jax.retrieval import load_matrix, matrix_status, save_parts


@pytest.fixture(name="parts")
def fixture_parts(tmp_path):
    """A folder of the parts of 40 objects: three pairs of blocks."""
    for k in range(40):
        save_parts(make_parts(f"o{k:02}", seed=k, parts=2, noise=0.1), tmp_path / "parts" / f"o{k:02}.npz")
    return tmp_path / "parts"


def result(capsys, *arguments):
    capsys.readouterr()
    assert run(["matrix", *map(str, arguments), "--json", "--quiet"]) == 0
    return json.loads(capsys.readouterr().out)


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_same_command_goes_on_and_adds_what_is_new(parts, tmp_path, capsys):
    out = tmp_path / "D.zarr"
    out.mkdir()  # An empty folder is as good as none.
    assert result(capsys, parts, "--out", out)["blocks"] == {"computed": 3, "present": 0}
    before = contents(out)
    assert result(capsys, parts, "--out", out)["blocks"] == {"computed": 0, "present": 3}
    assert contents(out) == before
    save_parts(make_parts("new", seed=99, parts=2), parts / "a" / "new.npz")
    assert result(capsys, parts, "--out", out)["objects"][-1] == "a/new"
    assert load_matrix(out).dissimilarity.shape == (41, 41)


def test_status(parts, tmp_path, capsys):
    out = tmp_path / "D.zarr"
    result(capsys, parts, "--out", out)
    (out / "distances" / "c" / "0" / "0" / "1").unlink()
    found = result(capsys, "--out", out, "--status")
    assert (found["objects"], found["done"], found["left"], found["complete"]) == (40, 2, 1, True)
    assert run(["matrix", "--out", str(out), "--status"]) == 0
    assert "40 objects: 2 of 3 blocks done" in capsys.readouterr().out
    assert run(["matrix", "--out", str(tmp_path / "none.zarr"), "--status"]) == 2
    assert "no such matrix" in capsys.readouterr().err
    assert run(["matrix", "--out", str(out)]) == 2
    assert "give meshes or parts" in capsys.readouterr().err


def test_other_settings_are_refused(parts, tmp_path, capsys):
    result(capsys, parts, "--out", tmp_path / "D.zarr")
    assert run(["matrix", str(parts), "--out", str(tmp_path / "D.zarr"), "--preset", "partial"]) == 2
    said = "was made with the preset default, and is asked for with the preset partial: use the same settings"
    assert said in capsys.readouterr().err


def test_what_is_no_matrix_is_refused_before_any_work(tmp_path, capsys):
    (tmp_path / "D.zarr").mkdir()
    (tmp_path / "D.zarr" / "thesis.tex").write_text("dear")
    assert run(["matrix", str(tmp_path / "none.off"), "--out", str(tmp_path / "D.zarr")]) == 2
    assert "not a curvematch matrix" in capsys.readouterr().err


@pytest.mark.slow
def test_a_killed_run_ends_with_the_same_bytes(parts, tmp_path, capsys):
    whole, out = tmp_path / "whole.zarr", tmp_path / "D.zarr"
    result(capsys, parts, "--out", whole)
    command = [sys.executable, "-m", "curvematch_jax.cli", "matrix", str(parts), "--out", str(out)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    while not (out.exists() and matrix_status(out).done) and process.poll() is None:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    present = matrix_status(out).done
    assert result(capsys, parts, "--out", out)["blocks"] == {"computed": 3 - present, "present": present}
    assert contents(out) == contents(whole)


@pytest.mark.filterwarnings("ignore")
def test_on_a_cluster(parts, tmp_path, capsys):
    """Of the programs that the documentation names; of several workers: `tests/retrieval/test_executors.py`."""
    pytest.importorskip("distributed")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    scheduler = start_dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", env=environment)
    started = [scheduler]
    try:
        assert scheduler.stderr is not None
        address = next(
            match[1] for line in scheduler.stderr if (match := re.search(r"Scheduler at:\s+(tcp://127\S+)", line))
        )
        started.append(start_dask("worker", address, "--nthreads", "1", "--no-dashboard", env=environment))
        found = result(capsys, parts, "--out", tmp_path / "D.zarr", "--scheduler", address)
        assert found["blocks"]["computed"] == 3
    finally:
        for process in reversed(started):
            process.kill()
            process.communicate()
    result(capsys, parts, "--out", tmp_path / "here.zarr")
    there, here = load_matrix(tmp_path / "D.zarr"), load_matrix(tmp_path / "here.zarr")
    np.testing.assert_array_equal(there.dissimilarity, here.dissimilarity)


def start_dask(*arguments, env):
    command = [sys.executable, "-m", "dask", *arguments]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env=env)
