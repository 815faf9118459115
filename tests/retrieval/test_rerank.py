"""Re-ranking: what neighbours agree on, and what is left as it is."""

import numpy as np
import pytest

from curvematch_jax.retrieval import Collection, Matching, evaluate, rank, rerank, reranked


def circles(noise: float, seed: int = 0):
    """Points on two arcs that come near each other, and their labels: neighbours lead along an arc."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, np.pi, 30)
    points = np.concatenate([
        np.stack([np.cos(angle), np.sin(angle)], axis=1),
        np.stack([1 - np.cos(angle), 0.5 - np.sin(angle)], axis=1),
    ])  # fmt: skip
    points = points + noise * rng.normal(size=points.shape)
    return np.linalg.norm(points[:, None] - points, axis=2), ["a"] * 30 + ["b"] * 30


def test_neighbours_lead_along_classes():
    matrix, labels = circles(0.03)
    found = rerank(matrix)
    assert evaluate(found, labels).map > evaluate(matrix, labels).map + 0.01
    np.testing.assert_array_equal(found, found.T)
    assert (np.diag(found) == 0).all()
    assert ((found >= 0) & (found <= 1)).all()


def test_it_is_the_formula():
    matrix, _ = circles(0.1)
    matrix = matrix[::6, ::6]
    count, k = len(matrix), 3
    reach = [np.sort(row)[k] for row in matrix]
    affinity = np.empty((count, count))
    for i, j in np.ndindex(count, count):
        affinity[i, j] = np.exp(-matrix[i, j] / np.sqrt(reach[i] * reach[j]))
    near = matrix <= np.array(reach)[:, None]
    step = np.where(near & near.T, affinity, 0.0)
    step /= step.sum(axis=1, keepdims=True)
    fixed = np.linalg.solve(np.eye(count**2) - 0.8 * np.kron(step, step), 0.2 * affinity.ravel())
    expected = 1 - fixed.reshape(count, count)
    np.fill_diagonal(expected, 0.0)
    np.testing.assert_allclose(rerank(matrix, k), expected, atol=1e-3)


@pytest.mark.parametrize("matrix", [np.zeros((1, 1)), np.zeros((2, 2)), np.zeros((5, 5)), np.ones((4, 4)) - np.eye(4)])
def test_few_objects_and_twins(matrix):
    found = rerank(matrix)
    assert np.isfinite(found).all()
    assert found.shape == matrix.shape


def test_what_is_no_matrix_is_refused():
    for matrix in (np.zeros((2, 3)), np.full((2, 2), np.nan), np.zeros(4)):
        with pytest.raises(ValueError, match="square matrix of finite values"):
            rerank(matrix)
    with pytest.raises(ValueError, match="k must be a whole number"):
        rerank(np.zeros((2, 2)), 0)


def test_a_ranking_in_another_order(make_parts):
    objects = [make_parts(f"{kind}-{k}", seed=kind, noise=0.15) for kind in range(6) for k in range(4)]
    ready = Collection.of(objects)
    before = rank(objects[5], ready, top=24)
    after = reranked(ready, before)
    assert after.order[0] == 5
    assert set(after.order[:4].tolist()) == {4, 5, 6, 7}
    assert sorted(after.order.tolist()) == list(range(24))
    plain = Matching(fusion="mean")
    with pytest.raises(ValueError, match="needs symmetric dissimilarities"):
        reranked(Collection.of(objects, plain), rank(objects[5], objects, plain))
