"""What dirt costs: raw meshes as queries against clean ones.

    python -m benchmarks.figures.dirt [FOLDER [RAW]] [--out DIR] [--methods default paper]

RAW is a second folder with the same classes: the meshes as they came, with holes, pieces or faces that do not fit.
Each of them queries FOLDER without its clean counterpart, the model of the same name (numbers may have leading zeros),
and so does the counterpart. Without RAW every model of FOLDER, or every creature, is made dirty: holes are torn,
patches turned inside out, faces doubled, and the corners of the faces come apart. The picture is 11-point
precision-recall of the first method.
"""

from __future__ import annotations

import argparse
import re
import zlib
from pathlib import Path

import numpy as np

from benchmarks.baselines._run import Model, models_in
from benchmarks.figures._common import Collection, Figure, Numbers, command, say
from benchmarks.figures._queries import Queries, changed, compared, query_options
from curvematch_jax.surface import Mesh, Parts, extract_parts

# Of each kind of patch, and how wide it is, in diagonals of the bounding box.
_PATCHES, _WIDTH = 6, 0.015


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
    return extract_parts(dirty(model.load(*model.source), zlib.crc32(model.name.encode())))


def raw_parts(model: Model) -> Parts:
    """Parts of one raw mesh."""
    return extract_parts(model.load(*model.source))


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


def run(collection: Collection, picture: Path, arguments: argparse.Namespace) -> Numbers:
    """Scores of raw and clean queries."""
    if arguments.raw is None:
        found: dict[str, Queries] = {"made dirty": changed(collection, dirty_parts, [0], arguments.per_class)["0 %"]}
    else:
        raw = models_in(arguments.raw)
        made = zip(counterparts(raw, collection), collection.each(raw_parts, raw, "raw"), strict=True)
        found = {"raw": {k: parts for k, parts in made if parts is not None}}
    for name, queries in found.items():
        say(f"{len(queries)} queries {name}; the first: {'; '.join(next(iter(queries.values())).notes)}")
    return compared(collection, found, arguments.methods, picture, "dirty queries")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("raw", nargs="?", type=Path, metavar="RAW", help="by default models are made dirty")
    query_options(parser)


FIGURE = Figure("dirt", __doc__, run, options)

if __name__ == "__main__":
    command(FIGURE)
