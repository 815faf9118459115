"""The dissimilarities of all pairs of models, classes in blocks.

    python -m benchmarks.figures.matrix [FOLDER] [--out DIR]

The JSON has the scores, and the mean dissimilarity of each class to each other.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.figures._common import Collection, Figure, Numbers, command
from curvematch_jax.pictures import matrix_picture
from curvematch_jax.retrieval import evaluate


def class_means(matrix: np.ndarray, labels: list[str]) -> dict[str, dict[str, float | None]]:
    """Mean dissimilarity of queries of one class to other models of each; None for a class of one model to itself."""
    names, other = np.array(labels), ~np.eye(len(labels), dtype=bool)

    def mean(query: str, model: str) -> float | None:
        pairs = other & (names == query)[:, None] & (names == model)
        return float(matrix[pairs].mean()) if pairs.any() else None

    return {query: {model: mean(query, model) for model in sorted(set(labels))} for query in sorted(set(labels))}


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The picture, and how good the matrix is."""
    matrix = collection.matrix()
    matrix_picture(matrix, collection.labels, picture)
    scores = evaluate(matrix, collection.labels).summary()
    return {"scores": scores, "class_means": class_means(matrix, collection.labels)}


FIGURE = Figure("matrix", __doc__, run)

if __name__ == "__main__":
    command(FIGURE)
