"""A few kills of each command; `python -m tests.faults` does a hundred."""

import pytest
from faults._scenarios import Campaign, kill_again_and_again, matrix_scenario, parts_scenario


@pytest.mark.slow
def test_killed_matrices_end_with_the_same_bytes(tmp_path):
    found = kill_again_and_again(matrix_scenario(tmp_path, objects=70), tmp_path / "runs", kills=3, seed=1)
    assert found.kills == 3
    assert found.ends >= 1
    assert found.sound


@pytest.mark.slow
def test_killed_extractions_end_with_the_same_bytes(tmp_path):
    found = kill_again_and_again(parts_scenario(tmp_path, poses=1), tmp_path / "runs", kills=2, seed=1)
    assert found.kills == 2
    assert found.sound


def test_what_is_not_sound():
    assert not Campaign("a", 1.0).sound
    assert Campaign("a", 1.0, ends=2, same_bytes=2).sound
    assert not Campaign("a", 1.0, ends=2, same_bytes=1).sound
    assert not Campaign("a", 1.0, ends=2, same_bytes=2, written_again=1).sound
