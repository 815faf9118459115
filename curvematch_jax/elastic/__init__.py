"""The engine: closed curves in, elastic distances, alignments and geodesics out."""

from ._align import Alignment, align
from ._aligner import Aligner, Stage
from ._batch import distance_matrix, pair_distances, tabulate
from ._bound import least_distance, signatures
from ._curve import centre, length, resample
from ._distance import alignment_distance, elastic_distance
from ._geodesic import Geodesic, aligned_srvf, geodesic, log_map
from ._preshape import exp_map, parallel_transport, project_closed
from ._srvf import to_curve, to_srvf
from ._tables import Tables

__all__ = [
    "Aligner",
    "Alignment",
    "Geodesic",
    "Stage",
    "Tables",
    "align",
    "aligned_srvf",
    "alignment_distance",
    "centre",
    "distance_matrix",
    "elastic_distance",
    "exp_map",
    "geodesic",
    "least_distance",
    "length",
    "log_map",
    "pair_distances",
    "parallel_transport",
    "project_closed",
    "resample",
    "signatures",
    "tabulate",
    "to_curve",
    "to_srvf",
]
