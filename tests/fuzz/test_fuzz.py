"""Some hundred hostile files; `python -m tests.fuzz --count 20000` reads as many as one likes."""

from pathlib import Path

import numpy as np
import pytest
from fuzz._campaign import cases, run, summary
from fuzz._judge import _faults_in, _faults_of, _Watch
from fuzz._seeds import WRITERS
from retrieval.conftest import synthetic_parts

pytestmark = pytest.mark.skipif("sys.platform != 'linux'", reason="the harness measures what Linux says of a process")


@pytest.mark.parametrize(("count", "jobs"), [(30, 1), pytest.param(500, 2, marks=pytest.mark.slow)])
def test_no_hostile_mesh_file_does_harm(count, jobs):
    pytest.importorskip("pymeshfix")
    verdicts = list(run(cases(count, 7, tuple(WRITERS)), jobs))
    assert len(verdicts) == count
    assert [(case, verdict.violations) for case, verdict in verdicts if verdict.violations] == []
    figures = summary(verdicts)
    counts = [sum(kind.get(outcome, 0) for kind in figures["files"].values()) for outcome in ("loaded", "refused")]
    assert min(counts) > count / 10  # neither is all of them harmless nor all of them garbage


def test_the_watch_sees_what_a_reader_must_not_do(tmp_path):
    watch = _Watch()
    watch.folder = str(tmp_path)
    try:
        (tmp_path / "given.off").write_text("OFF")
        (tmp_path / "given.off").read_text()
        with pytest.raises(OSError, match="No such file"):
            Path("/etc/no-such-file").read_text()
    finally:
        watch.folder = None
    kinds = [(kind, detail.split()[0]) for kind, detail in watch.found]
    assert kinds == [("outside", "open"), ("outside", "open")]  # written to, and elsewhere


def test_unsound_results_are_found():
    sound = synthetic_parts("a")
    assert _faults_in(sound) == []
    lengths = sound.lengths.copy()
    lengths[0, 0] = np.nan
    assert ("unsound", "lengths is not finite") in _faults_in(synthetic_parts("a", lengths=lengths))
    assert _faults_in(synthetic_parts("a", areas=np.ones(1, np.float32)))[0][0] == "unsound"


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (ValueError("a.off: bad"), None),
        (ValueError("bad"), "message without the file"),
        (ValueError("a.off: bad\nworse"), "message of many lines"),
        (KeyError("a.off"), "exception"),
        (MemoryError(), "memory"),
    ],
)
def test_refusals_that_are_not_clear_are_found(error, kind):
    assert [name for name, _ in _faults_of(error, Path("a.off"))] == ([kind] if kind else [])


def test_a_case_follows_from_its_seed():
    first, second = cases(33, 3), cases(33, 3)
    assert [case.made() for case in first] == [case.made() for case in second]
    assert first[0].made() != cases(1, 4)[0].made()
