"""How long work tells its caller how far it has come."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

Report: TypeAlias = Callable[[int, int], None]
Progress: TypeAlias = bool | Report


def reporter(progress: Progress, label: str, unit: str) -> Report:
    """What to call with `(done, total)` as the work goes on.

    Args:
        progress: `False` reports nothing, `True` shows a bar with its rate on stderr, and a callable is
            called with `(done, total)` itself.
        label: what is being done, shown before the bar.
        unit: what is being counted, shown behind the rate.

    Returns:
        a function of `(done, total)`. The bar appears with its first call and closes when `done`
        reaches `total`.
    """
    if callable(progress):
        return progress
    return _bar(label, unit) if progress else _silent


def _silent(done: int, total: int) -> None:
    pass


def _bar(label: str, unit: str) -> Report:
    from tqdm import tqdm

    bar = None

    def report(done: int, total: int) -> None:
        nonlocal bar
        if bar is None:
            bar = tqdm(desc=label, initial=done, unit=f" {unit}", unit_scale=True, dynamic_ncols=True)
        bar.total = total
        bar.update(done - bar.n)
        if done >= total:
            bar.close()
            bar = None

    return report
