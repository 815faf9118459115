"""Small generated surfaces."""

from itertools import pairwise

import numpy as np
import trimesh

from curvematch_jax.surface import Mesh

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def sphere(subdivisions: int = 4) -> Mesh:
    made = trimesh.creation.icosphere(subdivisions=subdivisions)
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces), "sphere")


def limbed(directions: np.ndarray = AXES, length: float = 2.0, subdivisions: int = 4) -> Mesh:
    """A ball with a limb in each direction, its tip at distance `1 + length`."""
    ball = sphere(subdivisions)
    out = np.asarray(directions) / np.linalg.norm(directions, axis=1, keepdims=True)
    radius = 1 + length * np.exp(30 * (ball.vertices @ out.T - 1)).sum(axis=1)
    return Mesh(ball.vertices * radius[:, None], ball.faces, "limbed")


def torus(major: float = 1.0, minor: float = 0.3) -> Mesh:
    made = trimesh.creation.torus(major, minor, major_sections=96, minor_sections=32)
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces), "torus")


def cube(cells: int = 1) -> Mesh:
    """The unit cube, each side cut into `cells` x `cells` squares of two triangles; every vertex once."""
    steps = np.arange(cells + 1) / cells
    row, column = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    low = (row * (cells + 1) + column).ravel()
    across = cells + 1
    square = np.concatenate(
        [np.stack([low, low + across, low + 1], axis=1), np.stack([low + 1, low + across, low + across + 1], axis=1)]
    )
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    points, faces = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            faces.append((square if side else square[:, ::-1]) + sum(len(block) for block in points))
            points.append(np.roll(np.insert(grid, 2, side, axis=1), axis + 1, axis=1))
    places, group = np.unique(np.concatenate(points).round(12), axis=0, return_inverse=True)
    return Mesh(places, group.ravel()[np.concatenate(faces)], "cube")


def joined(*meshes: Mesh) -> Mesh:
    """All vertices and faces in one mesh, nothing merged."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces), "joined")


def moved(mesh: Mesh, offset: tuple[float, float, float] = (0, 0, 0), scale: float = 1.0) -> Mesh:
    return Mesh(mesh.vertices * scale + offset, mesh.faces, mesh.name)


def without(mesh: Mesh, faces: np.ndarray) -> Mesh:
    """The mesh without some of its faces."""
    keep = np.ones(len(mesh.faces), dtype=bool)
    keep[faces] = False
    return Mesh(mesh.vertices, mesh.faces[keep], mesh.name)


def soup(mesh: Mesh) -> Mesh:
    """Every corner a vertex of its own, as in an STL file."""
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3), mesh.name)


def bridged(mesh: Mesh, first: int, second: int, steps: int = 12) -> Mesh:
    """A short cut: two faces, given by their numbers, become the ends of a straight tube of three sides."""
    start, end = mesh.faces[first], mesh.faces[second][::-1]  # the same way round, seen along the tube
    apart = [np.linalg.norm(mesh.vertices[start] - mesh.vertices[np.roll(end, k)], axis=1).sum() for k in range(3)]
    end = np.roll(end, int(np.argmin(apart)))
    shares = np.arange(1, steps)[:, None, None] / steps
    inner = (1 - shares) * mesh.vertices[start] + shares * mesh.vertices[end]
    rings = [start, *(len(mesh.vertices) + np.arange(3 * (steps - 1)).reshape(-1, 3)), end]
    sides = []
    for low, high in pairwise(rings):
        ahead, above = np.roll(low, -1), np.roll(high, -1)
        sides += [np.stack([low, ahead, high], axis=1), np.stack([ahead, above, high], axis=1)]
    kept = np.delete(mesh.faces, [first, second], axis=0)
    return Mesh(np.concatenate([mesh.vertices, inner.reshape(-1, 3)]), np.concatenate([kept, *sides]), "bridged")


def horseshoe(thickness: float = 0.25, gap: float = 0.6) -> Mesh:
    """A tube bent around a circle of radius 1 up to a gap (radians). The first two vertices are its round ends."""
    half = np.pi - gap / 2 - thickness
    turn = np.linspace(0, np.pi / 2, 9)
    cap = np.stack([thickness * np.sin(turn), half + thickness * np.cos(turn)], axis=1)
    tube = np.stack([np.full(61, thickness), np.linspace(half, -half, 61)], axis=1)
    made = trimesh.creation.revolve(np.concatenate([cap[:-1], tube, cap[-2::-1] * [1, -1]]), sections=24)
    x, y, along = np.asarray(made.vertices).T
    bent = np.stack([(1 + x) * np.cos(along), (1 + x) * np.sin(along), y], axis=1)
    order = np.argsort(np.abs(along) < along.max(), kind="stable")
    rank = np.argsort(order)
    return Mesh(bent[order], rank[np.asarray(made.faces)], "horseshoe")


def sheared(sides: int = 40, rings: int = 60, turn: float = 0.6, rise: float = 0.15) -> Mesh:
    """A closed cylinder whose rings are turned against each other, so that its triangles are slanted needles."""
    angle = 2 * np.pi * np.arange(sides) / sides + turn * np.arange(rings)[:, None]
    height = np.broadcast_to(rise * np.arange(rings)[:, None], angle.shape)
    sheath = np.stack([np.cos(angle), np.sin(angle), height], axis=-1).reshape(-1, 3)
    k, low = np.arange(sides), sides * np.arange(rings - 1)[:, None]
    a, b = (low + k).ravel(), (low + (k + 1) % sides).ravel()
    bottom, top, last = len(sheath), len(sheath) + 1, sides * (rings - 1)
    ends = [
        np.stack([np.full(sides, bottom), (k + 1) % sides, k], axis=1),
        np.stack([np.full(sides, top), last + k, last + (k + 1) % sides], axis=1),
    ]
    faces = np.concatenate([np.stack([a, b, a + sides], axis=1), np.stack([b, b + sides, a + sides], axis=1), *ends])
    return Mesh(np.concatenate([sheath, [[0, 0, 0], [0, 0, rise * (rings - 1)]]]), faces, "sheared")


def _made() -> dict[str, Mesh]:
    """Shapes as CAD programs write them: 8 to 200 vertices, flat faces, needles, unions of boxes."""
    new, place = trimesh.creation, trimesh.transformations.translation_matrix
    box = new.box

    def union(*pieces: trimesh.Trimesh) -> trimesh.Trimesh:
        return trimesh.boolean.union(list(pieces), engine="manifold")

    def legged(leg: float, height: float, seat: float, *more: trimesh.Trimesh) -> trimesh.Trimesh:
        corners = [(x, y, -height / 2) for x in (-0.4, 0.4) for y in (-0.4, 0.4)]
        return union(box((1, 1, seat)), *[box((leg, leg, height), place(corner)) for corner in corners], *more)

    made = {
        "box": box((10, 4, 1)),
        "cube": box((1, 1, 1)),
        "brick": box((3, 2, 1)),
        "beam": box((50, 1, 1)),
        "slat": box((100, 1, 0.5)),
        "slab": box((20, 20, 1)),
        "plate": box((100, 100, 0.1)),
        "oblong plate": box((60, 20, 0.2)),
        **{f"rod of {sides} sides": new.cylinder(1, 100, sections=sides) for sides in (6, 8, 32, 64)},
        "rod of 98 sides": new.cylinder(1, 10, sections=98),
        "prism": new.cylinder(1, 5, sections=5),
        "tin": new.cylinder(1, 2, sections=24),
        "disc": new.cylinder(10, 0.5, sections=90),
        **{
            f"cone of {sides} sides": new.cone(1, height, sections=sides)
            for sides, height in ((8, 3), (64, 3), (128, 20))
        },
        "flat cone": new.cone(1, 0.5, sections=100),
        "pyramid": new.cone(1, 1.5, sections=4),
        "chair": legged(0.1, 1, 0.1),
        "chair with a back": legged(0.1, 1, 0.1, box((1, 0.1, 1), place((0, 0.45, 0.5)))),
        "stool": legged(0.15, 0.6, 0.1),
        "table": legged(0.05, 1.5, 0.04),
        "angle": union(box((5, 1, 1)), box((1, 5, 1), place((2, 2, 0)))),
        "cross": union(box((5, 1, 1)), box((1, 5, 1)), box((1, 1, 5))),
        "tee": union(box((10, 1, 1)), box((1, 1, 8), place((0, 0, -4)))),
        "frame": trimesh.boolean.difference([box((3, 3, 1)), box((1, 1, 2))], engine="manifold"),
        "stairs": union(*[box((1, 2, k + 1), place((k, 0, (k + 1) / 2))) for k in range(5)]),
        "shelf": union(
            *[box((2, 0.5, 0.05), place((0, 0, z))) for z in (0, 0.5, 1, 1.5)],
            *[box((0.05, 0.5, 1.55), place((x, 0, 0.75))) for x in (-1, 1)],
        ),
        "hammer": union(new.cylinder(0.3, 8, sections=12), box((3, 1, 1), place((0, 0, 4)))),
        "pipe": new.annulus(0.8, 1, 3, sections=24),
    }
    return {name: Mesh(np.asarray(m.vertices), np.asarray(m.faces), name) for name, m in made.items()}


MADE = _made()
