"""Outlines of cells and wings: whether treatments and genera differ, and whether neighbours tell them apart.

    python -m benchmarks specimens DIR [--preset fast] [--samples 100] [--limit N] [--out FILE.json]

DIR has `cells.npz`: `points (p, 2)`, `counts (c,)`, `cell_line`, `treatment`; and `wings.npz`: `points`, `counts`,
`genus`. The cells are those of geomstats 2.8, the wings those of ktch 0.11. Treatments are compared within each cell
line, genera among those of seven wings or more.

Each is measured with elastic distances, and with those of `Rigid`: rotation and start point alone, without warps.

    p         of `energy_test`, 9,999 permutations
    balanced  accuracy of the k nearest neighbours, each left out in turn, in the mean over groups.
              Of k = 1, 3, 5, 9, 15, 25, the best on every other outline is used for the rest, and the other way
              round; chance is 1 / groups
    scores    balanced accuracy of linear discriminants of ten tangent scores, in five folds, the mean and the
              components made from the other folds; of the wings alone, since it takes five means
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import curvematch_jax as cm
from curvematch_jax.statistics import ShapeTransformer, energy_test

from ._measure import PRESETS, say
from ._record import record

_NEIGHBOURS = (1, 3, 5, 9, 15, 25)
_LEAST = 7  # members of a group
_FOLDS, _SCORES = 5, 10


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--preset", choices=["fast", "accurate"], default="fast")
    parser.add_argument("--samples", type=int, default=100, metavar="N", help="of each outline, by arc length")
    parser.add_argument("--limit", type=int, metavar="N", help="the first N of each group alone")


def run(arguments: argparse.Namespace) -> None:
    read = lambda name, *labels: outlines(arguments.folder / name, arguments.samples, labels)  # noqa: E731
    cells, (lines, treatments) = read("cells.npz", "cell_line", "treatment")
    results = {}
    for line in np.unique(lines):
        results[f"treatment of {line}"] = told_apart(cells[lines == line], treatments[lines == line], arguments)
    wings, (genera,) = read("wings.npz", "genus")
    results["genus of wings"] = told_apart(wings, genera, arguments, discriminants=True)
    record(arguments, {"groups": results})


def outlines(path: Path, samples: int, labels: tuple[str, ...]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Outlines `(c, 2, samples)`, counter-clockwise, and what they are labelled with."""
    with np.load(path, allow_pickle=False) as data:
        pieces = np.split(data["points"], np.cumsum(data["counts"])[:-1])
        named = [data[label] for label in labels]
    return np.stack([_outline(piece.T, samples) for piece in pieces]), named


def _outline(curve: np.ndarray, samples: int) -> np.ndarray:
    curve = curve[:, :-1] if np.allclose(curve[:, 0], curve[:, -1]) else curve
    x, y = curve
    clockwise = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0
    return np.asarray(cm.resample(curve[:, ::-1] if clockwise else curve, samples))


def told_apart(
    curves: np.ndarray, labels: np.ndarray, arguments: argparse.Namespace, discriminants: bool = False
) -> dict:
    """How far groups are told apart, with warps and without."""
    names, members = np.unique(labels, return_counts=True)
    kept = np.isin(labels, names[members >= _LEAST])
    if arguments.limit is not None:
        kept &= np.array([np.sum(labels[:i] == label) < arguments.limit for i, label in enumerate(labels)])
    curves, labels = curves[kept], labels[kept]
    names, members = np.unique(labels, return_counts=True)
    found: dict = {"members": dict(zip(names.tolist(), members.tolist(), strict=True)), "chance": 1 / len(names)}
    for preset in ("rigid", arguments.preset):
        matrix = cm.distance_matrix(curves, aligner=PRESETS[preset])
        p = energy_test(matrix, labels).p
        found[preset] = {"p": p, "balanced": neighbours(matrix, labels)}
        if discriminants:
            found[preset]["scores"] = by_scores(curves, labels, PRESETS[preset])
        say(f"{', '.join(names)}, {preset}: p {p:.4f}, balanced {found[preset]['balanced']:.3f}")
    return found


def neighbours(matrix: np.ndarray, labels: np.ndarray) -> float:
    """Balanced accuracy; each half of the outlines with the k that is best on the other one."""
    halves = np.arange(len(labels)) % 2 == 0
    told = np.stack([voted(matrix, labels, k) == labels for k in _NEIGHBOURS])
    right = np.empty(len(labels), bool)
    for half in (halves, ~halves):
        best = int(np.argmax([balanced(each[~half], labels[~half]) for each in told]))
        right[half] = told[best, half]
    return balanced(right, labels)


def voted(matrix: np.ndarray, labels: np.ndarray, k: int) -> np.ndarray:
    """The label that most of the k nearest others have; of several, that of the nearest among them."""
    away = matrix.astype(float)
    np.fill_diagonal(away, np.inf)
    near = labels[np.argsort(away, axis=1, kind="stable")[:, :k]]
    votes = (near[:, :, None] == near[:, None, :]).sum(axis=2)
    return near[np.arange(len(near)), np.argmax(votes, axis=1)]


def balanced(right: np.ndarray, labels: np.ndarray) -> float:
    return float(np.mean([right[labels == label].mean() for label in np.unique(labels)]))


def by_scores(curves: np.ndarray, labels: np.ndarray, aligner: cm.Aligner) -> float:
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.model_selection import StratifiedKFold, cross_val_predict
    from sklearn.pipeline import make_pipeline

    scores = ShapeTransformer(min(_SCORES, len(curves) // 2), aligner=aligner)
    model = make_pipeline(scores, LinearDiscriminantAnalysis())
    folds = StratifiedKFold(_FOLDS, shuffle=True, random_state=0)
    return balanced(cross_val_predict(model, curves, labels, cv=folds) == labels, labels)
