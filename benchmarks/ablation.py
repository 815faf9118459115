"""What each preset, witness and setting is worth: scores with it left out or changed.

    python -m benchmarks ablation DIR... [--rows NAME...] [--out FILE.json]   # adds to what the file holds

A DIR has `labels.csv` (columns `file,class`). The members of each class are dealt out to two halves in turn. Settings
were chosen on the first; the second is what they are worth.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from curvematch_jax.retrieval import Matching, Scores, Witness, dissimilarity_matrix, evaluate, rerank, run_settings
from curvematch_jax.surface import Extraction, Parts

from ._measure import say, timed, use_every_core
from ._models import extracted, jobs_option, name_of
from ._record import known, record

MEASURES = ("nn", "ft", "st", "dcg", "map")
PAPER = Matching.paper()
ONE_WAY = Matching(fusion="belief", witnesses=())

# The presets, one change of the default at a time, and the paper's method with changes of its own.
ROWS: dict[str, tuple[Extraction, Matching]] = {
    "default": (Extraction(), Matching()),
    "articulated": (Extraction(), Matching.articulated()),
    "generic": (Extraction(), Matching.generic()),
    "parts alone": (Extraction(), Matching(witnesses=())),
    "parts and spectrum": (Extraction(), Matching(witnesses=(Witness("spectrum"),))),
    "parts and views": (Extraction(), Matching(witnesses=(Witness("views"),))),
    "one-way": (Extraction(), ONE_WAY),
    "one-way, masses of equation 4": (Extraction(), dataclasses.replace(ONE_WAY, masses="shares", scale=1.0)),
    "without smoothing": (Extraction(smoothing=0.0), Matching()),
    "without lengths": (Extraction(), Matching(length_weight=0.0)),
    "without level sets": (Extraction(), Matching(level_set_weight=0.0)),
    "without near-isometry": (Extraction(), Matching(isometry_weight=0.0)),
    # Sizes so heavy that shapes decide nothing.
    "without shapes": (
        Extraction(),
        dataclasses.replace(
            Matching(), length_weight=25.0, level_set_weight=25.0, isometry_weight=1200.0, missing=60.0
        ),
    ),
    "without added parts": (Extraction(min_parts=1), Matching()),
    "even levels": (Extraction(spacing=1.0), Matching()),
    "radius .4, 12 levels": (Extraction(radius=0.4, levels=12), Matching()),
    "all candidates": (Extraction(), Matching(candidates=0)),
    "diameter as unit": (Extraction(), Matching(unit="diameter")),
    "true size": (Extraction(), Matching(unit="mesh")),
    "significance by area": (Extraction(), Matching(significance="area")),
    "isometry weight 6": (Extraction(), Matching(isometry_weight=6.0)),
    "isometry weight 24": (Extraction(), Matching(isometry_weight=24.0)),
    "level weights k^-.25": (Extraction(), Matching(decay=0.25)),
    "level weights k^-.5": (Extraction(), Matching(decay=0.5)),
    "with warps": (Extraction(), Matching.elastic()),
    "paper": (Extraction(), PAPER),
    "paper, levels weigh alike": (Extraction(), dataclasses.replace(PAPER, decay=0.0)),
    "paper, without warps": (Extraction(), dataclasses.replace(PAPER, aligner=Matching().aligner)),
    "paper, without smoothing": (Extraction(smoothing=0.0), PAPER),
}


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    parser.add_argument("--rows", nargs="+", choices=tuple(ROWS), default=tuple(ROWS), metavar="NAME")
    jobs_option(parser)


def run(arguments: argparse.Namespace) -> None:
    """Rows that the file holds are kept, and replaced one by one as they are measured."""
    use_every_core()
    results = {key: known(arguments).get(key, {}) for key in ("settings", "collections")}
    for folder in arguments.folders:
        table = results["collections"].setdefault(name_of(folder), {})
        for name, values in ablated(folder, arguments.rows, arguments.jobs):
            table[name] = values
            results["settings"][name] = run_settings(*ROWS[name])
            if arguments.out:
                record(arguments, results)
    if not arguments.out:
        record(arguments, results)


def ablated(folder: Path, rows: Sequence[str], jobs: int) -> Iterator[tuple[str, dict]]:
    """Every row's name and scores on one collection; says them as they come."""
    made: dict[Extraction, tuple[list[Parts], list[str]]] = {}
    say(f"\n{name_of(folder):28s}" + "".join(f"{name:>7s}" for name in MEASURES) + "    map of the halves   seconds")
    for name in rows:
        extraction, matching = ROWS[name]
        if extraction not in made:
            made[extraction] = extracted(folder, extraction, jobs)[:2]
        values = measured(*made[extraction], matching)
        say(
            f"{name:28s}"
            + "".join(f"{values['whole'][m]:7.3f}" for m in MEASURES)
            + f"{values['first half']['map']:10.3f}{values['second half']['map']:8.3f}{values['seconds']:12.0f}"
        )
        yield name, values


def measured(parts: Sequence[Parts], labels: Sequence[str], matching: Matching) -> dict:
    """Scores on the whole, re-ranked where dissimilarities are symmetric, and on both halves."""
    matrix, seconds = timed(lambda: dissimilarity_matrix(parts, matching))
    scores: dict = {"whole": summary(evaluate(matrix, labels)), "seconds": seconds}
    if matching.mutual:
        scores["re-ranked"] = summary(evaluate(rerank(matrix), labels))
    for name, members in zip(("first half", "second half"), halves(labels), strict=True):
        scores[name] = summary(evaluate(matrix[np.ix_(members, members)], [labels[i] for i in members]))
    return scores


def halves(labels: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the two halves: the members of each class in turn."""
    seen: defaultdict[str, int] = defaultdict(int)
    side = []
    for label in labels:
        side.append(seen[label] % 2)
        seen[label] += 1
    return np.flatnonzero(np.array(side) == 0), np.flatnonzero(np.array(side) == 1)


def summary(scores: Scores) -> dict[str, float]:
    """The measures of the table."""
    return {name: float(getattr(scores, name)) for name in MEASURES}
