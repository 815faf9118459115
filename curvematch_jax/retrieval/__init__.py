"""Parts in, rankings and their quality out."""

from ._evaluation import GradedScores, Scores, evaluate, evaluate_graded
from ._files import remove_leftovers
from ._matching import Matching
from ._matrix import dissimilarity_matrix
from ._parts_file import fingerprint, load_collection, load_parts, save_parts, source_key, stored_source
from ._ranking import Match, Ranking, rank
from ._store import (
    SavedMatrix,
    distinct_names,
    load_matrix,
    require_place_for_matrix,
    save_matrix,
)
from ._symmetry import symmetric_parts

__all__ = [
    "GradedScores",
    "Match",
    "Matching",
    "Ranking",
    "SavedMatrix",
    "Scores",
    "dissimilarity_matrix",
    "distinct_names",
    "evaluate",
    "evaluate_graded",
    "fingerprint",
    "load_collection",
    "load_matrix",
    "load_parts",
    "rank",
    "remove_leftovers",
    "require_place_for_matrix",
    "save_matrix",
    "save_parts",
    "source_key",
    "stored_source",
    "symmetric_parts",
]
