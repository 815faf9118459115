"""From a mesh to its parts: the fixed-size arrays that are handed to the engine."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .._given import require_type
from ._clean import clean
from ._features import Features, feature_points
from ._fields import Distances, Field, check_field, curve_unit, distances_on
from ._levels import LevelSets
from ._mesh import Mesh, MeshError
from ._report import CleanReport
from ._smooth import smooth
from ._spectrum import spectrum
from ._views import views

# Sizes of surfaces: how much the area counts in them, and the diameter of creatures with limbs in its square roots. One
# pose more or less changes the diameter by a tenth, and the area not at all.
_AREA_COUNTS, _LIMBED = 0.75, 1.7

# A level curve that has split goes on as its longest branch while that has this share of the length.
_DOMINANCE = 0.6


# The fields of `Parts` that hold an entry for each part or object: all are finite.
ARRAYS = (
    "curves",
    "mask",
    "lengths",
    "level_set_lengths",
    "centres",
    "areas",
    "points",
    "feature_distances",
    "spectrum",
    "views",
)


@dataclass(frozen=True)
class Extraction:
    """How parts are made; parts made with different settings are not comparable.

    Attributes:
        epsilon: how close extrema of the two fields must be, and how far apart feature points, in diameters.
        radius: how far a part reaches from its feature point, in sizes of the surface (`Parts.size`); with a spectral
            field in diameters: the field's distance of the two vertices that are farthest apart.
        levels: level curves of a part, at `radius * (k / (levels + 1))^spacing` for k = 2..levels + 1. What would be
            the first is left out: so close to its point a curve is the mesh's, not the surface's.
        spacing: 1 for levels that are evenly spaced; more for levels that are denser next to the feature point.
        samples: points on a curve.
        field: the distance along the surface: `"geodesic"`, or one of the spectral distances `"diffusion"`,
            `"biharmonic"` and `"commute_time"`, which a short cut between two pieces of the surface shortens less.
        vertices: edges much longer than those of so many even triangles are halved, and a surface of more than four
            times as many vertices is decimated to twice as many.
        min_parts: how many parts an object has at least; farthest points make up for feature points that are not there.
        smoothing: before anything is measured, waves on the surface that are shorter than some six times this, in
            square roots of its area, are taken off, from rough surfaces repeatedly; 0 leaves it as it is.
    """

    epsilon: float = 0.05
    radius: float = 0.8
    levels: int = 23
    samples: int = 100
    field: Field = "geodesic"
    vertices: int = 5000
    spacing: float = 1.5
    min_parts: int = 4
    smoothing: float = 0.008

    def __post_init__(self) -> None:
        if not 0 < self.epsilon < 1:
            raise ValueError(f"epsilon must lie between 0 and 1 diameters, found {self.epsilon}")
        if not 0 < self.radius < 1:
            raise ValueError(f"radius must lie between 0 and 1, found {self.radius}")
        if not 0 < self.spacing < np.inf:
            raise ValueError(f"spacing must be more than 0, found {self.spacing}")
        if not 0 <= self.smoothing < 0.1:
            raise ValueError(
                f"smoothing must lie between 0 and 0.1, in square roots of the area, found {self.smoothing}"
            )
        check_field(self.field)
        for name, least in (("levels", 1), ("samples", 8), ("vertices", 100), ("min_parts", 1)):
            value = getattr(self, name)
            if not isinstance(value, int) or value < least:
                raise ValueError(f"{name} must be an integer of at least {least}, found {value!r}")

    @property
    def radii(self) -> np.ndarray:
        """Where the level curves are, `(levels,)`, in sizes (see `Parts.size`)."""
        return self.radius * (np.arange(2, self.levels + 2) / (self.levels + 1)) ** self.spacing


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of one object: P feature points with L level curves of n samples each. P = 0 is legal.

    Attributes:
        name: the mesh's name.
        curves: `(P, L, 3, n)` float32, sampled evenly by arc length, centred, scaled to unit length, component-major;
            counter-clockwise around the feature point seen against the outward normal; zeros where masked.
        mask: `(P, L)` bool, True where the level curve exists.
        lengths: `(P, L)` float32, curve length over `diameter`; 0 where masked.
        level_set_lengths: `(P, L)` float32, length of all curves of the level set together, whether the part
            follows them or not, over `diameter`; 0 where the level set is empty.
        centres: `(P, L, 3)` float64, centroid of the curve in mesh units, so that
            `curve * length * diameter + centre` is the curve on the mesh; 0 where masked.
        areas: `(P,)` float32, share of the surface's area within `radius` of the feature point.
        points: `(P, 3)` float64, the feature points in mesh units.
        feature_distances: `(P, P)` float32, distances of the feature points from each other, in diameters of the field.
        area: of the surface, in squared mesh units.
        diameter: geodesic diameter in mesh units; with spectral distances 1.5 times the square root of the area.
        settings: how they were made.
        notes: what cleaning changed, and warnings.
        spectrum: float32, logarithms of the surface's lowest 20 eigenvalues times its area; empty when not described.
        views: float32, the 322 numbers of how the surface looks from outside; empty when not described.
    """

    name: str
    curves: np.ndarray
    mask: np.ndarray
    lengths: np.ndarray
    level_set_lengths: np.ndarray
    centres: np.ndarray
    areas: np.ndarray
    points: np.ndarray
    feature_distances: np.ndarray
    area: float
    diameter: float
    settings: Extraction
    notes: tuple[str, ...]
    spectrum: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))
    views: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))

    @property
    def size(self) -> float:
        """`diameter^(1/4) (1.7 sqrt(area))^(3/4)`, in mesh units: what radii are measured in."""
        return size_of(self.diameter, self.area)


def extract_parts(mesh: Mesh, extraction: Extraction = Extraction()) -> Parts:
    """Clean a mesh and cut it into parts around its feature points (method: Tabia et al., IEEE PAMI 33(4), 2011).

    Deterministic, and independent of the mesh's unit.

    Raises:
        ValueError: `mesh` is no `Mesh`, or `extraction` no `Extraction`.
        MeshError: the mesh cannot be made into one closed surface, or its triangles are too thin.
        ImportError: cleaning needs a library of the extra `prep`; the message has the line that installs it.
    """
    mesh, report = prepared(mesh, extraction)
    distances = distances_on(mesh, extraction.field)
    features = feature_points(mesh, distances, extraction.epsilon, extraction.min_parts)
    if not 0 < features.diameter < np.inf:
        raise MeshError(f"{mesh.name or 'mesh'}: its triangles are too thin for distances along the surface")
    parts = parts_around(mesh, distances, features, extraction, report.messages)
    parts = replace(parts, **described(mesh))
    for name in ARRAYS:
        if not np.isfinite(getattr(parts, name)).all():
            raise MeshError(f"{mesh.name or 'mesh'}: its triangles are too thin: {name} of its parts are not finite")
    return parts


def prepared(mesh: Mesh, extraction: Extraction) -> tuple[Mesh, CleanReport]:
    """The surface that is measured: cleaned, and smoothed as `extraction` says."""
    require_type("extraction", extraction, Extraction, "give an Extraction, e.g. Extraction(levels=15)")
    mesh, report = clean(mesh, vertices=extraction.vertices)
    return smooth(mesh, extraction.smoothing), report


def described(mesh: Mesh) -> dict[str, np.ndarray]:
    """What `Parts` holds of the surface as a whole, by name."""
    with np.errstate(divide="ignore", invalid="ignore"):  # What is not finite is refused by its name.
        return {"spectrum": np.log(spectrum(mesh)).astype(np.float32), "views": views(mesh).astype(np.float32)}


def parts_around(
    mesh: Mesh, distances: Distances, features: Features, extraction: Extraction, notes: tuple[str, ...] = ()
) -> Parts:
    """The parts around given vertices of a clean mesh.

    Args:
        distances: of `mesh`, the field that `extraction` names.
        notes: what cleaning changed.
    """
    unit = curve_unit(mesh, extraction.field, features.diameter)
    area = mesh.area
    reach = size_of(features.diameter, area) if extraction.field == "geodesic" else features.diameter
    parts = [_part(mesh, distances(v) / reach, v, extraction) for v in features.vertices.tolist()]
    curves, mask, lengths, level_sets, centres, areas = (np.stack(column) for column in zip(*parts, strict=True))
    between = np.stack([distances(v)[features.vertices] for v in features.vertices.tolist()]) / features.diameter
    return Parts(
        name=mesh.name,
        curves=curves.astype(np.float32),
        mask=mask,
        lengths=(lengths / unit).astype(np.float32),
        level_set_lengths=(level_sets / unit).astype(np.float32),
        centres=centres,
        areas=areas.astype(np.float32),
        points=mesh.vertices[features.vertices],
        feature_distances=((between + between.T) / 2).astype(np.float32),
        area=area,
        diameter=unit,
        settings=extraction,
        notes=notes + _warnings(features, mask),
    )


def size_of(diameter: float, area: float) -> float:
    """The size of a surface from its geodesic diameter and its area; a limb that bends leaves most of it as it is."""
    return float(diameter ** (1 - _AREA_COUNTS) * (_LIMBED * np.sqrt(area)) ** _AREA_COUNTS)


def _part(mesh: Mesh, relative: np.ndarray, vertex: int, extraction: Extraction) -> tuple[np.ndarray, ...]:
    sets = LevelSets(mesh, relative, extraction.radii)
    found = sets.follow(vertex, _DOMINANCE)
    curves = np.zeros((extraction.levels, 3, extraction.samples))
    lengths = np.zeros(extraction.levels)
    centres = np.zeros((extraction.levels, 3))
    mask = np.array([curve is not None for curve in found])
    polylines = [sets.polyline(curve) for curve in found if curve is not None]
    if polylines:
        curves[mask], lengths[mask], centres[mask] = normalise(polylines, extraction.samples)
    return curves, mask, lengths, sets.level_set_lengths, centres, area_share(mesh, relative, extraction.radius)


def normalise(polylines: Sequence[np.ndarray], samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample closed polylines `(p, 3)` evenly by arc length.

    Returns:
        the samples `(k, 3, samples)`, centred and scaled so that the closed polygon through them has length 1, the
        lengths of these polygons `(k,)` and their centres `(k, 3)` in the units of the input.
    """
    points = np.stack([_evenly(polyline, samples) for polyline in polylines])
    centres = points.mean(axis=2)
    lengths = np.sqrt((np.diff(points, axis=2, append=points[:, :, :1]) ** 2).sum(axis=1)).sum(axis=1)
    return (points - centres[:, :, None]) / lengths[:, None, None], lengths, centres


def _evenly(polyline: np.ndarray, samples: int) -> np.ndarray:
    closed = np.concatenate([polyline, polyline[:1]]).T
    steps = np.sqrt((np.diff(closed, axis=1) ** 2).sum(axis=0))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.arange(samples) * (along[-1] / samples)
    return np.stack([np.interp(wanted, along, component) for component in closed])


def area_share(mesh: Mesh, function: np.ndarray, value: float) -> np.ndarray:
    """Share of the area where a function, given at the vertices `(v,)` and linear on faces, is at most `value`."""
    a, b, c = function[mesh.faces.T]
    lower, upper = np.minimum(a, b), np.maximum(a, b)
    low, middle, high = np.minimum(lower, c), np.maximum(lower, np.minimum(upper, c)), np.maximum(upper, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        near = (value - low) ** 2 / ((middle - low) * (high - low))  # a corner cut off at the low end
        far = 1 - (high - value) ** 2 / ((high - middle) * (high - low))  # all but a corner at the high end
    share = np.select([value >= high, value <= low, value <= middle], [1.0, 0.0, near], far)
    return np.asarray((share * mesh.face_areas).sum() / mesh.area)


def _warnings(features: Features, mask: np.ndarray) -> tuple[str, ...]:
    notes = []
    if features.fallback:
        notes.append("no feature point: the two ends of the diameter are used instead")
    if features.added:
        notes.append(f"{features.added} of {len(mask)} parts are around farthest points, since feature points are few")
    empty = int((~mask.any(axis=1)).sum())
    if empty:
        notes.append(f"{empty} of {len(mask)} parts have no level curve")
    return tuple(notes)
