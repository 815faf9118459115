"""The work of `curvematch query`: a ranking, how long its stages took, and why it is as it is."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..extraction import extract_collection
from ..extraction._sources import find_meshes, is_parts
from ..pictures import check_picture, explanation_picture
from ..retrieval import Matching, Ranking, rank, run_settings
from ..surface import Mesh, MeshError, Parts, load_mesh
from ._commands import SOME_FAILED, report_failures
from ._output import Output, matches_table, ranking_rows, ranking_table

# Objects beside the query in a picture: as many as stay readable in one row.
_DRAWN = 5


@dataclasses.dataclass(frozen=True)
class Explanation:
    """Where `--explain` draws the matched parts, and the folder of `--meshes`."""

    picture: Path
    meshes: Path | None = None


@dataclasses.dataclass
class _Clock:
    """Seconds by stage, in the order of the stages."""

    seconds: dict[str, float] = dataclasses.field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        started = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - started


def run_query(
    query: Path,
    folder: Path,
    matching: Matching,
    top: int,
    explanation: Explanation | None,
    jobs: int,
    strict: bool,
    output: Output,
) -> int:
    """`curvematch query`: one mesh, or its parts, against a folder of parts."""
    if explanation is not None:
        check_picture(explanation.picture)
    clock = _Clock()
    with clock.stage("collection"):
        opened = extract_collection([folder], jobs=jobs)
    collection, failed = opened.parts, opened.failures
    report_failures(failed, len(collection), output)
    with clock.stage("query"):
        asked = extract_collection([query], collection[0].settings, jobs=jobs)
    found = asked.parts
    report_failures(asked.failures, len(found), output)
    files = _mesh_files(explanation, query, [*collection, found[0]])
    ranking = rank(found[0], collection, matching, output.progress, top=top)
    clock.seconds.update(ranking.seconds)
    for note in ranking.notes:
        output.note(note)
    if explanation is not None:
        with clock.stage("picture"):
            _draw(found[0], collection, ranking, explanation.picture, min(top, _DRAWN), files, output)
    output.note(", ".join(f"{name} {seconds:.2f} s" for name, seconds in clock.seconds.items()))
    output.result(
        _text(ranking, top, explanation),
        {
            "query": found[0].name,
            "results": ranking_rows(ranking, top, explained=explanation is not None),
            "objects": len(collection),
            "conflict": ranking.conflict,
            "unknown": ranking.unknown,
            "notes": list(ranking.notes),
            "failed": [dataclasses.asdict(failure) for failure in failed],
            "picture": None if explanation is None else str(explanation.picture),
            "seconds": clock.seconds,
            "settings": run_settings(collection[0].settings, matching),
        },
    )
    return SOME_FAILED if failed and strict else 0


def _text(ranking: Ranking, top: int, explanation: Explanation | None) -> str:
    """The result for people."""
    table = ranking_table(ranking, top)
    if explanation is None:
        return table
    return f"{table}\n\n{matches_table(ranking, top)}\n\nmatched parts in the same colours: {explanation.picture}"


def _mesh_files(explanation: Explanation | None, query: Path, objects: Sequence[Parts]) -> dict[int, Path]:
    """The mesh files, as far as they are known, by the indices of objects of which the query is the last.

    Raises:
        ValueError: when there is none at all in the folder that was given.
    """
    if explanation is None:
        return {}
    files: dict[int, Path] = {}
    if explanation.meshes is not None:
        named = find_meshes(explanation.meshes, [parts.name for parts in objects])
        files = {j: named[parts.name] for j, parts in enumerate(objects) if parts.name in named}
    return files if is_parts(query) else files | {len(objects) - 1: query}


def _draw(
    query: Parts,
    collection: Sequence[Parts],
    ranking: Ranking,
    picture: Path,
    top: int,
    files: Mapping[int, Path],
    output: Output,
) -> None:
    """The picture of `--explain`; a mesh file that cannot be read costs its own surface alone."""
    meshes: dict[int, Mesh] = {}
    for index in [len(collection), *ranking.order[:top].tolist()]:
        if index in files:
            try:
                meshes[index] = load_mesh(files[index])
            except MeshError as error:
                output.note(f"drawn without its surface: {error}")
    explanation_picture(query, collection, ranking, picture, top, meshes.pop(len(collection), None), meshes)
