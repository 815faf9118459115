"""What `clean` says of its work: what was changed, and how far that moved the surface."""

from dataclasses import dataclass, field

# Changes that are warned about: of area and volume, of extents, and of the place of a point in widths.
_AREA, _EXTENT, _PLACE = 0.01, 0.005, 0.01
_INVENTED = 0.01  # of the area


@dataclass(frozen=True)
class CleanReport:
    """What `clean` changed, as counts; all zero when the mesh was clean.

    `area`, `volume` and `extents` are those of the kept pieces as they were given and of the result, in mesh units; the
    volume of an open surface is NaN. A report of a clean mesh holds zeros there.
    """

    welded: int = 0  # vertices merged into another
    dropped_faces: int = 0  # degenerate or duplicate
    unused_vertices: int = 0
    cut: int = 0  # vertices added where faces met in no manifold way
    flipped: int = 0  # faces turned round
    dropped_components: int = 0
    dropped_area: float = 0.0  # their share of the area
    joined_patches: int = 0
    decimated: tuple[int, int] = (0, 0)  # vertices before and after
    closed_holes: int = 0
    invented: float = field(default=0.0, compare=False)  # area of what closes holes and joins patches, of that before
    refined: tuple[int, int] = (0, 0)  # vertices before and after; the surface stays exactly as it is
    area: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    volume: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    extents: tuple[tuple[float, ...], tuple[float, ...]] = field(default=((), ()), compare=False)
    moved: float = field(default=0.0, compare=False)  # Hausdorff distance of both surfaces, sampled, in widths

    @property
    def messages(self) -> tuple[str, ...]:
        """One sentence for each change, and one for each warning."""
        sentences = (
            (self.welded, f"{self.welded} vertices welded"),
            (self.dropped_faces, f"{self.dropped_faces} degenerate or duplicate faces dropped"),
            (self.unused_vertices, f"{self.unused_vertices} unused vertices dropped"),
            (self.cut, f"{self.cut} vertices added to cut non-manifold edges and vertices apart"),
            (self.flipped, f"{self.flipped} faces turned round"),
            (
                self.dropped_components,
                f"{self.dropped_components} smaller components dropped, {self.dropped_area:.2%} of the area",
            ),
            (self.decimated[0], "decimated from {} to {} vertices".format(*self.decimated)),
            (self.joined_patches, f"{self.joined_patches} open patches joined"),
            (self.closed_holes, f"{self.closed_holes} holes closed"),
            (self.refined[0], "refined from {} to {} vertices, the surface as it was".format(*self.refined)),
        )
        return tuple(sentence for count, sentence in sentences if count) + self.warnings

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was moved or invented more than a little: area and volume by 1 %, extents by 0.5 %, points by 1 %."""
        found = []
        if self.invented > _INVENTED:
            found.append(f"what closes it has {self.invented:.1%} of the area that was there")
        changes = [("area", self.area, _AREA), ("volume", self.volume, _AREA)]
        changes += [(f"extent along {axis}", pair, _EXTENT) for axis, *pair in zip("xyz", *self.extents, strict=False)]
        for name, (before, after), stated in changes:
            if before and abs(after - before) > stated * before:
                found.append(f"{name} changed by {after / before - 1:+.1%}")
        if self.moved > _PLACE:
            found.append(f"the surface moved by up to {self.moved:.1%} of its width")
        return tuple(found)
