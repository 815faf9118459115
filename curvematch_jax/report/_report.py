"""From a matrix, and what is known of its objects, to the report."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from .._files import replacing, writing
from .._progress import Progress
from ..pictures._colours import PALETTE, UNMATCHED
from ..retrieval import Matching, SavedMatrix, evaluate, require_same
from ..retrieval._matching import DEFAULT
from ..surface import Mesh, Parts
from ._limits import Limits
from ._matrix import packed_matrix
from ._packed import packed
from ._page import page
from ._pairs import explained
from ._rankings import Rankings, rankings
from ._scores import measures_table, precision_recall
from ._surfaces import packed_surface

_LIMITS = Limits()


def report_page(
    saved: SavedMatrix,
    labels: Sequence[str] | None = None,
    parts: Sequence[Parts] | None = None,
    meshes: Mapping[str, Mesh] | None = None,
    matching: Matching = DEFAULT,
    title: str = "Retrieval report",
    limits: Limits = _LIMITS,
    progress: Progress = False,
) -> str:
    """The report as HTML: one page that needs no other file and no network.

    What is not given is left out, and the page says so: without `labels` the measures and the classes, without `parts`
    the matches and beliefs, without `meshes` the surfaces.

    Args:
        saved: the dissimilarity matrix of M objects, as `load_matrix` returns it.
        labels: (M,) classes. Objects of a class come together, classes in alphabetical order.
        parts: (M,) of the objects, in the matrix's order; `StoredParts` reads them one by one from files.
        meshes: surfaces by names of objects, in the units of the parts. Any may be missing. Only those that the page
            shows are looked up.
        matching: with which the matrix was made; of no account without `parts`.
        title: of the page.
        limits: how much of a large collection is shown.
        progress: `True` for bars on stderr, or a function of `(done, total)`.

    Raises:
        ValueError: when labels or parts do not fit the matrix, the matrix was made with other settings than those of
            `parts` and `matching`, or no class has two members.
        ImportError: for a mesh that needs decimation, without fast-simplification (the extra `prep`).
    """
    matrix, count = np.asarray(saved.dissimilarity, float), len(saved.names)
    if matrix.shape != (count, count) or count < 2 or not np.isfinite(matrix).all():
        raise ValueError(f"a report needs finite dissimilarities (M, M) of M > 1 objects, found {matrix.shape}")
    _check(saved, labels, parts, matching)
    classes = [""] * count if labels is None else [str(label) for label in labels]
    order = np.argsort(np.asarray(classes), kind="stable")
    found = rankings(matrix, order, limits)
    surfaces = _surfaces(saved.names, parts, meshes, found.drawn(limits.surfaces), limits.vertices)
    names, of = np.unique(classes, return_inverse=True)
    data = {
        "names": list(saved.names),
        "classes": names.tolist() if labels is not None else [],
        "classOf": packed(of, "u4"),
        "order": packed(order, "u4"),
        "matrix": packed_matrix(matrix[np.ix_(order, order)], limits.cells),
        "rankings": found.packed(),
        "explained": {} if parts is None else explained(parts, found.explained, matching, progress),
        "surfaces": surfaces,
        "palette": [*PALETTE, UNMATCHED],
    }
    scores = None if labels is None else evaluate(matrix, classes)
    return page(
        title,
        f"{count} objects" if labels is None else f"{count} objects in {len(names)} classes",
        "" if scores is None else measures_table(scores),
        "" if scores is None else precision_recall(scores),
        [*_left_out(found, count, limits, surfaces), *_missing(labels, parts, meshes), *saved.notes],
        saved.settings,
        data,
    )


def write_report(page: str, path: str | os.PathLike[str]) -> None:
    """Write a report; it takes the place of a file that is there once it is whole.

    Raises:
        ValueError: when there is a folder at `path`, or it cannot be written to.
    """
    path = Path(path)
    if path.is_dir():
        raise ValueError(f"{path}: a folder, and a report is one file")
    with writing(path), replacing(path) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="replace")


def _check(saved: SavedMatrix, labels: Sequence[str] | None, parts: Sequence[Parts] | None, matching: Matching) -> None:
    for what, given in (("labels", labels), ("parts", parts)):
        if given is not None and len(given) != len(saved.names):
            raise ValueError(
                f"the matrix has {len(saved.names)} objects, and {what} of {len(given)} were given: one each is needed"
            )
    if parts is None:
        return
    for what, given in (("matching", matching), ("extraction", parts[0].settings)):
        words = ("the matrix was made", "and its parts are to be matched")
        remedy = "give the settings and the parts that it was made with"
        require_same(saved.settings.get(what, given), given, words, remedy)


def _surfaces(
    names: Sequence[str],
    parts: Sequence[Parts] | None,
    meshes: Mapping[str, Mesh] | None,
    drawn: Sequence[int],
    vertices: int,
) -> dict[str, dict[str, object]]:
    """What is drawn of objects, by their indices; one object is held at a time."""
    found = {}
    for j in drawn:
        own, mesh = None if parts is None else parts[j], None if meshes is None else meshes.get(names[j])
        if mesh is not None or (own is not None and len(own.areas)):
            found[str(j)] = packed_surface(own, mesh, vertices)
    return found


def _missing(labels: object, parts: object, meshes: object) -> list[str]:
    """What was not given, and what the page lacks for it."""
    lacks = {
        "No classes were given: there are no measures, and objects are in the matrix's order.": labels,
        "No parts were given: there are no matched parts, and no beliefs.": parts,
        "No meshes were given: objects are drawn as their level curves, or not at all.": meshes,
    }
    return [sentence for sentence, given in lacks.items() if given is None]


def _left_out(found: Rankings, count: int, limits: Limits, surfaces: Mapping[str, Mapping[str, object]]) -> list[str]:
    """What the limits left out."""
    queries, ranked = found.ranked.shape
    sentences = []
    if count > limits.cells:
        sentences.append(
            f"The matrix of {count} objects is drawn with {limits.cells} cells a side: each is the mean of a block."
        )
    sentences.append("The matrix has 256 steps of colour; values under the pointer are rounded to them.")
    if queries < count:
        sentences.append(f"Rankings of {queries} of {count} queries are listed, evenly spread over the classes.")
    if ranked < count - 1:
        sentences.append(f"A ranking lists the first {ranked} of {count - 1} objects.")
    if surfaces:
        pairs = len(next(iter(found.explained.values())))
        sentences += [
            f"{len(found.explained)} of {count} queries are set beside the first {pairs} of their ranking.",
            f"{len(surfaces)} of {count} objects are drawn, decimated to about {limits.vertices} vertices and rounded "
            "to 1/65,535 of their size; level curves are thinned.",
        ]
    bare = sum(not surface["faces"] for surface in surfaces.values())
    if bare:
        sentences.append(f"{bare} of those drawn have no mesh here: they are drawn as level curves.")
    return sentences
