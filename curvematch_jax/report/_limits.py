"""How much of a collection a report shows."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Limits:
    """Bounds on what a report holds, so that its size is bounded; the page says what they left out.

    Attributes:
        cells: rows and columns of the matrix as drawn; those of a larger matrix are averaged.
        queries: objects whose rankings are listed, evenly spread over the classes.
        ranked: objects in a ranking.
        explained: queries with matched parts, evenly spread over the classes.
        pairs: objects of a ranking with matched parts.
        surfaces: objects that are drawn, about 50 KB each.
        vertices: of a surface; larger ones are decimated. At most 65,535.
    """

    cells: int = 512
    queries: int = 1000
    ranked: int = 20
    explained: int = 24
    pairs: int = 8
    surfaces: int = 80
    vertices: int = 1500

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not isinstance(value, int) or value < 1:
                raise ValueError(f"{each.name} must be a whole number, 1 or more, and was {value!r}")
        if self.vertices > 65535:
            raise ValueError(f"vertices must be at most 65535, and was {self.vertices}")
