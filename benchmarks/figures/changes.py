"""What changes of a mesh cost retrieval: noise, misplaced feature points, dirt."""

from __future__ import annotations

import argparse
import dataclasses
import re
import zlib
from pathlib import Path

import numpy as np

from curvematch_jax.surface import Extraction, Mesh, Parts, extract_parts
from curvematch_jax.surface._features import feature_points
from curvematch_jax.surface._fields import distances_on
from curvematch_jax.surface._parts import described, parts_around, prepared

from .._measure import say
from .._models import Model, models_in
from ._changed import Queries, changed, compared
from ._collection import Collection, Numbers

NOISE = (0.002, 0.005)  # in diagonals of the bounding box
MOVES = (0.01, 0.02)  # in geodesic diameters
# Vertices this far from where a point is to be, as a share of the way, are as good as any.
_TOLERANCE = 0.25
# Of each kind of patch, and how wide it is, in diagonals of the bounding box.
_PATCHES, _WIDTH = 6, 0.015


def noise(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Noisy queries against the clean collection.

    Every vertex moves along its normal by a Gaussian step whose standard deviation is a share of the bounding box's
    diagonal.
    """
    variants = changed(collection, noisy_parts, NOISE, arguments.per_class)
    return compared(collection, variants, arguments.methods, picture, "noise, in diagonals of the bounding box")


def with_noise(mesh: Mesh, amount: float, seed: int = 0) -> Mesh:
    """A mesh whose vertices have moved along their normals, `amount` diagonals of the bounding box in the r.m.s."""
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    steps = np.random.default_rng(seed).normal(scale=amount * diagonal, size=(len(mesh.vertices), 1))
    return Mesh(mesh.vertices + steps * vertex_normals(mesh), mesh.faces, mesh.name)


def vertex_normals(mesh: Mesh) -> np.ndarray:
    """Unit normals (v, 3), those of the faces around weighted by area; 0 where there are none."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    normals = np.zeros_like(mesh.vertices)
    for corner in mesh.faces.T:
        np.add.at(normals, corner, np.cross(b - a, c - a))
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(size > 0, size, 1)


def noisy_parts(task: tuple[Model, float]) -> Parts:
    """Parts of one noisy model; another model, another noise."""
    model, amount = task
    return extract_parts(with_noise(model.mesh(), amount, zlib.crc32(model.name.encode())))


def moved_points(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Queries from misplaced feature points against the collection from those where they should be.

    Every feature point of a query moves to a random vertex at a geodesic distance of a share of the diameter.
    """
    variants = changed(collection, parts_from_moved_points, MOVES, arguments.per_class)
    return compared(collection, variants, arguments.methods, picture, "feature points moved, in diameters")


def moved(field: np.ndarray, away: float, random: np.random.Generator) -> int:
    """A random vertex where the distance field of a feature point (v,) is about `away`; without one, the nearest."""
    off = np.abs(field - away)
    near = np.flatnonzero(off <= _TOLERANCE * away)
    return int(random.choice(near)) if len(near) else int(np.argmin(off))


def parts_from_moved_points(task: tuple[Model, float]) -> Parts:
    """Parts of one model, every feature point moved by a share of the diameter."""
    (model, amount), settings = task, Extraction()
    mesh, report = prepared(model.mesh(), settings)
    distances = distances_on(mesh, settings.field)
    features = feature_points(mesh, distances, settings.epsilon, settings.min_parts)
    random = np.random.default_rng(zlib.crc32(model.name.encode()))
    vertices = [moved(distances(v), amount * features.diameter, random) for v in features.vertices.tolist()]
    features = features._replace(vertices=np.array(vertices))
    parts = parts_around(mesh, distances, features, settings, report.messages)
    return dataclasses.replace(parts, **described(mesh))


def dirt(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Raw meshes as queries against clean ones.

    The folder `--raw` has the same classes: the meshes as they came, with holes, pieces or faces that do not fit. Each
    of them queries the collection without its clean counterpart, the model of the same name (numbers may have leading
    zeros), and so does the counterpart. Without `--raw` every model is made dirty: holes are torn, patches turned
    inside out, faces doubled, and the corners of the faces come apart.
    """
    if arguments.raw is None:
        found: dict[str, Queries] = {"made dirty": changed(collection, dirty_parts, [0], arguments.per_class)["0 %"]}
    else:
        raw = models_in(arguments.raw)
        made = zip(counterparts(raw, collection), collection.each(raw_parts, raw, "raw"), strict=True)
        found = {"raw": {k: parts for k, parts in made if parts is not None}}
    for name, queries in found.items():
        say(f"{len(queries)} queries {name}; the first: {'; '.join(next(iter(queries.values())).notes)}")
    return compared(collection, found, arguments.methods, picture, "dirty queries")


def dirty(mesh: Mesh, seed: int = 0) -> Mesh:
    """The same surface with holes, patches that are turned inside out, doubled faces, and a vertex for each corner."""
    random = np.random.default_rng(seed)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    reach = _WIDTH * np.linalg.norm(np.ptp(mesh.vertices, axis=0))

    def patches() -> np.ndarray:
        places = middles[random.choice(len(middles), _PATCHES, replace=False)]
        return (np.linalg.norm(middles[:, None] - places, axis=2) <= reach).any(axis=1)

    holes, turned, doubled = patches(), patches(), patches()
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    faces = np.concatenate([faces[~holes], faces[doubled & ~holes]])
    return Mesh(mesh.vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3), mesh.name)


def dirty_parts(task: tuple[Model, float]) -> Parts:
    """Parts of one model that was made dirty."""
    model, _ = task
    return extract_parts(dirty(model.mesh(), zlib.crc32(model.name.encode())))


def raw_parts(model: Model) -> Parts:
    """Parts of one raw mesh."""
    return extract_parts(model.mesh())


def counterparts(raw: list[Model], collection: Collection) -> list[int]:
    """The clean model that each raw one has been.

    Raises:
        ValueError: a raw model without one, or with one of another class.
    """
    places = {_key(model.name): k for k, model in enumerate(collection.described)}
    found = [places.get(_key(model.name), -1) for model in raw]
    for model, k in zip(raw, found, strict=True):
        if k < 0 or collection.labels[k] != model.label:
            raise ValueError(f"{model.name} ({model.label}) has no clean counterpart in {collection.name}")
    return found


def _key(name: str) -> tuple[str, ...]:
    return tuple(str(int(word)) if word.isdigit() else word for word in re.split(r"(\d+)", Path(name).stem))
