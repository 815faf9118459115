import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import limbed

from benchmarks._models import Model
from benchmarks.figures import _loft
from benchmarks.figures._collection import Collection, Described
from benchmarks.figures.changes import counterparts, dirty
from benchmarks.figures.rankings import not_above
from curvematch_jax.surface import clean, extract_parts
from curvematch_jax.surface._topology import is_closed_manifold


@pytest.fixture(scope="module")
def limbs():
    return extract_parts(limbed())


def test_a_dirty_mesh_has_holes_and_is_cleaned_to_what_it_was():
    mesh = limbed()
    torn = dirty(mesh, 1)
    assert not is_closed_manifold(torn.vertices, torn.faces)
    mended, report = clean(torn)
    assert is_closed_manifold(mended.vertices, mended.faces)
    assert min(report.closed_holes, report.flipped, report.dropped_faces) > 0
    assert np.ptp(mended.vertices, axis=0) == pytest.approx(np.ptp(mesh.vertices, axis=0), rel=0.05)


def test_raw_models_find_their_counterparts_by_name(limbs):
    raw = [Model("cat3.obj", "cat", limbed, ()), Model("gorilla5.off", "gorilla", limbed, ())]
    tidy = Collection("tidy", [])
    tidy.described = [Described("gorilla05.off", "gorilla", limbed(), limbs), Described("cat3", "cat", limbed(), limbs)]
    assert counterparts(raw, tidy) == [1, 0]
    with pytest.raises(ValueError, match=r"dog1.off \(dog\) has no clean counterpart in tidy"):
        counterparts([Model("dog1.off", "dog", limbed, ())], tidy)


def test_the_first_method_is_above_another_where_it_is_better_or_both_are_perfect():
    curves = {"default": [1.0, 0.8, 0.5], "same": [1.0, 0.8, 0.4], "worse": [0.9, 0.7, 0.4]}
    assert not_above(curves) == {"same": [0.1], "worse": []}


def test_the_way_from_a_part_to_its_turned_copy_moves_nothing(limbs, monkeypatch):
    turn = Rotation.from_rotvec([0.4, -1.0, 0.7])
    turned = dataclasses.replace(
        limbs,
        curves=np.einsum("ij,pljn->plin", turn.as_matrix(), limbs.curves).astype(np.float32),
        centres=turn.apply(limbs.centres.reshape(-1, 3)).reshape(limbs.centres.shape),
        points=turn.apply(limbs.points),
    )
    # The engine's own tests are elsewhere, and to compile it takes long.
    still = SimpleNamespace(curves=lambda: np.repeat(limbs.curves[0, :3, None], 3, axis=1))
    monkeypatch.setattr(_loft, "geodesic", lambda one, other, steps: still)
    rotations = np.repeat(turn.inv().as_matrix()[None], 3, axis=0)
    monkeypatch.setattr(_loft, "align", lambda one, other: SimpleNamespace(rotation=rotations))
    found = _loft.way(limbs, 0, turned, 0, count=3, steps=2)
    assert found.curves.shape == (3, 3, limbs.curves.shape[-1], 3)
    assert np.allclose(found.curves, found.curves[0], atol=1e-5)
    on_mesh = limbs.curves[0, :3] * limbs.lengths[0, :3, None, None] + limbs.centres[0, :3, :, None] / limbs.diameter
    placed = on_mesh.transpose(0, 2, 1) - limbs.points[0] / limbs.diameter
    assert np.allclose(found.curves[0], placed, atol=1e-5)


def test_lofted_curves_begin_next_to_each_other():
    angle = 2 * np.pi * np.arange(24) / 24
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    rings = np.stack([np.roll(ring, shift, axis=0) + np.array([0, 0, shift]) for shift in (0, 5, 17)])
    assert np.allclose(_loft.lofted(rings)[..., :2], ring[:, :2])
