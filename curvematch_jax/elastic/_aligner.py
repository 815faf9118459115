"""What aligns two curves: the interface, and the settings of the two that are here."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from jaxtyping import Array, Float

from ._frame import AnyArray


class Alignment(NamedTuple):
    """A path of two closed curves, and the distance that it achieves.

    `q1(warp1) sqrt(warp1') ~ R q2(warp2) sqrt(warp2')`: at equal times the curves are matched. With the curves
    exchanged, the warps are, and R is transposed. `alignment_distance` computes the distance anew.

    Attributes:
        rotation: `(*b, d, d)`, R in SO(d).
        warp1, warp2: `(*b, m + 1)`, parameters of the two curves in turns at the times `k/m`: never falling, linear in
            between, `warp[m] = warp[0] + 1`. With the mirror image of curve2, which only aligners with `mirror` use, R
            reflects, of determinant -1, and warp2 falls to `warp[0] - 1`; `q2(warp2)` is then negative.
        distance: `(*b,)`, radians.
    """

    rotation: Float[Array, "*b d d"]
    warp1: Float[Array, "*b m+1"]
    warp2: Float[Array, "*b m+1"]
    distance: Float[Array, "*b"]


class Aligner(abc.ABC):
    """How curves are aligned. To write another one, make a frozen dataclass with these two functions.

    Both are pure functions of JAX arrays, with whole batches on the first axis; instances are compared and hashed.

    Attributes:
        chunk: pairs computed at once.
        warps: whether curves are reparametrised; their distance is then that of shapes, and has a gradient.
        mirror: whether curve2 may be taken for its mirror image: reflected, and run through backwards.
    """

    chunk: int
    warps: ClassVar[bool] = True
    mirror: bool = False

    @abc.abstractmethod
    def tabulate(self, curve: Float[AnyArray, "b d n"]) -> Any:
        """What `align` has to know of each curve, of a size near 1: arrays in any structure, `b` first."""

    @abc.abstractmethod
    def align(self, first: Any, second: Any) -> Alignment:
        """The alignments of tabulated curves, pair by pair."""

    def distance(self, first: Any, second: Any) -> Float[Array, " b"]:
        """Their distances, for aligners that have them for less than the alignment."""
        return self.align(first, second).distance

    @staticmethod
    def fast() -> Aligner:
        """For matrices of many millions of pairs."""
        from ._elastic import Elastic

        return Elastic()

    @staticmethod
    def accurate() -> Aligner:
        """The best alignment known, at about a third of the speed."""
        from ._elastic import Elastic

        return Elastic.accurate()

    @staticmethod
    def rigid() -> Aligner:
        """Start point and rotation only, both curves by arc length: the least effort, and an upper bound."""
        from ._rigid import Rigid

        return Rigid()


@dataclass(frozen=True)
class Round:
    """One round of dynamic programming.

    Attributes:
        paths: searched around, the best of those before; in the first round, start points.
        nodes: rows of the grid.
        width: of the strip on either side of a path, in steps of the smallest slope.
        slopes: positive slopes; the largest is for one curve standing still.
    """

    paths: int
    nodes: int
    width: int = 8
    slopes: int = 2


def check_least(settings: object, least: dict[str, int]) -> None:
    """`ValueError` for the first setting below its least value."""
    for name, value in least.items():
        if getattr(settings, name) < value:
            kind = type(settings).__name__
            raise ValueError(f"{kind}.{name} = {getattr(settings, name)}: it has to be {value} or more.")
