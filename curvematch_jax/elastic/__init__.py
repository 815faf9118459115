"""The engine: closed curves in, elastic distances, alignments and geodesics out."""

from ._align import align
from ._aligner import Aligner, Alignment, Round
from ._batch import distance_matrix, pair_distances, tabulate
from ._bound import bounded, least_distance, signatures
from ._curve import centre, length, resample
from ._distance import alignment_distance, elastic_distance
from ._elastic import Elastic
from ._geodesic import Geodesic, geodesic, log_map
from ._matched import aligned_curve, matched_points, warp_onto
from ._mirror import mirror_image
from ._preshape import exp_map, parallel_transport, project_closed
from ._rigid import Rigid
from ._srvf import to_curve, to_srvf
from ._tabulated import Tables

__all__ = [
    "Aligner",
    "Alignment",
    "Elastic",
    "Geodesic",
    "Rigid",
    "Round",
    "Tables",
    "align",
    "aligned_curve",
    "alignment_distance",
    "bounded",
    "centre",
    "distance_matrix",
    "elastic_distance",
    "exp_map",
    "geodesic",
    "least_distance",
    "length",
    "log_map",
    "matched_points",
    "mirror_image",
    "pair_distances",
    "parallel_transport",
    "project_closed",
    "resample",
    "signatures",
    "tabulate",
    "to_curve",
    "to_srvf",
    "warp_onto",
]
