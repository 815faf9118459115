"""What files are called."""

import pytest

from curvematch_jax.extraction._sources import distinct_names


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["m/cat.off", "m/dog.off"], ["cat.off", "dog.off"]),
        (["m/cat.off", "n/cat.off", "n/dog.off"], ["m/cat.off", "n/cat.off", "dog.off"]),
        (["m/x/cat.off", "n/x/cat.off", "n/y/cat.off"], ["m/x/cat.off", "n/x/cat.off", "y/cat.off"]),
        (["m/cat.off", "m/../m/cat.off", "m/cat.off"], ["cat.off", "cat.off#2", "cat.off#3"]),
        (["m/cat.off", "m/cat.obj"], ["cat.off", "cat.obj"]),
        ([], []),
    ],
)
def test_names_tell_files_apart(paths, names):
    assert distinct_names(paths) == names
