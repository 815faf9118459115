import numpy as np
import pytest
from surface.shapes import AXES, cube, limbed, sphere, torus, without

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._fields import Geodesics
from curvematch_jax.surface._levels import LevelSets
from curvematch_jax.surface._topology import compact


def length(polyline: np.ndarray) -> float:
    return float(np.linalg.norm(np.roll(polyline, -1, axis=0) - polyline, axis=1).sum())


def turning(polyline: np.ndarray, axis: np.ndarray) -> float:
    """Twice the signed area of a closed polyline seen against `axis`: positive for counter-clockwise."""
    return float(np.cross(polyline, np.roll(polyline, -1, axis=0)).sum(axis=0) @ axis)


def polylines(mesh: Mesh, function: np.ndarray, value: float) -> list[np.ndarray]:
    sets = LevelSets(mesh, function, np.array([value]))
    assert sets.closed.all()
    return [sets.polyline(k) for k in range(len(sets.lengths))]


@pytest.mark.parametrize("height", [-0.9, -0.3, 0.0, 0.25, 0.8])
def test_circles_of_latitude(height):
    ball = sphere(4)
    (circle,) = polylines(ball, ball.vertices[:, 2], height)
    assert np.allclose(circle[:, 2], height)
    assert length(circle) == pytest.approx(2 * np.pi * np.sqrt(1 - height**2), rel=0.01)


def test_lower_values_lie_on_the_left_seen_from_outside():
    ball = sphere(3)
    (circle,) = polylines(ball, ball.vertices[:, 2], 0.1)
    assert turning(circle, np.array([0, 0, -1])) > 0  # around the south pole, seen from the south
    (circle,) = polylines(ball, -ball.vertices[:, 2], 0.1)
    assert turning(circle, np.array([0, 0, 1])) > 0


@pytest.mark.parametrize("cells", [1, 2, 5, 8])
@pytest.mark.parametrize("total", [0.25, 0.5, 1.0, 1.5, 2.0])
def test_level_through_vertices_of_the_cube_is_one_ordered_loop(cells, total):
    box = cube(cells)
    function = (box.vertices * 20).round().sum(axis=1) / 20 if cells in (1, 2, 5) else box.vertices.sum(axis=1)
    (loop,) = polylines(box, function, total)
    side = np.sqrt(2) * (total if total <= 1 else 3 - total if total >= 2 else 1)
    expected = 3 * side if not 1 < total < 2 else 6 * np.sqrt(0.5)
    assert length(loop) == pytest.approx(expected)
    assert turning(loop, -np.ones(3)) > 0


def test_a_level_at_a_vertex_that_is_an_extremum():
    ball = sphere(2)
    function = ball.vertices[:, 2]
    assert polylines(ball, function, float(function.max())) == []
    (point,) = polylines(ball, function, float(function.min()))
    assert length(point) == pytest.approx(0)


def test_every_loop_of_a_level_set():
    mesh = limbed()
    distance = np.linalg.norm(mesh.vertices, axis=1)
    loops = polylines(mesh, distance, 1.6)
    assert len(loops) == 6
    centres = np.array([loop.mean(axis=0) for loop in loops])
    assert (np.abs(centres @ AXES.T).max(axis=0) > 1.4).all()
    tower = [turning(loop, -centre) for loop, centre in zip(loops, centres, strict=True)]
    assert (np.array(tower) > 0).all()  # the low side is the body


def test_boundary_makes_open_curves():
    ball = sphere(3)
    function = ball.vertices[:, 2]
    opened = without(ball, np.flatnonzero(ball.vertices[ball.faces][:, :, 0].min(axis=1) > 0.7))
    sets = LevelSets(opened, function, np.array([0.0, 0.95]))
    assert not sets.closed[sets.level == 0].any()
    assert sets.closed[sets.level == 1].all()


def followed(mesh: Mesh, source: int, values: np.ndarray, dominance: float = 0.6) -> list[np.ndarray | None]:
    distance = Geodesics(mesh)(source)
    sets = LevelSets(mesh, distance / distance.max(), values)
    return [None if curve is None else sets.polyline(curve) for curve in sets.follow(source, dominance)]


def tip(mesh: Mesh, axis: int) -> int:
    return int(np.argmax(mesh.vertices @ AXES[axis]))


def test_curves_stay_around_their_limb_until_the_surface_branches_for_good():
    mesh = limbed(subdivisions=5)
    values = np.linspace(0.02, 0.95, 20)
    curves = followed(mesh, tip(mesh, 0), values)
    assert all(curve is not None for curve in curves[:8])
    assert any(curve is None for curve in curves[8:])  # where the other five limbs begin, none of them dominates
    heights = [curve.mean(axis=0) @ AXES[0] for curve in curves if curve is not None]
    assert (np.diff(heights) < 0).all()  # never a jump to another branch
    for curve in curves[:8]:
        assert curve is not None
        assert turning(curve, AXES[0]) > 0
        assert np.linalg.norm(np.diff(curve, axis=0), axis=1).max() < 0.2


def test_a_small_branch_does_not_end_a_part():
    mesh = limbed(np.array([[1, 0, -0.3]]), length=0.8, subdivisions=5)
    source = int(np.argmax(mesh.vertices[:, 2]))
    distance = Geodesics(mesh)(source)
    sets = LevelSets(mesh, distance / distance.max(), np.linspace(0.1, 0.9, 65))
    assert np.bincount(sets.level).max() >= 2
    for level, curve in enumerate(sets.follow(source, 0.6)):
        assert curve is not None
        assert length(sets.polyline(curve)) == pytest.approx(sets.lengths[sets.level == level].max())


def test_a_part_goes_on_after_a_temporary_split():
    # A thick forearm with a fork of two fingers, started at the bottom of the fork.
    mesh = limbed(np.array([[1, 0, 0.45], [1, 0, -0.45], [-1, 0, 0]]), subdivisions=5)
    near = np.abs(mesh.vertices[:, 1:]).sum(axis=1) + 10 * (mesh.vertices[:, 0] < 0)
    curves = followed(mesh, int(np.argmin(near)), np.linspace(0.1, 0.8, 15))
    exists = [curve is not None for curve in curves]
    assert exists[0]
    assert not all(exists[: len(exists) // 2])
    assert exists[-1]
    assert curves[-1].mean(axis=0)[0] < -1  # around the limb on the other side


def test_a_part_of_the_torus_has_no_curve_where_its_level_set_has_met_itself():
    mesh = torus()
    curves = followed(mesh, 0, np.linspace(0.05, 0.9, 18))
    assert curves[0] is not None
    assert any(curve is None for curve in curves)
    for curve in curves:
        assert curve is None or np.linalg.norm(np.diff(curve, axis=0), axis=1).max() < 0.2


def test_a_part_ends_at_a_boundary():
    ball = sphere(4)
    kept = np.flatnonzero(ball.vertices[ball.faces][:, :, 0].min(axis=1) <= 0.8)
    opened = Mesh(*compact(ball.vertices, ball.faces[kept]))
    source = int(np.argmax(opened.vertices[:, 2]))
    curves = followed(opened, source, np.linspace(0.05, 0.6, 12))
    ended = [curve is None for curve in curves]
    assert not ended[0]
    assert ended[-1]
    assert ended == sorted(ended)


def test_no_curve_is_invented_past_the_end_of_the_surface():
    ball = sphere(3)
    distance = Geodesics(ball)(0)
    assert LevelSets(ball, distance, np.array([1.0, 4.0, 5.0])).follow(0, 0.6)[1:] == [None, None]


def test_levels_are_the_same_one_by_one_and_all_at_once():
    mesh = limbed()
    height = mesh.vertices[:, 0]
    values = np.append(np.quantile(height, [0.02, 0.3, 0.7, 0.97]), height.max() + 1)
    together = LevelSets(mesh, height, values)
    for level, value in enumerate(values):
        alone = LevelSets(mesh, height, np.array([value]))
        np.testing.assert_allclose(np.sort(together.lengths[together.level == level]), np.sort(alone.lengths))
        np.testing.assert_allclose(together.level_set_lengths[level], alone.level_set_lengths[0])
    assert together.level_set_lengths[-1] == 0
