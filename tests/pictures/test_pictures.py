import sys

import numpy as np
import pytest

from curvematch_jax.pictures import Tile, matrix_picture, sheet
from curvematch_jax.pictures._view import paint
from curvematch_jax.surface import Mesh

image = pytest.importorskip("matplotlib.image")

GREEN, RED = (26, 152, 80), (215, 48, 31)


def ball(steps=24, name="ball"):
    """A closed sphere of quadrilaterals cut in two, poles included."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, steps), np.arange(2 * steps) * np.pi / steps, indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    index = np.arange(points[..., 0].size).reshape(steps, -1)
    right = np.roll(index, -1, axis=1)
    a, b, c, d = index[:-1], index[1:], right[1:], right[:-1]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Mesh(points.reshape(-1, 3), faces, name)


def pixels(path):
    return (image.imread(path)[..., :3] * 255).round().astype(int)


def count(picture, colour):
    return int(np.all(np.abs(picture - colour) <= 2, axis=-1).sum())


def test_matrix_classes_are_put_in_blocks(tmp_path):
    labels = np.repeat(["b", "a", "c"], 4)
    matrix = np.where(np.equal.outer(labels, labels), 0.1, 0.9) + np.arange(144).reshape(12, 12) * 1e-3
    shuffle = np.array([0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11])  # keeps the order within each class
    matrix_picture(matrix, list(labels), tmp_path / "sorted.png")
    matrix_picture(matrix[np.ix_(shuffle, shuffle)], list(labels[shuffle]), tmp_path / "shuffled.png")
    matrix_picture(matrix[np.ix_(shuffle, shuffle)], list(labels), tmp_path / "wrong.png")
    assert np.array_equal(pixels(tmp_path / "sorted.png"), pixels(tmp_path / "shuffled.png"))
    assert not np.array_equal(pixels(tmp_path / "sorted.png"), pixels(tmp_path / "wrong.png"))


@pytest.mark.parametrize("matrix", [np.zeros((1, 1)), np.array([[0.0, np.inf], [np.nan, 0.0]])])
def test_matrix_of_one_object_and_with_missing_values(tmp_path, matrix):
    matrix_picture(matrix, ["x"] * len(matrix), tmp_path / "m.pdf")
    assert (tmp_path / "m.pdf").stat().st_size > 1000


def test_matrix_that_does_not_fit_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"shape \(M, M\) with M > 0, not \(2, 3\)"):
        matrix_picture(np.zeros((2, 3)), ["a", "b"], tmp_path / "m.png")
    with pytest.raises(ValueError, match="2 rows, but there are 3 labels"):
        matrix_picture(np.zeros((2, 2)), ["a", "b", "c"], tmp_path / "m.png")


def test_frames_say_what_is_relevant(tmp_path):
    query, known, unknown = Tile(ball(), "query"), Tile(ball(), "near .1", True), Tile(ball(), "far .9", False)
    sheet([[query, known, unknown], [query, Tile(ball())]], tmp_path / "both.png")
    sheet([[query, known]], tmp_path / "green.png")
    sheet([[query, unknown]], tmp_path / "red.png")
    both, green, red = (pixels(tmp_path / f"{name}.png") for name in ("both", "green", "red"))
    assert count(both, GREEN) > 100
    assert count(both, RED) > 100
    assert count(green, GREEN) > 100
    assert count(green, RED) == 0
    assert count(red, GREEN) == 0


def test_empty_sheets_are_refused(tmp_path):
    for rows in ([], [[Tile(ball())], []]):
        with pytest.raises(ValueError, match="at least one row, and each row a query"):
            sheet(rows, tmp_path / "s.png")


def test_a_ball_is_projected_to_a_disc_lit_from_above():
    corners, shades = paint(ball())
    triangles = corners[..., :2]
    middles = triangles.mean(axis=1)
    assert np.abs(triangles).max() == pytest.approx(1, abs=0.02)
    assert np.linalg.norm(middles, axis=1).max() < 1.01
    assert shades[middles[:, 1] > 0.5].mean() > shades[middles[:, 1] < -0.5].mean() + 0.2


def test_the_near_side_is_painted_last_and_the_back_not_at_all():
    towards = np.array([0.6113, 0.7286, 0.3090])  # from the middle to the viewer
    right, up = np.array([-0.7660, 0.6428, 0.0]), np.array([-0.1986, -0.2367, 0.9511])
    triangle = np.stack([-right - up, right - up, up])
    near_small, far_large = 0.2 * triangle + towards, triangle - towards
    for points in (np.concatenate([near_small, far_large]), np.concatenate([far_large, near_small])):
        painted, _ = paint(Mesh(points, np.array([[0, 1, 2], [3, 4, 5]])))
        assert [np.ptp(t[:, :2]) > 1 for t in painted] == [True, False]
        assert len(paint(Mesh(points, np.array([[0, 2, 1], [3, 4, 5]]))).corners) == 1


def test_large_scans_are_thinned_and_scale_does_not_matter():
    large = ball(400)
    triangles, _ = paint(large)
    assert len(large.faces) > 600_000
    assert len(triangles) < 60_000
    small, _ = paint(ball(16))
    scaled, _ = paint(Mesh(ball(16).vertices * 1e6 + 3, ball(16).faces))
    assert len(small) == len(scaled)


def test_without_matplotlib_the_message_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"drawing a picture needs matplotlib: pip install 'curvematch_jax\[plot\]'"):
        matrix_picture(np.zeros((1, 1)), ["a"], tmp_path / "m.png")
