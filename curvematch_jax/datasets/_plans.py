"""The body plans of the generated creatures. x is to the left, y forward, z up; a human is 1.8 tall.

The ranges of the joints keep limbs apart: limbs that touch would change the surface's topology, and a pose would no
longer be nearly isometric to the next.
"""

import itertools
import math
from collections.abc import Callable, Sequence

from ._skeleton import Bone, Plan, Turn, Vector, both_sides

_X: Vector = (1.0, 0.0, 0.0)
_Y: Vector = (0.0, 1.0, 0.0)
_Z: Vector = (0.0, 0.0, 1.0)

# One bone of a limb: its vector, its radius at the tip, the turns of the joint at its start.
Segment = tuple[Vector, float, tuple[Turn, ...]]


def _limb(
    name: str,
    parent: str | None,
    radius: float,
    segments: Sequence[Segment],
    *,
    group: str = "",
    at: float = 1.0,
    offset: Vector = (0.0, 0.0, 0.0),
    flat: float = 1.0,
    normal: Vector = _Z,
) -> tuple[Bone, ...]:
    """A chain of bones that starts with `radius`. The first has the limb's name, the others have it numbered."""
    stem, dot, side = name.partition(".")
    bones: list[Bone] = []
    for k, (vector, tip_radius, turns) in enumerate(segments):
        here = Bone(
            name=name if k == 0 else f"{stem} {k}{dot}{side}",
            parent=bones[-1].name if bones else parent,
            vector=vector,
            radii=(radius, tip_radius),
            group=group or stem,
            turns=turns,
            at=1.0 if bones else at,
            offset=(0.0, 0.0, 0.0) if bones else offset,
            flat=flat,
            normal=normal,
        )
        bones.append(here)
        radius = tip_radius
    return tuple(bones)


def _upper_body(parent: str, offset: Vector = (0.0, 0.0, 0.0)) -> tuple[Bone, ...]:
    """A human from the waist up: what the centaur borrows."""
    waist, chest = (Turn(_X, -10, 15), Turn(_Z, -15, 15)), (Turn(_X, -10, 15), Turn(_Y, -10, 10), Turn(_Z, -15, 15))
    trunk = (((0.0, 0.0, 0.16), 0.12, waist), ((0.0, 0.0, 0.32), 0.15, chest))
    shoulder = (((0.13, 0.0, 0.0), 0.07, ()),)
    arm = (
        ((0.24, 0.0, -0.14), 0.049, (Turn(_Y, -55, 20), Turn(_Z, -30, 50))),
        ((0.22, 0.0, -0.13), 0.04, (Turn((0.5, 0.0, 0.86), 0, 95),)),
        ((0.13, 0.0, -0.08), 0.036, (Turn(_Y, -30, 30),)),
    )
    head = (
        ((0.0, 0.01, 0.24), 0.058, (Turn(_X, -15, 15),)),
        ((0.0, 0.02, 0.1), 0.1, (Turn(_X, -15, 15),)),
        ((0.0, 0.01, 0.06), 0.09, ()),
    )
    return (
        *_limb("waist", parent, 0.125, trunk, group="trunk", offset=offset, flat=0.75, normal=_Y),
        *both_sides(_limb("shoulder.l", "waist 1", 0.09, shoulder, group="trunk", at=0.86)),
        *both_sides(_limb("arm.l", "waist 1", 0.058, arm, at=0.86, offset=(0.15, 0.0, 0.0))),
        *_limb("head", "waist 1", 0.062, head),
    )


def _human() -> Plan:
    hips = _limb("hips", None, 0.13, (((0.0, 0.0, 0.1), 0.125, ()),), group="trunk", flat=0.8, normal=_Y)
    leg = (
        ((0.05, 0.0, -0.42), 0.065, (Turn(_Y, -22, 2), Turn(_X, -20, 60))),
        ((0.02, -0.01, -0.4), 0.042, (Turn(_X, -75, 0),)),
        ((0.02, 0.18, -0.03), 0.039, (Turn(_X, -20, 20),)),
    )
    return Plan(
        (
            *hips,
            *_upper_body("hips"),
            *both_sides(_limb("leg.l", "hips", 0.092, leg, at=0.0, offset=(0.095, 0.0, -0.03))),
        )
    )


def _four_legs() -> tuple[Bone, ...]:
    """Barrel, legs and tail of a horse: what the centaur borrows. The shoulders are at the barrel's tip."""
    barrel = (((0.0, 0.33, 0.0), 0.15, ()), ((0.0, 0.33, 0.02), 0.165, (Turn(_Z, -15, 15), Turn(_X, -8, 8))))

    def leg(swing: Turn, knee: Turn) -> tuple[Segment, ...]:
        return (
            ((0.02, 0.0, -0.38), 0.05, (swing, Turn(_Y, -10, 2))),
            ((0.0, 0.0, -0.3), 0.038, (knee,)),
            ((0.0, 0.05, -0.07), 0.045, (Turn(_X, -15, 15),)),
        )

    hind, fore = leg(Turn(_X, -25, 25), Turn(_X, -50, 0)), leg(Turn(_X, -20, 45), Turn(_X, -60, 0))
    tail = (((0.0, -0.22, -0.02), 0.05, (Turn(_X, -30, 20), Turn(_Z, -30, 30))), ((0.0, -0.2, -0.25), 0.037, ()))
    return (
        *_limb("barrel", None, 0.17, barrel),
        *both_sides(_limb("hind leg.l", "barrel", 0.09, hind, group="leg", at=0.0, offset=(0.105, 0.0, -0.08))),
        *both_sides(_limb("fore leg.l", "barrel 1", 0.085, fore, group="leg", offset=(0.105, 0.0, -0.08))),
        *_limb("tail", "barrel", 0.045, tail, at=0.0, offset=(0.0, -0.1, 0.09)),
    )


def _horse() -> Plan:
    head = (
        ((0.0, 0.2, 0.34), 0.085, (Turn(_X, -35, 15), Turn(_Z, -25, 25))),
        ((0.0, 0.27, -0.1), 0.055, (Turn(_X, -15, 25),)),
    )
    ear = (((0.03, -0.03, 0.14), 0.034, ()),)
    return Plan(
        (
            *_four_legs(),
            *_limb("head", "barrel 1", 0.12, head, offset=(0.0, 0.03, 0.05)),
            *both_sides(_limb("ear.l", "head 1", 0.042, ear, group="head", at=0.0, offset=(0.055, 0.0, 0.04))),
        )
    )


def _centaur() -> Plan:
    return Plan((*_four_legs(), *_upper_body("barrel 1", offset=(0.0, 0.02, 0.07))))


def _bird() -> Plan:
    neck = (((0.0, 0.13, 0.12), 0.075, (Turn(_Z, -40, 40), Turn(_X, -35, 20))), ((0.0, 0.06, 0.03), 0.08, ()))
    wing = (
        ((0.32, 0.06, 0.06), 0.13, (Turn(_Y, -40, 25), Turn(_Z, -15, 20))),
        ((0.45, -0.12, 0.0), 0.085, (Turn(_Y, -35, 30), Turn(_Z, -30, 5))),
    )
    leg = (
        ((0.02, -0.02, -0.18), 0.036, (Turn(_X, -30, 40),)),
        ((0.01, 0.13, -0.02), 0.036, (Turn(_X, -30, 10),)),
    )
    return Plan(
        (
            *_limb("body", None, 0.11, (((0.0, 0.36, 0.08), 0.15, ()),)),
            *_limb("neck", "body", 0.1, neck),
            *_limb("beak", "neck 1", 0.05, (((0.0, 0.2, -0.03), 0.03, ()),)),
            *_limb("tail", "body", 0.1, (((0.0, -0.36, 0.0), 0.13, (Turn(_X, -20, 25),)),), at=0.0, flat=0.35),
            *both_sides(_limb("wing.l", "body", 0.12, wing, at=0.75, offset=(0.06, 0.0, 0.03), flat=0.35)),
            *both_sides(_limb("leg.l", "body", 0.048, leg, at=0.4, offset=(0.07, 0.0, -0.09))),
        )
    )


def _radial(angle: float, out: float, up: float) -> Vector:
    """A vector in the vertical plane at `angle` (degrees, from x towards y)."""
    return (out * math.cos(math.radians(angle)), out * math.sin(math.radians(angle)), up)


def _octopus() -> Plan:
    bones = list(
        _limb("mantle", None, 0.2, (((0.0, 0.0, 0.2), 0.22, ()), ((0.0, -0.1, 0.3), 0.19, (Turn(_X, -20, 20),))))
    )
    for k in range(8):
        angle = 45.0 * k + 22.5
        # Positive turns about this axis lift the arm.
        side = _radial(angle - 90, 1, 0)
        slopes, radii = (-0.1, -0.08, -0.02, 0.02, 0.06), (0.062, 0.054, 0.046, 0.039, 0.033)
        curl = ((-25, 10), (-25, 25), (-25, 40), (-20, 50), (-20, 50))
        segments = tuple(
            (_radial(angle, 0.17, slope), radius, (Turn(side, *bend), Turn(_Z, -6, 6)))
            for slope, radius, bend in zip(slopes, radii, curl, strict=True)
        )
        offset = _radial(angle, 0.1, -0.06)
        bones += _limb(f"arm{k}", "mantle", 0.075, segments, group="arm", at=0.0, offset=offset)
    return Plan(tuple(bones))


def _spider() -> Plan:
    body = (((0.0, 0.2, 0.0), 0.13, ()),)
    abdomen = (((0.0, -0.3, 0.08), 0.2, (Turn(_X, -15, 10), Turn(_Z, -15, 15))), ((0.0, -0.16, 0.0), 0.14, ()))
    bones = [*_limb("body", None, 0.13, body), *_limb("abdomen", "body", 0.07, abdomen, at=0.0)]
    for k, angle in enumerate((-42.0, -14.0, 14.0, 42.0)):
        lift = _radial(angle - 90, 1, 0)
        segments = (
            (_radial(angle, 0.3, 0.26), 0.043, (Turn(lift, -15, 15), Turn(_Z, -7, 7))),
            (_radial(angle, 0.36, -0.2), 0.037, (Turn(lift, -20, 15),)),
            (_radial(angle, 0.14, -0.36), 0.032, (Turn(lift, -20, 20),)),
        )
        offset = (0.07, -0.02 + 0.08 * k, 0.0)
        bones += both_sides(_limb(f"leg{k}.l", "body", 0.046, segments, group="leg", at=0.0, offset=offset))
    return Plan(tuple(bones))


def _hand() -> Plan:
    wrist = _limb("wrist", None, 0.2, (((0.0, 0.0, 0.5), 0.19, (Turn(_X, -15, 15),)),), flat=0.7, normal=_Y)
    palm = _limb("palm", "wrist", 0.22, (((0.0, 0.0, 0.32), 0.35, (Turn(_X, -30, 30),)),), flat=0.4, normal=_Y)
    bones = [*wrist, *palm]
    fingers = {
        "index": (-0.27, 0.06, 14, 0.98),
        "middle": (-0.1, 0.17, 4, 1.0),
        "ring": (0.1, 0.17, -5, 0.95),
        "little": (0.27, 0.06, -15, 0.82),
    }
    for name, (across, along, lean, size) in fingers.items():
        lengths, radii = (0.32 * size, 0.24 * size, 0.2 * size), (0.063, 0.058, 0.052)
        side = math.tan(math.radians(-lean))
        knuckles = (Turn(_X, -8, 32), Turn(_X, 0, 50), Turn(_X, 0, 40))
        segments = tuple(
            ((length * side, 0.0, length), radius, (turn,))
            for length, radius, turn in zip(lengths, radii, knuckles, strict=True)
        )
        bones += _limb(name, "palm", 0.068, segments, group="finger", offset=(across, 0.0, along))
    thumb = (
        ((-0.28, 0.03, 0.06), 0.09, (Turn(_Y, -5, 20), Turn(_Z, -30, 10))),
        ((-0.2, 0.02, 0.16), 0.08, (Turn(_Y, -5, 20),)),
        ((-0.12, 0.02, 0.18), 0.064, (Turn(_Y, -5, 20),)),
    )
    bones += _limb("thumb", "palm", 0.11, thumb, at=0.0, offset=(-0.14, 0.0, 0.1))
    return Plan(tuple(bones))


def _snake() -> Plan:
    radii = (0.05, 0.06, 0.066, 0.07, 0.072, 0.072, 0.07, 0.066, 0.06, 0.054, 0.048)
    body = tuple(((0.0, 0.2, 0.0), radius, (Turn(_Z, -36, 36), Turn(_X, -10, 10))) for radius in radii)
    head = (((0.0, 0.1, 0.01), 0.095, ()), ((0.0, 0.12, -0.01), 0.055, ()))
    return Plan((*_limb("body", None, 0.03, body), *_limb("head", f"body {len(radii) - 1}", 0.05, head, flat=0.7)))


def _teapot() -> Plan:
    tilt = (Turn(_Y, -12, 12),)
    spout = (((0.2, 0.0, 0.06), 0.08, tilt), ((0.1, 0.0, 0.2), 0.06, tilt), ((0.12, 0.0, 0.08), 0.055, ()))
    lid = (((0.0, 0.0, 0.1), 0.07, ()), ((0.0, 0.0, 0.07), 0.085, ()))
    # An arc from inside the body out and back in.
    arc = [(0.45 * math.sin(math.radians(t)), 0.22 * math.cos(math.radians(t))) for t in range(0, 181, 30)]
    handle = tuple(((x0 - x1, 0.0, z1 - z0), 0.05, ()) for (x0, z0), (x1, z1) in itertools.pairwise(arc))
    return Plan(
        (
            *_limb("body", None, 0.4, (((0.02, 0.0, 0.0), 0.4, ()),), flat=0.85),
            *_limb("lid", "body", 0.16, lid, offset=(0.0, 0.0, 0.27)),
            *_limb("spout", "body", 0.13, spout, offset=(0.25, 0.0, -0.06)),
            *_limb("handle", "body", 0.05, handle, at=0.0, offset=(-0.24, 0.0, 0.22)),
        ),
        genus=1,
    )


def _airplane() -> Plan:
    wing = (
        ((0.45, -0.1, 0.03), 0.12, (Turn(_Y, -12, 8), Turn(_Z, -25, 12))),
        ((0.45, -0.12, 0.03), 0.085, (Turn(_Y, -15, 5),)),
    )
    tail = (((0.3, -0.1, 0.02), 0.075, (Turn(_Y, -12, 8), Turn(_Z, -15, 10))),)
    fin = (((0.0, -0.14, 0.32), 0.075, (Turn(_X, -12, 12),)),)
    return Plan(
        (
            *_limb(
                "body",
                None,
                0.06,
                (((0.0, 0.6, -0.02), 0.12, ()), ((0.0, 0.7, 0.0), 0.12, ()), ((0.0, 0.22, -0.02), 0.06, ())),
            ),
            *both_sides(_limb("wing.l", "body 1", 0.17, wing, at=0.4, offset=(0.05, 0.0, -0.04), flat=0.35)),
            *both_sides(_limb("tail.l", "body", 0.1, tail, at=0.05, offset=(0.02, 0.0, 0.01), flat=0.38)),
            *_limb("fin", "body", 0.12, fin, at=0.05, flat=0.38, normal=_X),
        )
    )


PLANS: dict[str, Callable[[], Plan]] = {
    "airplane": _airplane,
    "bird": _bird,
    "centaur": _centaur,
    "hand": _hand,
    "horse": _horse,
    "human": _human,
    "octopus": _octopus,
    "snake": _snake,
    "spider": _spider,
    "teapot": _teapot,
}
