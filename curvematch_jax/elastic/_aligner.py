"""Settings of an alignment."""

from dataclasses import dataclass

_LEAST = {"grid": 8, "seeds": 1, "slope": 0, "passes": 1, "table": 1, "fineness": 1, "chunk": 1}
_LEAST_OF_STAGE = {"kept": 1, "steps": 0, "knots": 8, "nodes": 1}


def _check_least(settings: object, least: dict[str, int]) -> None:
    for name, value in least.items():
        if getattr(settings, name) < value:
            raise ValueError(
                f"{type(settings).__name__}.{name} = {getattr(settings, name)}: it has to be {value} or more."
            )


@dataclass(frozen=True)
class Stage:
    """One stage of refinement.

    Attributes:
        kept: alignments that are refined, the best of those before.
        steps: Gauss-Newton steps.
        knots: pieces of the path, linear each.
        nodes: quadrature nodes to a piece.
    """

    kept: int
    steps: int
    knots: int
    nodes: int = 2

    def __post_init__(self) -> None:
        _check_least(self, _LEAST_OF_STAGE)


@dataclass(frozen=True)
class Aligner:
    """How hard to look for the alignment of two curves. The presets differ in these settings alone.

    Attributes:
        grid: arc-length samples for start points and dynamic programming.
        seeds: start points tried, the highest local maxima of the rotation gain over all shifts.
        band: half width of the dynamic programming's band around the diagonal, as a share of the grid.
        slope: largest step of the dynamic programming in either direction; slopes lie in [1/slope, slope].
            0 for no warp at all: start point and rotation only.
        passes: dynamic programmings of a seed, its rotation solved again before each.
        stages: of refinement on the continuous problem, coarse to fine.
        table: tangents tabulated to a sample of the grid, or more for curves of many samples; refinement interpolates
            between them.
        fineness: samples of the resulting warp to a sample of the curve. A warp that skips a piece of curve2 spends
            one of its intervals on it, and the curve does not pass there: coarse warps cannot hold good alignments.
        chunk: pairs computed at once.
    """

    grid: int = 48
    seeds: int = 8
    band: float = 0.25
    slope: int = 3
    passes: int = 1
    stages: tuple[Stage, ...] = (Stage(kept=3, steps=3, knots=48), Stage(kept=1, steps=8, knots=112))
    table: int = 12
    fineness: int = 4
    chunk: int = 64

    def __post_init__(self) -> None:
        _check_least(self, _LEAST)
        if not 0 < self.band <= 0.5:
            raise ValueError(f"Aligner.band = {self.band}: it is a share of the grid, in (0, 0.5].")
        kept = [stage.kept for stage in self.stages]
        if [self.grid, self.seeds, *kept] != sorted([self.grid, self.seeds, *kept], reverse=True):
            raise ValueError(
                f"Aligner needs grid >= seeds >= kept of each stage in turn, not {self.grid}, {self.seeds}, {kept}."
            )

    @classmethod
    def fast(cls) -> "Aligner":
        """For matrices of many millions of pairs."""
        return cls()

    @classmethod
    def accurate(cls) -> "Aligner":
        """The best alignment known, at about a seventh of the speed."""
        stages = Stage(24, 3, 48), Stage(6, 8, 96), Stage(1, 16, 256)
        return cls(seeds=24, passes=3, stages=stages, fineness=8, chunk=32)

    @classmethod
    def rigid(cls) -> "Aligner":
        """Start point and rotation only, both curves by arc length: the least effort, and an upper bound."""
        return cls(grid=64, slope=0, stages=(), table=4, chunk=256)
