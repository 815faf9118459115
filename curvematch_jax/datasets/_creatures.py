"""Generated creatures: labelled, articulated, closed surfaces, the same for the same seed."""

import itertools as it
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..surface import Mesh
from ._implicit import surface
from ._plans import PLANS
from ._skeleton import Capsules, draw_build, draw_pose, place, rest_pose

CREATURES: tuple[str, ...] = tuple(PLANS)
"""The classes there are. `centaur` is composed of `horse` and `human`; `teapot` has a handle."""

_ATTEMPTS = 20


@dataclass(frozen=True, eq=False)
class Creature:
    """A generated mesh, named after its class and pose ("centaur3"), and its class."""

    mesh: Mesh
    label: str


def creature(kind: str, pose: int = 0, seed: int = 0, vertices: int = 3000) -> Creature:
    """One creature: an individual of a class, with proportions and a pose of its own.

    The surface is a closed oriented manifold in one piece, of genus 0 (`teapot`: 1). Joints bend between rigid limbs,
    so poses are nearly isometric to each other; the lengths and thicknesses of limbs differ from one individual to
    the next by some 6 and 9 per cent, which is not.

    Args:
        kind: the class, one of `CREATURES`.
        pose: the number of the individual; number 0 stands in the rest pose.
        seed: another seed, another family of individuals.
        vertices: about how many vertices; more where thin limbs need them to hold together.

    Raises:
        ValueError: an unknown class, or a negative pose, seed or vertex count.
        ImportError: without manifold3d (the extra `prep`).
    """
    _check_kinds([kind])
    if pose < 0 or seed < 0 or vertices < 1:
        raise ValueError(f"pose {pose}, seed {seed} and vertices {vertices} must be 0, 0 and 1 or more")
    plan = PLANS[kind]()
    for capsules in it.islice(individuals(kind, pose, seed), _ATTEMPTS):
        points, faces = surface(capsules, vertices)
        if _is_whole(faces, len(points), plan.genus):
            return Creature(Mesh(points, faces, f"{kind}{pose}"), kind)
    raise RuntimeError(f"no {kind} whose limbs do not touch in {_ATTEMPTS} attempts: its plan needs narrower joints")


def creatures(classes: Sequence[str] | None = None, poses: int = 5, seed: int = 0) -> Iterator[Creature]:
    """Creatures of several classes, made one after the other as they are asked for.

    Args:
        classes: which of `CREATURES`, by default all.
        poses: individuals a class.
        seed: as in `creature`.

    Raises:
        ValueError: as `creature` does, at once.
    """
    kinds = CREATURES if classes is None else tuple(classes)
    _check_kinds(kinds)
    if poses < 1:
        raise ValueError(f"poses must be 1 or more, not {poses}")
    return (creature(kind, pose, seed) for kind in kinds for pose in range(poses))


def _check_kinds(kinds: Sequence[str]) -> None:
    unknown = [kind for kind in kinds if kind not in PLANS]
    if unknown:
        raise ValueError(f"no creature is called {', '.join(unknown)}; there are {', '.join(CREATURES)}")


def individuals(kind: str, pose: int, seed: int) -> Iterator[Capsules]:
    """Attempts at one creature: the first whose surface is whole is the creature."""
    plan = PLANS[kind]()
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode()), pose])
    while True:
        build = draw_build(plan, rng)
        yield place(plan, build, rest_pose(plan) if pose == 0 else draw_pose(plan, rng))


def _is_whole(faces: np.ndarray, count: int, genus: int) -> bool:
    """Whether a closed surface is one component of the given genus: limbs that touch are neither."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = (faces.ravel(), np.roll(faces, -1, axis=1).ravel())
    components, _ = connected_components(coo_array((np.ones(faces.size), edges), shape=(count, count)))
    # Euler: v - e + f = 2 - 2 genus, and a closed triangle surface has e = 3 f / 2.
    return components == 1 and count - len(faces) // 2 == 2 - 2 * genus
