import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import curvematch_jax as cm

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
RIGID = cm.Aligner(grid=12, seeds=2, slope=0, stages=(), table=2, chunk=4)
ELASTIC = cm.Aligner(grid=12, seeds=2, stages=(cm.elastic.Stage(2, 1, 8),), table=2, fineness=2, chunk=4)
ROOFS = {"operations_per_second": 1e9, "bytes_per_second": 1e9, "reads_per_second": 1e9}


@pytest.fixture(autouse=True)
def folder_of_scripts(monkeypatch):
    """As for a script that runs there."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))


def test_curves_are_sampled_by_arc_length():
    from _measure import fourier_curves

    curves = fourier_curves(0, 3, 200)
    steps = np.linalg.norm(np.diff(curves, axis=-1, append=curves[..., :1]), axis=1)
    assert curves.dtype == np.float32
    short = 1 - steps / steps.max(axis=1, keepdims=True)  # chords are, where a curve turns sharply
    assert np.quantile(short, 0.9) < 0.01


def test_operations_and_reads_are_counted_in_loops_and_branches():
    from _stages import operations_and_reads

    def counted(function, *operands):
        return tuple(operations_and_reads(jax.make_jaxpr(function)(*operands).jaxpr))

    x, index = jnp.ones(10), jnp.zeros(4, jnp.int32)
    assert counted(lambda a: a * 2.0 + a, x) == (20, 0)
    assert counted(lambda a: jax.lax.scan(lambda c, _: (c * 2.0, None), a, None, length=7)[0], x) == (70, 0)
    assert counted(lambda a: jax.lax.cond(a[0] > 0, lambda b: b * b + b, lambda b: b, a), x) == (20, 0)
    assert counted(jax.jit(lambda a: jnp.sum(a)), x) == (10, 0)
    assert counted(jnp.matmul, jnp.ones((2, 3)), jnp.ones((3, 5))) == (60, 0)
    assert counted(lambda a, i: a.at[i].get(mode="promise_in_bounds"), x, index) == (0, 4)
    assert counted(lambda i: i * 3 + 1, index) == (0, 0)


@pytest.mark.parametrize("aligner", [RIGID, pytest.param(ELASTIC, marks=pytest.mark.slow)])
def test_stages_add_up_to_the_whole(aligner):
    from _measure import fourier_curves
    from _stages import stages

    report = stages(aligner, fourier_curves(0, 4, 20), fourier_curves(1, 4, 20), ROOFS)
    whole = report["stages"].pop("all")
    assert {report["align_bound_by"], report["distance_matrix_bound_by"]} <= set(report["stages"])
    for key in ("share", "operations", "reads"):
        values = [stage[key] for stage in report["stages"].values()]
        assert sum(values) == pytest.approx(whole[key])
    assert all(stage["operations"] >= 0 and stage["reads"] >= 0 for stage in report["stages"].values())
    assert ("dynamic_programming" in report) == (aligner.slope > 0)


@pytest.mark.slow
def test_speeds_and_geodesics_are_rates():
    from _measure import fourier_curves
    from _stages import measured_roofs
    from engine import geodesics, speed

    first, second = fourier_curves(0, 9, 20), fourier_curves(1, 9, 20)
    found = [*measured_roofs(32, 64).values(), *speed(first, second, RIGID).values()]
    assert all(np.isfinite(found))
    assert min(found) > 0
    assert geodesics(first[:2], second[:2], RIGID)["straightened_per_second"] > 0


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from what Linux says of a process")
def test_run_elsewhere_measures_time_and_memory(tmp_path):
    from _runs import Run

    found = Run("rigid", 5, n=20).elsewhere(tmp_path)
    assert found["pairs"] == 25
    assert found["seconds"] > 0
    assert found["peak_bytes"] >= found["bytes_before"] > 0
    assert any(tmp_path.iterdir())
    with pytest.raises(RuntimeError, match="KeyError"):
        Run("no such preset", 5).elsewhere(tmp_path)


def test_picture_is_drawn(tmp_path):
    image = pytest.importorskip("matplotlib.image")
    from _runs import picture

    row = lambda pairs, n=100: {"pairs": pairs, "n": n, "seconds": pairs / 1e4, "pairs_per_second": 1e4}  # noqa: E731
    rows = [row(pairs) | {"peak_bytes": 2**28 + 8 * pairs} for pairs in (1000, 10**4, 10**6)]
    picture({"rigid": rows, "fast": rows[:2]}, [row(1024, n) for n in (50, 100, 200)], tmp_path / "scaling.png")
    assert image.imread(tmp_path / "scaling.png").std() > 0.05


def test_results_are_rounded_and_the_options_explained():
    from engine import Plan, rounded

    assert rounded({"a": [1.23456789e-7, 3], "b": None}) == {"a": [1.2346e-7, 3], "b": None}
    assert dict(Plan.full().sides)["fast"][-1] == 1000
    command = [sys.executable, str(BENCHMARKS / "engine.py"), "--help"]
    assert "--quick" in subprocess.run(command, capture_output=True, text=True, check=True).stdout
