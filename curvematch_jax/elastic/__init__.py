"""The engine: closed curves in, elastic distances, alignments and geodesics out."""

from ._align import Alignment, align
from ._aligner import Aligner
from ._batch import distance_matrix, pair_distances
from ._curve import centre, length, resample
from ._srvf import to_curve, to_srvf

__all__ = [
    "Aligner",
    "Alignment",
    "align",
    "centre",
    "distance_matrix",
    "length",
    "pair_distances",
    "resample",
    "to_curve",
    "to_srvf",
]
