"""Elastic shapes of closed curves, and the retrieval of 3D models by them."""

from .elastic import (
    Aligner,
    Alignment,
    align,
    distance_matrix,
    length,
    pair_distances,
    resample,
    to_curve,
    to_srvf,
)

__all__ = ["Aligner", "Alignment", "align", "distance_matrix", "length", "pair_distances", "resample", "to_curve", "to_srvf"]
