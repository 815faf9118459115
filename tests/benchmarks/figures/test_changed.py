import argparse
import json

import numpy as np
import pytest
from surface.shapes import limbed

from benchmarks._models import Model
from benchmarks.figures import perform
from benchmarks.figures._changed import scores
from benchmarks.figures._collection import Collection
from benchmarks.figures.changes import moved, parts_from_moved_points, vertex_normals, with_noise
from curvematch_jax.datasets import creature
from curvematch_jax.surface import extract_parts
from curvematch_jax.surface._fields import Geodesics


def small(kind, pose):
    return creature(kind, pose, vertices=1500).mesh


def four():
    """Two classes of two creatures."""
    return [Model(f"{kind}{pose}", kind, small, (kind, pose)) for kind in ("human", "octopus") for pose in (0, 1)]


@pytest.mark.parametrize("amount", [0.002, 0.005])
def test_noise_has_the_size_that_was_asked_for_and_the_direction_of_the_normals(amount):
    mesh = limbed()
    steps = with_noise(mesh, amount).vertices - mesh.vertices
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    assert np.sqrt((steps**2).sum(axis=1).mean()) == pytest.approx(amount * diagonal, rel=0.05)
    assert np.abs(np.cross(steps, vertex_normals(mesh))).max() < 1e-12


def test_noise_is_the_same_for_the_same_seed_only():
    mesh = limbed()
    assert np.array_equal(with_noise(mesh, 0.002, 1).vertices, with_noise(mesh, 0.002, 1).vertices)
    assert not np.array_equal(with_noise(mesh, 0.002, 1).vertices, with_noise(mesh, 0.002, 2).vertices)


@pytest.mark.parametrize("amount", [0.02, 0.05])
def test_a_point_moves_as_far_as_it_should(amount):
    field = Geodesics(limbed(subdivisions=5))(0)
    away = amount * field.max()
    vertices = [moved(field, away, np.random.default_rng(seed)) for seed in range(20)]
    assert np.abs(field[vertices] - away).max() <= 0.25 * away
    assert len(set(vertices)) > 1


def test_a_point_moves_to_what_is_nearest_to_its_place_where_no_vertex_is_near():
    assert moved(np.array([0.0, 3.0, 2.0, 9.0]), 0.9, np.random.default_rng(0)) == 0


def test_parts_from_moved_points_are_around_these():
    model = four()[0]
    parts, still = parts_from_moved_points((model, 0.02)), extract_parts(small("human", 0))
    steps = np.linalg.norm(parts.points - still.points, axis=1) / still.diameter
    assert parts.mask.shape == still.mask.shape
    assert 0.008 < steps.min() <= steps.max() < 0.026
    assert parts.settings == still.settings


def test_a_query_is_never_compared_with_what_it_was_made_from():
    rows = np.array([[0.0, 2.0, 1.0, 3.0], [5.0, 9.0, 2.0, 3.0]])
    found = scores(rows, [0, 1], ["a", "a", "b", "b"])
    assert found["queries"] == 2
    assert found["nn"] == 0
    assert found["map"] == pytest.approx((1 / 2 + 1 / 3) / 2)


def test_a_query_that_is_alone_in_its_class_does_not_count():
    rows = np.array([[0.0, 1.0, 2.0], [1.0, 2.0, 0.0]])
    assert scores(rows, [0, 2], ["a", "a", "b"])["queries"] == 1
    with pytest.raises(ValueError, match="nothing to retrieve"):
        scores(rows[1:], [2], ["a", "a", "b"])


@pytest.mark.slow
def test_noisy_queries_of_two_classes(tmp_path):
    pytest.importorskip("matplotlib")
    given = argparse.Namespace(benchmark="figures", out=tmp_path, methods=["default"], per_class=1)
    perform("noise", Collection("four", four()), given)
    assert (tmp_path / "noise.png").stat().st_size > 5_000
    found = json.loads((tmp_path / "noise.json").read_text())
    row = found["noise"]["default"]["0.2 %"]
    assert row["changed"]["queries"] == row["clean"]["queries"] == 2
    assert row["changed"]["map"] == 1
    assert not found["failed"]
    assert found["arguments"] == {"methods": ["default"], "per_class": 1}
