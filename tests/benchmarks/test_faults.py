"""A few kills of each command; `benchmarks/faults.py` does a hundred."""

from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(autouse=True)
def folder_of_scripts(monkeypatch):
    """As for a script that runs there."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))


def test_killed_matrices_end_with_the_same_bytes(tmp_path):
    from faults import kill_again_and_again, matrix_scenario

    found = kill_again_and_again(matrix_scenario(tmp_path, objects=70), tmp_path / "runs", kills=3, seed=1)
    assert found.kills == 3
    assert found.ends >= 1
    assert found.sound


def test_killed_extractions_end_with_the_same_bytes(tmp_path):
    from faults import kill_again_and_again, parts_scenario

    found = kill_again_and_again(parts_scenario(tmp_path, poses=1), tmp_path / "runs", kills=2, seed=1)
    assert found.kills == 2
    assert found.sound


def test_what_is_not_sound():
    from faults import Campaign

    assert not Campaign("a", 1.0).sound
    assert Campaign("a", 1.0, ends=2, same_bytes=2).sound
    assert not Campaign("a", 1.0, ends=2, same_bytes=1).sound
    assert not Campaign("a", 1.0, ends=2, same_bytes=2, written_again=1).sound
