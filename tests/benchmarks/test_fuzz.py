from pathlib import Path

import numpy as np
import pytest
from retrieval.conftest import synthetic_parts

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
COUNT = 500

pytestmark = pytest.mark.skipif("sys.platform != 'linux'", reason="the harness measures what Linux says of a process")


@pytest.fixture(autouse=True)
def folder_of_scripts(monkeypatch):
    """As for a script that runs there."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    pytest.importorskip("gpytoolbox")
    pytest.importorskip("pymeshfix")


def test_no_hostile_mesh_file_does_harm():
    import fuzz
    from _seeds import WRITERS

    verdicts = list(fuzz.run(fuzz.cases(COUNT, 7, tuple(WRITERS)), 2))
    assert len(verdicts) == COUNT
    assert [(case, verdict.violations) for case, verdict in verdicts if verdict.violations] == []
    figures = fuzz.summary(verdicts)
    counts = [sum(kind.get(outcome, 0) for kind in figures["files"].values()) for outcome in ("loaded", "refused")]
    assert min(counts) > COUNT / 10  # neither is all of them harmless nor all of them garbage


def test_the_watch_sees_what_a_reader_must_not_do(tmp_path):
    from _judge import _Watch

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
    from _judge import _faults_in

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
    from _judge import _faults_of

    assert [name for name, _ in _faults_of(error, Path("a.off"))] == ([kind] if kind else [])


def test_a_case_follows_from_its_seed():
    from fuzz import cases

    first, second = cases(33, 3), cases(33, 3)
    assert [case.made() for case in first] == [case.made() for case in second]
    assert first[0].made() != cases(1, 4)[0].made()
