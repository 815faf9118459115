"""The engine's tests share what they compile: an alignment takes seconds, and its shapes are the same everywhere."""

import jax
import pytest


@pytest.fixture(name="compiled", scope="package", autouse=True)
def fixture_compiled():
    yield
    jax.clear_caches()
