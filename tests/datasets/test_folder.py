import re

import pytest

from curvematch_jax.datasets import labelled_folder, match_labels, read_labels


@pytest.fixture
def folder(tmp_path):
    for name in ("cat0.off", "cat1.OFF", "deep/dog0.obj"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "._cat0.off").touch()
    return tmp_path


def write_labels(folder, *rows, header="file,class"):
    (folder / "labels.csv").write_text("\n".join([header, *rows, ""]))


def test_label_file_gives_files_and_classes_in_its_order(folder):
    write_labels(folder, "deep/dog0.obj,dog", "cat1.OFF,cat", "cat0.off, cat")
    assert labelled_folder(folder) == [
        (folder / "deep/dog0.obj", "dog"),
        (folder / "cat1.OFF", "cat"),
        (folder / "cat0.off", "cat"),
    ]


def test_spreadsheets_add_a_mark_and_columns(folder):
    (folder / "labels.csv").write_bytes('\ufeffid,class,file\r\n1,"a, b",cat0.off\r\n\r\n'.encode())
    assert read_labels(folder / "labels.csv") == {"cat0.off": "a, b"}


def test_folder_per_class(tmp_path):
    for name in ("dog/b.off", "dog/a.off", "cat/a.off", "cat/more/c.off"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    found = [(path.relative_to(tmp_path).as_posix(), label) for path, label in labelled_folder(str(tmp_path))]
    assert found == [("cat/a.off", "cat"), ("cat/more/c.off", "cat"), ("dog/a.off", "dog"), ("dog/b.off", "dog")]


def test_loose_meshes_without_a_label_file(folder):
    with pytest.raises(ValueError, match=r"2 meshes are in no class folder \(cat0.off, cat1.OFF\).*labels.csv"):
        labelled_folder(folder)


def test_labels_that_miss_and_exceed_the_meshes_list_the_first_few(folder):
    write_labels(folder, "cat0.off,cat", *(f"bird{k}.off,bird" for k in range(7)))
    with pytest.raises(ValueError, match=r"labels.csv does not fit") as caught:
        labelled_folder(folder)
    message = str(caught.value)
    assert "no class for 2 of 3 meshes (cat1.OFF, deep/dog0.obj)" in message
    assert "labels 7 that are not there (bird0.off, bird1.off, bird2.off, bird3.off, bird4.off, ...)" in message


def test_match_labels_follows_the_names():
    assert match_labels(["b", "a"], {"a": "x", "b": "y"}, "labels") == ["y", "x"]
    with pytest.raises(ValueError, match=r"labels does not fit the meshes: it labels 1 that are not there \(c\)"):
        match_labels(["a"], {"a": "x", "c": "y"}, "labels")


def test_suffixes_may_be_missing_on_one_side(folder):
    assert match_labels(["cat0.off", "leaf"], {"leaf.png": "x", "cat0": "y"}, "labels") == ["y", "x"]
    assert match_labels(["a.off", "a"], {"a": "x", "a.off": "y"}, "labels") == ["y", "x"]
    write_labels(folder, "deep/dog0,dog", "cat1,cat", "cat0.off,cat")
    assert [path.name for path, _ in labelled_folder(folder)] == ["dog0.obj", "cat1.OFF", "cat0.off"]


@pytest.mark.parametrize(
    ("names", "labels", "complaint"),
    [
        (
            ["a.off", "a.obj"],
            ["a"],
            "no class for 2 of 2 meshes (a.off, a.obj) and 1 of its labels fit no name alone (a)",
        ),
        (["a"], ["a.png", "a.tif"], "2 of its labels fit no name alone (a.png, a.tif)"),
        (["a.off"], ["a.obj"], "it labels 1 that are not there (a.obj)"),
        (["v1"], ["v1.2"], "it labels 1 that are not there (v1.2)"),
    ],
)
def test_labels_that_could_be_of_several_names_are_refused(names, labels, complaint):
    with pytest.raises(ValueError, match=re.escape(complaint)):
        match_labels(names, dict.fromkeys(labels, "x"), "labels")


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "must name the columns file,class; it has nothing"),
        (b"name;class\n", "it has name;class"),
        (b"file,class\n", "labels nothing"),
        (b"file,class\na.off\n", "line 2: a row needs a file and a class"),
        (b"file,class\n,cat\n", "line 2: a row needs a file and a class"),
        (b"file,class\na.off,x\na.off,y\n", "line 3: a.off is named twice"),
        (b"\xff\xfe\x00", "not UTF-8 text"),
        (b'file,class\n"a.off,x\n', "not readable as CSV"),
    ],
)
def test_unusable_label_files(tmp_path, content, complaint):
    (tmp_path / "labels.csv").write_bytes(content)
    with pytest.raises(ValueError, match=re.escape(complaint)):
        read_labels(tmp_path / "labels.csv")


def test_no_folder_no_meshes_no_label_file(tmp_path):
    with pytest.raises(ValueError, match="is not a folder"):
        labelled_folder(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="holds no meshes"):
        labelled_folder(tmp_path)
    with pytest.raises(ValueError, match="No such file"):
        read_labels(tmp_path / "labels.csv")
