"""Parts in, rankings and their quality out."""

from .._files import remove_leftovers
from ._collection import Collection
from ._evaluation import GradedScores, Scores, evaluate, evaluate_graded
from ._executors import Outcome
from ._index import build_index, is_index
from ._matching import Matching, Witness
from ._matrix import build_matrix, dissimilarity_matrix
from ._matrix_file import MatrixStatus, SavedMatrix, load_matrix, matrix_status, save_matrix
from ._parts_file import StoredParts, fingerprint, load_collection, load_parts, save_parts, source_key, stored_source
from ._ranking import Match, Ranking, rank
from ._rerank import RERANKED, rerank, reranked
from ._settings import first_difference, require_same, run_settings
from ._symmetry import symmetric_parts

__all__ = [
    "RERANKED",
    "Collection",
    "GradedScores",
    "Match",
    "Matching",
    "MatrixStatus",
    "Outcome",
    "Ranking",
    "SavedMatrix",
    "Scores",
    "StoredParts",
    "Witness",
    "build_index",
    "build_matrix",
    "dissimilarity_matrix",
    "evaluate",
    "evaluate_graded",
    "fingerprint",
    "first_difference",
    "is_index",
    "load_collection",
    "load_matrix",
    "load_parts",
    "matrix_status",
    "rank",
    "remove_leftovers",
    "require_same",
    "rerank",
    "reranked",
    "run_settings",
    "save_matrix",
    "save_parts",
    "source_key",
    "stored_source",
    "symmetric_parts",
]
