"""The work of `curvematch report`: a matrix, and what is beside it, as one HTML file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .._words import counted
from ..datasets import match_labels, read_labels
from ..extraction import Failure
from ..extraction._sources import find_meshes, find_sources, is_parts
from ..report import report_page, write_report
from ..retrieval import Matching, SavedMatrix, StoredParts, first_difference, load_matrix
from ..surface import Mesh, MeshError, load_mesh
from ._output import Output


@dataclass
class MeshFiles(Mapping[str, Mesh]):
    """Mesh files by the names of objects, read when they are asked for; one that can't be read is not there."""

    files: Mapping[str, Path]
    failures: list[Failure] = field(default_factory=list)

    def __getitem__(self, name: str) -> Mesh:
        path = self.files[name]
        try:
            return load_mesh(path)
        except MeshError as error:
            self.failures.append(Failure(name, str(error)))
            raise KeyError(name) from error

    def __iter__(self) -> Iterator[str]:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)


def make_report(
    matrix: Path,
    out: Path,
    parts: Path | None,
    meshes: Path | None,
    labels: Path | None,
    presets: Sequence[Matching],
    output: Output,
) -> int:
    """`curvematch report`: what is not given is left out of the page, which says so.

    Args:
        presets: the matching of the matrix is looked for among them.
    """
    saved = load_matrix(matrix)
    surfaces = None if meshes is None else MeshFiles(find_meshes(meshes, saved.names))
    page = report_page(
        saved,
        labels=None if labels is None else match_labels(saved.names, read_labels(labels), labels),
        parts=None if parts is None else _parts_of(saved, parts),
        meshes=surfaces,
        matching=Matching() if parts is None else _matching_of(saved, matrix, presets),
        title=f"Retrieval report: {matrix.name}",
        progress=output.progress,
    )
    write_report(page, out)
    failures = [] if surfaces is None else surfaces.failures
    output.failures(failures)
    megabytes = out.stat().st_size / 1e6
    output.result(
        f"{counted(len(saved.names), 'object')}: report in {out} ({megabytes:.1f} MB)",
        {
            "out": str(out),
            "objects": len(saved.names),
            "bytes": out.stat().st_size,
            "failed": [{"name": failure.name, "reason": failure.reason} for failure in failures],
        },
    )
    return 0


def _parts_of(saved: SavedMatrix, folder: Path) -> StoredParts:
    """The parts of the matrix's objects, in its order."""
    files = {source.name: source.path for source in find_sources([folder]) if is_parts(source.path)}
    lacking = [name for name in saved.names if name not in files]
    if lacking:
        raise ValueError(
            f"{folder} has no parts of {len(lacking)} of {len(saved.names)} objects, such as {lacking[0]}: "
            "give the folder of parts that the matrix was made of"
        )
    return StoredParts([files[name] for name in saved.names], saved.names)


def _matching_of(saved: SavedMatrix, matrix: Path, presets: Sequence[Matching]) -> Matching:
    """The preset that the matrix was made with."""
    for matching in presets:
        if first_difference(saved.settings.get("matching", {}), matching) is None:
            return matching
    raise ValueError(
        f"{matrix} was made with the settings of no preset, so its matches can't be made again: leave out --parts, or "
        "call curvematch_jax.report.report_page with its matching"
    )
