import threading
import time

import pytest

from curvematch_jax import _files
from curvematch_jax._files import because, locked, short


def test_what_a_damaged_file_makes_an_error_say_is_one_printable_line():
    text = short(TypeError("no keyword 'chun\ufeffk'\n\x1b[31m" + "x" * 1000))
    assert text.startswith("TypeError: no keyword 'chun?k' ?[31mxxx")
    assert text.isprintable()
    assert len(text) < 200


def test_only_what_the_system_says_of_a_file_is_passed_on():
    assert because(PermissionError(13, "Permission denied")) == " (Permission denied)"
    assert because(ValueError("a\nb\x1b")) == " (a b?)"
    assert because(FileNotFoundError("No group found in store PosixPath('a')")) == because(KeyError("a")) == ""


def test_a_lock_leaves_no_file(tmp_path):
    with locked(tmp_path / "D"):
        assert (tmp_path / ".D.lock").exists()
        with pytest.raises(ValueError, match="another process is using it"), locked(tmp_path / "D"):
            pass
    assert list(tmp_path.iterdir()) == []


def test_a_lock_that_was_removed_while_another_one_waited_keeps_nobody_out(tmp_path, monkeypatch):
    """Removed between the opening and the locking, it is opened again."""
    fcntl = pytest.importorskip("fcntl")
    removed = []

    def flock(*arguments):
        if not removed:
            removed.append(True)
            (tmp_path / ".D.lock").unlink()
        real(*arguments)

    real = fcntl.flock
    monkeypatch.setattr(_files.fcntl, "flock", flock)
    with locked(tmp_path / "D"), pytest.raises(ValueError, match="another process is using it"), locked(tmp_path / "D"):
        pass
    assert removed


def test_many_at_once_are_in_one_by_one(tmp_path):
    inside, most, entered = [], [], []

    def work():
        for _ in range(200):
            try:
                with locked(tmp_path / "D"):
                    inside.append(1)
                    most.append(len(inside))
                    time.sleep(0)
                    inside.pop()
            except ValueError:
                continue
            entered.append(1)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(entered) > 1
    assert max(most) == 1
    assert list(tmp_path.iterdir()) == []
