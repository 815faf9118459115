"""Masks to curves, curves in files, and the two commands."""

import json

import numpy as np
import pytest

from curvematch_jax.cli._app import run
from curvematch_jax.datasets import leaves
from curvematch_jax.outlines import (
    distances_table,
    outlines_of,
    read_curves,
    read_outlines,
    scores_table,
    write_curves,
)

pytest.importorskip("skimage")


def disk(radius=30, size=100, row=50, column=50):
    y, x = np.mgrid[:size, :size]
    return (x - column) ** 2 + (y - row) ** 2 <= radius**2


def area(curve):
    x, y = curve
    return np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2


def test_a_disk_is_a_circle_that_runs_counter_clockwise():
    found = outlines_of(disk())
    radius = np.linalg.norm(found.curves[0] - [[50], [-50]], axis=0)
    assert np.abs(radius - 30).max() < 0.6
    assert area(found.curves[0]) == pytest.approx(np.pi * 900, rel=0.02)
    assert found.notes == ()


@pytest.mark.parametrize("smoothing", [0.5, 1.0, 3.0])
def test_no_point_moves_farther_than_stated(smoothing):
    rough, smooth = (outlines_of(disk(12), n=400, smoothing=s).curves[0] for s in (0.0, smoothing))
    apart = np.linalg.norm(smooth[:, :, None] - rough[:, None, :], axis=0).min(axis=1)
    assert apart.max() < smoothing + 0.3


def test_labels_give_an_outline_each_and_holes_are_noted():
    image = np.zeros((100, 100), int)
    image[disk(12, row=25, column=25)], image[disk(15, row=65, column=60)] = 3, 7
    image[65, 60] = 0
    found = outlines_of(image, each=True, name="cell")
    assert found.names == ("cell-3", "cell-7")
    assert found.notes[0] == "cell-7: 1 hole left out"
    assert area(found.curves[1]) > area(found.curves[0]) > 0


@pytest.mark.parametrize(
    ("image", "said"),
    [
        (np.zeros((20, 20)), "no foreground"),
        (disk(1, 20, 10, 10), "has 5 pixels"),
        (np.eye(20) * 0 + np.eye(20, k=30), "no foreground"),
        (np.pad([[1]], 5), "has 1 pixel:"),
        (np.ones((20, 20)), "border"),
        (~disk(), "^the shape reaches the border .*: invert the image if its shape is dark"),
        (np.zeros((20, 20, 2)), "give a mask"),
        (np.full((20, 20), np.nan), "NaN"),
        (np.arange(1200).reshape(20, 20, 3), "coloured"),
    ],
)
def test_bad_images_get_a_sentence(image, said):
    with pytest.raises(ValueError, match=said):
        outlines_of(image)


def test_smaller_pieces_are_counted():
    two, three = disk(12, row=25, column=25) | disk(3, row=65, column=60), disk(3, row=85, column=20)
    said = "outline: 1 smaller piece is left out, 29 pixels in all: for outlines of these, split the image, or label"
    assert outlines_of(two).notes[0].startswith(said)
    assert "2 smaller pieces are left out, 58 pixels in all" in outlines_of(two | three).notes[0]


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".tps"])
def test_one_curve_is_written_as_several_are(tmp_path, suffix):
    curve = leaves(1, n=20).curves[0]
    write_curves(tmp_path / f"one{suffix}", curve)
    write_curves(tmp_path / f"several{suffix}", curve[None])
    one, several = read_curves(tmp_path / f"one{suffix}"), read_curves(tmp_path / f"several{suffix}")
    assert one.names == several.names == ("curve-0",)
    np.testing.assert_array_equal(one.array(), several.array())
    for bad, said in ((curve.T, "looks transposed"), (curve[0], r"shape \(\): give"), ([], "give one curve or more")):
        with pytest.raises(ValueError, match=said):
            write_curves(tmp_path / f"bad{suffix}", bad)


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".tps"])
@pytest.mark.parametrize("d", [2, 3])
def test_curves_come_back_from_files(tmp_path, suffix, d):
    curves = [leaves(1, n=n, d=d).curves[0] for n in (20, 31)]
    write_curves(tmp_path / f"curves{suffix}", curves, ["a", "b"])
    found = read_curves(tmp_path / f"curves{suffix}")
    assert found.names == ("a", "b")
    assert all(np.allclose(x, y, atol=1e-6) for x, y in zip(curves, found.curves, strict=True))
    assert found.array().shape == (2, d, 31)
    assert [path.name for path in tmp_path.iterdir()] == [f"curves{suffix}"]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "curve,x\na,1\n", "has to name the columns"),
        ("a.csv", "curve,point,x,y\na,0,1,none\n", "line 2"),
        ("a.tps", "nothing", "holds no curve"),
        ("a.npz", "nothing", "a.npz"),
        ("a.txt", "nothing", "not a format of curves"),
    ],
)
def test_bad_files_get_a_sentence(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=said):
        read_curves(tmp_path / name)


def test_tables_have_names_on_them():
    table = scores_table(np.ones((2, 3)), ["a", "b"], ["x", "y"])
    assert list(table.columns) == ["group", "PC1", "PC2", "PC3"]
    assert list(distances_table(np.eye(2), ["a", "b"]).index) == ["a", "b"]
    with pytest.raises(ValueError, match="a name"):
        scores_table(np.ones((2, 3)), ["a"])


def _images(folder):
    image = pytest.importorskip("PIL.Image")
    for i, radius in enumerate((20, 25, 30, 35)):
        stretched = disk(radius, 200, 100, 100) | disk(radius, 200, 100, 100 + 5 * i)
        image.fromarray((255 * stretched).astype(np.uint8)).save(folder / f"m{i}.png")
    (folder / "bad.png").write_text("no image")
    image.fromarray(np.zeros((20, 20), np.uint8)).save(folder / "empty.tif")


def test_images_are_read_and_the_bad_ones_named(tmp_path, capsys):
    _images(tmp_path)
    assert read_outlines(tmp_path / "m0.png").names == ("m0",)
    assert run(["outlines", str(tmp_path), "--out", str(tmp_path / "curves.npz"), "--json"]) == 0
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert result["outlines"] == ["m0", "m1", "m2", "m3"]
    assert [failure["name"] for failure in result["failed"]] == ["bad.png", "empty.tif"]
    assert "no PNG or TIFF" in said.err
    assert run(["outlines", str(tmp_path), "--out", str(tmp_path / "curves.npz"), "--strict"]) == 1
    assert run(["outlines", str(tmp_path / "bad.png"), "--out", str(tmp_path / "none.npz")]) == 2


@pytest.mark.slow
def test_mean_writes_a_folder(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    made = leaves(8, apart=0.4)
    names = [f"leaf{i}" for i in range(8)]
    write_curves(tmp_path / "curves.npz", made.curves, names)
    rows = [f"{name},{group}" for name, group in zip(names, made.groups, strict=True)]
    (tmp_path / "labels.csv").write_text("\n".join(["file,class", *rows]))
    arguments = ["mean", str(tmp_path / "curves.npz"), "--groups", str(tmp_path / "labels.csv"), "--json"]
    assert run([*arguments, "--out", str(tmp_path / "out"), "--permutations", "99"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["converged"]
    assert result["tests"]["energy"]["p"] <= 0.1
    with (tmp_path / "out" / "scores.csv").open() as file:
        header = file.readline().strip().split(",")
    assert header == ["curve", "group", *(f"PC{i}" for i in range(1, 8))]  # one fewer than curves
    assert len(result["explained"]) == 7
    files = {"aligned.npz", "components.png", "mean.npz", "mean.png", "scores.csv", "scores.png"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == files
    (tmp_path / "labels.csv").write_text("file,class\nleaf0,a\n")
    assert run([*arguments, "--out", str(tmp_path / "other")]) == 2
    assert "has no class for 7 of 8 curves" in capsys.readouterr().err
