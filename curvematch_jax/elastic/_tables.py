"""Tables of many curves: what an aligner needs to know of each, computed once."""

from __future__ import annotations

import functools as ft
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from . import _chunks as chunks
from ._align import represent_for
from ._aligner import Aligner
from ._curve import Representative, represent


@dataclass(frozen=True, eq=False)
class Tables:
    """C curves as one aligner sees them; indexed along the curves, like an array.

    Attributes:
        curves: arrays of numpy. Without warps `tangents` alone, `(C, d, grid)`; the others are empty.
        aligner: whose they are.
    """

    curves: Representative
    aligner: Aligner

    @classmethod
    def joined(cls, several: Sequence[Tables]) -> Tables:
        """Tables of one aligner as those of all curves."""
        pieces = [tables.curves for tables in several]
        return cls(jax.tree.map(lambda *column: np.concatenate(column), *pieces), several[0].aligner)

    @property
    def shape(self) -> tuple[int, ...]:
        return self.curves.tangents.shape

    @property
    def dtype(self) -> Any:
        return self.curves.tangents.dtype

    def __len__(self) -> int:
        return len(self.curves.tangents)

    def __getitem__(self, index: slice | np.ndarray) -> Tables:
        return Tables(jax.tree.map(lambda table: table[index], self.curves), self.aligner)


def tables_of(curves: np.ndarray, aligner: Aligner) -> Tables:
    """The tables of curves `(C, d, n)` without repeated samples."""
    size = aligner.chunk
    shapes = jax.eval_shape(ft.partial(_tabulate_chunk, aligner), chunks.padded(curves[:size], size))
    tables = jax.tree.map(lambda shape: np.empty((len(curves), *shape.shape[1:]), shape.dtype), shapes)

    def compute(part: slice) -> Representative:
        return _tabulate_chunk(aligner, chunks.padded(curves[part], size))

    for part, found in chunks.run(compute, (slice(s, s + size) for s in range(0, len(curves), size))):
        for table, values in zip(tables, found, strict=True):
            table[part] = values[: len(curves[part])]
    return Tables(tables, aligner)


@ft.partial(jax.jit, static_argnums=0)
def _tabulate_chunk(aligner: Aligner, curves: Float[Array, "b d n"]) -> Representative:
    if aligner.slope:
        return represent_for(aligner, curves)
    nothing = curves[:, 0, :0]
    return Representative(represent(curves, aligner.grid, aligner.fineness).tangents, nothing, nothing)
