import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.surface._polygons import triangulated
from curvematch_jax.surface._topology import edges, face_areas

ARROW = np.array([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], dtype=float)
# The same with a corner in the middle of each of its sides.
DENSE_ARROW = np.stack([ARROW, (ARROW + np.roll(ARROW, -1, axis=0)) / 2], axis=1).reshape(-1, 2)
COMB = np.array([[0, 0], [7, 0], [7, 3], [6, 1], [5, 3], [4, 1], [3, 3], [2, 1], [1, 3]], dtype=float)


def area(outline: np.ndarray) -> float:
    x, y = outline.T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def turned(outline: np.ndarray, seed: int) -> np.ndarray:
    """The outline somewhere in space."""
    basis, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return outline @ basis[:2] + basis[2]


@pytest.mark.parametrize("outline", [ARROW, DENSE_ARROW, COMB], ids=["arrow", "dense arrow", "comb"])
@pytest.mark.parametrize("shift", range(5))
@pytest.mark.parametrize("backwards", [False, True])
def test_concave_polygons_are_cut_inside_themselves(outline, shift, backwards):
    points = turned(outline, shift)
    polygon = np.roll(np.arange(len(points)), shift)[:: -1 if backwards else 1]
    faces = triangulated(points, [polygon.tolist()])
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    around = points[polygon]
    whole = np.cross(around, np.roll(around, -1, axis=0)).sum(axis=0)
    assert len(faces) == len(points) - 2
    assert (edges(faces).count == 1).sum() == len(points)
    assert face_areas(points, faces).sum() == pytest.approx(area(outline))
    assert (normals @ whole > 0).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(3, 12), st.integers(0, 2**32 - 1))
def test_polygons_that_are_seen_whole_from_a_point_keep_their_area(corners, seed):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.9, corners)) / corners
    outline = rng.uniform(0.2, 1, corners)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = turned(outline, seed)
    faces = triangulated(points, [list(range(corners))])
    assert np.linalg.norm(
        np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]).sum(axis=0) / 2
    ) == pytest.approx(abs(area(outline)))
    if corners > 3 and area(outline) > 0:
        assert face_areas(points, faces).sum() == pytest.approx(area(outline))


def test_polygons_keep_their_order_and_convex_ones_are_fans():
    points = turned(ARROW, 0)
    faces = triangulated(points, [[4, 0, 3], [0, 1], [0, 1, 2, 4], [], [1, 2, 3]])
    assert faces.tolist() == [[4, 0, 3], [0, 1, 2], [0, 2, 4], [1, 2, 3]]
    assert triangulated(points, []).shape == (0, 3)


@pytest.mark.parametrize("polygon", [[0, 1, 2, 9], [0, 1, 2, -9], [0, 0, 0, 0], [0, 1, 0, 1], [0, 2, 1, 4, 3]])
def test_polygons_that_are_none_are_fans(polygon):
    faces = triangulated(turned(ARROW, 0), [polygon])
    assert len(faces) == len(polygon) - 2
