"""The masses that the parts of one query put on the objects, by the belief model.

    python -m benchmarks.figures.part_masses [FOLDER] [--out DIR] [--query NAME] [--top 20]

Without `--query` the first of the class with the most models queries all the others.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.figures._common import Collection, Figure, Numbers, command
from curvematch_jax.pictures import masses_picture
from curvematch_jax.retrieval import rank


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """The picture, and the numbers in it."""
    query = (collection.named([arguments.query] if arguments.query else []) or collection.members())[0]
    others = [j for j in range(len(collection.described)) if j != query]
    ranking = rank(collection.parts[query], [collection.parts[j] for j in others])
    masses_picture(ranking, picture, arguments.top)
    best = ranking.order[: arguments.top].tolist()
    return {
        "query": collection.described[query].name,
        "conflict": ranking.conflict,
        "ignorance": ranking.ignorance,
        "objects": [
            {
                "name": collection.described[others[j]].name,
                "class": collection.labels[others[j]],
                "probability": float(ranking.probability[j]),
                "masses": ranking.masses[:, j].tolist(),
            }
            for j in best
        ],
    }


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--query", metavar="NAME", help="by default the first of the class with the most models")
    parser.add_argument("--top", type=int, default=20, help="objects")


FIGURE = Figure("part_masses", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
