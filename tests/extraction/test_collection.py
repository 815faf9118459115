import numpy as np
import pytest
import trimesh

from curvematch_jax import Extraction, creature, extract_collection, extract_parts, load_mesh
from curvematch_jax.retrieval import fingerprint

SETTINGS = Extraction(levels=3, samples=32, vertices=300)


@pytest.fixture(name="folder", scope="module")
def fixture_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    for name in ("hand", "snake"):
        mesh = creature(name, 0, vertices=400).mesh
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / f"{name}.off")
    (folder / "broken.off").write_text("OFF\n3 1 0\n")
    return folder


def test_a_folder_becomes_parts_and_failures_and_the_cache_remembers(folder, tmp_path):
    calls = []
    first = extract_collection(
        [folder], SETTINGS, jobs=2, cache=tmp_path / "kept", progress=lambda done, total: calls.append((done, total))
    )
    assert [parts.name for parts in first.parts] == ["hand.off", "snake.off"]
    assert [failure.name for failure in first.failures] == ["broken.off"]
    assert "truncated" in first.failures[0].reason
    assert first.computed == 2
    assert (calls[0], calls[-1]) == ((0, 3), (3, 3))
    again = extract_collection([folder], SETTINGS, jobs=1, cache=tmp_path / "kept")
    assert again.computed == 0
    assert list(map(fingerprint, again.parts)) == list(map(fingerprint, first.parts))
    read = extract_collection([tmp_path / "kept"], SETTINGS)
    assert (len(read.parts), read.computed) == (2, 0)


def test_a_mesh_that_is_given_with_its_parts_counts_once(folder, tmp_path):
    kept = tmp_path / "kept"
    assert extract_collection([folder / "hand.off", folder / "snake.off"], SETTINGS, jobs=1, cache=kept).computed == 2
    for given in ([kept, folder / "hand.off"], [folder / "snake.off", kept]):
        found = extract_collection(given, SETTINGS, jobs=1)
        assert found.computed == 0
        assert [parts.name for parts in found.parts] == ["hand.off", "snake.off"]


def test_another_mesh_of_the_name_of_parts_is_another_object(folder, tmp_path):
    extract_collection([folder / "hand.off"], SETTINGS, jobs=1, cache=tmp_path / "kept")
    other = tmp_path / "hand.off"
    other.write_bytes((folder / "snake.off").read_bytes())
    found = extract_collection([tmp_path / "kept", other], SETTINGS, jobs=1)
    assert len(found.parts) == 2


def test_it_is_what_one_mesh_alone_gives(folder):
    path = folder / "hand.off"
    (parts,) = extract_collection([path], SETTINGS, jobs=1).parts
    alone = extract_parts(load_mesh(path), SETTINGS)
    np.testing.assert_array_equal(parts.curves, alone.curves)
    np.testing.assert_array_equal(parts.points, alone.points)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"jobs": 0}, "jobs must be at least 1, found 0"),
        ({"time_limit": 0}, "time_limit must be more than 0 seconds, found 0"),
    ],
)
def test_limits_that_are_none_are_refused(folder, given, reason):
    with pytest.raises(ValueError, match=reason):
        extract_collection([folder], SETTINGS, **given)


def test_a_mesh_that_takes_too_long_fails_alone(folder):
    found = extract_collection([folder / "hand.off"], SETTINGS, jobs=1, time_limit=1e-3)
    assert found.parts == ()
    assert "took longer than 0.001 s" in found.failures[0].reason
