import sys
from pathlib import Path

import numpy as np
import pytest

import curvematch_jax as cm
from benchmarks._elsewhere import checkout, output_of
from benchmarks._measure import fourier_curves
from benchmarks._record import commit
from benchmarks._runs import Engine, Lengths, Matrix, NewSamples
from benchmarks._stages import stages
from benchmarks.engine import geodesics, picture, times_faster

RIGID = cm.Rigid(grid=16, chunk=4)
ELASTIC = cm.Elastic((cm.Round(2, 8, 2),), steps=1, knots=8, chunk=4)


def test_curves_are_sampled_by_arc_length():
    curves = fourier_curves(0, 3, 200)
    steps = np.linalg.norm(np.diff(curves, axis=-1, append=curves[..., :1]), axis=1)
    assert curves.dtype == np.float32
    short = 1 - steps / steps.max(axis=1, keepdims=True)  # chords are, where a curve turns sharply
    assert np.quantile(short, 0.9) < 0.01


@pytest.mark.parametrize("aligner", [RIGID, pytest.param(ELASTIC, marks=pytest.mark.slow)])
def test_stages_add_up_to_the_whole(aligner):
    report = stages(aligner, fourier_curves(0, 4, 20), fourier_curves(1, 4, 20))
    assert {report["align_bound_by"], report["distance_matrix_bound_by"]} <= set(report["stages"])
    assert sum(stage["share"] for stage in report["stages"].values()) == pytest.approx(1)
    if aligner is ELASTIC:
        assert report["stages"]["round 1"]["updates"] == 2 * 8 * 5 * 5
        assert report["stages"]["refinement"]["microseconds"] > 0


@pytest.mark.slow
def test_geodesics_are_rates():
    first, second = fourier_curves(0, 2, 20), fourier_curves(1, 2, 20)
    assert geodesics(first, second, RIGID)["straightened_per_second"] > 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from what Linux says of a process")
def test_runs_in_processes_of_their_own_measure_time_and_memory(tmp_path):
    engine = Engine(tmp_path)
    found = engine.run(Matrix("rigid", 5, n=20))
    assert found["pairs"] == 25
    assert found["seconds"] > 0
    assert found["peak_bytes"] >= found["bytes_before"] > 0
    assert any((tmp_path / "Matrix" / "rigid" / "distance_matrix").iterdir())
    assert engine.run(Lengths(2))["added_bytes"] > 0
    with pytest.raises(RuntimeError, match="KeyError"):
        engine.run(Matrix("no such preset", 5))


def test_calls_with_other_numbers_of_samples_are_told_one_by_one():
    found = NewSamples("resample", (30, 20, 25), 2).measured()
    assert found["first_seconds"] > 0
    assert list(found["seconds"]) == ["20", "25"]


def test_the_package_of_another_commit_is_the_one_that_runs(tmp_path, monkeypatch):
    if commit() is None:
        pytest.skip("not in a repository")
    (tmp_path / "where.py").write_text("import json, curvematch_jax; print(json.dumps(curvematch_jax.__file__))")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with checkout("HEAD") as package:
        assert Path(output_of("where", [], package)).is_relative_to(package.resolve())
    assert not package.exists()
    with pytest.raises(RuntimeError, match="no package of no-such-commit"), checkout("no-such-commit"):
        pass


def test_times_and_rates_are_compared_where_both_have_them():
    ours = {
        "fast": {"pairs_per_second": 6.0, "cold_seconds": 2.0, "within_limits": True},
        "seconds": {"73": 0.5},
        "a": 1,
    }
    theirs = {"fast": {"pairs_per_second": 3.0, "cold_seconds": 8.0}, "seconds": {"73": 5.0}, "b": 1}
    assert times_faster(ours, theirs) == {"fast": {"pairs_per_second": 2, "cold_seconds": 4}, "seconds": {"73": 10}}


def test_picture_is_drawn(tmp_path):
    image = pytest.importorskip("matplotlib.image")
    row = lambda pairs, n=100: {"pairs": pairs, "n": n, "seconds": pairs / 1e4, "pairs_per_second": 1e4}  # noqa: E731
    rows = [row(pairs) | {"peak_bytes": 2**28 + 8 * pairs} for pairs in (1000, 10**4, 10**6)]
    picture({"rigid": rows, "fast": rows[:2]}, [row(1024, n) for n in (50, 100, 200)], tmp_path / "scaling.png")
    assert image.imread(tmp_path / "scaling.png").std() > 0.05
