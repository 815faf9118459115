"""Parts in, rankings and their quality out."""

from ._evaluation import GradedScores, Scores, evaluate, evaluate_graded

__all__ = ["GradedScores", "Scores", "evaluate", "evaluate_graded"]
