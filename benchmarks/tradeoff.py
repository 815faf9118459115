"""Accuracy of alignments against their speed, by settings of the elastic aligner.

    python -m benchmarks tradeoff YARDSTICK.npz [--settings NAME...] [--repeat 8] [--out FILE.json]

The yardstick has groups of curves, `NAME (c, d, n)`, with `NAME_pairs (p, 2)` and the best distance known of each pair,
`NAME_best (p,)`. Every distance is computed anew from the rotation and warps that `align` returns, in float64; what it
is above the best one is its excess, in radians. Speed is that of `align` in float32 on the pairs of a group, repeated.
With `--out` a picture is drawn beside the file.
"""

import argparse
import functools as ft
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

import curvematch_jax as cm
from curvematch_jax import Aligner, Elastic, Round

from ._measure import PRESETS, least_seconds, say
from ._record import record

_ACCURATE = Elastic.accurate()
SETTINGS: dict[str, Aligner] = {
    "one coarse round": Elastic((Round(8, 48),), steps=2, knots=128, nodes=4),
    "two rounds": Elastic((Round(16, 32), Round(2, 96)), steps=3),
    "half the starts": Elastic((Round(16, 24, 8), Round(4, 72, 9), Round(2, 216, 8))),
    "half the width": Elastic((Round(32, 24, 4), Round(7, 72, 5), Round(2, 216, 4))),
    "half the knots": Elastic(knots=128, nodes=4),
    "fast": PRESETS["fast"],
    "more starts": Elastic((Round(48, 24, 8), Round(12, 72, 9), Round(4, 216, 8))),
    "more refined": Elastic(paths=2, steps=6),
    "without its second round": replace(_ACCURATE, rounds=(_ACCURATE.rounds[0], *_ACCURATE.rounds[2:])),
    "accurate, one path refined": replace(_ACCURATE, paths=1, steps=7),
    "accurate": _ACCURATE,
}
_COLOURS = ("#2b6cb0", "#d7301f", "#238b45", "#6a51a3")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("yardstick", type=Path, metavar="YARDSTICK.npz")
    parser.add_argument("--settings", nargs="+", choices=list(SETTINGS), default=list(SETTINGS))
    parser.add_argument("--repeat", type=int, default=8, metavar="N", help="copies of the pairs in what is timed")


def run(arguments: argparse.Namespace) -> None:
    with np.load(arguments.yardstick, allow_pickle=False) as data:
        names = [name.removesuffix("_pairs") for name in data if name.endswith("_pairs")]
        groups = {name: tuple(data[name + end] for end in ("", "_pairs", "_best")) for name in names}
    rows = {name: measured(name, SETTINGS[name], groups, arguments.repeat) for name in arguments.settings}
    record(arguments, {"settings": rows})
    if arguments.out:
        picture(rows, arguments.out.with_suffix(".png"))


def measured(name: str, aligner: Aligner, groups: dict[str, tuple[np.ndarray, ...]], repeat: int) -> dict:
    """Excess and pairs a second of one aligner, by group."""
    row: dict = {"aligner": str(aligner), "groups": {}}
    for group, (curves, pairs, best) in groups.items():
        first, second = (curves[side].astype(np.float32) for side in pairs.T)
        found = cm.align(first, second, aligner)
        over = recomputed(first, second, found) - best
        align = ft.partial(aligned, np.tile(first, (repeat, 1, 1)), np.tile(second, (repeat, 1, 1)), aligner)
        align()
        row["groups"][group] = {
            "excess_median": float(np.median(over)),
            "excess_p95": float(np.quantile(over, 0.95)),
            "excess_max": float(over.max()),
            "pairs_per_second": repeat * len(pairs) / least_seconds(align),
        }
        say(f"{name}, {group}: " + ", ".join(f"{key} {value:.5g}" for key, value in row["groups"][group].items()))
    return row


def aligned(first: np.ndarray, second: np.ndarray, aligner: Aligner) -> cm.Alignment:
    return jax.block_until_ready(cm.align(first, second, aligner))


def recomputed(first: np.ndarray, second: np.ndarray, found: cm.Alignment) -> np.ndarray:
    """The distances of alignments, in float64."""
    with jax.enable_x64(True):
        wide = [np.asarray(x, np.float64) for x in (first, second, found.rotation, found.warp1, found.warp2)]
        return np.asarray(cm.alignment_distance(*wide))


def picture(rows: dict, path: Path) -> None:
    """Draw the excess of each group against speed: the median, and dashed what 95 % of the pairs stay below."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    axes = figure.subplots()
    for colour, group in zip(_COLOURS, next(iter(rows.values()))["groups"], strict=False):
        points = sorted((row["groups"][group] for row in rows.values()), key=lambda point: point["pairs_per_second"])
        speed = [point["pairs_per_second"] for point in points]
        for key, dashes, label in (("excess_median", "o-", group), ("excess_p95", "s--", None)):
            values = [max(point[key], 1e-5) for point in points]
            axes.loglog(speed, values, dashes, color=colour, label=label, markersize=4)
    for name, row in rows.items():
        least = min(row["groups"].values(), key=lambda point: point["excess_median"])
        place = least["pairs_per_second"], max(least["excess_median"], 1e-5)
        axes.annotate(name, place, textcoords="offset points", xytext=(2, -4), fontsize=6, rotation=-60, va="top")
    axes.set(ylim=(1e-7, 1), xlabel="pairs a second of `align`", ylabel="excess over the best known, radians")
    axes.grid(which="major", color="#dddddd", linewidth=0.6)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)
