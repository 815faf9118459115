"""Linear algebra on one thread."""

import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from curvematch_jax.surface._blas import on_one_thread


def threads() -> list[int]:
    np.linalg.eigh(np.eye(3))
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_there_is_one_thread_and_afterwards_as_many_as_before():
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        assert set(on_one_thread(threads)()) == {1}
        assert threads() == before


def test_the_threads_come_back_after_an_error():
    @on_one_thread
    def failing() -> None:
        raise ValueError("as it was")

    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with pytest.raises(ValueError, match="as it was"):
            failing()
        assert threads() == before


def test_calls_that_overlap_leave_as_many_threads_as_there_were():
    entered, left = threading.Event(), threading.Event()

    @on_one_thread
    def first() -> None:
        entered.set()
        left.wait(10)

    @on_one_thread
    def second() -> set[int]:
        left.set()
        one.join(10)  # the first, who has set the limit, is gone
        return set(threads())

    before = threads()
    one = threading.Thread(target=first)
    one.start()
    entered.wait(10)
    assert second() == {1}
    assert threads() == before
