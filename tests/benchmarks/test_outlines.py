import numpy as np
import pytest

import curvematch_jax as cm
from benchmarks import outlines

RIGID = cm.Rigid(grid=32, measured=False, chunk=16)


@pytest.fixture(name="shapes")
def fixture_shapes():
    """Three members of each of two classes, of which only one is its own mirror image; every other one is mirrored."""
    random = np.random.default_rng(3)
    angle = 2 * np.pi * np.arange(40) / 40
    ellipse = np.stack([2 * np.cos(angle), np.sin(angle)])
    comma = np.stack([np.cos(angle), np.sin(angle)]) * (1 + 0.45 * np.cos(angle) + 0.35 * np.sin(2 * angle))
    curves = np.stack([shape for shape in (ellipse, comma) for _ in range(3)])
    curves += 0.01 * random.normal(size=(6, 2, 1)) * np.cos(3 * angle)
    curves[1::2] = (curves[1::2] * [[-1], [1]])[..., ::-1]
    return curves.astype(np.float32), np.repeat(["ellipse", "comma"], 3)


def test_bullseye_by_hand():
    """The nearest four of each, itself first: of the first two they hold both of the class, of the others one."""
    labels = np.array(["a", "a", "b", "b", "c", "c"])
    order = [
        [0, 2, 3, 1, 4, 5],
        [1, 0, 2, 3, 4, 5],
        *([k, 0, 1, *{2, 3, 4, 5} - {k, k ^ 1}, k ^ 1] for k in range(2, 6)),
    ]
    matrix = np.argsort(order, axis=1).astype(float)
    assert outlines.hits(matrix, labels) == pytest.approx([1, 1, 0.5, 0.5, 0.5, 0.5])
    assert outlines.hits(np.where(np.eye(6), 9, matrix), labels) == pytest.approx([1, 1, 0.5, 0.5, 0.5, 0.5])


def test_mirror_images_run_the_same_way_and_are_near(shapes):
    curves, _ = shapes
    mirrored = outlines.images(curves)
    area = lambda c: np.sum(c[:, 0] * np.roll(c[:, 1], -1, -1) - c[:, 1] * np.roll(c[:, 0], -1, -1), axis=1)  # noqa: E731
    np.testing.assert_allclose(area(mirrored), area(curves), rtol=1e-5)
    found = outlines.between(curves, mirrored, RIGID)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_allclose(found, np.where(np.eye(6), 0, cm.distance_matrix(curves, mirrored, RIGID)), atol=1e-2)
    assert found[3, 4] < 0.1 < cm.distance_matrix(curves, aligner=RIGID)[3, 4]


def test_scores_with_mirror_images_are_better(shapes, monkeypatch):
    curves, labels = shapes
    monkeypatch.setitem(outlines.PRESETS, "rigid", RIGID)
    rows = outlines.report(curves, labels, ["rigid"])["presets"]["rigid"]
    assert rows["mirrored"]["bullseye"] == rows["mirrored"]["nn"] == rows["mirrored"]["ft"] == 1
    assert rows["plain"]["ft"] < 1
    for row in (rows["plain"], rows["mirrored"]):
        assert row["pairs_per_second"] * row["seconds"] == pytest.approx(15)


def test_two_matrices_have_the_same_distances_with_mirror_images(shapes):
    """They are what the first engine has to compute."""
    curves, _ = shapes
    measured = cm.Rigid(chunk=8)
    twice = np.minimum(*(outlines.between(curves, c, measured) for c in (curves, outlines.images(curves))))
    np.testing.assert_allclose(outlines.mirrored(curves, measured), twice, atol=2e-3)


def test_k_is_chosen_on_every_other_class(monkeypatch):
    """Classes are scattered unless k is 8; it is found among a, c and e, and used for all."""
    labels = np.repeat(list("abcde"), 3)
    given = []

    def rerank(matrix, k):
        given.append((len(matrix), k))
        same = labels if len(matrix) == 15 else labels[np.isin(labels, list("ace"))]
        apart = (same[:, None] != same).astype(float)
        return apart if k == 8 else 1 - apart

    monkeypatch.setattr(outlines.cm, "rerank", rerank)
    found = outlines.reranked(np.zeros((15, 15)), labels)
    assert found["k"] == 8
    assert found["others"] == found["bullseye"] == 1
    assert given == [*((9, k) for k in (4, 6, 8, 10, 12, 15)), (15, 8)]


def test_the_first_of_each_class_are_read(shapes, tmp_path):
    curves, labels = shapes
    mixed = np.array([3, 0, 4, 1, 5, 2])
    np.savez(tmp_path / "mpeg7_half.npz", curves=curves[mixed], labels=labels[mixed])
    found, names = outlines.outlines(tmp_path / "mpeg7_half.npz", 32, 2)
    assert found.shape == (4, 2, 32)
    assert names.tolist() == ["comma", "ellipse", "comma", "ellipse"]
