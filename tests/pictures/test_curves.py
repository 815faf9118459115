"""Pictures of curves: what is drawn where, in which colour; movies; and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from curvematch_jax.pictures import components_picture, geodesic_picture, mean_picture, movie, scores_picture

image = pytest.importorskip("matplotlib.image")

TIMES = 2 * np.pi * np.arange(60) / 60
CIRCLE = np.stack([np.cos(TIMES), np.sin(TIMES)])
BENT = np.stack([np.cos(TIMES), np.sin(TIMES), 0.3 * np.cos(2 * TIMES)])
DARK, FIRST, SECOND = (27, 58, 93), (27, 108, 168), (209, 73, 91)


def drawn(path, colour=DARK):
    """Rows and columns of the pixels of a colour, and the picture's height and width."""
    pixels = (image.imread(path)[..., :3] * 255).round().astype(int)
    return np.argwhere(np.all(np.abs(pixels - colour) <= 3, axis=-1)), pixels.shape[:2]


def test_a_mean_is_drawn_closed_and_round(tmp_path):
    mean_picture(CIRCLE, np.stack([0.5 * CIRCLE, 0.8 * CIRCLE]), tmp_path / "mean.png")
    places, _ = drawn(tmp_path / "mean.png")
    away = places - (places.max(axis=0) + places.min(axis=0)) / 2
    radius = np.linalg.norm(away, axis=1)
    assert radius.min() > 0.95 * radius.max()
    angles = np.sort(np.arctan2(*away.T))
    assert np.diff(angles).max() < 0.1


def test_components_are_a_row_each_on_one_scale(tmp_path):
    rows = np.stack([[CIRCLE, CIRCLE], [0.25 * CIRCLE, 0.5 * CIRCLE]])
    components_picture(rows, tmp_path / "rows.png")
    places, (height, width) = drawn(tmp_path / "rows.png")
    quarters = [[places[((places // [height / 2, width / 2]) == [i, j]).all(axis=1)] for j in (0, 1)] for i in (0, 1)]
    sizes = np.array([[np.ptp(quarter[:, 0]) for quarter in row] for row in quarters])
    assert np.allclose(sizes / sizes[0, 0], [[1, 1], [0.25, 0.5]], atol=0.04)


def test_scores_have_the_colours_of_their_groups(tmp_path):
    scores_picture(np.array([[-1.0, 0], [-1, 1], [1, 0], [1, 1]]), tmp_path / "scores.png", ["a", "a", "b", "b"])
    columns = [drawn(tmp_path / "scores.png", colour)[0][:, 1] for colour in (FIRST, SECOND)]
    assert np.median(columns[0]) < np.median(columns[1])


def test_few_samples_are_drawn_smooth(tmp_path):
    """A circle of 10 samples is round: its corners would be 5 % farther out than its sides."""
    mean_picture(CIRCLE[:, ::6], CIRCLE[None, :, ::6], tmp_path / "mean.png")
    places, _ = drawn(tmp_path / "mean.png")
    radius = np.linalg.norm(places - (places.max(axis=0) + places.min(axis=0)) / 2, axis=1)
    assert radius.min() > 0.97 * radius.max()


def test_rows_columns_and_few_points_have_names(tmp_path):
    """Names are drawn when they are given, and not of too many points."""
    rows = np.stack([[CIRCLE, CIRCLE]])
    components_picture(rows, tmp_path / "plain.png")
    components_picture(rows, tmp_path / "named.png", ["first"], ["-1", "+1"])
    random = np.random.default_rng(0)
    for count, named in ((30, True), (31, False)):
        scores, names = random.normal(size=(count, 2)), [f"curve{i}" for i in range(count)]
        scores_picture(scores, tmp_path / "plain_scores.png")
        scores_picture(scores, tmp_path / "named_scores.png", names=names)
        differs = dark(tmp_path / "named_scores.png") > dark(tmp_path / "plain_scores.png") + 100
        assert differs == named
    assert dark(tmp_path / "named.png") > dark(tmp_path / "plain.png") + 100


def dark(path):
    """How many pixels are nearly black."""
    return int((image.imread(path)[..., :3].max(axis=-1) < 0.3).sum())


def test_curves_in_space_are_drawn(tmp_path):
    mean_picture(BENT, BENT[None], tmp_path / "mean.png")
    geodesic_picture(np.stack([BENT, 0.9 * BENT]), tmp_path / "way.png")
    assert all(len(drawn(tmp_path / name)[0]) > 100 for name in ("mean.png", "way.png"))


def test_a_movie_goes_there_and_back_and_leaves_nothing_behind(tmp_path):
    opened = pytest.importorskip("PIL.Image")
    movie(np.stack([CIRCLE, 0.7 * CIRCLE, 0.4 * CIRCLE]), tmp_path / "first.gif")
    with opened.open(tmp_path / "first.gif") as found:
        frames = []
        for frame in range(found.n_frames):
            found.seek(frame)
            frames.append(np.asarray(found.convert("L")))
    assert len(frames) == 4
    assert np.array_equal(frames[1], frames[3])
    widths = [np.ptp(np.argwhere(frame < 128)[:, 1]) for frame in frames]
    assert widths[0] > widths[1] > widths[2]
    assert [path.name for path in tmp_path.iterdir()] == ["first.gif"]


def test_what_cannot_be_drawn_gets_a_sentence(tmp_path):
    for call, said in [
        (lambda: mean_picture(np.ones((4, 9)), np.ones((1, 4, 9)), tmp_path / "a.png"), "d = 2 or 3"),
        (lambda: mean_picture(np.full((2, 9), np.nan), CIRCLE[None], tmp_path / "a.png"), "finite"),
        (lambda: mean_picture(CIRCLE, CIRCLE[None], tmp_path / "a.txt"), "is not a picture format"),
        (lambda: components_picture(CIRCLE, tmp_path / "a.png"), "rows"),
        (lambda: scores_picture(np.ones((3, 2)), tmp_path / "a.png", ["a"]), "a group for each"),
        (lambda: movie(CIRCLE[None], tmp_path / "a.png"), "a movie is one of"),
        (lambda: movie(CIRCLE[None], tmp_path / "a.gif", seconds=0), "more than 0 seconds"),
        (lambda: movie(CIRCLE[None], Path(__file__) / "a.gif"), "is not a writable folder"),
    ]:
        with pytest.raises(ValueError, match=said):
            call()
    assert list(tmp_path.iterdir()) == []
