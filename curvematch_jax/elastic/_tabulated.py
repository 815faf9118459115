"""Many curves, tabulated once for an aligner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from . import _chunks as chunks
from ._align import order_key
from ._aligner import Aligner

_MOST = 64  # curves tabulated at once, however many pairs are aligned so: a few curves cost little


@dataclass(frozen=True, eq=False)
class Tables:
    """C curves as one aligner sees them; indexed along the curves, like an array.

    Attributes:
        curves: what `aligner.tabulate` made of them, arrays of numpy.
        keys: `(C,)`, numbers that put two curves in order.
        dimension: d of the curves.
        aligner: whose they are.
    """

    curves: Any
    keys: np.ndarray
    dimension: int
    aligner: Aligner

    @classmethod
    def joined(cls, several: Sequence[Tables]) -> Tables:
        """Tables of one aligner as those of all curves."""
        curves = jax.tree.map(lambda *column: np.concatenate(column), *(tables.curves for tables in several))
        keys = np.concatenate([tables.keys for tables in several])
        return cls(curves, keys, several[0].dimension, several[0].aligner)

    @property
    def dtype(self) -> Any:
        return self.keys.dtype

    def __len__(self) -> int:
        return len(self.keys)

    def __getitem__(self, index: slice | np.ndarray) -> Tables:
        curves = jax.tree.map(lambda table: table[index], self.curves)
        return Tables(curves, self.keys[index], self.dimension, self.aligner)


def tables_of(curves: np.ndarray, aligner: Aligner) -> Tables:
    """The tables of curves `(C, d, n)` without repeated samples."""
    size = min(aligner.chunk, _MOST)
    some = jax.ShapeDtypeStruct((size, *curves.shape[1:]), curves.dtype)
    shapes = jax.eval_shape(aligner.tabulate, some)
    tables = jax.tree.map(lambda shape: np.empty((len(curves), *shape.shape[1:]), shape.dtype), shapes)

    def compute(part: slice) -> Any:
        return aligner.tabulate(chunks.padded(curves[part], size))

    for part, found in chunks.run(compute, (slice(s, s + size) for s in range(0, len(curves), size))):
        for table, values in zip(jax.tree.leaves(tables), jax.tree.leaves(found), strict=True):
            table[part] = values[: len(curves[part])]
    return Tables(tables, np.asarray(order_key(curves)), curves.shape[1], aligner)
