"""The retrieval methods that the package is compared with, each from its own publication.

python -m benchmarks.baselines [DIR...] [--out FILE.json]
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from curvematch_jax.surface import Mesh

from . import d2, dsr, erg, geodesic_d2, rsh, shapedna


@dataclass(frozen=True)
class Baseline:
    """A method: one mesh to a description, and descriptions to dissimilarities.

    Attributes:
        name: what tables call it.
        describe: a closed connected mesh, as `clean` makes it, to something that can be pickled. The same mesh always
            gets the same description.
        compare: Q descriptions and M descriptions to dissimilarities `(Q, M)`; smaller is more similar.
    """

    name: str
    describe: Callable[[Mesh], Any]
    compare: Callable[[Sequence[Any], Sequence[Any]], np.ndarray]


BASELINES: tuple[Baseline, ...] = (
    Baseline("D2", d2.describe, d2.compare),
    Baseline("geodesic D2", geodesic_d2.describe, geodesic_d2.compare),
    Baseline("RSH", rsh.describe, rsh.compare),
    Baseline("DSR", dsr.describe, dsr.compare),
    Baseline("ERG", erg.describe, erg.compare),
    Baseline("ShapeDNA", shapedna.describe, shapedna.compare),
)
