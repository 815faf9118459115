"""Closed curves in files: CSV in long format, TPS, and NPZ."""

from __future__ import annotations

import csv
import os
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from ..elastic._check import as_framed
from ..elastic._curve import resample

CURVE_SUFFIXES = (".npz", ".csv", ".tps")
_AXES = ("x", "y", "z")


class NamedCurves(NamedTuple):
    """Attributes: closed curves, each `(d, n_i)`, and their names."""

    curves: list[np.ndarray]
    names: tuple[str, ...]

    def array(self, n: int | None = None) -> np.ndarray:
        """All as `(k, d, n)`; by arc length where their numbers of samples differ or n is another one."""
        counts = {curve.shape[1] for curve in self.curves}
        samples = max(counts) if n is None else n
        if counts == {samples}:
            return np.stack(self.curves)
        return np.stack([np.asarray(resample(curve, samples)) for curve in self.curves])


def write_curves(path: str | Path, curves: np.ndarray | Sequence, names: Sequence[str] | None = None) -> None:
    """Closed curves, `(k, d, n)` or a list of `(d, n_i)`, to a file; its suffix says the format.

    - `.npz`: `points (sum n_i, d)`, `counts (k,)`, `names (k,)`.
    - `.csv`: columns `curve,point,x,y[,z]`, a row for each sample.
    - `.tps`: `LM=n`, n lines `x y`, `ID=name` (`LM3=` and three numbers in R^3).

    Raises `ValueError` for another suffix, other than closed curves of one dimension, and names that are not one for
    each."""
    path = Path(path)
    listed = [_closed(f"curve {i}", curve) for i, curve in enumerate(curves)]
    names = [f"curve-{i}" for i in range(len(listed))] if names is None else [str(name) for name in names]
    if not listed or len(set(names)) != len(listed) or len({curve.shape[0] for curve in listed}) != 1:
        raise ValueError(f"{path}: give one curve or more, all of one dimension, and a name of its own for each.")
    if path.suffix.lower() not in CURVE_SUFFIXES:
        raise ValueError(f"{path}: not a format of curves; known are {', '.join(CURVE_SUFFIXES)}.")
    write = {".npz": _write_npz, ".csv": _write_csv, ".tps": _write_tps}[path.suffix.lower()]
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".curvematch-{os.getpid()}-") as folder:
        temporary = Path(folder) / path.name
        write(temporary, listed, names)
        temporary.replace(path)


def read_curves(path: str | Path) -> NamedCurves:
    """The closed curves of a file that `write_curves`, or another program, has written; nothing is unpickled.

    Raises `ValueError`, with the file's name, for what cannot be read.
    """
    path = Path(path)
    readers = {".npz": _read_npz, ".csv": _read_csv, ".tps": _read_tps}
    if path.suffix.lower() not in readers:
        raise ValueError(f"{path}: not a format of curves; known are {', '.join(CURVE_SUFFIXES)}.")
    try:
        curves, names = readers[path.suffix.lower()](path)
        curves = [_closed(f"curve {name!r}", curve) for curve, name in zip(curves, names, strict=True)]
    except (OSError, KeyError, IndexError, EOFError, UnicodeDecodeError, zipfile.BadZipFile, csv.Error) as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
        raise ValueError(f"{path}: cannot be read as curves ({reason}).") from None
    except ValueError as problem:
        raise ValueError(f"{path}: {problem}") from None
    if not curves:
        raise ValueError(f"{path}: holds no curve.")
    return NamedCurves(curves, tuple(names))


def _closed(name: str, curve: ArrayLike) -> np.ndarray:
    """A checked curve, without its repeated end point."""
    found = np.asarray(curve, float)
    if found.ndim != 2:
        raise ValueError(f"{name} has shape {found.shape}: give (d, n).")
    if found.shape[1] > 8 and np.array_equal(found[:, 0], found[:, -1]):
        found = found[:, :-1]
    as_framed(name, found)
    return found


def _write_npz(path: Path, curves: list[np.ndarray], names: list[str]) -> None:
    counts = np.array([curve.shape[1] for curve in curves])
    np.savez_compressed(path, points=np.concatenate(curves, axis=1).T, counts=counts, names=np.array(names))


def _read_npz(path: Path) -> tuple[list[np.ndarray], list[str]]:
    with np.load(path, allow_pickle=False) as data:
        if "curves" in data:
            curves = list(data["curves"])
        else:
            points, counts = data["points"], data["counts"]
            if points.ndim != 2 or counts.ndim != 1 or counts.sum() != len(points) or (counts < 1).any():
                raise ValueError("points and counts do not fit each other.")
            curves = [part.T for part in np.split(points, np.cumsum(counts)[:-1])]
        names = [str(name) for name in data["names"]] if "names" in data else [f"curve-{i}" for i in range(len(curves))]
    return curves, names


def _write_csv(path: Path, curves: list[np.ndarray], names: list[str]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["curve", "point", *_axes(len(curves[0]))])
        for name, curve in zip(names, curves, strict=True):
            rows.writerows([name, i, *(repr(float(x)) for x in point)] for i, point in enumerate(curve.T))


def _read_csv(path: Path) -> tuple[list[np.ndarray], list[str]]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.DictReader(file, skipinitialspace=True, strict=True)
        axes = [axis for axis in _AXES if axis in (rows.fieldnames or ())]
        if "curve" not in (rows.fieldnames or ()) or len(axes) < 2:
            raise ValueError("the first line has to name the columns curve,point,x,y or curve,point,x,y,z.")
        points: dict[str, list[list[float]]] = {}
        for row in rows:
            try:
                points.setdefault(row["curve"], []).append([float(row[axis]) for axis in axes])
            except (TypeError, ValueError):
                raise ValueError(f"line {rows.line_num} has no number for each of {', '.join(axes)}.") from None
    return [np.array(curve).T for curve in points.values()], list(points)


def _write_tps(path: Path, curves: list[np.ndarray], names: list[str]) -> None:
    with path.open("w", encoding="utf-8") as file:
        for name, curve in zip(names, curves, strict=True):
            file.write(f"LM{'3' if len(curve) == 3 else ''}={curve.shape[1]}\n")
            file.writelines(" ".join(repr(float(x)) for x in point) + "\n" for point in curve.T)
            file.write(f"ID={name}\n")


def _read_tps(path: Path) -> tuple[list[np.ndarray], list[str]]:
    curves: list[np.ndarray] = []
    names: list[str] = []
    lines = iter(path.read_text(encoding="utf-8-sig").splitlines())
    for line in lines:
        key, _, value = line.strip().partition("=")
        if key.upper() in ("LM", "LM3", "POINTS"):
            count = int(value)
            if not 0 < count <= 10**7:
                continue
            curves.append(np.array([[float(x) for x in next(lines, "").split()] for _ in range(count)]).T)
            names.append(f"curve-{len(curves) - 1}")
        elif key.upper() in ("ID", "IMAGE") and curves and value.strip():
            names[-1] = value.strip() if key.upper() == "ID" or names[-1].startswith("curve-") else names[-1]
    return curves, names


def _axes(d: int) -> list[str]:
    return list(_AXES[:d]) if d <= 3 else [f"x{i}" for i in range(d)]
