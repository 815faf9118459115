import sys
import time

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from curvematch_jax.datasets import CREATURES, creature, creatures
from curvematch_jax.datasets._implicit import surface
from curvematch_jax.datasets._plans import PLANS
from curvematch_jax.datasets._skeleton import draw_build, draw_pose, place, rest_pose

pytest.importorskip("manifold3d")

SMALL = 800


@pytest.fixture(scope="module")
def built_in():
    """One creature at rest and one posed of every class, with the processor time that each took."""
    found = []
    for kind in CREATURES:
        for pose in (0, 1):
            start = time.process_time()
            found.append((creature(kind, pose), time.process_time() - start))
    return found


def directed_edges(faces):
    return np.stack([faces.ravel(), np.roll(faces, -1, axis=1).ravel()], axis=1)


def area(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def smallest_angles(vertices, faces):
    corners = vertices[faces]
    to_next = np.roll(corners, -1, axis=1) - corners
    to_last = np.roll(corners, 1, axis=1) - corners
    cosine = np.sum(to_next * to_last, axis=2) / np.linalg.norm(to_next, axis=2) / np.linalg.norm(to_last, axis=2)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))).min(axis=1)


def test_classes_and_poses_in_order(built_in):
    assert len(CREATURES) >= 8
    assert [c.label for c, _ in built_in] == [kind for kind in CREATURES for _ in range(2)]
    made = [(c.label, c.mesh.name) for c in creatures(["snake", "hand"], poses=2)]
    assert made == [("snake", "snake0"), ("snake", "snake1"), ("hand", "hand0"), ("hand", "hand1")]


def assert_closed_oriented_in_one_piece(mesh, genus):
    edges = directed_edges(mesh.faces)
    keys = set(map(tuple, edges.tolist()))
    assert len(keys) == len(edges), mesh.name  # at most one face on each side of an edge
    assert keys == {(b, a) for a, b in keys}, mesh.name  # and one on both, the other way round
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    links = coo_array((np.ones(len(edges)), edges.T), shape=(len(mesh.vertices),) * 2)
    assert connected_components(links)[0] == 1, mesh.name
    characteristic = len(mesh.vertices) - len(edges) // 2 + len(mesh.faces)
    assert characteristic == 2 - 2 * genus, mesh.name
    assert volume(mesh.vertices, mesh.faces) > 0, mesh.name


def test_each_is_a_closed_oriented_manifold_in_one_piece(built_in):
    for made, _ in built_in:
        assert_closed_oriented_in_one_piece(made.mesh, genus=made.label == "teapot")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_more_individuals_are_closed_oriented_manifolds_in_one_piece(seed):
    for made in creatures(poses=10, seed=seed):
        assert_closed_oriented_in_one_piece(made.mesh, genus=made.label == "teapot")


def test_triangles_are_regular_and_some_thousand(built_in):
    for made, _ in built_in:
        assert 2000 < len(made.mesh.vertices) < 6000, made.mesh.name
        assert np.percentile(smallest_angles(made.mesh.vertices, made.mesh.faces), 1) > 20, made.mesh.name


def test_each_takes_less_than_a_second(built_in):
    assert max(seconds for _, seconds in built_in) < 1.0


def test_individuals_differ_and_repeat_with_the_seed():
    first, again, other = (creature("snake", 2, seed, SMALL).mesh for seed in (0, 0, 1))
    assert np.array_equal(first.vertices, again.vertices)
    assert np.array_equal(first.faces, again.faces)
    assert not np.array_equal(first.vertices, other.vertices)
    assert not np.array_equal(first.vertices, creature("snake", 3, 0, SMALL).mesh.vertices)


def test_a_creature_does_not_depend_on_which_others_are_made():
    (alone,) = creatures(["teapot"], poses=1)
    assert np.array_equal(alone.mesh.vertices, creature("teapot", 0).mesh.vertices)


@pytest.mark.parametrize("kind", ["horse", "octopus", "human"])
def test_poses_of_one_build_are_nearly_isometric(kind):
    plan = PLANS[kind]()
    build = draw_build(plan, np.random.default_rng(0))
    rest, bent = rest_pose(plan), draw_pose(plan, np.random.default_rng(1))
    at_rest, posed = (surface(place(plan, build, pose), 4000) for pose in (rest, bent))
    assert area(*posed) == pytest.approx(area(*at_rest), rel=0.02)
    extent = [np.ptp(points, axis=0) for points, _ in (at_rest, posed)]
    assert np.abs(extent[0] - extent[1]).max() > 0.05  # it did move


def test_individuals_vary_in_length_and_thickness():
    plan = PLANS["human"]()
    builds = [draw_build(plan, np.random.default_rng(k)) for k in range(200)]
    lengths, thicknesses = np.log([build["leg"] for build in builds]).T
    assert 0.04 < lengths.std() < 0.08
    assert 0.06 < thicknesses.std() < 0.12


def test_the_centaur_is_composed_of_horse_and_human():
    horse, human, centaur = ({bone.name: bone for bone in PLANS[k]().bones} for k in ("horse", "human", "centaur"))
    assert all(bone in (horse.get(name), human.get(name)) or name == "waist" for name, bone in centaur.items())
    assert {"hind leg.l", "fore leg.r", "tail", "barrel 1"} <= centaur.keys() & horse.keys()
    assert {"arm.l", "arm 2.r", "head 2", "waist 1"} <= centaur.keys() & human.keys()


def test_left_and_right_mirror_each_other():
    plan = PLANS["human"]()
    capsules = place(plan, draw_build(plan, np.random.default_rng(0)), rest_pose(plan))
    names = [bone.name for bone in plan.bones]
    for k, name in enumerate(names):
        if name.endswith(".l"):
            other = names.index(name[:-1] + "r")
            np.testing.assert_allclose(capsules.tips[other], capsules.tips[k] * [-1, 1, 1], atol=1e-12)
            np.testing.assert_allclose(capsules.radii[other], capsules.radii[k])


def test_unknown_classes_and_numbers_are_refused():
    with pytest.raises(ValueError, match="no creature is called unicorn, yeti; there are airplane"):
        creatures(["human", "unicorn", "yeti"])
    with pytest.raises(ValueError, match="no creature is called yeti"):
        creature("yeti")
    with pytest.raises(ValueError, match="pose -1"):
        creature("human", -1)
    with pytest.raises(ValueError, match="poses must be 1 or more, not 0"):
        creatures(poses=0)


def test_without_manifold3d_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(
        ImportError, match=r"generating a creature needs manifold3d: pip install 'curvematch_jax\[prep\]'"
    ):
        creature("snake")
