"""Settings of retrieval: how parts are compared, and how the evidence is combined.

Equations D, 4 and 5 of H. Tabia, M. Daoudi, J.-P. Vandeborre, O. Colot, "A new 3D-matching method of non-rigid and
partially similar models using curve analysis", IEEE PAMI 33(4), 2011, with what the paper leaves open decided here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from ..elastic import Aligner, Rigid

Fusion = Literal["cohort", "belief", "weighted", "mean"]
Masses = Literal["odds", "shares"]
Descriptor = Literal["spectrum", "views"]
Significance = Literal["equal", "area"]
Unit = Literal["area", "diameter", "mesh"]

# No two aligned unit-length curves are farther apart: the best rotation never leaves a negative inner product.
MAX_CURVE_DISTANCE = math.pi / 2
# Sizes that differ by more than this factor are as different as can be.
MAX_LOG_RATIO = math.log(8.0)
# Where surfaces are isometric, lengths agree within what meshing and geodesics leave of them. A single level that
# differs by more, or that only one part has, says no more than that it differs.
MAX_ISOMETRY_RATIO = 0.2
# Their weights fall as `k^-0.6`: near its tip a limb keeps its girth in any pose.
ISOMETRY_DECAY = 0.6
# Of every part, when all are worth the same. Between .1 and .9 it changes the order of next to nothing.
EQUAL_SIGNIFICANCE = 0.5


@dataclass(frozen=True)
class Witness:
    """A descriptor of whole surfaces that joins the parts as a source of belief.

    Attributes:
        name: `"spectrum"`, the lowest eigenvalues of the Laplacian, which tell near-isometric bodies from others; or
            `"views"`, depth images and reach, which tell rigid things apart and change when a body is bent.
        weight: of its evidence, where that of the parts has 1. None: as far as it agrees with the parts in the
            collection, `min(r^2 / (3 (1 - r^2)), 1)` with the correlation r of the two over the cohort.
    """

    name: Descriptor
    weight: float | None = None

    def __post_init__(self) -> None:
        if self.name not in get_args(Descriptor):
            raise ValueError(f"a witness is one of {', '.join(get_args(Descriptor))}, found {self.name!r}")
        if self.weight is not None and not 0 <= self.weight < math.inf:
            raise ValueError(f"the weight of a witness must be 0 or more, found {self.weight!r}")


_CHOICES = {"fusion": Fusion, "masses": Masses, "significance": Significance, "unit": Unit}


@dataclass(frozen=True)
class Matching:
    """How parts are compared, and how the evidence is combined.

    Two parts differ, level by level, by the elastic distance of their curves (radians) and by `length_weight` times
    the difference of the logarithms of the curves' lengths. The levels are averaged with weights `k^-decay`, k = 1
    next to the feature point, up to a part's first gap; a level that only one of the two parts has counts as
    `missing`, one that neither has does not count. Added are `level_set_weight` times the mean difference of the
    logarithms of the lengths of whole level sets, and `isometry_weight` times the mean difference of the logarithms of
    the lengths in sizes (`Parts.size`), each counted up to 0.2, with weights `k^-0.6`, and the mean up to
    `isometry_limit`: it tells a body from others of nearly the same proportions, and is the same constant for all that
    is farther from isometric.

    Attributes:
        aligner: the alignment of two curves.
        candidates: how many parts of each object are compared by shape with each part of the other: those nearest by
            sizes or, where sizes do not count, by start point and rotation of the curves alone. 0 compares all.
        length_weight: radians for a factor e between the lengths of two curves.
        level_set_weight: radians for a factor e between the lengths of two level sets.
        isometry_weight: radians for a factor e between lengths that are nearly equal.
        isometry_limit: logarithm of the ratio up to which lengths are nearly equal.
        decay: how fast the weight of a level falls with its distance from the feature point.
        unit: what lengths are measured in: the square root of the surface's `"area"`, its geodesic `"diameter"`, or the
            unit of the `"mesh"`, for models in their true size: it tells apart bodies of different height.
        missing: radians for a level curve that only one of two parts has.
        fusion: how the evidence for an object is combined. `"cohort"`: in both directions, from the query's parts to
            the object and back, as the chance that an unrelated object is as near, together with the witnesses (see
            `_cohort.py`); dissimilarities are symmetric and comparable. The others use the query's parts only.
            `"belief"`: by the transferable belief model. `"weighted"`: by the sum of masses that the belief model
            comes to in large collections. `"mean"`: by the mean of their distances to the object.
        witnesses: further sources of belief beside the parts, with `fusion="cohort"`.
        masses: what distances are turned into. `"odds"`: the mass of a part on an object is
            `expm1(mu (D_max - D1) / scale)` times its mass on the whole collection, so that the combined evidence for
            an object is a sum over the parts which no other object enters. `"shares"`: as published (equation 4),
            `1 - D1` as a share of the sum over the collection, where D1 is first made `1 - exp(-D1 / scale)`.
        significance: mu, the weight of a part: the same for all parts (`"equal"`), or smaller for parts that cover
            less of the query's surface (`"area"`, as published).
        scale: radians; see `masses`.
    """

    aligner: Aligner = field(default_factory=Rigid.estimate)
    candidates: int = 2
    length_weight: float = 0.25
    level_set_weight: float = 0.25
    isometry_weight: float = 12.0
    isometry_limit: float = 0.1
    decay: float = 0.0
    unit: Unit = "area"
    missing: float = 0.6
    fusion: Fusion = "cohort"
    witnesses: tuple[Witness, ...] = (Witness("spectrum"), Witness("views"))
    masses: Masses = "odds"
    significance: Significance = "equal"
    scale: float = 0.4

    def __post_init__(self) -> None:
        for name, kind in _CHOICES.items():
            if getattr(self, name) not in get_args(kind):
                raise ValueError(f"{name} must be one of {', '.join(get_args(kind))}, found {getattr(self, name)!r}")
        if self.aligner.mirror:
            raise ValueError(f"parts are compared without mirror images, found {self.aligner}: leave mirror=False")
        if not isinstance(self.candidates, int) or self.candidates < 0:
            raise ValueError(f"candidates must be a whole number, 0 or more, found {self.candidates!r}")
        for name in ("length_weight", "level_set_weight", "isometry_weight", "isometry_limit", "decay", "missing"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be 0 or more, found {getattr(self, name)!r}")
        if not 0 < self.scale < math.inf:
            raise ValueError(f"scale must be more than 0, found {self.scale!r}")
        if len({witness.name for witness in self.witnesses}) < len(self.witnesses):
            raise ValueError("a witness is named twice")

    @classmethod
    def elastic(cls) -> Matching:
        """The default with reparametrisation of curves: about 15 times slower, and hardly better at retrieval."""
        return cls(aligner=Aligner.fast())

    @classmethod
    def articulated(cls) -> Matching:
        """For bodies that bend: the spectrum counts as much as the parts, and views do not count."""
        return cls(witnesses=(Witness("spectrum", 1.0),))

    @classmethod
    def generic(cls) -> Matching:
        """For objects of many kinds, most of them rigid: views count half as much as the parts."""
        return cls(witnesses=(Witness("spectrum", 0.25), Witness("views", 0.5)))

    @classmethod
    def partial(cls) -> Matching:
        """For queries that are pieces of bodies or composed of pieces: near levels and close parts count most.

        One-way: the parts of the query are compared with the object, and not the other way round.

        Far from its feature point a part of one body reaches into the other, so that the weight of levels falls with
        the distance, and lengths in diameters of the whole say nothing about a piece. With masses by equation 4, a few
        close parts are enough to rank an object highly: half of a query can match without the other half.
        """
        return cls(fusion="belief", witnesses=(), isometry_weight=0.0, decay=1.0, masses="shares", scale=0.05)

    @classmethod
    def paper(cls) -> Matching:
        """The published method: elastic shapes of curves alone, masses by equation 4, significance by area.

        Equation D integrates over the levels without saying by which measure; this is `d lambda / lambda`, a
        factor of the radius counts the same anywhere. Of each object the part nearest by start point and rotation is
        compared elastically, the others are farther as a rule.
        """
        return cls(
            aligner=Aligner.fast(),
            candidates=1,
            length_weight=0.0,
            level_set_weight=0.0,
            isometry_weight=0.0,
            decay=1.0,
            missing=0.8,
            fusion="belief",
            witnesses=(),
            masses="shares",
            significance="area",
            scale=0.1,
        )

    @property
    def sized(self) -> bool:
        """Whether sizes count."""
        return self.length_weight + self.level_set_weight + self.isometry_weight > 0

    @property
    def separate(self) -> bool:
        """Whether the order of two objects depends on their own distances alone, and never rises with them."""
        return self.masses == "odds" or self.fusion in ("cohort", "mean")

    @property
    def mutual(self) -> bool:
        """Whether both directions are asked, so that dissimilarities are symmetric."""
        return self.fusion == "cohort"

    @property
    def max_distance(self) -> float:
        """The greatest distance of two parts there is: that of parts with nothing in common."""
        level = max(MAX_CURVE_DISTANCE + self.length_weight * MAX_LOG_RATIO, self.missing)
        return level + self.level_set_weight * MAX_LOG_RATIO + self.isometry_weight * self.isometry_limit

    def normalised(self, distances: np.ndarray) -> np.ndarray:
        """Part-to-object distances brought into [0, 1] by a constant, never by the collection."""
        return np.clip(-np.expm1(-distances / self.scale), 0.0, 1.0)


DEFAULT = Matching()
"""The default settings."""

_PRESETS = ("elastic", "articulated", "generic", "partial", "paper")


def presets() -> dict[str, Matching]:
    """The settings that have a name, by name."""
    return {"default": DEFAULT, **{name: getattr(Matching, name)() for name in _PRESETS}}
