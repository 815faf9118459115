"""Articulated skeletons: a body plan, drawn builds and poses, and the capsules that they place in space."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

Vector = tuple[float, float, float]

# Standard deviations of the logarithm of limb length and thickness between individuals of a class.
_LENGTH_SPREAD = 0.06
_THICKNESS_SPREAD = 0.09

# Width of the fillet where a limb grows out of another, and where it goes on through a joint, as shares of its
# smaller radius. A wide fillet would put a bead on a straight joint.
_ROOT_FILLET = 0.6
_JOINT_FILLET = 0.15


@dataclass(frozen=True)
class Turn:
    """A rotation that a joint allows: about `axis` (in the rest pose), by `low` to `high` degrees; 0 is at rest."""

    axis: Vector
    low: float
    high: float


@dataclass(frozen=True)
class Bone:
    """A tapered capsule hinged to its parent, given in the rest pose (x to the left, y forward, z up).

    Attributes:
        parent: the bone that carries it, `None` for the root.
        at: where on the parent it starts, 0 at the parent's start and 1 at its tip; `offset` is added.
        vector: from its start to its tip.
        radii: at the start and at the tip.
        group: bones of one group (both legs, say) get the same length and thickness in an individual.
        turns: applied from the last to the first.
        flat: thickness along `normal` as a share of the width.
    """

    name: str
    parent: str | None
    vector: Vector
    radii: tuple[float, float]
    group: str
    turns: tuple[Turn, ...] = ()
    at: float = 1.0
    offset: Vector = (0.0, 0.0, 0.0)
    flat: float = 1.0
    normal: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Plan:
    """What all creatures of one class share: bones, parents before children, and the genus of the surface."""

    bones: tuple[Bone, ...]
    genus: int = 0


@dataclass(frozen=True, eq=False)
class Capsules:
    """Tapered, possibly flattened capsules.

    `starts`, `tips`, `normals` (k, 3), `radii` (k, 2), `flats` (k,), and the widths of their `fillets` (k,).
    """

    starts: np.ndarray
    tips: np.ndarray
    radii: np.ndarray
    normals: np.ndarray
    flats: np.ndarray
    fillets: np.ndarray

    @property
    def thinnest(self) -> float:
        """Half of the smallest thickness anywhere."""
        return float((self.radii.min(axis=1) * self.flats).min())


def both_sides(bones: Iterable[Bone]) -> tuple[Bone, ...]:
    """The bones of the left side, whose names end in `.l`, followed by their mirror images, ending in `.r`."""
    left = tuple(bones)
    return left + tuple(_mirrored(bone) for bone in left)


def _mirrored(bone: Bone) -> Bone:
    def flip(vector: Vector) -> Vector:
        return (-vector[0], vector[1], vector[2])

    def other_side(name: str | None) -> str | None:
        return name[:-2] + ".r" if name is not None and name.endswith(".l") else name

    # A reflection turns a rotation by t about an axis into one by -t about the axis' image.
    turns = tuple(replace(t, axis=(t.axis[0], -t.axis[1], -t.axis[2])) for t in bone.turns)
    return replace(
        bone,
        name=other_side(bone.name) or bone.name,
        parent=other_side(bone.parent),
        vector=flip(bone.vector),
        offset=flip(bone.offset),
        normal=flip(bone.normal),
        turns=turns,
    )


def draw_build(plan: Plan, rng: np.random.Generator) -> dict[str, tuple[float, float]]:
    """An individual: for each group of bones, the factors of its lengths and of its thicknesses."""
    groups = dict.fromkeys(bone.group for bone in plan.bones)
    spreads = (_LENGTH_SPREAD, _THICKNESS_SPREAD)

    def factors() -> tuple[float, float]:
        length, thickness = np.exp(np.clip(rng.standard_normal(2), -2, 2) * spreads)
        return float(length), float(thickness)

    return {group: factors() for group in groups}


def draw_pose(plan: Plan, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """A pose: for each bone, the rotation (3, 3) at its start, every turn drawn uniformly from its range."""
    return {
        bone.name: _product(_rotation(t.axis, np.radians(rng.uniform(t.low, t.high))) for t in bone.turns)
        for bone in plan.bones
    }


def rest_pose(plan: Plan) -> dict[str, np.ndarray]:
    """The pose in which the plan is given."""
    return {bone.name: np.eye(3) for bone in plan.bones}


def place(plan: Plan, build: dict[str, tuple[float, float]], pose: dict[str, np.ndarray]) -> Capsules:
    """The capsules of an individual in a pose (forward kinematics)."""
    frames: dict[str | None, np.ndarray] = {None: np.eye(3)}
    starts: dict[str | None, np.ndarray] = {None: np.zeros(3)}
    vectors: dict[str | None, np.ndarray] = {None: np.zeros(3)}
    scale: dict[str | None, float] = {None: 1.0}
    for bone in plan.bones:
        parent, name = bone.parent, bone.name
        frames[name] = frames[parent] @ pose[name]
        scale[name] = build[bone.group][0]
        # The place of a limb on the trunk follows the trunk's size.
        offset = frames[parent] @ (np.array(bone.offset) * scale[parent])
        starts[name] = starts[parent] + bone.at * vectors[parent] + offset
        vectors[name] = frames[name] @ (np.array(bone.vector) * scale[name])
    names = [bone.name for bone in plan.bones]
    radii = np.array([np.array(bone.radii) * build[bone.group][1] for bone in plan.bones])
    flats = np.array([bone.flat for bone in plan.bones])
    grows_out = np.array([bone.at != 1.0 or any(bone.offset) for bone in plan.bones])
    return Capsules(
        starts=np.stack([starts[n] for n in names]),
        tips=np.stack([starts[n] + vectors[n] for n in names]),
        radii=radii,
        normals=np.stack([frames[bone.name] @ _unit(bone.normal) for bone in plan.bones]),
        flats=flats,
        fillets=np.where(grows_out, _ROOT_FILLET, _JOINT_FILLET) * radii.min(axis=1) * flats,
    )


def _rotation(axis: Vector, angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = _unit(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def _product(rotations: Iterable[np.ndarray]) -> np.ndarray:
    total = np.eye(3)
    for rotation in rotations:
        total = total @ rotation
    return total


def _unit(vector: Vector) -> np.ndarray:
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)
