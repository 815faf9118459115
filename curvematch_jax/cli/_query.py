"""The work of `curvematch query`: a ranking, how long its stages took, and why it is as it is."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from .._progress import Progress
from .._words import counted
from ..extraction import Failure, extract_collection
from ..extraction._sources import find_meshes, is_parts
from ..pictures import check_picture, explanation_picture
from ..retrieval import RERANKED, Collection, Matching, Ranking, is_index, rank, reranked, run_settings
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


@dataclasses.dataclass(frozen=True)
class Question:
    """What is asked of the collection."""

    matching: Matching
    top: int
    exclude_self: bool = False
    rerank: bool = False

    def ranked(self, query: Parts, collection: Collection, progress: Progress) -> Ranking:
        top = max(self.top, RERANKED) if self.rerank else self.top
        ranking = rank(query, collection, self.matching, progress, top, self.exclude_self)
        return reranked(collection, ranking) if self.rerank else ranking


def run_query(
    queries: Sequence[Path],
    place: Path,
    question: Question,
    explanation: Explanation | None,
    jobs: int,
    strict: bool,
    output: Output,
) -> int:
    """`curvematch query`: meshes, or their parts, against an index or a folder of parts."""
    if explanation is not None:
        check_picture(explanation.picture)
    clock = _Clock()
    with clock.stage("collection"):
        collection, parts, failed = _opened(place, question.matching, explanation, jobs, output)
    with clock.stage("query"):
        asked = extract_collection(queries, collection.objects.extraction, jobs=jobs)
    found, unusable = asked.parts, asked.failures
    report_failures(unusable, len(found), output)
    files = _mesh_files(explanation, queries[0], [*collection.names, found[0].name])
    answers, texts = [], []
    for query in found:
        ranking = question.ranked(query, collection, output.progress)
        for name, seconds in ranking.seconds.items():
            clock.seconds[name] = clock.seconds.get(name, 0.0) + seconds
        for note in ranking.notes:
            output.note(note)
        if explanation is not None:
            with clock.stage("picture"):
                _draw(query, parts, ranking, explanation.picture, min(question.top, _DRAWN), files, output)
        answers.append(_answer(query, ranking, question.top, explanation))
        texts.append(_text(ranking, question.top, explanation))
    output.note(", ".join(f"{name} {seconds:.2f} s" for name, seconds in clock.seconds.items()))
    if len(found) > 1:
        texts = [f"{query.name}\n{text}" for query, text in zip(found, texts, strict=True)]
    facts = {
        "objects": len(collection.names),
        "failed": [dataclasses.asdict(failure) for failure in (*failed, *unusable)],
        "picture": None if explanation is None else str(explanation.picture),
        "reranked": question.rerank,
        "seconds": clock.seconds,
        "settings": run_settings(collection.objects.extraction, question.matching),
    }
    output.result("\n\n".join(texts), (answers[0] if len(queries) == 1 else {"queries": answers}) | facts)
    return SOME_FAILED if (failed or unusable) and strict else 0


def _opened(
    place: Path, matching: Matching, explanation: Explanation | None, jobs: int, output: Output
) -> tuple[Collection, list[Parts], list[Failure]]:
    """The collection, its parts where there are such, and what could not be read."""
    if is_index(place):
        if explanation is not None:
            raise ValueError(
                f"{place}: an index holds no surfaces to draw: --explain needs --in with a folder of parts"
            )
        return Collection.open(place, matching), [], []
    read = extract_collection([place], jobs=jobs, progress=output.progress)
    report_failures(read.failures, len(read.parts), output)
    if read.computed:
        meshes = counted(read.computed, "mesh", "meshes")
        output.note(f"cut {meshes} into parts for this query alone: `curvematch parts {place}` keeps them")
    return Collection.of(read.parts, matching, output.progress), list(read.parts), list(read.failures)


def _answer(query: Parts, ranking: Ranking, top: int, explanation: Explanation | None) -> dict[str, object]:
    """What JSON says of one query."""
    return {
        "query": query.name,
        "results": ranking_rows(ranking, top, explained=explanation is not None),
        "conflict": ranking.conflict,
        "ignorance": ranking.ignorance,
        "notes": list(ranking.notes),
    }


def _text(ranking: Ranking, top: int, explanation: Explanation | None) -> str:
    """The result for people."""
    table = ranking_table(ranking, top)
    if explanation is None:
        return table
    return f"{table}\n\n{matches_table(ranking, top)}\n\nmatched parts in the same colours: {explanation.picture}"


def _mesh_files(explanation: Explanation | None, query: Path, names: Sequence[str]) -> dict[int, Path]:
    """The mesh files, as far as they are known, by the indices of objects of which the query is the last.

    Raises:
        ValueError: when there is none at all in the folder that was given.
    """
    if explanation is None:
        return {}
    files: dict[int, Path] = {}
    if explanation.meshes is not None:
        named = find_meshes(explanation.meshes, names)
        files = {j: named[name] for j, name in enumerate(names) if name in named}
    return files if is_parts(query) else files | {len(names) - 1: query}


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
