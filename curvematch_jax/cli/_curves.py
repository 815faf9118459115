"""The work of `curvematch outlines` and `curvematch mean`."""

from __future__ import annotations

import csv
import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .._files import replacing, writing
from .._progress import reporter
from .._words import counted
from ..datasets import match_labels, read_labels
from ..elastic import distance_matrix
from ..extraction import Failure
from ..outlines import CURVE_SUFFIXES, IMAGE_SUFFIXES, read_curves, read_outlines, write_curves
from ..pictures import components_picture, mean_picture, scores_picture
from ..statistics import TangentPCA, energy_test, karcher_mean, variance_test
from ._commands import SOME_FAILED, report_failures
from ._output import Output

_SHOWN = 3  # components drawn
# Of a component: at which curves are drawn, and what is above them.
_DEVIATIONS = {-2: "-2 standard deviations", -1: "-1", 0: "mean", 1: "+1", 2: "+2 standard deviations"}
_TESTS = {"energy": energy_test, "variance": variance_test}


def make_outlines(
    images: Sequence[Path],
    out: Path,
    samples: int,
    smoothing: float,
    each: bool,
    strict: bool,
    output: Output,
) -> int:
    """Images to one file of curves; images that cannot be used are reported one by one."""
    started = time.perf_counter()
    if out.suffix.lower() not in CURVE_SUFFIXES:
        raise ValueError(f"{out}: not a format of curves; known are {', '.join(CURVE_SUFFIXES)}.")
    paths = _image_files(images)
    report = reporter(output.progress, "reading", "images")
    curves, names, notes, failed = [], [], [], []
    for done, path in enumerate(paths, start=1):
        try:
            found = read_outlines(path, samples, smoothing, each)
        except ValueError as problem:
            failed.append(Failure(path.name, str(problem)))
        else:
            curves += list(found.curves)
            names += found.names
            notes += found.notes
        report(done, len(paths))
    for note in notes:
        output.note(note)
    report_failures(failed, len(curves), output)
    with writing(out):
        write_curves(out, curves, names)
    seconds = time.perf_counter() - started
    failures = [dataclasses.asdict(failure) for failure in failed]
    output.result(
        f"{counted(len(curves), 'outline')} of {counted(len(paths), 'image')} in {out} ({seconds:.1f} s)",
        {"out": str(out), "outlines": names, "notes": notes, "failed": failures, "seconds": seconds},
    )
    return SOME_FAILED if failed and strict else 0


def make_mean(
    path: Path, out: Path, groups: Path | None, samples: int | None, permutations: int, output: Output
) -> int:
    """Curves to their mean, scores, tests and pictures, in a folder that appears when all of it is there."""
    started = time.perf_counter()
    read = read_curves(path)
    labels = None if groups is None else match_labels(read.names, read_labels(groups), groups, "curves")
    curves = read.array(samples)
    mean = karcher_mean(curves, progress=output.progress)
    components = TangentPCA.fit(mean)
    kept = len(curves) - 1  # The tangents at a mean sum to 0: one component more is what the descent left of that.
    scores, explained = components.scores(mean)[:, :kept], components.explained[:kept]
    tests = {} if labels is None else _tests(curves, labels, permutations, output)
    with writing(out), replacing(out) as folder:
        folder.mkdir()
        _write(folder, mean, components, scores, read.names, labels)
    result = {
        "out": str(out),
        "curves": len(curves),
        "variance": float(mean.variance),
        "gradient": float(mean.gradient),
        "converged": bool(mean.converged),
        "explained": explained.tolist(),
        "tests": tests,
        "seconds": time.perf_counter() - started,
    }
    if not mean.converged:
        output.note(f"the descent stopped at a gradient of {float(mean.gradient):.1e} radians")
    shares = ", ".join(f"{100 * share:.0f} %" for share in explained[:_SHOWN])
    said = "".join(f"; {name}: p = {test['p']:.4f}" for name, test in tests.items())
    output.result(
        f"the mean of {counted(len(curves), 'curve')} is in {out}: variance {float(mean.variance):.4g}, "
        f"components {shares}{said} ({result['seconds']:.1f} s)",
        result,
    )
    return 0


def _image_files(inputs: Sequence[Path]) -> list[Path]:
    """The images that the inputs stand for, folders opened, sorted within."""
    found: list[Path] = []
    for path in inputs:
        if path.is_dir():
            found += [p for p in sorted(path.iterdir()) if p.suffix.lower() in IMAGE_SUFFIXES]
        else:
            found.append(path)
    if not found:
        raise ValueError(f"no images ({', '.join(IMAGE_SUFFIXES)}) in {', '.join(str(path) for path in inputs)}")
    return found


def _tests(curves: np.ndarray, labels: list[str], permutations: int, output: Output) -> dict[str, dict[str, float]]:
    matrix = distance_matrix(curves, progress=output.progress)
    found = {name: test(matrix, labels, permutations) for name, test in _TESTS.items()}
    return {name: {"statistic": test.statistic, "p": test.p} for name, test in found.items()}


def _write(folder: Path, mean, components: TangentPCA, scores: np.ndarray, names, labels: list[str] | None) -> None:
    write_curves(folder / "mean.npz", mean.curve[None], ["mean"])
    write_curves(folder / "aligned.npz", mean.aligned, names)
    with (folder / "scores.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(
            ["curve", *([] if labels is None else ["group"]), *(f"PC{i + 1}" for i in range(scores.shape[1]))]
        )
        for index, (name, row) in enumerate(zip(names, scores, strict=True)):
            rows.writerow([name, *([] if labels is None else [labels[index]]), *(f"{x:.7g}" for x in row)])
    shown = min(_SHOWN, scores.shape[1])
    if mean.curve.shape[0] <= 3:
        mean_picture(mean.curve, mean.aligned, folder / "mean.png")
        titles = [f"PC{i + 1}, {100 * components.explained[i]:.0f} %" for i in range(shown)]
        drawn = np.stack([components.along(i, list(_DEVIATIONS)) for i in range(shown)])
        components_picture(drawn, folder / "components.png", titles, list(_DEVIATIONS.values()))
    scores_picture(scores, folder / "scores.png", labels, names)
