import tracemalloc

import numpy as np
import pytest
from surface.shapes import cube, sphere

from curvematch_jax.surface._rays import depths, reach


def directions(polar: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    rows, columns = polar[:, None], azimuth[None]
    return np.stack(
        np.broadcast_arrays(np.sin(rows) * np.cos(columns), np.sin(rows) * np.sin(columns), np.cos(rows)), -1
    )


def grid(count: int) -> tuple[np.ndarray, np.ndarray]:
    return (np.arange(count) + 0.5) * np.pi / count, 2 * np.pi * np.arange(count) / count


def slabs(low: np.ndarray, high: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Where rays from the origin leave a box, 0 where they miss it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([low / rays, high / rays])
    enter, leave = np.nanmax(ends.min(axis=0), axis=-1), np.nanmin(ends.max(axis=0), axis=-1)
    return np.where((leave >= enter) & (leave >= 0), leave, 0)


@pytest.mark.parametrize(
    "corner", [[-0.5, -0.5, -0.5], [-0.3, -0.9, -0.2], [0.4, -0.3, -0.4], [-2, 0.3, 0.6], [-0.4, -0.4, 0.1], [3, 3, -9]]
)
@pytest.mark.parametrize("count", [7, 16])
def test_reach_is_where_rays_leave_a_box(corner, count):
    box = cube(3).vertices + corner
    rays = grid(count)
    expected = slabs(box.min(axis=0), box.max(axis=0), directions(*rays))
    np.testing.assert_allclose(reach(box[cube(3).faces], *rays), expected, atol=1e-12)


def test_reach_is_the_farthest_intersection_on_that_side():
    boxes = np.concatenate([(cube().vertices + offset)[cube().faces] for offset in ([1, -0.3, -0.4], [4, -0.3, -0.4])])
    found = reach(boxes, *grid(3))
    np.testing.assert_allclose(found[1], [5, 0, 0], atol=1e-12)


def test_depths_of_the_sphere():
    ball = sphere(4)
    low, high = depths(ball.vertices[ball.faces], 1.25, 50)
    x, y = np.meshgrid(*2 * [(np.arange(50) + 0.5) / 20 - 1.25], indexing="ij")
    inside = x**2 + y**2 < 0.95
    np.testing.assert_allclose(high[inside], np.sqrt((1 - x**2 - y**2)[inside]), atol=0.02)
    np.testing.assert_allclose(low, -high, atol=1e-9)
    assert (np.isfinite(high) == (x**2 + y**2 < 1)).mean() > 0.99


def test_depths_beyond_the_window_are_cut_off():
    box = cube(2).vertices * [10, 1, 1] + [-5, 0, 2]
    low, high = depths(box[cube(2).faces], 2.0, 8)
    covered = np.broadcast_to((np.arange(8) >= 4) & (np.arange(8) < 6), (8, 8))
    assert (np.isfinite(low) == covered).all()
    assert (low[covered], high[covered]) == (pytest.approx(2), pytest.approx(3))


def test_large_triangles_behind_each_other_take_bounded_memory():
    """200 squares that fill the window: 13 million pixels to look at, 1.5 GB at once."""
    squares = np.array([[[-2, -2], [2, -2], [2, 2]], [[-2, -2], [2, 2], [-2, 2]]])
    heights = np.linspace(-1, 1, 200)
    triangles = np.concatenate([np.insert(squares, 2, height, axis=2) for height in heights[:, None, None]])
    tracemalloc.start()
    low, high = depths(triangles, 2.0, 256)
    found = reach(triangles + np.array([0, 0, 3]), *grid(64))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    np.testing.assert_allclose(low, -1)
    np.testing.assert_allclose(high, 1)
    assert found.max() == pytest.approx(4 * np.sqrt(1.5), abs=0.3)
    assert peak < 100e6
