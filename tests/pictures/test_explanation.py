"""What explains a ranking: matched parts in the same colours, and the masses of a query's parts."""

import dataclasses
import sys

import numpy as np
import pytest
import trimesh

from curvematch_jax.pictures import check_picture, explanation_picture, masses_picture
from curvematch_jax.pictures._colours import PALETTE, UNMATCHED, matched_by, part_colours
from curvematch_jax.pictures._strokes import strokes
from curvematch_jax.retrieval import Match, Ranking
from curvematch_jax.surface import Extraction, Mesh, Parts

image = pytest.importorskip("matplotlib.image")

SETTINGS = Extraction()


def sphere_parts(name="sphere", poles=2):
    """A unit sphere with a part around the north pole and one around the south pole; or less of them."""
    polar = SETTINGS.radii * np.pi
    around = 2 * np.pi * np.arange(SETTINGS.samples) / SETTINGS.samples
    circle = np.stack([np.cos(around), np.sin(around), 0 * around]) / (2 * np.pi)
    centres = np.cos(polar)[:, None] * np.array([0, 0, 1])
    turned = np.array([[1, 1, 1], [1, -1, -1]])[:poles]  # half a turn about the first axis
    shape = (poles, SETTINGS.levels)
    return Parts(
        name=name,
        curves=np.broadcast_to(circle * turned[:, None, :, None], (*shape, *circle.shape)).astype(np.float32),
        mask=np.ones(shape, bool),
        lengths=np.broadcast_to(2 * np.sin(polar), shape).astype(np.float32),
        level_set_lengths=np.broadcast_to(2 * np.sin(polar), shape).astype(np.float32),
        centres=(centres * turned[:, None]).astype(np.float32),
        areas=np.full(poles, 0.9, np.float32),
        points=(np.array([0, 0, 1]) * turned).astype(np.float32),
        feature_distances=(1 - np.eye(poles)).astype(np.float32),
        area=4 * np.pi,
        diameter=np.pi,
        settings=SETTINGS,
        notes=(),
    )


def ranking_of(collection, matched, distances):
    """A ranking in the order of the collection."""
    distances = np.array(distances, dtype=float)
    return Ranking(
        order=np.arange(len(collection)),
        names=tuple(parts.name for parts in collection),
        dissimilarity=np.arange(len(collection)) + 0.5,
        probability=np.full(len(collection), 0.2),
        conflict=0.1,
        ignorance=0.1,
        evidence={},
        distances=distances,
        matched=np.array(matched),
        masses=0.5 / (1 + distances),
        exact=np.ones(len(collection), bool),
        notes=(),
        seconds={},
    )


def pixels(path):
    return (image.imread(path)[..., :3] * 255).round().astype(int)


def count(picture, colour):
    rgb = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return int(np.all(np.abs(picture - rgb) <= 2, axis=-1).sum())


def halves(picture, tiles):
    """Upper and lower halves of the drawings side by side, without titles and captions."""
    return [np.split(tile[tile.shape[0] % 2 :], 2) for tile in np.array_split(picture, tiles, axis=1)]


def test_a_part_goes_by_the_nearest_that_matched_it():
    matches = [Match(2, 1, 0.1, 0.5), Match(0, 1, 0.2, 0.5), Match(1, 0, 0.3, 0.5)]
    assert matched_by(matches, 3).tolist() == [1, 2, -1]
    assert matched_by(matches[::-1], 3).tolist() == [1, 2, -1]
    assert matched_by([], 2).tolist() == [-1, -1]


def test_colours_are_those_of_the_parts_that_matched():
    query, other = part_colours(np.arange(16)), part_colours(np.array([3, -1, 0]))
    assert len(np.unique(query, axis=0)) == 16
    assert other[[0, 2]].tolist() == query[[3, 0]].tolist()
    assert other[1].tolist() == [int(UNMATCHED[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    assert part_colours(np.array([16])).tolist() == query[:1].tolist()


def test_strokes_leave_each_piece_of_the_surface_to_the_nearest_point():
    pieces = strokes(sphere_parts())
    own = pieces.beyond <= 0
    height = pieces.outer[:, :, 2].mean(axis=1)
    assert height[own & (pieces.part == 0)].min() > -0.1
    assert height[own & (pieces.part == 1)].max() < 0.1
    quads = np.concatenate([pieces.outer, pieces.inner[:, ::-1]], axis=1)
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]) / 2
    assert ((normals * quads.mean(axis=1)).sum(axis=1) > 0).all()
    assert np.linalg.norm(normals[own], axis=1).sum() == pytest.approx(4 * np.pi, rel=0.1)


def test_strokes_of_one_part_and_of_none():
    assert set(strokes(sphere_parts(poles=1)).part.tolist()) == {0}
    assert len(strokes(sphere_parts(poles=0)).part) == 0


def test_matched_parts_have_the_same_colours(tmp_path):
    query = sphere_parts("query")
    collection = [sphere_parts("same"), sphere_parts("swapped"), sphere_parts("half"), sphere_parts("none", poles=0)]
    matched = [[0, 1, 0, -1], [1, 0, 0, -1]]
    ranking = ranking_of(collection, matched, [[0.1, 0.2, 0.3, 1.0], [0.2, 0.1, 0.4, 1.0]])
    explanation_picture(query, collection, ranking, tmp_path / "why.png")
    picture = pixels(tmp_path / "why.png")
    assert picture.shape[1] > 3 * picture.shape[0] > 900
    (first, second, *_), tiles = PALETTE, halves(picture, 5)
    for (upper, lower), above, below in zip(tiles[:3], (first, first, second), (second, second, first), strict=True):
        assert count(upper, above) > 2 * count(lower, above) + 100
        assert count(lower, below) > 2 * count(upper, below) + 100
    assert count(tiles[3][0], first) > 100
    assert count(tiles[3][1], UNMATCHED) > 30
    assert count(tiles[3][0], second) == count(tiles[3][1], second) == 0
    assert not any(count(half, colour) for half in tiles[4] for colour in PALETTE)


def test_surfaces_are_drawn_whichever_way_they_are_oriented(tmp_path):
    query, collection = sphere_parts("query"), [sphere_parts("$same_^$")]  # a name, not mathematics
    ranking = ranking_of(collection, [[0], [1]], [[0.1], [0.2]])
    ball = trimesh.creation.icosphere(3)
    out = Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    turned = dataclasses.replace(out, faces=out.faces[:, ::-1])
    for name, mesh in (("out", out), ("turned", turned), ("none", None)):
        explanation_picture(query, collection, ranking, tmp_path / f"{name}.png", mesh=mesh, meshes={0: out})
    drawn, inside_out, by_curves = (pixels(tmp_path / f"{name}.png") for name in ("out", "turned", "none"))
    assert np.mean(np.abs(drawn - inside_out) > 8) < 0.01
    assert np.mean(np.abs(drawn - by_curves) > 8) > 0.01


def test_parts_without_curves_are_points_on_the_surface(tmp_path):
    bare = dataclasses.replace(sphere_parts(), mask=np.zeros((2, SETTINGS.levels), bool))
    ball = trimesh.creation.icosphere(2)
    mesh = Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    ranking = ranking_of([bare], [[0], [1]], [[1.0], [1.0]])
    explanation_picture(bare, [bare], ranking, tmp_path / "bare.png", mesh=mesh)
    assert all(count(pixels(tmp_path / "bare.png"), colour) > 100 for colour in PALETTE[:2])


def test_a_ranking_of_something_else_is_refused(tmp_path):
    collection = [sphere_parts("a"), sphere_parts("b")]
    ranking = ranking_of(collection, [[0, 0], [1, 1]], [[0.1, 0.2], [0.1, 0.2]])
    for query, others in ((sphere_parts(poles=1), collection), (sphere_parts(), collection[::-1])):
        with pytest.raises(ValueError, match="not one of this query in this collection"):
            explanation_picture(query, others, ranking, tmp_path / "why.png")
    with pytest.raises(ValueError, match="top must be at least 1, found 0"):
        explanation_picture(sphere_parts(), collection, ranking, tmp_path / "why.png", top=0)


def test_masses_by_parts_and_objects(tmp_path):
    collection = [sphere_parts(f"object{j}") for j in range(12)]
    ranking = ranking_of(collection, np.zeros((2, 12), int), np.linspace(0.1, 2, 24).reshape(2, 12))
    masses_picture(ranking, tmp_path / "all.png")
    masses_picture(ranking, tmp_path / "three.png", top=3)
    wide, narrow = pixels(tmp_path / "all.png"), pixels(tmp_path / "three.png")
    assert wide.shape[1] > narrow.shape[1] > 200
    assert len(np.unique(wide.reshape(-1, 3), axis=0)) > 100
    with pytest.raises(ValueError, match="no masses"):
        masses_picture(ranking_of(collection, np.zeros((0, 12), int), np.zeros((0, 12))), tmp_path / "m.png")
    with pytest.raises(ValueError, match="top must be at least 1, found 0"):
        masses_picture(ranking, tmp_path / "m.png", top=0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("why.mesh", "the suffix '.mesh' is not a picture format; known are .*png"),
        ("why", r"the suffix \(none\) is not a picture format"),
        ("file/missing/why.png", "file is not a writable folder"),
        ("folder.png", "is a folder, not a picture"),
    ],
)
def test_paths_that_cannot_be_written_are_refused_before_any_work(tmp_path, name, message):
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match=message):
        check_picture(tmp_path / name)
    check_picture(tmp_path / "missing" / "why.png")


def test_checking_a_path_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"drawing a picture needs matplotlib: pip install"):
        check_picture(tmp_path / "why.png")
