"""Linear algebra in many small steps, on one thread.

Threads that BLAS wakes for a few rows wait for each other longer than they work, and keep a core busy afterwards.
"""

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

Given = ParamSpec("Given")
Found = TypeVar("Found")


@functools.cache
def _libraries() -> ThreadpoolController:
    """Those that are loaded at the first call: numpy's and scipy's."""
    return ThreadpoolController()


def on_one_thread(function: Callable[Given, Found]) -> Callable[Given, Found]:
    """The same function, with one thread of BLAS while it runs."""

    @functools.wraps(function)
    def limited(*args: Given.args, **kwargs: Given.kwargs) -> Found:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
