"""Parts in, rankings and their quality out."""

from ._collection import Collection
from ._evaluation import GradedScores, Scores, evaluate, evaluate_graded
from ._matching import Matching
from ._matrix import dissimilarity_matrix
from ._ranking import Match, Ranking, rank
from ._store import (
    SavedMatrix,
    distinct_names,
    load_collection,
    load_matrix,
    load_parts,
    require_place_for_matrix,
    save_matrix,
    save_parts,
)
from ._symmetry import symmetric_parts

__all__ = [
    "Collection",
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
    "load_collection",
    "load_matrix",
    "load_parts",
    "rank",
    "require_place_for_matrix",
    "save_matrix",
    "save_parts",
    "symmetric_parts",
]
