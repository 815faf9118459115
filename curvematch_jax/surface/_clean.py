"""Make any triangle soup one closed, oriented, regular surface, and say what was changed."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from . import _prep
from ._mesh import Mesh, MeshError
from ._topology import (
    compact,
    edges,
    face_areas,
    face_components,
    is_closed_manifold,
    label_components,
    orient,
    signed_volume,
    split_nonmanifold,
    weld,
)

_STITCH = 1e-6  # of the bounding box: cracks narrower than this are rounding, not holes
_PATCH = 1e-3  # of the area: open patches of this size belong to an open surface
_FLAT = 1e-7  # volume / area^1.5; a closed sheet of paper has 1e-5, a ball 0.09
_HUGE = 5  # times the wanted vertices: what is decimated, to twice the wanted vertices, before anything slow is done
_FEWEST, _MOST = 0.2, 1.7  # times the wanted vertices: what is not remeshed
_NEEDLES = 0.1  # 5th percentile of the triangles' quality: what is remeshed. Graded meshes have 0.2, remeshed ones 0.8
_LONGEST = 0.2  # of the square root of the area: edges that are too long for level curves
_LEAST_WIDTH, _MOST_WIDTH = 1e-15, 1e15  # in mesh units: squares and their inverses are float32 numbers
_FARTHEST = 1e8  # widths from the origin: beyond, rounding shows
_THIN = 100  # times the wanted vertices: edges of the wanted length, end to end, in a surface that is mostly needles
_SWOLLEN = 10  # times the wanted vertices: what remeshing has made of a surface of needles
_JOINABLE = 2e9  # patches times squared border edges: about ten seconds of joining
_FILLABLE = 6e7  # squared border edges of each hole: about ten seconds of filling


@dataclass(frozen=True)
class CleanReport:
    """What `clean` changed, as counts; all zero when the mesh was clean."""

    welded: int = 0  # vertices merged into another
    dropped_faces: int = 0  # degenerate or duplicate
    unused_vertices: int = 0
    cut: int = 0  # vertices added where faces met in no manifold way
    flipped: int = 0  # faces turned round
    dropped_components: int = 0
    dropped_area: float = 0.0  # their share of the area
    joined_patches: int = 0
    decimated: tuple[int, int] = (0, 0)  # vertices before and after
    closed_holes: int = 0
    remeshed: tuple[int, int] = (0, 0)  # vertices before and after

    @property
    def messages(self) -> tuple[str, ...]:
        """One sentence for each change."""
        sentences = (
            (self.welded, f"{self.welded} vertices welded"),
            (self.dropped_faces, f"{self.dropped_faces} degenerate or duplicate faces dropped"),
            (self.unused_vertices, f"{self.unused_vertices} unused vertices dropped"),
            (self.cut, f"{self.cut} vertices added to cut non-manifold edges and vertices apart"),
            (self.flipped, f"{self.flipped} faces turned round"),
            (
                self.dropped_components,
                f"{self.dropped_components} smaller components dropped, {self.dropped_area:.2%} of the area",
            ),
            (self.decimated[0], "decimated from {} to {} vertices".format(*self.decimated)),
            (self.joined_patches, f"{self.joined_patches} open patches joined"),
            (self.closed_holes, f"{self.closed_holes} holes closed"),
            (self.remeshed[0], "remeshed from {} to {} vertices".format(*self.remeshed)),
        )
        return tuple(sentence for count, sentence in sentences if count)


class _Work:
    """The arrays on their way through the steps, and the report that grows with them.

    Vertices are in units of a power of two, one to two to the width: what libraries hold for small or equal does not
    depend on the mesh's unit then, and nothing is rounded.
    """

    def __init__(self, mesh: Mesh):
        self.name = mesh.name or "mesh"
        self.unit = 2.0 ** math.floor(math.log2(_width(mesh)))
        self.vertices, self.faces = mesh.vertices / self.unit, mesh.faces
        self.report = CleanReport()

    def set(self, vertices: np.ndarray, faces: np.ndarray, **changes: Any) -> None:
        """The next state; a change is a count, which is added to the report's, or a pair, which replaces it."""
        if not len(faces):
            raise MeshError(f"{self.name}: no face is left once degenerate faces are dropped")
        self.vertices, self.faces = vertices, faces
        added = {k: v if isinstance(v, tuple) else v + getattr(self.report, k) for k, v in changes.items()}
        self.report = replace(self.report, **added)

    @property
    def closed(self) -> bool:
        return is_closed_manifold(self.vertices, self.faces)

    @property
    def single(self) -> bool:
        return face_components(self.faces)[0] == 1


def clean(mesh: Mesh, *, vertices: int = 5000) -> tuple[Mesh, CleanReport]:
    """One closed, connected, outward-oriented manifold of fair triangles, about `vertices` of them.

    In order, and each only where it is needed: weld; drop degenerate and duplicate faces and unused vertices; cut
    non-manifold edges and bow-ties apart; orient consistently; keep the largest component by area (or, when that is
    open, all patches that are open too, which are then joined); decimate a huge mesh; close holes; orient outwards;
    remesh what is too fine, too coarse or full of needles. A clean mesh comes back as it is. Deterministic and
    scale-free.

    A mesh of fair size and fair triangles is not remeshed: that would lose details which its author kept (fingers).

    Args:
        vertices: the number of vertices to aim at where the mesh has fewer than a fifth or more than 1.7 times as many.

    Returns:
        the mesh, and the report of what was changed.

    Raises:
        MeshError: nothing usable is left, or the surface cannot be closed, has one side only, encloses nothing or is
            mostly needles; or its width is below 1e-15, above 1e15, or less than 1e-8 of its distance from the origin.
        ImportError: closing, decimating or remeshing is needed and the extra `prep` is not installed.
    """
    work = _Work(mesh)
    if len(mesh.faces) < 4:
        raise MeshError(f"{work.name}: {len(mesh.faces)} faces cannot enclose a volume; at least 4 are needed")
    if not work.closed:
        _weld(work)
    join = _make_manifold(work)
    if len(work.vertices) > _HUGE * vertices and len(work.faces) > 4 * vertices:
        join = _decimate(work, vertices) or join
    _refuse_needles(work, vertices, join)
    _close(work, join)
    _face_outwards(work)
    if is_unfit(work.vertices, work.faces, vertices):
        _remesh(work, vertices)
    if work.report == CleanReport():
        return mesh, work.report
    return Mesh(work.vertices * work.unit, work.faces, mesh.name), work.report


def _width(mesh: Mesh) -> float:
    """Of the box around all faces; `MeshError` where squares overflow, or rounding would not tell vertices apart."""
    used = mesh.vertices[np.unique(mesh.faces)]
    with np.errstate(over="ignore"):
        width = float(np.ptp(used, axis=0).max())
    label = mesh.name or "mesh"
    if not _LEAST_WIDTH <= width <= _MOST_WIDTH:
        raise MeshError(f"{label}: it is {width:.3g} units wide; scale it to between {_LEAST_WIDTH} and {_MOST_WIDTH}")
    far = float(np.abs(used).max())
    if far > _FARTHEST * width:
        raise MeshError(f"{label}: it is {width:.3g} wide and {far:.3g} from the origin, too far for its size; move it")
    return width


def _weld(work: _Work) -> None:
    """Merge equal vertices, and border vertices that are a rounding error apart."""
    vertices, faces, welded = weld(work.vertices, work.faces)
    table = edges(faces)
    border = np.unique(table.ends[table.count == 1])
    size = float(np.linalg.norm(np.ptp(vertices[np.unique(faces)], axis=0)))
    if len(border):
        close = border[KDTree(vertices[border]).query_pairs(_STITCH * size, output_type="ndarray")]
        number, group = label_components(len(vertices), close)
        _, first = np.unique(group, return_index=True)
        keep = np.sort(first)
        faces = np.searchsorted(keep, first)[group][faces]
        welded += len(vertices) - number
        vertices = vertices[keep]
    work.set(vertices, faces, welded=welded)


def _make_manifold(work: _Work) -> bool:
    """All steps that need no library: afterwards every edge has one or two faces, of opposite directions.

    True when what was kept are patches that must be joined.
    """
    if not work.closed:
        _drop_faces(work)
        vertices, faces, added = split_nonmanifold(work.vertices, work.faces)
        work.set(vertices, faces, cut=added)
    faces, flipped, two_sided = orient(work.faces)
    if not two_sided:
        raise MeshError(f"{work.name}: the surface has one side only (like a Moebius strip); cut it open first")
    work.set(work.vertices, faces, flipped=flipped)
    return not work.single and _select(work)


def _drop_faces(work: _Work) -> None:
    faces = work.faces
    proper = faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]
    _, first = np.unique(np.sort(proper, axis=1), axis=0, return_index=True)
    kept = proper[np.sort(first)]
    work.set(work.vertices, kept, dropped_faces=len(faces) - len(kept))
    vertices, faces = compact(work.vertices, kept)
    work.set(vertices, faces, unused_vertices=len(work.vertices) - len(vertices))


def _select(work: _Work) -> bool:
    """Keep the largest component; when it is open, the other open patches with it. True when patches must be joined."""
    number, label = face_components(work.faces)
    area = np.bincount(label, weights=face_areas(work.vertices, work.faces), minlength=number)
    table = edges(work.faces)
    on_border = table.count[table.of_halfedge] == 1
    is_open = np.bincount(np.tile(label, 3)[on_border], minlength=number) > 0
    largest = int(np.argmax(area))
    keep = np.arange(number) == largest
    if is_open[largest]:
        keep |= is_open & (area >= _PATCH * area.sum())
    dropped = int((~keep).sum())
    share = float(area[~keep].sum() / area.sum()) if dropped else 0.0
    work.set(*compact(work.vertices, work.faces[keep[label]]), dropped_components=dropped, dropped_area=share)
    return int(keep.sum()) > 1


def _decimate(work: _Work, target: int) -> bool:
    """Decimation does not promise a manifold, so what it breaks is mended, and not reported as a fault of the input."""
    before, report = len(work.vertices), work.report
    work.set(*_prep.decimate(work.vertices, work.faces, 2 * target))
    join = _make_manifold(work)
    work.report = replace(report, decimated=(before, len(work.vertices)))
    return join


def _close(work: _Work, join: bool) -> None:
    if work.closed:
        return
    table = edges(work.faces)
    border = table.ends[table.count == 1]
    _, label = label_components(len(work.vertices), border)
    sizes = np.unique(label[border[:, 0]], return_counts=True)[1].astype(float)
    holes, patches = len(sizes), face_components(work.faces)[0] if join else 0
    if patches * len(border) ** 2 > _JOINABLE or (sizes**2).sum() > _FILLABLE:
        raise MeshError(f"{work.name}: {holes} holes with {len(border)} border edges are too many to close")
    work.set(*_prep.close(work.vertices, work.faces, join), closed_holes=holes, joined_patches=patches)
    if not work.closed or not work.single:
        raise MeshError(f"{work.name}: its {holes} holes could not be closed; repair it in a mesh editor first")


def _face_outwards(work: _Work) -> None:
    volume = signed_volume(work.vertices, work.faces)
    if abs(volume) < _FLAT * float(face_areas(work.vertices, work.faces).sum()) ** 1.5:
        raise MeshError(f"{work.name}: the surface is flat and encloses no volume")
    if volume < 0:
        flipped = len(work.faces) - 2 * work.report.flipped  # those that were turned before are back as they came
        work.set(work.vertices, work.faces[:, ::-1], flipped=flipped)


def _refuse_needles(work: _Work, target: int, join: bool = False) -> None:
    """Where long edges, or bridges to join patches, enclose next to no area, millions of triangles would be made."""
    ends = work.vertices[edges(work.faces).ends]
    length = float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum())
    if join:
        length += face_components(work.faces)[0] * float(np.ptp(work.vertices, axis=0).max())
    wanted = _prep.edge_length(work.vertices, work.faces, target)
    if length > _THIN * target * wanted:
        raise MeshError(f"{work.name}: the surface is mostly needles, too thin for {target} vertices; thicken it first")


def _remesh(work: _Work, target: int) -> None:
    before = len(work.vertices)
    _refuse_needles(work, target)
    vertices, faces = _prep.remesh(work.vertices, work.faces, target)
    if len(vertices) > _SWOLLEN * target:
        raise MeshError(f"{work.name}: the surface is mostly needles, too thin for {target} vertices; thicken it first")
    work.set(vertices, faces, remeshed=(before, len(vertices)))
    lengths = np.linalg.norm(vertices[faces] - vertices[faces[:, [1, 2, 0]]], axis=2)
    if not (np.isfinite(vertices).all() and lengths.min() > 0 and signed_volume(vertices, faces) > 0):
        raise MeshError(f"{work.name}: its surface is too tangled to be remeshed; repair it in a mesh editor first")
    if not work.closed or not work.single:
        raise MeshError(f"{work.name}: remeshing to {target} vertices broke the surface; ask for more vertices")


def is_unfit(vertices: np.ndarray, faces: np.ndarray, target: int) -> bool:
    """Whether distances and level curves on this mesh would be slow or poor: too fine, too coarse, full of needles."""
    area = face_areas(vertices, faces)
    corners = vertices[faces]
    squared = ((corners - corners[:, [1, 2, 0]]) ** 2).sum(axis=2)
    fair_size = _FEWEST * target <= len(vertices) <= _MOST * target
    if not fair_size or squared.min() == 0 or squared.max() > _LONGEST**2 * area.sum():
        return True
    quality = 4 * np.sqrt(3) * area / squared.sum(axis=1)  # 1 for the equilateral triangle, 0 for a needle
    return bool(np.percentile(quality, 5) < _NEEDLES)
