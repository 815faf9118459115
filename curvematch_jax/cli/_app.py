"""The commands, their arguments and options, and how errors end."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from ..extraction._workers import TIME_LIMIT, cores, one_line
from ..retrieval import Matching
from ..retrieval._matching import presets
from ..surface import Extraction
from . import _commands, _curves
from ._demo import run_demo
from ._jax import configure_jax
from ._matrix import make_index, make_matrix, show_status
from ._output import Output, complain
from ._query import Explanation, Question, run_query
from ._report import make_report

USAGE = 2
_INTERRUPTED = 130

# typer's errors in its arguments: click's class, or that of the copy of click inside typer, by version.
_UsageProblem: Any = typer.BadParameter.__mro__[2]

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


class Preset(StrEnum):
    """The named `Matching` settings."""

    default = "default"
    elastic = "elastic"
    articulated = "articulated"
    generic = "generic"
    partial = "partial"
    paper = "paper"

    def matching(self) -> Matching:
        return presets()[self.value]


class FieldName(StrEnum):
    """The distances along the surface of `Extraction`."""

    geodesic = "geodesic"
    diffusion = "diffusion"
    biharmonic = "biharmonic"
    commute_time = "commute_time"


_DEFAULT = Extraction()
_FIELD = FieldName(_DEFAULT.field)
_CORES = cores()

Meshes = Annotated[list[Path], typer.Argument(metavar="MESHES...", help="Mesh files, or folders of them.")]
Jobs = Annotated[int, typer.Option(min=1, show_default="all cores", help="Worker processes for the extraction.")]
Strict = Annotated[bool, typer.Option("--strict", help="Exit with status 1 when an input could not be used.")]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout instead of text.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress and no notes; failures are still reported.")]
PresetOption = Annotated[
    Preset,
    typer.Option(
        help="How objects are compared: default, for any collection; articulated, for bodies that bend; generic, for "
        "objects of many kinds; elastic, the default with reparametrisation of curves; partial, for pieces of bodies "
        "and bodies composed of pieces; paper, as published."
    ),
]


def _show_version(asked: bool) -> bool:
    if asked:
        print(f"curvematch {version('curvematch_jax')}")
        raise typer.Exit
    return asked


@app.callback()
def _setup(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and stop.")
    ] = False,
) -> None:
    """Find similar 3D models, in any pose or only in part, by the elastic shapes of their geodesic level curves."""


@app.command()
def parts(
    meshes: Meshes,
    out: Annotated[Path, typer.Option(metavar="PARTS_DIR", help="Folder for the parts, one file per mesh.")],
    epsilon: Annotated[
        float, typer.Option(help="Minimum distance between feature points, in diameters.")
    ] = _DEFAULT.epsilon,
    radius: Annotated[float, typer.Option(help="Radius of a part, in sizes of the surface.")] = _DEFAULT.radius,
    levels: Annotated[int, typer.Option(help="Level curves per part.")] = _DEFAULT.levels,
    samples: Annotated[int, typer.Option(help="Points per curve.")] = _DEFAULT.samples,
    field: Annotated[FieldName, typer.Option(help="Distance along the surface.")] = _FIELD,
    vertices: Annotated[
        int, typer.Option(help="Resolution: edges longer than those of a mesh of this many vertices are divided.")
    ] = _DEFAULT.vertices,
    spacing: Annotated[
        float, typer.Option(help="Spacing of levels; above 1, denser near the feature point.")
    ] = _DEFAULT.spacing,
    min_parts: Annotated[int, typer.Option(help="Minimum number of parts per object.")] = _DEFAULT.min_parts,
    smoothing: Annotated[
        float, typer.Option(help="Smoothing of the surface, in square roots of its area; 0 for none.")
    ] = _DEFAULT.smoothing,
    time_limit: Annotated[
        float, typer.Option(min=1, metavar="SECONDS", help="Time limit per mesh; a mesh that takes longer is skipped.")
    ] = TIME_LIMIT,
    jobs: Jobs = _CORES,
    strict: Strict = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Divide meshes into parts and save them. Meshes whose parts are already in the folder are skipped."""
    extraction = Extraction(epsilon, radius, levels, samples, field.value, vertices, spacing, min_parts, smoothing)
    return _commands.make_parts(meshes, out, extraction, jobs, time_limit, strict, Output(json, quiet))


@app.command()
def matrix(
    out: Annotated[Path, typer.Option(metavar="D.zarr", help="The matrix: an existing one, or a new path.")],
    meshes: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="MESHES...", help="Mesh files, folders of them, or folders of parts.", show_default=False
        ),
    ] = None,
    preset: PresetOption = Preset.default,
    scheduler: Annotated[
        str | None, typer.Option(metavar="tcp://HOST:PORT", help="Compute the blocks on this dask cluster.")
    ] = None,
    status: Annotated[bool, typer.Option("--status", help="Show the progress of the matrix and stop.")] = False,
    jobs: Jobs = _CORES,
    strict: Strict = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Compare all objects with each other. Run the same command again to resume, or to add new objects."""
    output = Output(json, quiet)
    if status:
        return show_status(out, output)
    if not meshes:
        raise typer.BadParameter("give meshes or parts, or --status")
    return make_matrix(meshes, out, _DEFAULT, preset.matching(), jobs, scheduler, strict, output)


@app.command()
def index(
    meshes: Annotated[
        list[Path], typer.Argument(metavar="MESHES...", help="Mesh files, folders of them, or folders of parts.")
    ],
    out: Annotated[Path, typer.Option(metavar="INDEX", help="The index: an existing one, or a new path.")],
    preset: PresetOption = Preset.default,
    jobs: Jobs = _CORES,
    strict: Strict = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Prepare a collection for fast queries. Run the same command again to add new objects."""
    return make_index(meshes, out, _DEFAULT, preset.matching(), jobs, strict, Output(json, quiet))


@app.command()
def query(
    mesh: Annotated[list[Path], typer.Argument(metavar="MESH...", help="Mesh files, or their parts.")],
    collection: Annotated[
        Path, typer.Option("--in", metavar="INDEX|PARTS_DIR", help="Index, or folder of parts, to search.")
    ],
    top: Annotated[int, typer.Option(min=1, help="Number of results to list.")] = 10,
    exclude_self: Annotated[
        bool, typer.Option("--exclude-self", help="Leave the query itself out of the results.")
    ] = False,
    rerank: Annotated[
        bool, typer.Option("--rerank", help="Re-rank the first 50 results by diffusion among their neighbours.")
    ] = False,
    explain: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Draw matched parts in the same colours, and list them."),
    ] = None,
    meshes: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder with the meshes of the collection, whose surfaces --explain draws."),
    ] = None,
    preset: PresetOption = Preset.default,
    jobs: Jobs = _CORES,
    strict: Strict = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Rank a collection by similarity to one or more meshes."""
    if meshes is not None and explain is None:
        raise typer.BadParameter("--meshes needs --explain")
    if explain is not None and len(mesh) > 1:
        raise typer.BadParameter("--explain draws one query, but several meshes were given")
    explanation = None if explain is None else Explanation(explain, meshes)
    question = Question(preset.matching(), top, exclude_self, rerank)
    return run_query(mesh, collection, question, explanation, jobs, strict, Output(json, quiet))


@app.command()
def evaluate(
    matrix: Annotated[Path, typer.Argument(metavar="D.zarr", help="A matrix made by `curvematch matrix`.")],
    labels: Annotated[Path, typer.Option(metavar="labels.csv", help="The classes, columns `file,class`.")],
    rerank: Annotated[
        bool, typer.Option("--rerank", help="Re-rank the matrix by diffusion among neighbours first.")
    ] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Measure how well a matrix retrieves the members of each class."""
    return _commands.run_evaluation(matrix, labels, rerank, Output(json, quiet))


@app.command()
def report(
    matrix: Annotated[Path, typer.Argument(metavar="D.zarr", help="A matrix made by `curvematch matrix`.")],
    out: Annotated[Path, typer.Option(metavar="report.html", help="The file to write.")],
    parts: Annotated[
        Path | None, typer.Option(metavar="PARTS_DIR", help="The matrix's parts, for matched parts and beliefs.")
    ] = None,
    meshes: Annotated[Path | None, typer.Option(metavar="DIR", help="The meshes, to be drawn.")] = None,
    labels: Annotated[
        Path | None, typer.Option(metavar="labels.csv", help="The classes, columns `file,class`, for the measures.")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Write one HTML file with measures, the matrix, rankings, and matched parts in 3-D; it needs no network."""
    presets = [preset.matching() for preset in Preset]
    return make_report(matrix, out, parts, meshes, labels, presets, Output(json, quiet))


@app.command()
def outlines(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGES...", help="PNG or TIFF masks, or folders of them.")],
    out: Annotated[Path, typer.Option(metavar="CURVES", help="File for the curves: .npz, .csv or .tps.")],
    samples: Annotated[int, typer.Option(min=8, help="Points per curve.")] = 100,
    smoothing: Annotated[float, typer.Option(min=0, help="Smoothing of the outline, in pixels.")] = 1.0,
    each: Annotated[bool, typer.Option("--each", help="One outline for each label of an image.")] = False,
    strict: Strict = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Convert the outlines of masks to closed curves."""
    return _curves.make_outlines(images, out, samples, smoothing, each, strict, Output(json, quiet))


@app.command()
def mean(
    curves: Annotated[Path, typer.Argument(metavar="CURVES", help="Closed curves: .npz, .csv or .tps.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the mean, tables and pictures.")],
    groups: Annotated[
        Path | None, typer.Option(metavar="labels.csv", help="Groups to compare, columns `file,class`.")
    ] = None,
    samples: Annotated[int | None, typer.Option(min=8, help="Points per curve.", show_default="as given")] = None,
    permutations: Annotated[int, typer.Option(min=1, help="Number of permutations for the tests.")] = 9999,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Compute the mean of closed curves, their components, tests of groups, and pictures."""
    return _curves.make_mean(curves, out, groups, samples, permutations, Output(json, quiet))


@app.command()
def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the results.")] = Path("curvematch-demo"),
    open: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
    jobs: Jobs = _CORES,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Run the complete pipeline on generated creatures: parts, matrix, measures, a query, pictures and a report."""
    return run_demo(out, jobs, open, Output(json, quiet))


def _plain(message: str) -> str:
    """A usage error without the words of the library that checks the values."""
    return re.sub(r"Value error, |Input (?=should)|, unable to parse.*", "", message).rstrip(".")


def main() -> int:
    """The program `curvematch`: settings of the process, then the command of its arguments."""
    configure_jax()
    return run(sys.argv[1:])


def run(arguments: Sequence[str]) -> int:
    """Run a command and return its exit status; errors are one line on stderr.

    `CURVEMATCH_TRACEBACK=1` in the environment lets unexpected errors show where they come from.
    """
    try:
        return app(list(arguments), standalone_mode=False) or 0
    except _UsageProblem as problem:
        complain(f"{_plain(problem.format_message())} (see curvematch --help)")
        return USAGE
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted; finished work is kept")
        return _INTERRUPTED
    except Exception as error:
        if os.environ.get("CURVEMATCH_TRACEBACK"):
            raise
        complain(one_line(error))
        return USAGE
