"""What holds in every test: strict JAX promotion, and annotated shapes and types executed.

`CURVEMATCH_TEST_PLAIN=1` turns both off, to tell a failure of the code from one of the checks.
"""

import os

import jax
import pytest
from jaxtyping import install_import_hook

if os.environ.get("CURVEMATCH_TEST_PLAIN", "0") in ("", "0"):
    jax.config.update("jax_numpy_dtype_promotion", "strict")
    jax.config.update("jax_numpy_rank_promotion", "raise")
    # Before the first import of the package. Not a context: the modules that load lazily are checked as well.
    install_import_hook("curvematch_jax", "typechecker.checked")


@pytest.fixture(name="compiled", scope="module", autouse=True)
def fixture_compiled():
    """Compiled code of one module is not kept for the next: some gigabytes by the end."""
    yield
    jax.clear_caches()
