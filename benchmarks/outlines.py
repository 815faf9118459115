"""Planar outlines by their elastic distances: how well classes are found, and how fast.

    python -m benchmarks outlines DIR [--presets rigid fast accurate] [--samples 100] [--limit N]
                                      [--baseline COMMIT] [--out FILE.json]

DIR has `mpeg7_half.npz`: `curves (c, 2, n)`, closed, and `labels (c,)`; half of MPEG-7 CE-Shape-1, 20 shapes of each of
35 classes.

Each preset compares every two outlines, `plain`, and `mirrored`: with an outline or its mirror image, whichever is
nearer, the reflection with its samples in reverse, so that it runs round the same way.

    bullseye  of the nearest 2c of each outline, itself included, the share of the c of its class, in the mean
    nn, ft    nearest neighbour and first tier; the query does not count
    seconds   of the whole matrix, after a small call has compiled everything

`reranked` has the mirrored matrix after `rerank`, the diffusion among mutual neighbours, with k = 4, 6, 8, 10, 12 or
15. The k is the one of the best bullseye among the outlines of every other class alone, in their order; `others` is
the bullseye of the outlines of the rest.

With `--baseline` the same is measured of the package of another commit, from a temporary checkout, in the same run.
7435b05 is the last commit of the first engine, which has no `rerank`; its `fast` has .862 in bullseye and .993 in nn
with mirror images.
"""

from __future__ import annotations

import argparse
import functools as ft
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import curvematch_jax as cm

from ._elsewhere import checkout, output_of
from ._measure import PRESETS, say, timed
from ._record import record

_FILE = "mpeg7_half.npz"
_FEW = 3  # outlines in the small call
_NEIGHBOURS = (4, 6, 8, 10, 12, 15)  # the k that are tried


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--presets", nargs="+", choices=list(PRESETS), default=["rigid", "fast"])
    parser.add_argument("--samples", type=int, default=100, metavar="N", help="of each outline, by arc length")
    parser.add_argument("--limit", type=int, metavar="N", help="the first N of each class alone")
    parser.add_argument("--baseline", metavar="COMMIT", help="whose package is measured as well")


def run(arguments: argparse.Namespace) -> None:
    curves, labels = outlines(arguments.folder / _FILE, arguments.samples, arguments.limit)
    results = report(curves, labels, arguments.presets)
    if arguments.baseline:
        say(f"the same with {arguments.baseline}")
        results["baseline"] = {"commit": arguments.baseline, "presets": measured_at(arguments.baseline, arguments)}
    record(arguments, results)


def measured_at(commit: str, arguments: argparse.Namespace) -> dict:
    """The presets of the package of another commit."""
    given = ["outlines", str(arguments.folder), "--samples", str(arguments.samples), "--presets", *arguments.presets]
    given += [] if arguments.limit is None else ["--limit", str(arguments.limit)]
    with checkout(commit) as package:
        return output_of("benchmarks", given, package)["presets"]


def outlines(path: Path, samples: int, limit: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Outlines `(c, 2, samples)` and their classes."""
    with np.load(path, allow_pickle=False) as data:
        curves, labels = data["curves"], data["labels"]
    if limit is not None:
        kept = np.sort(np.concatenate([np.flatnonzero(labels == label)[:limit] for label in np.unique(labels)]))
        curves, labels = curves[kept], labels[kept]
    return np.asarray(cm.resample(curves, samples)), labels


def report(curves: np.ndarray, labels: np.ndarray, presets: list[str]) -> dict:
    """Scores and times of each preset."""
    return {
        "outlines": len(curves),
        "classes": len(np.unique(labels)),
        "samples": curves.shape[-1],
        "bullseye_depth": "twice the members of the class, the query included",
        "presets": {name: scores(name, curves, labels) for name in presets},
    }


def scores(name: str, curves: np.ndarray, labels: np.ndarray) -> dict[str, dict[str, float]]:
    """Of one preset, without and with mirror images."""
    pairs = len(curves) * (len(curves) - 1) // 2
    rows, nearer = {}, np.zeros((0, 0))
    for kind, compare in (("plain", plain), ("mirrored", mirrored)):
        compare(curves[:_FEW], PRESETS[name])
        nearer, seconds = timed(ft.partial(compare, curves, PRESETS[name]))
        rows[kind] = rated(nearer, labels) | {"seconds": seconds, "pairs_per_second": pairs / seconds}
    if hasattr(cm, "rerank"):  # which the first engine came without
        rows["reranked"] = reranked(nearer, labels)
    for kind, row in rows.items():
        say(f"{name}, {kind}: bullseye {row['bullseye']:.3f}, nn {row['nn']:.3f}")
    return rows


def plain(curves: np.ndarray, aligner: cm.Aligner) -> np.ndarray:
    return cm.distance_matrix(curves, aligner=aligner)


def mirrored(curves: np.ndarray, aligner: Any) -> np.ndarray:
    """The smaller distances; the first engine has to compute two matrices for them."""
    if hasattr(aligner, "mirror"):
        return plain(curves, replace(aligner, mirror=True))
    return np.minimum(plain(curves, aligner), between(curves, images(curves), aligner))


def images(curves: np.ndarray) -> np.ndarray:
    """Reflections of planar curves `(c, 2, n)`, their samples in reverse: they keep the sense in which they run."""
    return (curves * np.array([[-1], [1]], curves.dtype))[..., ::-1]


def between(curves: np.ndarray, others: np.ndarray, aligner: cm.Aligner) -> np.ndarray:
    """Distances `(c, c)` of curves to the mirror images of others; a pair and its mirror image are computed once."""
    rows, columns = np.triu_indices(len(curves), 1)
    matrix = np.zeros((len(curves), len(curves)), curves.dtype)
    matrix[rows, columns] = cm.pair_distances(curves, others, np.stack([rows, columns], axis=1), aligner)
    return matrix + matrix.T


def rated(matrix: np.ndarray, labels: np.ndarray) -> dict[str, float]:
    found = cm.evaluate(matrix, labels)
    return {"bullseye": float(np.mean(hits(matrix, labels))), "nn": found.nn, "ft": found.ft}


def reranked(matrix: np.ndarray, labels: np.ndarray) -> dict[str, float]:
    """After diffusion with the k that is best for every other class alone; all outlines, and those of the `others`."""
    chosen = np.isin(labels, np.unique(labels)[::2])
    part = matrix[np.ix_(chosen, chosen)]
    k = max(_NEIGHBOURS, key=lambda k: np.mean(hits(cm.rerank(part, k), labels[chosen])))
    after = cm.rerank(matrix, k)
    return {"k": k, "others": float(np.mean(hits(after, labels)[~chosen]))} | rated(after, labels)


def hits(matrix: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """For each of a class of c, the share of the class among the 2c nearest, itself included."""
    nearest = matrix.astype(float)
    np.fill_diagonal(nearest, -np.inf)
    same = labels[np.argsort(nearest, axis=1, kind="stable")] == labels[:, None]
    return np.array([row[: 2 * row.sum()].sum() / row.sum() for row in same])
