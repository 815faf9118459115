"""Chunks of one shape, computed side by side on every device, in bounded memory."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from itertools import cycle
from typing import Any, TypeVar

import jax
import numpy as np

Item = TypeVar("Item")


def run(compute: Callable[[Item], Any], items: Iterable[Item]) -> Iterator[tuple[Item, Any]]:
    """`compute` of every item, with numpy leaves, as they finish; a few items under way on each device at any time.

    XLA runs most of one small computation on one core, so a CPU device gets a thread for each core of its own.
    """
    items = iter(items)
    devices = cycle(jax.local_devices())
    workers = _workers()
    wide = (
        jax.dtypes.canonicalize_dtype(np.float64) == np.float64
    )  # as the caller's context has it; contexts do not reach other threads

    def task(item: Item, device: Any) -> tuple[Item, Any]:
        with jax.default_device(device), jax.enable_x64(wide):
            return item, jax.tree.map(np.asarray, compute(item))

    with ThreadPoolExecutor(workers) as pool:
        pending = set()
        try:
            for item in items:
                pending.add(pool.submit(task, item, next(devices)))
                if len(pending) > 2 * workers:
                    done, pending = wait(pending, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in done)
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        finally:
            for future in pending:
                future.cancel()


def padded(array: np.ndarray, size: int) -> np.ndarray:
    """The array with its last entry repeated up to `size` entries, so that every chunk has one shape."""
    missing = size - len(array)
    return array if missing == 0 else np.concatenate([array, np.repeat(array[-1:], missing, axis=0)])


def _workers() -> int:
    devices = jax.local_devices()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(len(devices), cores) if devices[0].platform == "cpu" else 2 * len(devices)
