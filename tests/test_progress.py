"""One helper for all progress: silence, a callback, or a bar on stderr."""

from curvematch_jax._progress import reporter


def test_callback_is_used_as_it_is():
    calls: list[tuple[int, int]] = []
    reporter(lambda done, total: calls.append((done, total)), "x", "y")(3, 7)
    assert calls == [(3, 7)]


def test_silence(capsys):
    reporter(False, "matrix", "pairs")(7, 7)
    assert capsys.readouterr() == ("", "")


def test_bar_shows_rate_and_ends_with_the_work(capsys):
    report = reporter(True, "matrix", "pairs")
    for done in (0, 3, 7):
        report(done, 7)
    out, err = capsys.readouterr()
    assert out == ""
    assert "matrix: 100%" in err
    assert "7.00/7.00" in err
    assert "pairs/s" in err
    assert err.endswith("\n")


def test_a_reporter_can_be_used_again(capsys):
    report = reporter(True, "matrix", "pairs")
    report(1, 1)
    report(2, 2)
    assert capsys.readouterr().err.count("100%") == 2


def test_nothing_to_do(capsys):
    reporter(True, "matrix", "pairs")(0, 0)
    assert capsys.readouterr().err.endswith("\n")
