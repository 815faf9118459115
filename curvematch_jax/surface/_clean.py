"""Make any triangle soup one closed, oriented, regular surface, and say what was changed."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._given import require_type
from . import _prep
from ._mesh import Mesh, MeshError
from ._moved import hausdorff, shape_of
from ._refine import INNER, edge_lengths, even_edge, refine
from ._report import CleanReport
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
    used,
    weld,
)

_CRACKS = (1e-6, 1e-5, 1e-4, 1e-3)  # of the diagonal of the box: borders that are so close are one, closest first
_CRACK = 0.1  # of the shortest border edge there: no crack is wider
_PATCH = 1e-3  # of the area: open patches of this size belong to an open surface
_FLAT = 1e-7  # volume / area^1.5; a closed sheet of paper has 1e-5, a ball 0.09
_MOST, _KEPT = 4, 2  # times the wanted vertices: what is decimated, and to how many
_LONGEST = 1.8  # times the edge of evenly spread wanted vertices: edges that are longer are halved
_COARSER = (1.0, 1.6, 2.5, 4.0)  # times that, where a surface of needles would take too many vertices
_LEAST_WIDTH, _MOST_WIDTH = 1e-15, 1e15  # in mesh units: squares and their inverses are float32 numbers
_FARTHEST = 1e8  # widths from the origin: beyond, rounding shows
_FAR = 8  # widths from the origin: from there on the mesh is moved, in exact steps, before anything is computed
_THIN = 100  # times the wanted vertices: edges of the wanted length, end to end, in a surface that is mostly needles
_INVENTED = 0.8  # of the area: a surface that takes more to be closed is not honestly closed
_JOINABLE = 2e9  # patches times squared border edges: about ten seconds of joining
_FILLABLE = 6e7  # squared border edges of each hole: about ten seconds of filling


class _Work:
    """The arrays on their way through the steps, and the report that grows with them.

    Vertices are in units of a power of two, one to two to the width, and near the origin: what libraries hold for small
    or equal does not depend on the mesh's unit and place then, and nothing is rounded.
    """

    def __init__(self, mesh: Mesh):
        self.name = mesh.name or "mesh"
        self.faces, self.edges = mesh.faces, mesh.edges
        self.place(mesh.vertices)
        self.closed = is_closed_manifold(self.vertices, self.faces, self.edges)
        self.report = CleanReport()

    def place(self, vertices: np.ndarray) -> None:
        """Choose unit and origin for vertices in the mesh's own."""
        low, width = _box(vertices, self.faces, self.name)
        self.unit = 2.0 ** math.floor(math.log2(width))
        self.origin = np.where(np.abs(low) > _FAR * width, np.round(low / self.unit) * self.unit, 0.0)
        self.vertices = (vertices - self.origin) / self.unit

    @property
    def placed(self) -> np.ndarray:
        """The vertices in the unit of the mesh, and where it is."""
        return self.vertices * self.unit + self.origin

    def set(self, vertices: np.ndarray, faces: np.ndarray, **changes: Any) -> None:
        """The next state; a change is a count, which is added to the report's, or a pair, which replaces it."""
        if not len(faces):
            raise MeshError(f"{self.name}: no face is left once degenerate faces are dropped")
        if faces is not self.faces:
            self.edges = edges(faces)
            self.closed = is_closed_manifold(vertices, faces, self.edges)
        self.vertices, self.faces = vertices, faces
        added = {k: v if isinstance(v, tuple) else v + getattr(self.report, k) for k, v in changes.items()}
        self.report = replace(self.report, **added)

    @property
    def single(self) -> bool:
        return face_components(self.faces)[0] == 1


def clean(mesh: Mesh, *, vertices: int = 5000) -> tuple[Mesh, CleanReport]:
    """One closed, connected, outward-oriented manifold without long edges: the shape that was given.

    In order, and each only where it is needed: weld; drop degenerate and duplicate faces and unused vertices; cut
    non-manifold edges and bow-ties apart; orient consistently; keep the largest component by area (or, when that is
    open, all patches that are open too, which are then joined); decimate a mesh of more than four times as many
    vertices as wanted to twice as many; close holes; orient outwards; halve long edges, which leaves the surface
    exactly as it is. A clean mesh comes back as it is. Deterministic, scale-free, and independent of where the mesh is.

    The report says how far all of this moved the surface.

    Args:
        vertices: the number of vertices whose even edges are the measure of long ones.

    Returns:
        the mesh, and the report of what was changed.

    Raises:
        ValueError: `mesh` is no `Mesh`.
        MeshError: nothing usable is left, or the surface cannot be closed, lacks nearly as much as there is, has one
            side only, encloses nothing or is mostly needles; or its width is below 1e-15, above 1e15, or less than
            1e-8 of its distance from the origin.
        ImportError: closing or decimating is needed and the extra `prep` is not installed.
    """
    require_type("mesh", mesh, Mesh, "give a Mesh, e.g. load_mesh(path)")
    work = _Work(mesh)
    if len(mesh.faces) < 4:
        raise MeshError(f"{work.name}: {len(mesh.faces)} faces cannot enclose a volume; at least 4 are needed")
    if not work.closed:
        _weld(work)
    join = _make_manifold(work)
    if len(work.faces) < len(mesh.faces):  # What is left may be much smaller than what there was.
        work.place(work.placed)
    given, closed = (work.vertices, work.faces), work.closed
    if len(work.vertices) > _MOST * vertices and len(work.faces) > 2 * _MOST * vertices:
        join = _decimate(work, _KEPT * vertices) or join
    _refuse_needles(work, vertices, join)
    _close(work, join)
    _face_outwards(work)
    if work.report.invented > _INVENTED:
        raise MeshError(
            f"{work.name}: too much of its surface is missing: closing its {work.report.closed_holes} holes takes "
            f"{work.report.invented:.0%} of the area that is there"
        )
    _refine(work, vertices)
    if work.report == CleanReport():
        return mesh, work.report
    _measure(work, given, closed)
    return Mesh(work.placed, work.faces, mesh.name), work.report


def _measure(work: _Work, given: tuple[np.ndarray, np.ndarray], closed: bool) -> None:
    """Put into the report how far the surface moved from the pieces that were kept."""
    before, after = shape_of(*given, closed), shape_of(work.vertices, work.faces, closed=True)
    still = not (work.report.decimated[0] or work.report.closed_holes)
    moved = 0.0 if still else hausdorff(given, (work.vertices, work.faces)) / max(before.extents)
    volumes = (math.nan if shape.volume is None else shape.volume * work.unit**3 for shape in (before, after))
    first, second = volumes
    extents = tuple(tuple(extent * work.unit for extent in shape.extents) for shape in (before, after))
    work.report = replace(
        work.report,
        area=(before.area * work.unit**2, after.area * work.unit**2),
        volume=(first, second),
        extents=(extents[0], extents[1]),
        moved=moved,
    )


def _box(vertices: np.ndarray, faces: np.ndarray, label: str) -> tuple[np.ndarray, float]:
    """Lowest corner and width of the box around all faces.

    Raises:
        MeshError: squares would overflow, or rounding would not tell vertices apart.
    """
    named = used(faces)
    corners = vertices[: len(named)][named]
    with np.errstate(over="ignore"):
        width = float(np.ptp(corners, axis=0).max())
    if not _LEAST_WIDTH <= width <= _MOST_WIDTH:
        raise MeshError(f"{label}: it is {width:.3g} units wide; scale it to between {_LEAST_WIDTH} and {_MOST_WIDTH}")
    far = float(np.abs(corners).max())
    if far > _FARTHEST * width:
        raise MeshError(f"{label}: it is {width:.3g} wide and {far:.3g} from the origin, too far for its size; move it")
    return corners.min(axis=0), width


def _weld(work: _Work) -> None:
    """Merge equal vertices, and border vertices with a crack in between: narrow ones first, until no border is left."""
    vertices, faces, welded = weld(work.vertices, work.faces)
    size = float(np.linalg.norm(np.ptp(compact(vertices, faces)[0], axis=0)))
    for share in _CRACKS:
        table = edges(faces)
        border = table.ends[table.count == 1]
        if not len(border):
            break
        close = _across_cracks(vertices, border, share * size)
        number, group = label_components(len(vertices), close)
        _, first = np.unique(group, return_index=True)
        keep = np.sort(first)
        faces = np.searchsorted(keep, first)[group][faces]
        welded += len(vertices) - number
        vertices = vertices[keep]
    work.set(vertices, faces, welded=welded)


def _across_cracks(vertices: np.ndarray, border: np.ndarray, widest: float) -> np.ndarray:
    """Pairs of vertices of border edges `(b, 2)` that are apart by no more than `widest`, and by little of an edge."""
    length = np.linalg.norm(vertices[border[:, 0]] - vertices[border[:, 1]], axis=1)
    shortest = np.full(len(vertices), np.inf)
    np.minimum.at(shortest, border.ravel(), np.repeat(length, 2))
    places = np.unique(border)
    pairs = places[KDTree(vertices[places]).query_pairs(widest, output_type="ndarray")]
    apart = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    return pairs[(apart <= _CRACK * shortest[pairs].min(axis=1)) | (apart <= _CRACKS[0] / widest * apart)]


def _make_manifold(work: _Work) -> bool:
    """All steps that need no library: afterwards every edge has one or two faces, of opposite directions.

    True when what was kept are patches that must be joined.
    """
    if not work.closed:
        _drop_faces(work)
        vertices, faces, added = split_nonmanifold(work.vertices, work.faces, work.edges)
        work.set(vertices, faces, cut=added)
    faces, flipped, two_sided = orient(work.faces, work.edges)
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
    if not area.any():
        raise MeshError(f"{work.name}: all its vertices lie on one line; it has no surface")
    on_border = work.edges.count[work.edges.of_halfedge] == 1
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
    work.set(*_prep.decimate(work.vertices, work.faces, target))
    join = _make_manifold(work)
    work.report = replace(report, decimated=(before, len(work.vertices)))
    return join


def _close(work: _Work, join: bool) -> None:
    if work.closed:
        return
    border = work.edges.ends[work.edges.count == 1]
    _, label = label_components(len(work.vertices), border)
    sizes = np.unique(label[border[:, 0]], return_counts=True)[1].astype(float)
    holes, patches = len(sizes), face_components(work.faces)[0] if join else 0
    if patches * len(border) ** 2 > _JOINABLE or (sizes**2).sum() > _FILLABLE:
        raise MeshError(f"{work.name}: {holes} holes with {len(border)} border edges are too many to close")
    area = float(face_areas(work.vertices, work.faces).sum())
    closed = _prep.close(work.vertices, work.faces, join)
    invented = float(face_areas(*_made_up(work.vertices, work.faces, *closed)).sum()) / area
    work.set(*closed, closed_holes=holes, joined_patches=patches, invented=invented)
    if not work.closed or not work.single:
        raise MeshError(f"{work.name}: its {holes} holes could not be closed; repair it in a mesh editor first")


def _made_up(
    vertices: np.ndarray, faces: np.ndarray, points: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of a repaired surface the points, and those triangles that were not there before, wherever they are listed."""
    places = np.ascontiguousarray(np.concatenate([vertices, points]) + 0.0).view("V24").ravel()
    _, number = np.unique(places, return_inverse=True)
    corners = np.sort(np.concatenate([number[faces], number[triangles + len(vertices)]]), axis=1)
    _, row = np.unique(corners, axis=0, return_inverse=True)
    row = row.ravel()
    new = ~np.isin(row[len(faces) :], row[: len(faces)])
    return points, triangles[new]


def _face_outwards(work: _Work) -> None:
    volume = signed_volume(work.vertices, work.faces)
    if abs(volume) <= _FLAT * float(face_areas(work.vertices, work.faces).sum()) ** 1.5:
        raise MeshError(f"{work.name}: the surface is flat and encloses no volume")
    if volume < 0:
        flipped = len(work.faces) - 2 * work.report.flipped  # those that were turned before are back as they came
        work.set(work.vertices, work.faces[:, ::-1], flipped=flipped)


def _refuse_needles(work: _Work, target: int, join: bool = False) -> None:
    """Where long edges, or bridges to join patches, enclose next to no area, millions of triangles would be made."""
    length = float(edge_lengths(work.vertices, work.edges).sum())
    if join:
        length += face_components(work.faces)[0] * float(np.ptp(work.vertices, axis=0).max())
    wanted = even_edge(work.vertices, work.faces, target)
    if length > _THIN * target * wanted:
        raise MeshError(f"{work.name}: the surface is mostly needles, too thin for {target} vertices; thicken it first")


def _refine(work: _Work, target: int) -> None:
    """Halve long edges; on a surface that is mostly needles only those that are longer still."""
    longest = _LONGEST * even_edge(work.vertices, work.faces, target)
    if edge_lengths(work.vertices, work.edges).max() <= INNER * longest:
        return
    before = len(work.vertices)
    for factor in _COARSER:
        refined = refine(work.vertices, work.faces, factor * longest, _MOST * target)
        if refined is not None:
            break
    else:
        raise MeshError(f"{work.name}: the surface is mostly needles, too thin for {target} vertices; thicken it first")
    if len(refined[0]) > before:
        work.set(*refined, refined=(before, len(refined[0])))
