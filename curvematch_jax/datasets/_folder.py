"""Labelled collections of mesh files: a folder with `labels.csv`, or a folder per class."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

MESH_SUFFIXES = (".off", ".obj", ".ply", ".stl", ".glb", ".gltf")

_LABEL_FILE = "labels.csv"
_LISTED = 5


def labelled_folder(path: str | Path) -> list[tuple[Path, str]]:
    """The mesh files of a labelled folder, each with its class.

    Args:
        path: a folder with meshes and `labels.csv` (header `file,class`; files relative to the folder), in which case
            the order is that of the label file; or a folder with one folder of meshes per class, in which case the
            order is by class, then by name. Names that begin with a dot are passed over.

    Returns:
        `(file, class)` pairs, the files as paths that begin with `path`.

    Raises:
        ValueError: no folder, no meshes, a label file that cannot be used or does not name exactly the meshes there
            are, or meshes outside of every class folder. The message lists the first few.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise ValueError(
            f"{folder} is not a folder: give one with meshes and {_LABEL_FILE}, or with a folder per class"
        )
    meshes = [p.relative_to(folder) for p in sorted(folder.rglob("*")) if _is_mesh(p, folder)]
    if not meshes:
        raise ValueError(f"{folder} holds no meshes ({', '.join(MESH_SUFFIXES)})")
    label_file = folder / _LABEL_FILE
    if not label_file.exists():
        return [(folder / mesh, _class_folder(mesh, meshes, folder)) for mesh in meshes]
    labels = read_labels(label_file)
    names = [mesh.as_posix() for mesh in meshes]
    match_labels(names, labels, label_file)
    return [(folder / name, label) for name, label in labels.items()]


def read_labels(path: str | Path) -> dict[str, str]:
    """The `file,class` columns of a label file, in its order; other columns are ignored.

    Raises:
        ValueError: a file that is not readable CSV text with those columns, a row without a file or a class, a file
            named twice, or no row at all.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise ValueError(f"cannot read the label file {path}: {reason}") from error
    reader = csv.DictReader(lines, skipinitialspace=True, strict=True)
    labels: dict[str, str] = {}
    try:
        if not {"file", "class"} <= set(reader.fieldnames or ()):
            found = ",".join(reader.fieldnames or ()) or "nothing"
            raise ValueError(f"{path}: the first line must name the columns file,class; it has {found}")
        for row in reader:
            name, label = (row["file"] or "").strip(), (row["class"] or "").strip()
            if not name or not label:
                raise ValueError(f"{path}, line {reader.line_num}: a row needs a file and a class")
            if name in labels:
                raise ValueError(f"{path}, line {reader.line_num}: {name} is named twice")
            labels[name] = label
    except csv.Error as error:
        raise ValueError(f"{path}, line {reader.line_num}: not readable as CSV ({error})") from error
    if not labels:
        raise ValueError(f"{path} labels nothing: add a line file,class for each mesh")
    return labels


def match_labels(names: Sequence[str], labels: dict[str, str], source: str | Path, what: str = "meshes") -> list[str]:
    """The class of each name, from labels that name them all and nothing else.

    `source` is what messages call the labels, and `what` the things that have the names.

    Raises:
        ValueError: names without a label, or labels without a name; the first few are listed.
    """
    known = set(names)
    without_label = [name for name in names if name not in labels]
    without_name = [name for name in labels if name not in known]
    problems = []
    if without_label:
        problems.append(f"it has no class for {len(without_label)} of {len(names)} {what} ({_listed(without_label)})")
    if without_name:
        problems.append(f"it labels {len(without_name)} that are not there ({_listed(without_name)})")
    if problems:
        raise ValueError(f"{source} does not fit the {what}: {' and '.join(problems)}")
    return [labels[name] for name in names]


def _is_mesh(path: Path, folder: Path) -> bool:
    hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
    return path.suffix.lower() in MESH_SUFFIXES and not hidden and path.is_file()


def _class_folder(mesh: Path, meshes: Iterable[Path], folder: Path) -> str:
    if len(mesh.parts) > 1:
        return mesh.parts[0]
    loose = [m.name for m in meshes if len(m.parts) == 1]
    raise ValueError(
        f"{folder} has no {_LABEL_FILE}, and {len(loose)} meshes are in no class folder ({_listed(loose)}): "
        f"add {_LABEL_FILE} with the columns file,class, or put each mesh into a folder named after its class"
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
