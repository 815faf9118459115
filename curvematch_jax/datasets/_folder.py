"""Labelled collections of mesh files: a folder with `labels.csv`, or a folder per class."""

import csv
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path

from .._files import IMAGE_SUFFIXES

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
    return [(folder / name, label) for name, label in _labels_of(names, labels, label_file, "meshes").items()]


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

    Suffixes of meshes and images may be missing on one side: `cat0` labels `cat0.off`, and `leaf.png` labels `leaf`,
    where no other name or label fits.

    `source` is what messages call the labels, and `what` the things that have the names.

    Raises:
        ValueError: names without a label, or labels without a name; the first few are listed.
    """
    found = _labels_of(names, labels, source, what)
    return [found[name] for name in names]


def _labels_of(names: Sequence[str], labels: dict[str, str], source: str | Path, what: str) -> dict[str, str]:
    """The classes by names, in the order of the labels; raises as `match_labels`."""
    fitting = _fitting(names, labels)
    claims = Counter(name for fits in fitting.values() for name in fits)
    named = {label: fits[0] for label, fits in fitting.items() if len(fits) == 1 and claims[fits[0]] == 1}
    there = set(named.values())
    without_label = [name for name in names if name not in there]
    without_name = [label for label, fits in fitting.items() if not fits]
    unclear = [label for label, fits in fitting.items() if fits and label not in named]
    problems = []
    if without_label:
        problems.append(f"it has no class for {len(without_label)} of {len(names)} {what} ({_listed(without_label)})")
    if without_name:
        problems.append(f"it labels {len(without_name)} that are not there ({_listed(without_name)})")
    if unclear:
        problems.append(f"{len(unclear)} of its labels fit no name alone ({_listed(unclear)})")
    if problems:
        raise ValueError(f"{source} does not fit the {what}: {' and '.join(problems)}")
    return {name: labels[label] for label, name in named.items()}


def _fitting(names: Sequence[str], labels: Iterable[str]) -> dict[str, list[str]]:
    """The names that each label fits: itself, or else those without a label that differ by a suffix alone."""
    known = set(names)
    free = known.difference(labels)
    by_stem: defaultdict[str, list[str]] = defaultdict(list)
    for name in free:
        by_stem[_stem(name)].append(name)
    return {
        label: [label] if label in known else by_stem.get(label, []) + [s for s in (_stem(label),) if s in free]
        for label in labels
    }


def _stem(name: str) -> str:
    """A name without the suffix of a mesh or an image."""
    suffix = Path(name).suffix
    return name.removesuffix(suffix) if suffix.lower() in (*MESH_SUFFIXES, *IMAGE_SUFFIXES) else name


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
