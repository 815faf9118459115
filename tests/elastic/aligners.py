"""Aligners for the tests: small ones, and one as a user would write it."""

from dataclasses import dataclass
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from curvematch_jax.elastic import Aligner, Alignment, Elastic, Rigid, Round, resample, to_srvf

# Each is compiled once for every dimension and dtype; with chunks of 8, for batches of any size.
LEAN = Elastic(rounds=(Round(16, 16, 4), Round(2, 32, 4)), knots=32, steps=2, chunk=8)
COARSE = Elastic(rounds=(Round(2, 16, 4),), knots=32, steps=2, chunk=8)  # in two thirds of that time
FAST = Elastic(chunk=8)  # aligns as Aligner.fast() does
RIGID = Rigid(chunk=8)


@dataclass(frozen=True)
class StartOnly(Aligner):
    """The best start point alone: curves are neither turned nor warped."""

    warps: ClassVar[bool] = False

    samples: int = 64
    chunk: int = 8

    def tabulate(self, curve):
        return to_srvf(resample(curve, self.samples))

    def align(self, first, second):
        n, d = self.samples, first.shape[1]
        shifted = second[:, :, np.add.outer(np.arange(n), np.arange(n)) % n]
        cosines = jnp.einsum("bdn,bdsn->sb", first, shifted) / n
        time = jnp.broadcast_to(jnp.arange(n + 1, dtype=first.dtype) / n, (len(first), n + 1))
        shift = jnp.argmax(cosines, axis=0).astype(first.dtype)[:, None] / n
        distance = jnp.arccos(jnp.minimum(jnp.max(cosines, axis=0), 1))
        rotation = jnp.broadcast_to(jnp.eye(d, dtype=first.dtype), (len(first), d, d))
        return Alignment(rotation, time, time + shift, distance)
