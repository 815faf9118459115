"""What holds in every test: strict JAX promotion, annotated shapes and types executed, compiled code kept in bounds.

`CURVEMATCH_TEST_PLAIN=1` turns the checks off, to tell a failure of the code from one of the checks.
"""

import os

import jax
import psutil
import pytest
from jaxtyping import install_import_hook

if os.environ.get("CURVEMATCH_TEST_PLAIN", "0") in ("", "0"):
    jax.config.update("jax_numpy_dtype_promotion", "strict")
    jax.config.update("jax_numpy_rank_promotion", "raise")
    # Before the first import of the package. Not a context: the modules that load lazily are checked as well.
    install_import_hook("curvematch_jax", "typechecker.checked")

# Bytes that a worker may hold before it forgets the compiled code of the modules before.
LARGEST = 3 * 2**29


def pytest_configure():
    """Keep compiled code for the other workers, for the processes that tests start, and for the next run.

    Each worker gets one thread of BLAS: more of them compete for the cores, and sparse solvers take many times as long.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from curvematch_jax.cli._jax import cache_folder

    settings = {
        "jax_compilation_cache_dir": str(cache_folder() / "tests"),
        # JAX locks a folder of bounded size while it reads or writes.
        "jax_compilation_cache_max_size": 2**29,
        "jax_persistent_cache_min_compile_time_secs": 0.1,
    }
    for name, value in settings.items():
        if name.upper() not in os.environ:
            os.environ[name.upper()] = str(value)
            jax.config.update(name, value)


@pytest.fixture(name="compiled", scope="module", autouse=True)
def fixture_compiled():
    yield
    if psutil.Process().memory_info().rss > LARGEST:
        jax.clear_caches()
