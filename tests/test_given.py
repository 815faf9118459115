"""Arguments of the wrong type: one sentence, with what to give. The type checks of the tests are off here."""

from pathlib import Path

import numpy as np
import pytest
from jaxtyping import config

from curvematch_jax import (
    Collection,
    Extraction,
    Mesh,
    Parts,
    clean,
    dissimilarity_matrix,
    evaluate,
    extract_collection,
    extract_parts,
    load_collection,
    load_parts,
    rank,
    rerank,
    save_parts,
)
from curvematch_jax.retrieval import Ranking, SavedMatrix

MESH = Mesh(np.eye(4, 3), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]), "tetrahedron")
PARTS = Parts("a", *[np.zeros(0)] * 8, 1.0, 1.0, Extraction(), ())
SAVED = SavedMatrix(np.zeros((2, 2)), ("a", "b"), {})
SEVERAL = r"give a list of Parts, e\.g\. extract_collection\(paths\)\.parts$"


@pytest.fixture(autouse=True)
def fixture_unchecked(monkeypatch):
    monkeypatch.setattr(config, "jaxtyping_disable", True)


@pytest.mark.parametrize(
    ("function", "arguments", "said"),
    [
        (extract_parts, ("cat0.off",), r"^mesh is of type str: give a Mesh, e\.g\. load_mesh\(path\)$"),
        (extract_parts, (MESH, 15), "^extraction is of type int: give an Extraction"),
        (clean, (Path("cat0.off"),), "^mesh is of type PosixPath: give a Mesh"),
        (rank, (MESH, [PARTS]), r"^query is of type Mesh: give Parts, e\.g\. extract_parts\(mesh\)$"),
        (rank, (PARTS, "parts"), "^the collection is of type str: " + SEVERAL),
        (rank, (PARTS, Path("parts")), "^the collection is of type PosixPath: " + SEVERAL),
        (rank, (PARTS, PARTS), "^the collection is of type Parts: " + SEVERAL),
        (rank, (PARTS, [PARTS, MESH]), "^an object of the collection is of type Mesh: " + SEVERAL),
        (rank, (PARTS, [PARTS], "elastic"), "^matching is of type str: give a Matching"),
        (dissimilarity_matrix, (PARTS,), "^the collection is of type Parts: " + SEVERAL),
        (Collection.of, (MESH,), "^the collection is of type Mesh: " + SEVERAL),
        (save_parts, (MESH, "a.npz"), "^parts is of type Mesh: give Parts"),
        (load_collection, ("parts",), "^paths is of type str: give a list of files"),
        (extract_collection, ("parts",), "^paths is of type str: give a list of files and folders"),
        (evaluate, (SAVED, ["x", "x"]), r"^dissimilarity is of type SavedMatrix: give .*, saved\.dissimilarity$"),
        (rerank, (SAVED,), r"^dissimilarity is of type SavedMatrix: give .*, saved\.dissimilarity$"),
    ],
)
def test_arguments_of_the_wrong_type_get_a_sentence(function, arguments, said):
    with pytest.raises(ValueError, match=said):
        function(*arguments)


def test_a_ranking_is_explained_by_index():
    ranking = Ranking(**dict.fromkeys(Ranking.__dataclass_fields__, np.zeros(0)) | {"names": ("cat2",)})
    with pytest.raises(ValueError, match=r"^j is of type str: give an index, .* ranking\.names\.index\(name\)$"):
        ranking.explain("cat2")


def test_a_parts_file_that_is_not_there():
    with pytest.raises(FileNotFoundError, match=r"^nope\.npz: no such parts file$"):
        load_parts("nope.npz")
