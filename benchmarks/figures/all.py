"""Every figure of a collection; what one has computed, the next one uses.

    python -m benchmarks.figures.all [FOLDER] [--out DIR] [--raw DIR] [--baselines FILE.json]
        [--per-class N] [--only NAME ...]

Says which files it wrote; a figure that fails is reported, and the others are made. Options of single figures are those
of their own scripts. What a topological short cut does is measured by `benchmarks/shortcut.py`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.figures import (
    dirt,
    feature_points,
    level_curves,
    matrix,
    moved_points,
    noise,
    part_geodesic,
    part_masses,
    precision_recall,
    ranked_rows,
)
from benchmarks.figures._common import Collection, Figure, parser_of, perform, say
from curvematch_jax.cli._jax import configure_jax
from curvematch_jax.extraction._workers import one_line

FIGURES: dict[str, Figure] = {
    module.FIGURE.name: module.FIGURE
    for module in (
        feature_points,
        level_curves,
        part_geodesic,
        part_masses,
        matrix,
        ranked_rows,
        precision_recall,
        noise,
        moved_points,
        dirt,
    )
}


def arguments_of(figure: Figure, given: argparse.Namespace) -> argparse.Namespace:
    """What the figure's own script would be told."""
    told = parser_of(None, figure.options).parse_args([])
    shared = {name: value for name, value in vars(given).items() if hasattr(told, name)}
    return argparse.Namespace(**(vars(told) | shared))


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--raw", type=Path, metavar="DIR", help="raw meshes of the same classes, for `dirt`")
    parser.add_argument("--baselines", type=Path, metavar="FILE.json", help="take the baselines' figures from here")
    parser.add_argument("--per-class", type=int, metavar="N", help="changed queries of each class; by default all")
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=list(FIGURES))


def main() -> int:
    given = parser_of(__doc__, options).parse_args()
    configure_jax()
    collection = Collection.of(given.folder, given.jobs)
    failed = 0
    for name in given.only:
        try:
            perform(FIGURES[name], collection, arguments_of(FIGURES[name], given))
        except Exception as error:  # of one figure, which costs the others nothing
            failed += 1
            say(f"{name}: {one_line(error)}")
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
