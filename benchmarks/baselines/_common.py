"""What several baselines share."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist


def l1(queries: Sequence[np.ndarray], objects: Sequence[np.ndarray]) -> np.ndarray:
    """Sums of absolute differences `(Q, M)` of descriptions that are vectors."""
    return cdist(np.stack(queries), np.stack(objects), "cityblock")
