"""Make any triangle soup one closed, oriented, regular surface, and say what was changed."""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

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

_HUGE = 20  # times the wanted vertices: decimated before anything slow is done
_STITCH = 1e-6  # of the bounding box: cracks narrower than this are rounding, not holes
_PATCH = 1e-3  # of the area: open patches of this size belong to an open surface
_FLAT = 1e-7  # volume / area^1.5; a closed sheet of paper has 1e-5, a ball 0.09
_FEWEST, _MOST = 0.3, 1.7  # times the wanted vertices: what is not remeshed
_UNEVEN = 5.0  # 99th over 5th percentile of the edge lengths: what is remeshed; remeshing gives 1.6


@dataclass(frozen=True)
class CleanReport:
    """What `clean` changed, as counts; all zero when the mesh was clean."""

    welded: int = 0  # vertices merged into another
    dropped_faces: int = 0  # degenerate or duplicate
    unused_vertices: int = 0
    decimated: tuple[int, int] = (0, 0)  # vertices before and after
    cut: int = 0  # vertices added where faces met in no manifold way
    flipped: int = 0  # faces turned round
    dropped_components: int = 0
    dropped_area: float = 0.0  # their share of the area
    joined_patches: int = 0
    closed_holes: int = 0
    remeshed: tuple[int, int] = (0, 0)  # vertices before and after

    @property
    def messages(self) -> tuple[str, ...]:
        """One sentence for each change."""
        sentences = (
            (self.welded, f"{self.welded} vertices welded"),
            (self.dropped_faces, f"{self.dropped_faces} degenerate or duplicate faces dropped"),
            (self.unused_vertices, f"{self.unused_vertices} unused vertices dropped"),
            (self.decimated[0], "decimated from {} to {} vertices".format(*self.decimated)),
            (self.cut, f"{self.cut} vertices added to cut non-manifold edges and vertices apart"),
            (self.flipped, f"{self.flipped} faces turned round"),
            (
                self.dropped_components,
                f"{self.dropped_components} smaller components dropped, {self.dropped_area:.2%} of the area",
            ),
            (self.joined_patches, f"{self.joined_patches} open patches joined"),
            (self.closed_holes, f"{self.closed_holes} holes closed"),
            (self.remeshed[0], "remeshed from {} to {} vertices".format(*self.remeshed)),
        )
        return tuple(sentence for count, sentence in sentences if count)


class _Work:
    """The arrays on their way through the steps, and the report that grows with them."""

    def __init__(self, mesh: Mesh):
        self.vertices, self.faces, self.name = mesh.vertices, mesh.faces, mesh.name or "mesh"
        self.report = CleanReport()

    def set(self, vertices: np.ndarray, faces: np.ndarray, **counts) -> None:
        if not len(faces):
            raise MeshError(f"{self.name}: no face is left once degenerate faces are dropped")
        self.vertices, self.faces = vertices, faces
        self.report = replace(self.report, **counts)

    @property
    def closed(self) -> bool:
        return is_closed_manifold(self.vertices, self.faces)


def clean(mesh: Mesh, *, vertices: int = 5000) -> tuple[Mesh, CleanReport]:
    """One closed, connected, outward-oriented manifold of regular triangles, about `vertices` of them.

    In order, and each only where it is needed: weld; drop degenerate and duplicate faces and unused vertices; decimate
    a huge mesh; cut non-manifold edges and bow-ties apart; orient consistently; keep the largest component by area
    (or, when that is open, all patches that are open too, which are then joined); close holes; orient outwards;
    remesh what is too coarse, too fine or too uneven. Deterministic and scale-free. A clean mesh comes back as it is.

    Args:
        vertices: the number of vertices to remesh to.

    Returns:
        the mesh, and the report of what was changed.

    Raises:
        MeshError: nothing usable is left, or the surface cannot be closed, has one side only, or encloses nothing.
        ImportError: closing, decimating or remeshing is needed and the extra `prep` is not installed.
    """
    work = _Work(mesh)
    if len(mesh.faces) < 4:
        raise MeshError(f"{work.name}: {len(mesh.faces)} faces cannot enclose a volume; at least 4 are needed")
    if not work.closed:
        stitched = _weld(work)
        _drop_faces(work)
        _drop_vertices(work, stitched)
        _decimate(work, vertices)
        _cut(work)
    _orient(work)
    join = _select(work)
    _close(work, join)
    _face_outwards(work)
    _remesh(work, vertices)
    if work.report == CleanReport():
        return mesh, work.report
    return Mesh(work.vertices, work.faces, mesh.name), work.report


def _weld(work: _Work) -> int:
    """Merge equal vertices, and border vertices a rounding error apart; the latter, whose number it returns, stay
    behind unused."""
    vertices, faces, welded = weld(work.vertices, work.faces)
    table = edges(faces)
    border = np.unique(table.ends[table.count == 1])
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    close = border[cKDTree(vertices[border]).query_pairs(_STITCH * size, output_type="ndarray")] if len(border) else ()
    stitched = 0
    if len(close):
        number, group = label_components(len(vertices), close)
        _, first = np.unique(group, return_index=True)
        stitched = len(vertices) - number
        faces = first[group][faces]
    work.set(vertices, faces, welded=welded + stitched)
    return stitched


def _drop_faces(work: _Work) -> None:
    faces = work.faces
    proper = (faces != faces[:, [1, 2, 0]]).all(axis=1)
    _, first = np.unique(np.sort(faces[proper], axis=1), axis=0, return_index=True)
    kept = faces[proper][np.sort(first)]
    work.set(work.vertices, kept, dropped_faces=len(faces) - len(kept))


def _drop_vertices(work: _Work, merged: int) -> None:
    vertices, faces = compact(work.vertices, work.faces)
    work.set(vertices, faces, unused_vertices=len(work.vertices) - len(vertices) - merged)


def _decimate(work: _Work, target: int) -> None:
    before = len(work.vertices)
    if before <= _HUGE * target:
        return
    vertices, faces = _prep.decimate(work.vertices, work.faces, _HUGE * target // 2)
    work.set(*compact(vertices, faces), decimated=(before, len(vertices)))


def _cut(work: _Work) -> None:
    vertices, faces, added = split_nonmanifold(work.vertices, work.faces)
    work.set(vertices, faces, cut=added)


def _orient(work: _Work) -> None:
    faces, flipped, two_sided = orient(work.faces)
    if not two_sided:
        raise MeshError(f"{work.name}: the surface has one side only (like a Moebius strip); cut it open first")
    work.set(work.vertices, faces, flipped=flipped)


def _select(work: _Work) -> bool:
    """Keep the largest component; when it is open, the other open patches with it. True when patches must be joined."""
    number, label = face_components(work.faces)
    if number == 1:
        return False
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


def _close(work: _Work, join: bool) -> None:
    if work.closed:
        return
    table = edges(work.faces)
    border = table.ends[table.count == 1]
    holes = label_components(len(work.vertices), border)[0] - (len(work.vertices) - len(np.unique(border)))
    patches = face_components(work.faces)[0] if join else 0
    vertices, faces = _prep.close(work.vertices, work.faces, join)
    work.set(vertices, faces, closed_holes=holes, joined_patches=patches)
    if not work.closed or face_components(work.faces)[0] != 1:
        raise MeshError(f"{work.name}: its {holes} holes could not be closed; repair it in a mesh editor first")


def _face_outwards(work: _Work) -> None:
    volume = signed_volume(work.vertices, work.faces)
    if abs(volume) < _FLAT * float(face_areas(work.vertices, work.faces).sum()) ** 1.5:
        raise MeshError(f"{work.name}: the surface is flat and encloses no volume")
    if volume < 0:
        work.set(work.vertices, work.faces[:, ::-1], flipped=len(work.faces) - work.report.flipped)


def _remesh(work: _Work, target: int) -> None:
    before = len(work.vertices)
    if _FEWEST * target <= before <= _MOST * target and unevenness(work.vertices, work.faces) <= _UNEVEN:
        return
    vertices, faces = _prep.remesh(work.vertices, work.faces, target)
    work.set(vertices, faces, remeshed=(before, len(vertices)))
    if not work.closed or face_components(work.faces)[0] != 1:
        raise MeshError(f"{work.name}: remeshing to {target} vertices broke the surface; ask for more vertices")


def unevenness(vertices: np.ndarray, faces: np.ndarray) -> float:
    """How uneven the edges of a mesh are: the 99th percentile of their lengths over the 5th."""
    ends = edges(faces).ends
    lengths = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    low, high = np.percentile(lengths, (5, 99))
    return float(high / low) if low > 0 else math.inf
