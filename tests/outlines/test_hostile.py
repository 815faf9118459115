"""Damaged and hostile files: curves, or one sentence with the file's name."""

import io
import warnings
import zipfile

import numpy as np
import pytest

from curvematch_jax.outlines import distances_table, outlines_of, read_curves, read_outlines, write_curves

image = pytest.importorskip("PIL.Image")
pytest.importorskip("skimage")

TIMES = np.arange(24) / 24
ELLIPSES = np.stack([[a * np.cos(2 * np.pi * TIMES), np.sin(2 * np.pi * TIMES)] for a in (1.5, 2)])


def damaged(data, random):
    """A few bytes changed, a piece left out, or the end cut off."""
    found = bytearray(data)
    kind, at = random.integers(3), int(random.integers(len(found)))
    if kind == 0:
        for place in random.integers(len(found), size=4):
            found[place] = random.integers(256)
    elif kind == 1:
        del found[at : at + int(random.integers(1, 40))]
    else:
        del found[at:]
    return bytes(found)


def said(call, path):
    """Nothing, or the one sentence of what was raised."""
    found = ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            call(path)
        except ValueError as problem:
            found = str(problem)
    assert not found or path.stem in found
    assert "\n" not in found
    return found


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".tps"])
def test_damaged_curves_are_read_or_refused(tmp_path, suffix):
    write_curves(tmp_path / f"whole{suffix}", ELLIPSES)
    whole, random = (tmp_path / f"whole{suffix}").read_bytes(), np.random.default_rng(0)
    path, refused = tmp_path / f"damaged{suffix}", 0
    for _ in range(150):
        path.write_bytes(damaged(whole, random))
        refused += bool(said(read_curves, path))
    assert refused > 20


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_damaged_images_are_read_or_refused(tmp_path, suffix):
    y, x = np.mgrid[:40, :40]
    image.fromarray((255 * ((x - 20) ** 2 + (y - 20) ** 2 < 150)).astype(np.uint8)).save(tmp_path / f"whole{suffix}")
    whole, random = (tmp_path / f"whole{suffix}").read_bytes(), np.random.default_rng(1)
    path, refused = tmp_path / f"damaged{suffix}", 0
    for _ in range(60):
        path.write_bytes(damaged(whole, random))
        refused += bool(said(read_outlines, path))
    assert refused > 5


def npz(path, **members):
    """An archive of whatever bytes."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)


def npy(array, shape=None):
    """The bytes of an array, whose header may claim another shape."""
    file = io.BytesIO()
    header = {"descr": array.dtype.str, "fortran_order": False, "shape": array.shape if shape is None else shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + array.tobytes()


@pytest.mark.parametrize(
    ("members", "sentence"),
    [
        ({"curves": npy(ELLIPSES, (10**12, 2, 24))}, "damaged"),
        ({"curves": npy(ELLIPSES, (2, 2, 25))}, "damaged"),
        ({"curves": npy(np.float64(3))}, "give"),
        ({"curves": npy(np.full((2, 2, 24), np.nan))}, "NaN"),
        ({"points": npy(ELLIPSES[0].T), "counts": npy(np.array([12, 13]))}, "do not fit"),
        ({"points": npy(ELLIPSES[0].T), "counts": npy(np.array([2**62, 2**62, 24, -(2**63)]))}, "do not fit"),
        ({"points": npy(ELLIPSES[0].T)}, "counts"),
        ({"curves": npy(ELLIPSES), "names": npy(np.array(["a"]))}, "1 names for 2"),
        ({"curves": npy(np.array(ELLIPSES.tolist(), "U8"))}, "numbers"),
        ({"other": npy(ELLIPSES)}, "points"),
    ],
)
def test_hostile_archives_get_a_sentence(tmp_path, members, sentence):
    npz(tmp_path / "a.npz", **members)
    assert sentence in said(read_curves, tmp_path / "a.npz")


def test_pickles_are_not_opened(tmp_path):
    np.savez(tmp_path / "a.npz", curves=np.array([{"a": 1}], object))
    assert "other things than numbers" in said(read_curves, tmp_path / "a.npz")


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.tps", "LM=10000000\n1 2\n", "line 1"),
        ("a.tps", "LM=many\n1 2\n", "line 1"),
        ("a.tps", "LM=3\n1 2\n3\n4 5\n", "as many on each"),
        ("a.tps", "LM=3\n1 2\n3 x\n4 5\n", "line 1"),
        ("a.tps", "LM=-3\n1 2\n", "line 1"),
        ("a.csv", "curve,point,x,y\n" + "a,0,1,nan\n" * 9, "NaN"),
        ("a.csv", "curve,point,x,y\na,0,1,2\na,1,2,2\n", "8 samples"),
        ("a.csv", "curve,point,x,y\na,0,1,2\na,1\n", "line 3"),
        ("a.csv", 'curve,point,x,y\n"a,0,1,2\n', "a.csv"),
        ("a.csv", "", "has to name the columns"),
    ],
)
def test_hostile_text_gets_a_sentence(tmp_path, name, text, sentence):
    (tmp_path / name).write_text(text)
    assert sentence in said(read_curves, tmp_path / name)


def test_a_folder_and_a_missing_file_get_a_sentence(tmp_path):
    (tmp_path / "folder.npz").mkdir()
    assert "folder.npz: is a folder: give one file of curves" in said(read_curves, tmp_path / "folder.npz")
    assert "missing.csv: no such file" in said(read_curves, tmp_path / "missing.csv")
    assert "missing.png: no such file or folder" in said(read_outlines, tmp_path / "missing.png")
    (tmp_path / "folder.png").mkdir()
    assert "folder.png: cannot be read" in said(read_outlines, tmp_path / "folder.png")


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".tps"])
@pytest.mark.parametrize("name", ["", " a", "a\nb", "a\0", "\ud800"])
def test_names_that_would_not_come_back_are_refused(tmp_path, suffix, name):
    with pytest.raises(ValueError, match="the name"):
        write_curves(tmp_path / f"a{suffix}", ELLIPSES, [name, "b"])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".tps"])
def test_curves_of_any_dimension_come_back(tmp_path, suffix):
    curves = np.concatenate([ELLIPSES, ELLIPSES[::-1]], axis=1)
    write_curves(tmp_path / f"a{suffix}", curves, ["a=b", '"c,'])
    found = read_curves(tmp_path / f"a{suffix}")
    assert np.array_equal(found.array(), curves)
    assert found.names == ("a=b", '"c,')


@pytest.mark.parametrize("curves", [ELLIPSES * 1j, [np.ma.masked_array(ELLIPSES[0], ELLIPSES[0] > 1)]])
def test_complex_and_hidden_samples_are_refused(tmp_path, curves):
    with pytest.raises(ValueError, match="hides samples, or is complex"):
        write_curves(tmp_path / "a.npz", curves)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [({"n": 7}, "n = 7"), ({"smoothing": np.inf}, "smoothing = inf"), ({"smoothing": 1e300}, "smoothing = ")],
)
def test_settings_of_outlines_are_checked(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        outlines_of(np.pad(np.ones((9, 9)), 3), **arguments)


def test_masks_that_hide_pixels_are_refused():
    with pytest.raises(ValueError, match="hides pixels"):
        outlines_of(np.ma.masked_array(np.ones((9, 9)), np.eye(9) > 0))


def test_a_text_is_no_list_of_names():
    with pytest.raises(ValueError, match="give a name, and a group if any, for each row"):
        distances_table(np.zeros((2, 2)), "ab")
