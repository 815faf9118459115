"""Collections on disk that are mapped into memory: a folder of plain arrays that grow at their end.

`index.json` says what there is: names, settings, the cohort, and of each array its type, the shape of a row and how
many rows count. An array is a file of its rows, one after the other, in this order of bytes on any machine: little
end first. What is added is written behind the rows that count; then `index.json` is replaced, and not before: what a
stopped process has left behind the rows is no part of the index, and goes when something is added.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._files import because, locked, remove_leftovers, replacing, short, vacant, writing
from .._progress import Progress
from ..elastic import Tables
from ..elastic._rigid import RigidTable
from ..surface import Extraction, Parts
from ._cohort import LEAST, Cohort
from ._collection import Collection
from ._matching import DEFAULT, Matching
from ._objects import Objects, places
from ._settings import require_same, run_settings
from ._stack import Stack

INDEX_FORMAT = 2
_TABLE = "index.json"
_COHORT = ("members", "floor", "mean", "deviation", "weight")


def is_index(path: str | os.PathLike[str]) -> bool:
    """Whether there is an index at a path, whole or not."""
    return (Path(path) / _TABLE).is_file()


def build_index(
    parts: Sequence[Parts],
    path: str | os.PathLike[str],
    matching: Matching = DEFAULT,
    progress: Progress = False,
) -> int:
    """Write an index of a collection, or add new objects to one; `Collection.open` maps it into memory.

    Args:
        parts: M objects, extracted with the same settings, among them all that are in the index already; a lazy
            sequence, such as `StoredParts`, is read one by one.
        matching: that of the queries.
        progress: `True` for a bar on stderr, or a function of `(done, total)` objects compared with the cohort.

    Returns:
        how many objects are new.

    Raises:
        ValueError: when there is something else at `path`, the index was made of other objects or with other settings,
            naming the first difference, is in use, or cannot be written to.
    """
    path = Path(path)
    with locked(path):
        if not is_index(path):
            found = Collection.of(parts, matching, progress)
            _write(found, path)
            return len(found.names)
        there = read_index(path, matching)
        objects = Objects.of(parts, dataclasses.replace(matching, witnesses=()))
        _, added = places(path, there.names, there.objects.fingerprints, objects)
        new = [parts[k] for k in added]
        if new and there.cohort is not None and len(there.cohort.members) < LEAST:  # It grows, and all depends on it.
            _write(there.added(new, progress), path)
        elif new:
            remove_leftovers(path)
            with writing(path):
                _append(path, _read_table(path), there.judging(new, progress))
        return len(new)


def write_index(collection: Collection, path: str | os.PathLike[str]) -> None:
    """A new index; raises as `Collection.save`."""
    with locked(Path(path)):
        _write(collection, Path(path))


def _write(collection: Collection, path: Path) -> None:
    if not vacant(path) and not is_index(path):
        raise ValueError(f"{path}: is not an index: choose another place")
    with writing(path), replacing(path) as temporary:
        temporary.mkdir()
        _append(temporary, None, collection)


def read_index(path: str | os.PathLike[str], matching: Matching) -> Collection:
    """An index mapped into memory; raises as `Collection.open`."""
    path = Path(path)
    table = _read_table(path)
    what = (f"{path}: the index was made", "and is asked for")
    remedy = "use the preset that it was made with, or build another one"
    require_same(table["settings"]["matching"], matching, what, remedy)
    try:
        return _collection(path, table, matching)
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise ValueError(f"{path}: the index is damaged ({short(error)}): build it again") from error


def _read_table(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such index")
    try:
        table = json.loads((path / _TABLE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not a curvematch index{because(error)}") from error
    if not isinstance(table, dict) or "curvematch_index" not in table:
        raise ValueError(f"{path}: not a curvematch index")
    if table["curvematch_index"] != INDEX_FORMAT:
        found = table["curvematch_index"]
        raise ValueError(f"{path}: an index of format {found}, and this version reads {INDEX_FORMAT}: build it again")
    wanted = {"names": list, "fingerprints": list, "settings": dict, "arrays": dict}
    for name, kind in wanted.items():
        if not isinstance(table.get(name), kind):
            raise ValueError(f"{path}: the index is damaged: its {name} are something else")
    return table


def _append(folder: Path, table: dict[str, Any] | None, new: Collection) -> None:
    """Write objects behind those that the table says are there, and the table last."""
    known, arrays = table["arrays"] if table else {}, {}
    curves = known.get("keys", known.get("curves", {"count": 0}))["count"]
    for name, rows in _arrays(new, curves).items():
        there = known.get(name, {"count": 0})["count"]
        kept = {"dtype": rows.dtype.str, "shape": list(rows.shape[1:]), "count": there + len(rows)}
        if there and any(known[name][key] != kept[key] for key in ("dtype", "shape")):
            raise ValueError(f"{folder}: the {name} of the objects have another size: build another index")
        with (folder / f"{name}.bin").open("ab") as file:
            file.truncate(there * _row_bytes(kept))
            file.write(rows.tobytes())
            file.flush()
            os.fsync(file.fileno())
        arrays[name] = kept
    written = {
        "curvematch_index": INDEX_FORMAT,
        "settings": run_settings(new.objects.extraction, new.matching),
        "cohort": None if new.cohort is None else {name: getattr(new.cohort, name).tolist() for name in _COHORT},
        "dimension": new.stack.curves.dimension if isinstance(new.stack.curves, Tables) else None,
        "arrays": arrays,
        "names": [*(table["names"] if table else ()), *new.objects.names],
        "fingerprints": [*(table["fingerprints"] if table else ()), *new.objects.fingerprints],
    }
    with replacing(folder / _TABLE) as temporary:
        temporary.write_text(json.dumps(written), encoding="utf-8")


def _arrays(new: Collection, curves: int) -> dict[str, np.ndarray]:
    """The rows of every array; `curves` are there already."""
    stack = new.stack
    arrays: dict[str, np.ndarray] = {
        "sizes": np.diff(stack.starts),
        "rows": np.where(stack.rows >= 0, stack.rows + curves, -1).astype(np.int32),
        "log_lengths": stack.log_lengths,
        "log_level_sets": stack.log_level_sets,
        "log_units": stack.log_units,
        "areas": new.objects.areas,
    }
    if isinstance(stack.curves, Tables):
        arrays |= {"tangents": stack.curves.curves.tangents, "keys": stack.curves.keys}
    else:
        arrays["curves"] = stack.curves
    if new.signatures is not None:
        arrays["signatures"] = new.signatures
    if new.moments is not None:
        arrays["moments"] = np.moveaxis(new.moments, 1, 0)
    arrays |= {f"witness_{name}": rows for name, rows in new.objects.descriptors.items()}
    little = {name: np.ascontiguousarray(rows) for name, rows in arrays.items()}
    return {name: rows.astype(rows.dtype.newbyteorder("<"), copy=False) for name, rows in little.items()}


def _collection(path: Path, table: Mapping[str, Any], matching: Matching) -> Collection:
    arrays = {name: _mapped(path, name, entry) for name, entry in table["arrays"].items()}
    starts = np.concatenate([[0], np.cumsum(arrays["sizes"])])
    if "tangents" in arrays:
        tangents: Any = arrays["tangents"]
        rigid = RigidTable(tangents, None)
        curves: Any = Tables(rigid, arrays["keys"], int(table["dimension"]), matching.aligner)
    else:
        curves = arrays["curves"]
    rows = arrays["rows"]
    if len(rows) != starts[-1] or rows.max(initial=-1) >= len(curves) or (arrays["sizes"] < 0).any():
        raise ValueError("its arrays do not fit each other")
    if not len(arrays["sizes"]) == len(table["names"]) == len(table["fingerprints"]):
        raise ValueError("it has not as many names as objects")
    kept, cohort = table["cohort"], None
    if kept is not None:
        cohort = Cohort(*(np.array(kept[name], np.int64 if name == "members" else np.float64) for name in _COHORT))
    objects = Objects(
        extraction=Extraction(**table["settings"]["extraction"]),
        names=tuple(table["names"]),
        fingerprints=tuple(table["fingerprints"]),
        areas=arrays["areas"],
        counts=np.asarray(arrays["sizes"]),
        descriptors={witness.name: arrays[f"witness_{witness.name}"] for witness in matching.witnesses},
    )
    return Collection(
        objects=objects,
        stack=Stack(curves, rows, arrays["log_lengths"], arrays["log_level_sets"], arrays["log_units"], starts),
        signatures=arrays.get("signatures"),
        matching=matching,
        cohort=cohort,
        moments=np.moveaxis(arrays["moments"], 0, 1) if "moments" in arrays else None,
    )


def _mapped(path: Path, name: str, entry: Mapping[str, Any]) -> np.ndarray:
    """The rows that count, mapped for reading."""
    file, shape = path / f"{name}.bin", (int(entry["count"]), *(int(size) for size in entry["shape"]))
    dtype = np.dtype(entry["dtype"])
    if dtype.kind not in "fi" or min(shape) < 0 or file.stat().st_size < shape[0] * _row_bytes(entry):
        raise ValueError(f"{name} is not what the index says")
    if 0 in shape:
        return np.zeros(shape, dtype)
    return np.asarray(np.memmap(file, dtype, "r", shape=shape))


def _row_bytes(entry: Mapping[str, Any]) -> int:
    return np.dtype(entry["dtype"]).itemsize * int(np.prod(entry["shape"], dtype=object))
