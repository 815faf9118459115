import sys
from collections import Counter

import numpy as np
import pytest
from scipy.spatial import KDTree
from surface.shapes import joined, limbed, moved, sphere, torus

from curvematch_jax.datasets import CREATURES, composites, creature, creatures
from curvematch_jax.datasets._halves import halves, join
from curvematch_jax.surface import Mesh, MeshError
from curvematch_jax.surface._features import feature_points
from curvematch_jax.surface._fields import distances_on
from curvematch_jax.surface._topology import face_components, is_closed_manifold, signed_volume

pytest.importorskip("manifold3d")

KINDS = ("human", "horse", "hand", "snake")


@pytest.fixture(scope="module")
def models():
    return [(creature(kind, pose, vertices=800).mesh, kind) for kind in KINDS for pose in (0, 1)]


@pytest.fixture(scope="module")
def made(models):
    return list(composites(models, count=6))


def in_frame(half):
    return half.solid.to_mesh64().vert_properties[:, :3]


def euler(mesh):
    return len(mesh.vertices) - len(mesh.faces) // 2


def test_each_is_closed_and_in_one_piece(made):
    for composite in made:
        mesh = composite.mesh
        assert is_closed_manifold(mesh.vertices, mesh.faces), mesh.name
        assert face_components(mesh.faces)[0] == 1, mesh.name
        assert euler(mesh) == 2, mesh.name
        assert signed_volume(mesh.vertices, mesh.faces) > 0, mesh.name


def test_sources_are_two_models_of_the_two_classes(models, made):
    classes = {mesh.name: label for mesh, label in models}
    for composite in made:
        assert composite.labels == tuple(classes[name] for name in composite.sources)
        assert composite.labels[0] != composite.labels[1]
        assert composite.mesh.name == "+".join(composite.sources)


def test_classes_pairs_and_models_take_part_about_equally_often(made):
    assert Counter(label for composite in made for label in composite.labels) == dict.fromkeys(KINDS, 3)
    assert len({frozenset(composite.labels) for composite in made}) == 6
    assert len({name for composite in made for name in composite.sources}) == 8


def test_composites_repeat_with_the_seed_and_are_the_first_of_more(models, made):
    (again,) = composites(models, count=1)
    (other,) = composites(models, count=1, seed=1)
    assert again.sources == made[0].sources
    assert np.array_equal(again.mesh.vertices, made[0].mesh.vertices)
    assert np.array_equal(again.mesh.faces, made[0].mesh.faces)
    assert other.sources != made[0].sources


def test_human_and_horse_are_cut_at_the_waist(models):
    human, horse = (halves(models[k][0]) for k in (0, 2))
    assert [half.tips for half in human if half.axis == 0] in ([2, 3], [3, 2])
    for half in human + horse:
        points = in_frame(half)
        width, height, _ = np.ptp(points[points[:, 2] > -1e-6], axis=0)
        assert points[:, 2].max() < 1e-9
        assert width >= height
        assert half.cut.num_contour() == 1
        assert half.tips >= 1


def test_both_halves_keep_their_limbs_in_the_composite(models):
    lower, upper = halves(models[0][0])[0], halves(models[2][0])[0]
    mesh = join(lower, upper)
    assert mesh is not None
    assert KDTree(mesh.vertices).query(in_frame(lower))[0].max() < 0.05
    # The other half turned upside down: as high as it was deep, at a scale within bounds.
    scale = mesh.vertices[:, 2].max() / -in_frame(upper)[:, 2].min()
    assert 1 / 1.5 < scale < 1.5
    points = feature_points(mesh, distances_on(mesh, "geodesic"), 0.05).vertices
    assert min(lower.tips, upper.tips) >= 2
    assert (mesh.vertices[points, 2] < 0).sum() >= lower.tips
    assert (mesh.vertices[points, 2] > 0).sum() >= upper.tips


def test_place_and_size_of_a_model_do_not_matter(models):
    (one,), (same,) = (
        list(composites([(moved(mesh, offset, size), label) for mesh, label in models[:3:2]], count=1))
        for offset, size in (((0, 0, 0), 1.0), ((7, 0, -3), 100.0))
    )
    assert one.sources == same.sources
    assert one.mesh.vertices.max() == pytest.approx(same.mesh.vertices.max(), abs=0.05)


def test_two_models_are_enough_for_many_composites():
    pair = [(sphere(3), "ball"), (limbed(subdivisions=4), "star")]
    made = list(composites(pair, count=3))
    assert [set(composite.labels) for composite in made] == [{"ball", "star"}] * 3


def test_a_class_that_cannot_be_cut_is_passed_over(models):
    ring = Mesh(torus().vertices, torus().faces, "ring")
    made = list(composites([*models[:4], (ring, "ring")], count=3))
    assert all(set(composite.labels) == {"human", "horse"} for composite in made)


def test_what_cannot_be_made_is_said_in_a_sentence(models):
    with pytest.raises(ValueError, match=r"^composites are of two classes, and the 2 models have 1$"):
        composites(models[:2])
    with pytest.raises(ValueError, match=r"^count 0 and seed 0 must be 1 and 0 or more$"):
        composites(models, count=0)
    rings = [(torus(), "ring"), (torus(1.0, 0.2), "hoop")]
    with pytest.raises(ValueError, match=r"^only 0 of 30 composites could be made: no models of two classes are left"):
        next(composites(rings))
    flat = Mesh(np.eye(3), np.arange(3)[None], "sheet")
    with pytest.raises(MeshError, match="sheet"):
        next(composites([(flat, "sheet"), models[0]]))


def test_soups_are_cleaned_first(models):
    crumbs = joined(models[0][0], moved(sphere(1), (5, 0, 0), 0.01))
    (made,) = composites([(crumbs, "human"), models[2]], count=1)
    assert face_components(made.mesh.faces)[0] == 1


def test_without_manifold3d_the_message_says_what_to_install(models, monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(ImportError, match=r"making composites needs manifold3d: pip install 'curvematch_jax\[prep\]'"):
        next(composites(models))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_thirty_composites_of_creatures_are_of_thirty_pairs(seed):
    models = [(each.mesh, each.label) for each in creatures(poses=3, seed=seed)]
    made = list(composites(models, seed=seed))
    uses = Counter(label for composite in made for label in composite.labels)
    assert len(made) == len({frozenset(composite.labels) for composite in made}) == 30
    assert set(uses) == set(CREATURES)
    assert max(uses.values()) - min(uses.values()) <= 2
