"""Parts in, rankings and their quality out."""

from ._evaluation import GradedScores, Scores, evaluate, evaluate_graded
from ._store import (
    SavedMatrix,
    distinct_names,
    load_collection,
    load_matrix,
    load_parts,
    require_same_settings,
    save_matrix,
    save_parts,
)

__all__ = [
    "GradedScores",
    "SavedMatrix",
    "Scores",
    "distinct_names",
    "evaluate",
    "evaluate_graded",
    "load_collection",
    "load_matrix",
    "load_parts",
    "require_same_settings",
    "save_matrix",
    "save_parts",
]
