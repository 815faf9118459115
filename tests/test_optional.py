import pytest

from curvematch_jax._optional import require


def test_what_is_installed_is_returned():
    assert require("json.decoder", "prep", "reading").JSONDecoder


def test_what_is_missing_names_the_install_line():
    with pytest.raises(
        ImportError, match=r"repairing a mesh needs no_such_module: pip install 'curvematch_jax\[prep\]'"
    ):
        require("no_such_module.part", "prep", "repairing a mesh")
