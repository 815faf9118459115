"""The engine: closed curves in, elastic distances, alignments and geodesics out."""

from ._align import Alignment, align
from ._aligner import Aligner, Stage
from ._batch import distance_matrix, pair_distances
from ._curve import centre, length, resample
from ._distance import alignment_distance, elastic_distance
from ._geodesic import Geodesic, aligned_srvf, geodesic, log_map
from ._preshape import exp_map, parallel_transport, project_closed
from ._srvf import to_curve, to_srvf

__all__ = [
    "Aligner",
    "Alignment",
    "Geodesic",
    "Stage",
    "align",
    "aligned_srvf",
    "alignment_distance",
    "centre",
    "distance_matrix",
    "elastic_distance",
    "exp_map",
    "geodesic",
    "length",
    "log_map",
    "pair_distances",
    "parallel_transport",
    "project_closed",
    "resample",
    "to_curve",
    "to_srvf",
]
