"""Whether `symmetric_parts` finds the limbs that a symmetry exchanges.

    python -m benchmarks symmetry [DIR] [--out FILE.json]   # adds to what the file holds

DIR is like the SHREC'07 watertight track: mesh files N.off, `labels.csv` (`file,class`) and `landmarks/`, with
`N.vts` (vertex number, x, y, z of a landmark on each line) and `C.sym.info` for the twenty models `20 (C - 1) + 1` to
`20 C` of a class (landmarks that a symmetry exchanges on each line; Kim, Lipman, Funkhouser: Blended intrinsic maps,
SIGGRAPH 2011). A part stands for the landmark next to its feature point, within 0.07 diameters.

Without DIR the generated creatures are asked, standing as they are planned: the same on the left (x) as on the
right. Two parts are exchanged when one feature point is the mirror image of the other, within 0.07 diameters. Where
there is more symmetry than that (the arms of an octopus, nearly the legs of a spider) what it adds counts as wrong.

Counted are pairs of parts that stand for different landmarks: *precision* is the share of those in one group that are
truly exchanged, *recall* the share of those exchanged that are in one group. Settings were searched on the first half
of SHREC'07, every other member of each class. The second was looked at on the way, so it is no untouched test.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from curvematch_jax.datasets import creatures, labelled_folder
from curvematch_jax.retrieval import run_settings, symmetric_parts
from curvematch_jax.retrieval._symmetry import SELF
from curvematch_jax.surface import Extraction, Parts, extract_parts, load_mesh

from ._measure import say, timed, use_every_core
from ._models import name_of
from ._record import known, record
from .features import read_landmarks

NEAR = 0.07
MODELS_A_CLASS = 20
INDIVIDUALS = 3


class Truth(NamedTuple):
    """What is known about P parts."""

    places: np.ndarray  # (P,) two parts in one place are not asked about
    groups: np.ndarray  # (P,) parts of one group are exchanged; -1 where nothing is known


class Counts(NamedTuple):
    """Pairs of parts of one model."""

    pairs: int
    exchanged: int
    found: int
    both: int


def exchanged_landmarks(path: Path) -> dict[int, int]:
    """The set that each landmark is in. Sets are lines of numbers; some files end in remarks."""
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    sets = [[int(word) for word in words] for words in lines if all(word.isdigit() for word in words)]
    return {landmark: k for k, members in enumerate(sets) for landmark in members}


def landmark_truth(parts: Parts, landmarks: np.ndarray, sets: dict[int, int]) -> Truth:
    """Parts next to a landmark, and the set it is in."""
    distances = np.linalg.norm(parts.points[:, None] - landmarks, axis=-1) / parts.diameter
    places = distances.argmin(axis=1)
    groups = [sets.get(int(k), -1) if d <= NEAR else -1 for k, d in zip(places, distances.min(axis=1), strict=True)]
    return Truth(places, np.array(groups, int))


def mirror_truth(parts: Parts) -> Truth:
    """Parts with their mirror images in x; a part without one is not asked about."""
    distances = np.linalg.norm(parts.points[:, None] - parts.points * [-1, 1, 1], axis=-1) / parts.diameter
    every, image = np.arange(len(distances)), distances.argmin(axis=1)
    known = (image[image] == every) & (distances.min(axis=1) <= NEAR)
    return Truth(every, np.where(known, np.minimum(every, image), -1))


def compared(groups: Iterable[tuple[int, ...]], truth: Truth) -> Counts:
    """The pairs that are asked about, those truly exchanged, those found, and those that are both."""
    label = np.zeros(len(truth.groups), int)
    for k, members in enumerate(groups):
        label[list(members)] = k
    rows, columns = np.triu_indices(len(label), 1)
    known = (truth.groups[rows] >= 0) & (truth.groups[columns] >= 0) & (truth.places[rows] != truth.places[columns])
    rows, columns = rows[known], columns[known]
    exchanged, found = truth.groups[rows] == truth.groups[columns], label[rows] == label[columns]
    return Counts(len(rows), int(exchanged.sum()), int(found.sum()), int((exchanged & found).sum()))


def of_folder(folder: Path) -> Iterator[tuple[str, Parts, Truth]]:
    """Class, parts and truth of every model with landmarks."""
    for path, kind in labelled_folder(folder):
        points = folder / "landmarks" / f"{path.stem}.vts"
        sets = folder / "landmarks" / f"{-(-int(path.stem) // MODELS_A_CLASS)}.sym.info"
        if points.is_file() and sets.is_file():
            parts = extract_parts(load_mesh(path))
            yield kind, parts, landmark_truth(parts, read_landmarks(points), exchanged_landmarks(sets))


def of_creatures(individuals: int) -> Iterator[tuple[str, Parts, Truth]]:
    """Class, parts and truth of the creatures at rest; another seed is another individual."""
    for seed in range(individuals):
        for made in creatures(poses=1, seed=seed):
            parts = extract_parts(made.mesh)
            yield made.label, parts, mirror_truth(parts)


def measured(models: Iterable[tuple[str, Parts, Truth]]) -> tuple[dict[str, list[Counts]], list[float]]:
    """Counts of the models of each class, and the seconds that each model took beyond its extraction."""
    by_class: defaultdict[str, list[Counts]] = defaultdict(list)
    seconds = []
    for kind, parts, truth in models:
        groups, taken = timed(lambda parts=parts: symmetric_parts(parts))
        seconds.append(taken)
        by_class[kind].append(compared(groups, truth))
    return by_class, seconds


def row(counts: list[Counts]) -> dict[str, float | None]:
    """Counts of several models added up, and the two shares; None where there is nothing to have a share of."""
    total = Counts(*np.sum(counts, axis=0).tolist()) if counts else Counts(0, 0, 0, 0)
    return {
        "models": len(counts),
        **total._asdict(),
        "precision": total.both / total.found if total.found else None,
        "recall": total.both / total.exchanged if total.exchanged else None,
    }


def table(by_class: dict[str, list[Counts]], halves: bool) -> dict[str, dict[str, float | None]]:
    """A row for each class, for all, and for the two halves: the members of each class in turn."""
    rows = {kind: row(counts) for kind, counts in sorted(by_class.items())}
    rows["all"] = row([c for counts in by_class.values() for c in counts])
    for half, first in (("first half", 0), ("second half", 1)) if halves else ():
        rows[half] = row([c for counts in by_class.values() for c in counts[first::2]])
    return rows


def say_table(rows: dict[str, dict[str, float | None]]) -> None:
    say(f"{'class':12} models  pairs  exchanged  found   both  precision  recall")
    for kind, r in rows.items():
        shares = ["-" if r[name] is None else f"{r[name]:.3f}" for name in ("precision", "recall")]
        say(
            f"{kind:12} {r['models']:6} {r['pairs']:6} {r['exchanged']:10} {r['found']:6} {r['both']:6}"
            f"  {shares[0]:>9}  {shares[1]:>6}"
        )


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, nargs="?", metavar="DIR", help="by default the generated creatures")
    parser.add_argument("--individuals", type=int, default=INDIVIDUALS, metavar="N", help="creatures of each class")


def run(arguments: argparse.Namespace) -> None:
    """Collections that the file holds are kept."""
    use_every_core()
    folder = arguments.folder
    by_class, seconds = measured(of_folder(folder) if folder else of_creatures(arguments.individuals))
    if not by_class:
        raise ValueError(f"{folder} has no model with landmarks")
    rows = table(by_class, halves=folder is not None)
    say_table(rows)
    median = float(np.median(seconds))
    say(f"{median:.2f} seconds a model (median), beyond its extraction")
    collections = known(arguments).get("collections", {})
    collections[name_of(folder)] = {"median_seconds": median, "classes": rows}
    record(arguments, {"settings": {"near": NEAR, **run_settings(Extraction(), SELF)}, "collections": collections})
