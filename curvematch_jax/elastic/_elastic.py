"""Elastic alignment of one chunk of pairs: a search, its refinement, and the distance of the path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
from jaxtyping import Float

from ._aligner import Aligner, Alignment, Round, check_least
from ._certify import path_distance
from ._frame import AnyArray
from ._mirror import WithImage, both, chosen, smaller, to_the_curve, with_images
from ._refine import from_warps, refine, warps_of
from ._search import Paths, search
from ._tables import TANGENTS, CurveTable, tabulate


@dataclass(frozen=True)
class Elastic(Aligner):
    """Alignment by rotation, start point and reparametrisation of both curves.

    Attributes:
        rounds: of dynamic programming, coarse to fine.
        paths: that are refined, the best of the last round.
        steps: of refinement.
        knots: pieces of the path, linear each.
        nodes: to a piece, where the distance is measured.
        mirror: whether curve2 may be taken for its mirror image, where that is nearer. Paths are searched to both, half
            of them to each after the first round; those to the nearer one are refined.
        chunk: pairs computed at once.
    """

    rounds: tuple[Round, ...] = (Round(32, 24, 8), Round(7, 72, 9), Round(2, 216, 8))
    paths: int = 1
    steps: int = 4
    knots: int = 256
    nodes: int = 2
    mirror: bool = False
    chunk: int = 32

    def __post_init__(self) -> None:
        check_least(self, {"paths": 1, "steps": 0, "nodes": 1, "chunk": 1})
        nodes = 1
        for number, round_ in enumerate(self.rounds):
            check_least(round_, {"paths": 1, "nodes": 8, "width": 1, "slopes": 1})
            if round_.slopes * round_.nodes % nodes or round_.width > round_.slopes * round_.nodes // 2:
                raise ValueError(
                    f"Elastic.rounds[{number}] = {round_}: slopes * nodes has to be a multiple of the {nodes} nodes "
                    "before, and twice the width at least."
                )
            nodes = round_.nodes
        kept = [round_.paths for round_ in self.rounds] + [self.paths]
        if not self.rounds or kept != sorted(kept, reverse=True):
            raise ValueError(f"Elastic needs rounds of fewer and fewer paths, not {kept}.")
        starts = self.rounds[0].slopes * self.rounds[0].nodes
        if TANGENTS % starts or kept[0] > starts:
            raise ValueError(
                f"Elastic.rounds[0] = {self.rounds[0]}: slopes * nodes has to divide {TANGENTS}, and there can be no "
                "more paths than that."
            )
        if self.knots < 8 or self.knots & (self.knots - 1):
            raise ValueError(f"Elastic.knots = {self.knots}: it has to be a power of 2, 8 or more.")

    @staticmethod
    def accurate() -> Elastic:
        """The best alignment known, at about a third of the speed."""
        # The second round has the grid of the first, with the rotations that the paths of the first ask for.
        rounds = Round(48, 32, 10), Round(24, 32, 12), Round(10, 96, 16), Round(4, 288, 12)
        return Elastic(rounds, paths=2, steps=6, knots=512, chunk=16)

    def tabulate(self, curve: Float[AnyArray, "b d n"]) -> CurveTable | WithImage:
        return with_images(tabulate, curve) if self.mirror else tabulate(curve)

    def align(self, first: Any, second: Any) -> Alignment:
        if not self.mirror:
            return self._along(search(first, second, self.rounds, first.count[0] > 0), first, second)
        later = (replace(round_, paths=max(self.paths, -(-round_.paths // 2))) for round_ in self.rounds[1:])
        rounds = self.rounds[0], *later
        paths = search(*both(first, second), rounds, first.own.count[0] > 0)
        mirrored, pairs = smaller(-jnp.max(paths.cosine, axis=1))
        return to_the_curve(self._along(paths.at(pairs), first.own, chosen(mirrored, second)), mirrored)

    def _along(self, paths: Paths, first: CurveTable, second: CurveTable) -> Alignment:
        """The best of the paths, refined."""
        paths, true = paths.best(self.paths), first.count[0] > 0
        flat = lambda warp: warp.reshape(-1, warp.shape[-1])  # noqa: E731
        u = from_warps(flat(paths.warp1), flat(paths.warp2), self.knots)
        rotation = paths.rotation.reshape(*paths.rotation.shape[:2], -1)
        state = refine(first, second, u, rotation, self.steps, true)
        best = jnp.argmin(state.chord.reshape(-1, self.paths), axis=1)
        lane = jnp.arange(len(best)) * self.paths + best
        rotation = state.rotation[..., lane]
        warp1, warp2 = warps_of(first, second, state.u[lane])
        distance = path_distance(first, second, rotation, warp1, warp2, self.nodes)
        return Alignment(jnp.moveaxis(rotation, -1, 0), warp1, warp2, distance)
