"""Linear algebra in many small steps, on one thread.

Threads that BLAS wakes for a few rows wait for each other longer than they work, and keep a core busy afterwards.
"""

import functools
import threading
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

Given = ParamSpec("Given")
Found = TypeVar("Found")


@functools.cache
def _libraries() -> ThreadpoolController:
    """Those that are loaded at the first call: numpy's and scipy's."""
    return ThreadpoolController()


class _OneThread:
    """A limit that holds while anybody is inside: the first who enters sets it, the last who leaves takes it back."""

    def __init__(self) -> None:
        self._lock, self._inside = threading.Lock(), 0
        self._limit: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                self._limit = _libraries().limit(limits=1, user_api="blas")
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                self._limit.restore_original_limits()


_one_thread = _OneThread()


def on_one_thread(function: Callable[Given, Found]) -> Callable[Given, Found]:
    """The same function, with one thread of BLAS while it runs in any thread of the process."""

    @functools.wraps(function)
    def limited(*args: Given.args, **kwargs: Given.kwargs) -> Found:
        with _one_thread:
            return function(*args, **kwargs)

    return limited
