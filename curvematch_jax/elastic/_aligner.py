"""Settings of an alignment."""

from dataclasses import dataclass

_LEAST = {"grid": 8, "seeds": 1, "slope": 0, "kept": 1, "steps": 0, "rounds": 1, "nodes": 1, "chunk": 1}


@dataclass(frozen=True)
class Aligner:
    """How hard to look for the alignment of two curves. The presets differ in these settings alone.

    Attributes:
        grid: arc-length samples for start points and dynamic programming.
        seeds: start points tried, the highest local maxima of the rotation gain over all shifts.
        band: half width of the dynamic programming's band around the diagonal, as a share of the grid.
        slope: largest step of the dynamic programming in either direction; slopes lie in [1/slope, slope].
            0 for no warp at all: start point and rotation only.
        kept: seeds that are refined, the best after dynamic programming.
        steps: refinement steps in each round.
        rounds: rounds of refinement; each starts from the better of a direction's own warp and the other's inverse.
        nodes: quadrature nodes to an interval between samples.
        chunk: pairs computed at once.
    """

    grid: int = 48
    seeds: int = 6
    band: float = 0.25
    slope: int = 3
    kept: int = 1
    steps: int = 4
    rounds: int = 2
    nodes: int = 2
    chunk: int = 64

    def __post_init__(self) -> None:
        for name, least in _LEAST.items():
            if getattr(self, name) < least:
                raise ValueError(f"Aligner.{name} = {getattr(self, name)}: it has to be {least} or more.")
        if not 0 < self.band <= 0.5:
            raise ValueError(f"Aligner.band = {self.band}: it is a share of the grid, in (0, 0.5].")
        if self.kept > self.seeds or self.seeds > self.grid:
            raise ValueError(f"Aligner needs kept <= seeds <= grid, not {self.kept}, {self.seeds}, {self.grid}.")

    @classmethod
    def fast(cls) -> "Aligner":
        """For matrices of many millions of pairs."""
        return cls()

    @classmethod
    def accurate(cls) -> "Aligner":
        """The best alignment known, at about a twentieth of the speed."""
        return cls(grid=64, seeds=16, kept=6, slope=4, steps=12, nodes=4, chunk=32)

    @classmethod
    def rigid(cls) -> "Aligner":
        """Start point and rotation only, both curves by arc length: the least effort, and an upper bound."""
        return cls(grid=64, slope=0, chunk=256)
