import json

import numpy as np
import pytest
from surface.shapes import limbed, sphere

from benchmarks import baselines
from benchmarks._models import Model, models_in
from benchmarks.baselines import BASELINES, Baseline
from curvematch_jax.extraction._workers import Outcome
from curvematch_jax.surface import Mesh


def _pair(kind: str, pose: int) -> Mesh:
    if kind == "missing":
        raise ValueError("no such mesh")
    return limbed(subdivisions=3) if kind == "star" else Mesh(sphere(3).vertices * (1 + pose), sphere(3).faces)


def _models(*kinds: str) -> list[Model]:
    return [Model(f"{kind}{pose}", kind, _pair, (kind, pose)) for kind in kinds for pose in range(2)]


def _first_coordinate(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[0, :1]


def _refuse(mesh: Mesh) -> np.ndarray:
    raise ValueError("not this one")


def _differences(queries, objects) -> np.ndarray:
    return np.abs(np.array(queries) - np.array(objects).T)


def test_names_are_those_of_the_publications():
    assert [baseline.name for baseline in BASELINES] == ["D2", "geodesic D2", "RSH", "DSR", "ERG", "ShapeDNA"]


def test_models_that_fail_cost_themselves_only(monkeypatch, capsys):
    monkeypatch.setattr(
        baselines, "BASELINES", (Baseline("x", _first_coordinate, _differences), Baseline("y", _refuse, _differences))
    )
    monkeypatch.setattr("benchmarks._models.in_processes", lambda function, tasks, jobs: _run_here(function, tasks))
    found = baselines.measured("pair", _models("ball", "star", "missing"), jobs=1)
    first, second = found["baselines"]
    assert first["measures"]["queries"] == 4
    assert [failure["name"] for failure in first["failed"]] == ["missing0", "missing1"]
    assert second["measures"] is None
    assert {failure["reason"] for failure in second["failed"]} == {"not this one", "no such mesh"}
    json.dumps(found, allow_nan=False)
    said = capsys.readouterr()
    assert "pair, 6 models" in said.err.splitlines()
    assert "missing0: no such mesh" in said.err


def _run_here(function, tasks):
    for index, task in enumerate(tasks):
        try:
            yield Outcome(index, function(task))
        except ValueError as error:
            yield Outcome(index, failure=str(error))


def test_folders_become_models(tmp_path):
    (tmp_path / "labels.csv").write_text("file,class\na.off,cat\n")
    (tmp_path / "a.off").write_text("OFF\n")
    (model,) = models_in(tmp_path)
    assert (model.name, model.label, model.source) == ("a.off", "cat", (tmp_path / "a.off", "a.off"))


@pytest.mark.slow
def test_every_baseline_in_worker_processes():
    found = baselines.describe_all(_models("ball"), jobs=2)
    for baseline, descriptions in zip(BASELINES, zip(*found, strict=True), strict=True):
        first, second = (described.description for described in descriptions)
        assert baseline.compare([first], [second])[0, 0] < 1e-2
