"""`curvematch demo`: the complete pipeline on generated creatures."""

from __future__ import annotations

import csv
import time
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._progress import Progress, reporter
from ..datasets import CREATURES, creature
from ..extraction._workers import in_processes
from ..pictures import Tile, matrix_picture, sheet
from ..report import Limits, report_page, write_report
from ..retrieval import (
    Matching,
    Ranking,
    SavedMatrix,
    dissimilarity_matrix,
    evaluate,
    rank,
    run_settings,
    save_matrix,
    save_parts,
)
from ..surface import Extraction, Mesh, Parts, extract_parts
from ._output import Output, ranking_rows, ranking_table, scores_table

POSES = 5
COMPOSITE, SOURCES = "centaur", ("horse", "human")
_TOP = 10
_SHOWN = 7
# Queries whose matched parts are in the report: about one of each class.
_EXPLAINED = 10


@dataclass(frozen=True, eq=False)
class _Made:
    """A creature with its parts."""

    mesh: Mesh
    label: str
    parts: Parts


def run_demo(out: Path, jobs: int, show: bool, output: Output) -> int:
    """Make creatures, compare all with all, measure, rank a composite one, and write pictures and the report."""
    started = time.perf_counter()
    made = _make_all(jobs, output)
    matching, partial = Matching(), Matching.partial()
    seconds = {"parts": time.perf_counter() - started}
    matrix = dissimilarity_matrix([m.parts for m in made], matching, output.progress)
    labels = [m.label for m in made]
    scores = evaluate(matrix, labels)
    query = labels.index(COMPOSITE)
    others = [i for i, label in enumerate(labels) if label != COMPOSITE]
    ranking = rank(made[query].parts, [made[i].parts for i in others], partial)
    seconds["matrix"] = time.perf_counter() - started - seconds["parts"]
    classes = _class_order(ranking, [labels[i] for i in others])
    files = _save(out, made, matrix, matching, output.progress)
    seconds["all"] = time.perf_counter() - started
    output.result(
        "\n".join(
            [
                scores_table(scores),
                "",
                f"{made[query].mesh.name}, composed of {' and '.join(SOURCES)}, against the other classes (`partial`):",
                ranking_table(ranking, _TOP),
                f"classes by their best member: {', '.join(classes)}",
                "",
                f"made in {seconds['all']:.0f} s: {', '.join(str(path) for path in files[:-1])}",
                f"report: {files[-1]}",
            ]
        ),
        {
            "measures": scores.summary(),
            "query": made[query].mesh.name,
            "results": ranking_rows(ranking, _TOP),
            "conflict": ranking.conflict,
            "ignorance": ranking.ignorance,
            "class_order": classes,
            "sources_first": set(classes[: len(SOURCES)]) == set(SOURCES),
            "files": [str(path) for path in files],
            "seconds": seconds,
            "settings": run_settings(made[0].parts.settings, matching),
            "query_settings": run_settings(made[query].parts.settings, partial),
        },
    )
    if show:
        webbrowser.open(files[-1].resolve().as_uri())
    return 0


def _make_all(jobs: int, output: Output) -> list[_Made]:
    tasks = [(kind, pose) for kind in CREATURES for pose in range(POSES)]
    made: dict[int, _Made] = {}
    report = reporter(output.progress, "creatures", "meshes")
    report(0, len(tasks))
    for outcome in in_processes(_make, tasks, jobs):
        if outcome.failure is not None:
            kind, pose = tasks[outcome.task]
            raise RuntimeError(f"{kind}{pose} could not be made: {outcome.failure}")
        made[outcome.task] = outcome.result
        report(len(made), len(tasks))
    return [made[index] for index in sorted(made)]


def _make(task: tuple[str, int]) -> _Made:
    new = creature(*task)
    return _Made(new.mesh, new.label, extract_parts(new.mesh, Extraction()))


def _class_order(ranking: Ranking, labels: list[str]) -> list[str]:
    """The classes in the order of their best members."""
    return list(dict.fromkeys(labels[index] for index in ranking.order.tolist()))


def _save(out: Path, made: Sequence[_Made], matrix: np.ndarray, matching: Matching, progress: Progress) -> list[Path]:
    """Write everything that the other commands could start from, the pictures, and last the report."""
    labels, names = [m.label for m in made], [m.mesh.name for m in made]
    for m in made:
        save_parts(m.parts, out / "parts" / f"{m.mesh.name}.npz")
    saved = SavedMatrix(matrix, tuple(names), run_settings(made[0].parts.settings, matching))
    save_matrix(saved, out / "D.zarr")
    with (out / "labels.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("file", "class"), *zip(names, labels, strict=True)])
    matrix_picture(matrix, labels, out / "matrix.png")
    sheet([_row(made, matrix, labels.index(kind)) for kind in CREATURES], out / "ranked.png")
    parts, meshes = [m.parts for m in made], {m.mesh.name: m.mesh for m in made}
    title, limits = "Generated creatures", Limits(explained=_EXPLAINED)
    write_report(report_page(saved, labels, parts, meshes, matching, title, limits, progress), out / "report.html")
    return [out / name for name in ("parts", "D.zarr", "labels.csv", "matrix.png", "ranked.png", "report.html")]


def _row(made: Sequence[_Made], matrix: np.ndarray, query: int) -> list[Tile]:
    """A query and its best matches."""
    order = [i for i in np.argsort(matrix[query], kind="stable").tolist() if i != query]
    matches = [Tile(made[i].mesh, made[i].mesh.name, made[i].label == made[query].label) for i in order[:_SHOWN]]
    return [Tile(made[query].mesh, made[query].mesh.name), *matches]
