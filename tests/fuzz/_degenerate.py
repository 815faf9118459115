"""Meshes that a file may well hold and no method is made for: flat, folded, huge, tiny, torn, doubled, tangled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvematch_jax.surface import Mesh

Random = np.random.Generator
_EXPONENTS = (-320, -300, -160, -100, -45, -20, -8, 8, 20, 38, 100, 150, 155, 200, 300, 307)


def degenerate(mesh: Mesh, random: Random) -> Mesh:
    """The mesh after one to three changes."""
    vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
    for _ in range(random.integers(1, 4)):
        change: Callable = _CHANGES[random.integers(len(_CHANGES))]
        with np.errstate(all="ignore"):
            vertices, faces = change(vertices.copy(), faces.copy(), random)
        faces = faces if len(faces) else mesh.faces
    return Mesh(np.nan_to_num(vertices, posinf=1e308, neginf=-1e308), faces, mesh.name)


def _some(count: int, random: Random) -> np.ndarray:
    """A few indices below `count`."""
    return random.integers(0, count, random.integers(1, 6))


def _scaled(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices * 10.0 ** _EXPONENTS[random.integers(len(_EXPONENTS))], faces


def _moved(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices + 10.0 ** random.integers(0, 20, 3), faces


def _squeezed(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    factors = np.ones(3)
    factors[random.integers(0, 3, random.integers(1, 3))] = 10.0 ** -random.integers(1, 30)
    return vertices * (factors if random.random() < 0.7 else factors > 0.5), faces


def _spiked(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    vertices[_some(len(vertices), random)] *= 10.0 ** random.integers(1, 300)
    return vertices, faces


def _merged(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    vertices[_some(len(vertices), random)] = vertices[random.integers(len(vertices))] + random.choice(
        [0.0, 1e-17, 1e-9]
    )
    return vertices, faces


def _rounded(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices.round(int(random.integers(0, 2))), faces


def _shaken(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices + random.normal(size=vertices.shape) * 10.0 ** random.integers(-17, 2), faces


def _torn(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices, faces[random.random(len(faces)) > random.choice([0.02, 0.1, 0.5, 0.9])]


def _doubled(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    chosen = faces[_some(len(faces), random)]
    return vertices, np.concatenate([faces, chosen[:, ::-1] if random.random() < 0.5 else chosen])


def _turned(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices, np.where(random.random((len(faces), 1)) < 0.3, faces[:, ::-1], faces)


def _tangled(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    rows = _some(len(faces), random)
    faces[rows, random.integers(0, 3, len(rows))] = random.integers(0, len(vertices), len(rows))
    return vertices, faces


def _soup(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    return vertices, random.integers(0, len(vertices), (random.integers(1, 80), 3))


def _copied(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    """A second surface: on the first, through it, inside it, or far away."""
    offset = random.choice([0.0, 1e-9, 0.3, 1.0, 1e6])
    factor = random.choice([1.0, 0.5, -1.0, 1e-6])
    return np.concatenate([vertices, vertices * factor + offset]), np.concatenate([faces, faces + len(vertices)])


def _pinched(vertices: np.ndarray, faces: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    """Far vertices become one: bow-ties, and edges of four faces."""
    a, b = random.integers(0, len(vertices), 2)
    return vertices, np.where(faces == a, b, faces)


_CHANGES = (
    *(
        _scaled,
        _moved,
        _squeezed,
        _spiked,
        _merged,
        _rounded,
        _shaken,
        _torn,
        _doubled,
        _turned,
        _tangled,
        _soup,
        _copied,
    ),
    _pinched,
)
