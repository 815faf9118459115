"""Closed curves in files: CSV in long format, TPS, and NPZ."""

from __future__ import annotations

import csv
import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from .._files import replacing
from ..elastic._check import as_framed
from ..elastic._curve import resample

CURVE_SUFFIXES = (".npz", ".csv", ".tps")
_AXES = ("x", "y", "z")
_ARRAYS = ("curves", "points", "counts", "names")
_MOST_BYTES = 2**32  # of an NPZ file, unpacked
# What zipfile, numpy and csv raise at damaged files; the last one is of headers that are no Python.
_UNREADABLE = (
    *(OSError, LookupError, EOFError, UnicodeDecodeError, NotImplementedError, RuntimeError, SyntaxError),
    *(zipfile.BadZipFile, zlib.error, csv.Error, tokenize.TokenError),
)


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


def write_curves(path: str | Path, curves: ArrayLike | Sequence, names: Sequence[str] | None = None) -> None:
    """Closed curves, `(k, d, n)`, a list of `(d, n_i)`, or one `(d, n)`, to a file; its suffix says the format.

    - `.npz`: `points (sum n_i, d)`, `counts (k,)`, `names (k,)`.
    - `.csv`: columns `curve,point,x,y[,z]`, or `curve,point,x0,x1,...` for d > 3, a row for each sample.
    - `.tps`: `LM=n`, n lines `x y`, `ID=name` (`LM3=` and three numbers in R^3).

    Raises `ValueError` for another suffix, other than closed curves of one dimension, and names that are not one for
    each or would not come back: empty, with spaces at their ends, or with signs that do not print."""
    path = Path(path)
    several: Any = curves
    if len(several) and np.ndim(several[0]) == 1:
        several = [several]
    listed = [_closed(f"curve {i}", curve) for i, curve in enumerate(several)]
    names = [f"curve-{i}" for i in range(len(listed))] if names is None else [str(name) for name in names]
    if not listed or len(set(names)) != len(listed) or len({curve.shape[0] for curve in listed}) != 1:
        raise ValueError(f"{path}: give one curve or more, all of one dimension, and a name of its own for each.")
    unfit = [name for name in names if not name or name != name.strip() or not name.isprintable()]
    if unfit:
        raise ValueError(
            f"{path}: the name {unfit[0]!r} is empty, or has spaces at its ends or signs that do not print."
        )
    if path.suffix.lower() not in CURVE_SUFFIXES:
        raise ValueError(f"{path}: not a format of curves; known are {', '.join(CURVE_SUFFIXES)}.")
    write = {".npz": _write_npz, ".csv": _write_csv, ".tps": _write_tps}[path.suffix.lower()]
    with replacing(path) as temporary:
        write(temporary, listed, names)


def read_curves(path: str | Path) -> NamedCurves:
    """The closed curves of a file that `write_curves`, or another program, has written; nothing is unpickled.

    Raises `ValueError`, with the file's name, for what cannot be read.
    """
    path = Path(path)
    readers = {".npz": _read_npz, ".csv": _read_csv, ".tps": _read_tps}
    if path.is_dir():
        raise ValueError(
            f"{path}: is a folder: give one file of curves ({', '.join(CURVE_SUFFIXES)}), which `curvematch outlines` "
            "makes of images."
        )
    if not path.exists():
        raise ValueError(f"{path}: no such file.")
    if path.suffix.lower() not in readers:
        raise ValueError(f"{path}: not a format of curves; known are {', '.join(CURVE_SUFFIXES)}.")
    try:
        curves, names = readers[path.suffix.lower()](path)
        curves = [_closed(f"curve {name!r}", curve) for curve, name in zip(curves, names, strict=True)]
    except _UNREADABLE as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
        raise ValueError(f"{path}: cannot be read as curves ({reason}).") from None
    except ValueError as problem:
        raise ValueError(f"{path}: {problem}") from None
    if not curves:
        raise ValueError(f"{path}: holds no curve.")
    return NamedCurves(curves, tuple(names))


def _closed(name: str, curve: ArrayLike) -> np.ndarray:
    """A checked curve, without its repeated end point."""
    if np.ma.is_masked(curve) or np.iscomplexobj(curve):
        raise ValueError(f"{name} hides samples, or is complex: give real numbers without gaps.")
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
    data = _arrays(path)
    if "curves" in data:
        curves = [np.asarray(curve) for curve in np.atleast_1d(data["curves"])]
    else:
        points, counts = data["points"], data["counts"]
        fit = points.ndim == 2 and counts.ndim == 1 and counts.dtype.kind in "iu" and (counts > 0).all()
        if not fit or sum(counts.tolist()) != len(points):
            raise ValueError("points and counts do not fit each other.")
        curves = [part.T for part in np.split(points, np.cumsum(counts)[:-1])]
    names = [str(name) for name in data["names"]] if "names" in data else [f"curve-{i}" for i in range(len(curves))]
    if len(names) != len(curves):
        raise ValueError(f"there are {len(names)} names for {len(curves)} curves.")
    return curves, names


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """What curves are read from in an NPZ file; headers that claim more than the file holds are refused."""
    with zipfile.ZipFile(path) as archive:
        members = [each for each in archive.infolist() if each.filename.removesuffix(".npy") in _ARRAYS]
        if sum(each.file_size for each in members) > _MOST_BYTES:
            raise ValueError(f"it unpacks to more than {_MOST_BYTES >> 30} GiB.")
        named = [(each.filename.removesuffix(".npy"), archive.read(each)) for each in members]
    return {name: _array(data, "US" if name == "names" else "biuf") for name, data in named}


def _array(data: bytes, kinds: str) -> np.ndarray:
    file = io.BytesIO(data)
    read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, by_columns, dtype = read_header[np.lib.format.read_magic(file)](file)
    if dtype.kind not in kinds or math.prod(shape) * dtype.itemsize != len(data) - file.tell():
        raise ValueError("an array in it is damaged, or holds other things than numbers and names.")
    return np.frombuffer(data, dtype, offset=file.tell()).reshape(shape, order="F" if by_columns else "C")


def _write_csv(path: Path, curves: list[np.ndarray], names: list[str]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["curve", "point", *_axes(len(curves[0]))])
        for name, curve in zip(names, curves, strict=True):
            rows.writerows([name, i, *(repr(float(x)) for x in point)] for i, point in enumerate(curve.T))


def _read_csv(path: Path) -> tuple[list[np.ndarray], list[str]]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.DictReader(file, skipinitialspace=True, strict=True)
        axes = [axis for axis in rows.fieldnames or () if axis in _AXES or (axis[:1] == "x" and axis[1:].isdecimal())]
        if "curve" not in (rows.fieldnames or ()) or len(axes) < 2:
            raise ValueError("the first line has to name the columns curve,point,x,y or curve,point,x,y,z.")
        points: dict[str, list[list[float]]] = {}
        for row in rows:
            try:
                point = [float(row[axis]) for axis in axes]
            except (TypeError, ValueError):
                raise ValueError(f"line {rows.line_num} has no number for each of {', '.join(axes)}.") from None
            points.setdefault(str(row["curve"]), []).append(point)
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
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    place = 0
    while place < len(lines):
        key, _, value = lines[place].strip().partition("=")
        place += 1
        if key.upper() in ("LM", "LM3", "POINTS"):
            count = int(value) if value.strip().isdecimal() else -1
            if count:
                curves.append(_tps_points(lines, place, count))
                names.append(f"curve-{len(curves) - 1}")
            place += count
        elif key.upper() in ("ID", "IMAGE") and curves and value.strip():
            names[-1] = value.strip() if key.upper() == "ID" or names[-1].startswith("curve-") else names[-1]
    return curves, names


def _tps_points(lines: list[str], start: int, count: int) -> np.ndarray:
    """The points `(d, count)` of the lines from `start` on."""
    rows = [line.split() for line in lines[start : start + count]] if count > 0 else []
    try:
        found = np.array(rows, float)
    except ValueError:
        found = np.empty(0)
    if found.ndim != 2 or len(found) != count:
        raise ValueError(f"line {start} has to say how many lines of coordinates follow, as many on each.")
    return found.T


def _axes(d: int) -> list[str]:
    return list(_AXES[:d]) if d <= 3 else [f"x{i}" for i in range(d)]
