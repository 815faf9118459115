"""What the engine's tests share."""

import pytest
from elastic.shapes import x64


@pytest.fixture(name="float32")
def fixture_float32():
    """For what is said of float32 alone, in a suite that may run with float64 enabled."""
    with x64(False):
        yield
