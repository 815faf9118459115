"""What a topological short cut does to parts and to retrieval, by the distance along the surface.

    python -m benchmarks shortcut [--poses 3] [--widths 0.02 0.06] [--out FILE.json]

The creatures of all classes are compared with themselves after a bridge has joined a limb to what it nearly touches
(widths in square roots of the area, where limbs are 0.06 to 0.1 wide). For every field:

- points: the share of feature points that have one of the bridged creature within 0.05 geodesic diameters, and how
  many points of the bridged creature are near none, per creature;
- curves: of these pairs of points, the mean elastic distance of curves of one level (radians), and the mean absolute
  logarithm of the ratio of their lengths; the share of levels that only one of the two has;
- retrieval: the creature, bridged or not, queries all other creatures, which are not bridged. Nearest neighbour and
  mean average precision over the same queries before and after.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import get_args

import manifold3d
import numpy as np
from scipy.spatial import KDTree

from curvematch_jax import Aligner, Extraction, Matching, Mesh, MeshError, Parts, extract_parts, pair_distances, rank
from curvematch_jax.datasets import CREATURES, creatures
from curvematch_jax.retrieval._measures import average_precision, nearest_neighbour
from curvematch_jax.surface._features import diameter_pair, feature_points
from curvematch_jax.surface._fields import Field, Geodesics
from curvematch_jax.surface._topology import face_areas

from ._measure import say
from ._record import record

NEAR = 0.05
# Where a bridge ends, in geodesic diameters from a feature point: off the tip, which is still there then.
_FROM_TIP = (0.08, 0.12)
# How far away the other end is at least, on the surface.
_FAR = 0.35


@dataclass(frozen=True, eq=False)
class Model:
    """A creature and its short cuts, by width; none where there is no place for one."""

    mesh: Mesh
    label: str
    diameter: float
    bridged: dict[float, Mesh]


def models(classes: Sequence[str], poses: int, widths: Sequence[float]) -> list[Model]:
    """The creatures, most of them with short cuts."""
    made = []
    for creature in creatures(classes, poses):
        diameter = diameter_pair(creature.mesh, Geodesics(creature.mesh))[2]
        try:
            bridged = {width: with_short_cut(creature.mesh, width)[0] for width in widths}
        except MeshError as error:
            say(str(error))
            bridged = {}
        made.append(Model(creature.mesh, creature.label, diameter, bridged))
    return made


def judged(field: Field, collection: Sequence[Model], widths: Sequence[float]) -> dict[float, dict[str, float]]:
    """The figures of one field, for each width."""
    settings = Extraction(field=field)
    clean = [extract_parts(model.mesh, settings) for model in collection]
    labels = [model.label for model in collection]
    chosen = [k for k, model in enumerate(collection) if model.bridged]
    before = retrieval(chosen, [clean[k] for k in chosen], clean, labels)
    rows = {}
    for width in widths:
        bridged = [extract_parts(collection[k].bridged[width], settings) for k in chosen]
        pairs = [(clean[k], other, collection[k].diameter) for k, other in zip(chosen, bridged, strict=True)]
        after = retrieval(chosen, bridged, clean, labels)
        rows[width] = changes(pairs) | before_and_after(before, after)
        say(f"{field}, width {width}: {rows[width]}")
    return rows


def changes(pairs: Iterable[tuple[Parts, Parts, float]]) -> dict[str, float]:
    """How points and curves change, from parts before and after and the geodesic diameter before."""
    found, new, shapes, sizes, levels = [], [], [], [], []
    for before, after, diameter in pairs:
        apart = np.linalg.norm(before.points[:, None] - after.points[None], axis=2) / diameter
        found += (apart.min(axis=1) <= NEAR).tolist()
        new.append(int((apart.min(axis=0) > NEAR).sum()))
        kept = np.flatnonzero(apart.min(axis=1) <= NEAR)
        partner = apart.argmin(axis=1)[kept]
        one, other = before.mask[kept], after.mask[partner]
        levels += (one ^ other)[one | other].tolist()
        both = one & other
        ratio = after.lengths[partner][both] / before.lengths[kept][both]
        sizes += np.abs(np.log(ratio)).tolist()
        shapes += elastic(before.curves[kept][both], after.curves[partner][both])
    return {
        "points": len(found),
        "points_found": float(np.mean(found)),
        "points_new": float(np.mean(new)),
        "levels_changed": float(np.mean(levels)),
        "curve_distance": float(np.mean(shapes)),
        "log_length_ratio": float(np.mean(sizes)),
    }


def elastic(first: np.ndarray, second: np.ndarray) -> list[float]:
    """Elastic distances of curves `(c, 3, n)`, one by one."""
    if not len(first):
        return []
    pairs = np.repeat(np.arange(len(first))[:, None], 2, axis=1)
    return np.asarray(pair_distances(first, second, pairs, Aligner.fast())).tolist()


def retrieval(
    chosen: Sequence[int], queries: Sequence[Parts], collection: Sequence[Parts], labels: Sequence[str]
) -> dict[str, float]:
    """Nearest neighbour and mean average precision of queries that are some of the collection, or made from them."""
    first, precision = [], []
    for k, query in zip(chosen, queries, strict=True):
        others = [j for j in range(len(collection)) if j != k]
        order = rank(query, [collection[j] for j in others], Matching()).order
        relevant = np.array([labels[j] == labels[k] for j in others])[order]
        first.append(nearest_neighbour(relevant))
        precision.append(average_precision(relevant))
    return {"nn": float(np.mean(first)), "map": float(np.mean(precision))}


def before_and_after(before: dict[str, float], after: dict[str, float]) -> dict[str, float]:
    """Both in one row."""
    return {f"{name}_{when}": row[name] for name in before for when, row in (("before", before), ("after", after))}


def say_table(results: dict[Field, dict[float, dict[str, float]]]) -> None:
    """A table for each width."""
    for width in next(iter(results.values())):
        say(f"\nbridges of width {width}")
        say("field         found   new  levels  curves  lengths  NN before  after  mAP before  after")
        for field, rows in results.items():
            row = rows[width]
            say(
                f"{field:12} {row['points_found']:6.3f} {row['points_new']:5.2f} {row['levels_changed']:7.3f} "
                f"{row['curve_distance']:7.3f} {row['log_length_ratio']:8.3f} {row['nn_before']:10.3f} "
                f"{row['nn_after']:6.3f} {row['map_before']:11.3f} {row['map_after']:6.3f}"
            )


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=int, default=3, metavar="N", help="creatures of a class")
    parser.add_argument("--widths", type=float, nargs="+", default=[0.02, 0.06], help="in square roots of the area")
    parser.add_argument("--fields", nargs="+", choices=get_args(Field), default=get_args(Field))
    parser.add_argument("--classes", nargs="+", choices=CREATURES, default=CREATURES, metavar="NAME")


def run(arguments: argparse.Namespace) -> None:
    if arguments.poses < 2:
        raise ValueError(f"--poses must be at least 2, or no query finds its class; found {arguments.poses}")
    collection = models(arguments.classes, arguments.poses, arguments.widths)
    if not any(model.bridged for model in collection):
        raise ValueError(f"no creature of {', '.join(arguments.classes)} has a place for a bridge: take more of them")
    results = {field: judged(field, collection, arguments.widths) for field in arguments.fields}
    say_table(results)
    facts = {
        "creatures": len(collection),
        "queries": sum(bool(model.bridged) for model in collection),
        "settings": asdict(Extraction()) | {"field": "each"},
    }
    record(arguments, {**facts, "fields": results})


def with_short_cut(mesh: Mesh, width: float) -> tuple[Mesh, float]:
    """Join a limb to what it nearly touches by a straight round bridge, `width` thick in square roots of the area.

    Each feature point's surroundings come nearest to the rest of the surface somewhere. Of these places the one
    where a bridge makes the way shortest, for what it is on the surface, gets one. A bridge that meets anything on its
    way is not taken.

    Args:
        mesh: a closed connected surface.

    Returns:
        the boolean union, and how many times shorter the bridge is than the way on the surface.

    Raises:
        MeshError: there is no such place.
    """
    size = float(np.sqrt(face_areas(mesh.vertices, mesh.faces).sum()))
    edge = float(np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1).mean())
    body = _solid(mesh)
    for gain, start, end in sorted(_candidates(mesh), reverse=True):
        joined = body + _capsule(mesh.vertices[[start, end]], width * size / 2, edge)
        if joined.genus() == body.genus() + 1 and len(joined.decompose()) == 1:
            made = joined.to_mesh64()
            faces = np.array(made.tri_verts, dtype=np.int64)
            return Mesh(np.array(made.vert_properties[:, :3]), faces, mesh.name), gain
    raise MeshError(f"{mesh.name}: no place for a bridge")


def _candidates(mesh: Mesh) -> Iterator[tuple[float, int, int]]:
    """For each feature point where the surface near it comes nearest to what is far, and what a bridge would save."""
    geodesics = Geodesics(mesh)
    features = feature_points(mesh, geodesics, 0.05)
    low, high, far = (share * features.diameter for share in (*_FROM_TIP, _FAR))
    for tip in features.vertices.tolist():
        near = np.flatnonzero((geodesics(tip) >= low) & (geodesics(tip) <= high))
        away = np.flatnonzero(geodesics(tip) >= far)
        apart, place = map(np.asarray, KDTree(mesh.vertices[away]).query(mesh.vertices[near]))
        nearest = np.argmin(apart)
        start, end = int(near[nearest]), int(away[place[nearest]])
        yield float(geodesics(start)[end] / apart[nearest]), start, end


def _solid(mesh: Mesh):
    return manifold3d.Manifold(manifold3d.Mesh64(np.array(mesh.vertices), mesh.faces.astype(np.uint64)))


def _capsule(ends: np.ndarray, radius: float, edge: float):
    """The convex hull of two balls, with triangles about as large as the surface's."""
    ball = manifold3d.Manifold.sphere(radius, 8)
    return manifold3d.Manifold.batch_hull([ball.translate(end) for end in ends]).refine_to_length(edge)
