"""Components: scores there and back, closed curves at any scores, known components found."""

import jax
import numpy as np
import pytest
from elastic.aligners import FAST

from curvematch_jax import align, elastic_distance, warp_onto
from curvematch_jax.datasets import leaves
from curvematch_jax.statistics import TangentPCA, karcher_mean
from curvematch_jax.statistics._tangent import exp, vertices


def closure(q):
    return np.abs(np.mean(q * np.linalg.norm(q, axis=-2, keepdims=True), axis=-1)).max()


def test_all_scores_give_back_the_aligned_srvfs(mean):
    components = TangentPCA.fit(mean)
    scores = components.scores(mean)
    rebuilt = components.srvfs(scores)
    base = np.broadcast_to(mean.srvf, mean.tangents.shape)
    aligned = np.asarray(exp(base, np.asarray(mean.tangents)))
    assert np.sqrt(np.mean(np.sum((rebuilt - aligned) ** 2, axis=1), axis=1)).max() < 1e-5
    assert np.allclose(np.sum(scores**2, axis=1), mean.distances**2, rtol=0.02)
    assert components.explained.sum() == pytest.approx(1, abs=1e-6)
    assert np.allclose(np.sqrt(np.mean(scores**2, axis=0)), components.deviations, rtol=1e-3, atol=1e-5)


def test_curves_at_any_scores_are_closed(mean):
    components = TangentPCA.fit(mean)
    for size in (0.1, 40):
        scores = size * np.random.default_rng(1).normal(size=(3, len(components.deviations)))
        assert closure(components.srvfs(scores)) < 1e-6
    assert components.inverse_transform(np.zeros((2, 1))).shape == (2, 2, 100)
    assert np.allclose(components.inverse_transform(np.zeros(1)), mean.curve, atol=1e-4)


def leaf(scores, d, times):
    """The generating formula of `leaves`."""
    t = 2 * np.pi * times
    radius = 1 + 0.3 * np.cos(5 * t) + scores[0] * np.cos(2 * t) + scores[1] * np.sin(3 * t)
    flat = [1.5 * radius * np.cos(t), radius * np.sin(t)]
    return np.stack(flat if d == 2 else [*flat, 0.4 * np.cos(2 * t) + scores[0] * np.cos(3 * t)])


def polygon_srvf(points):
    """The SRVF of unit norm of the polygon through the points `(d, N + 1)`."""
    sides = np.diff(points, axis=1)
    return sides / np.sqrt(np.linalg.norm(sides, axis=0) * np.sum(np.linalg.norm(sides, axis=0)) / sides.shape[1])


def orbit_and_normals(q):
    """Fields `(b, d N)` that span what is not shape at q: scale, closure, rotations, and reparametrisations
    `q' h + q h' / 2` by h of the N / 3 lowest frequencies."""
    d, n = q.shape
    size, slope = np.linalg.norm(q, axis=0), np.gradient(np.pad(q, ((0, 0), (1, 1)), "wrap"), 1 / n, axis=1)[:, 1:-1]
    found = [q]
    for i, axis in enumerate(np.eye(d)):
        found.append(q[i] / size * q + size * axis[:, None])
        found += [np.outer(axis, q[j]) - np.outer(other, q[i]) for j, other in enumerate(np.eye(d)[:i])]
    for turns in np.arange(n // 3) * 2 * np.pi:
        angle = turns * np.arange(n) / n
        found.append(slope * np.cos(angle) - q * turns * np.sin(angle) / 2)
        found.append(slope * np.sin(angle) + q * turns * np.cos(angle) / 2)
    return np.stack(found).reshape(len(found), -1)


def known_components(mean, d):
    """The derivatives of the formula at scores 0, laid onto the mean that was found, without what is no shape there."""
    n = mean.srvf.shape[-1]
    found = align(np.asarray(vertices(mean.srvf)), leaf(np.zeros(2), d, np.arange(n) / n))
    turn, times = np.asarray(found.rotation, float), np.asarray(warp_onto(found, n), float)
    laid = lambda scores: polygon_srvf(turn @ leaf(scores, d, times))  # noqa: E731
    vectors = np.stack([(laid(step) - laid(-step)).ravel() for step in 1e-3 * np.eye(2)])
    _, values, basis = np.linalg.svd(orbit_and_normals(mean.srvf.astype(float)), full_matrices=False)
    basis = basis[values > 1e-6 * values[0]]
    vectors -= vectors @ basis.T @ basis
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_known_components_are_found(d):
    made = leaves(40, seed=2, d=d)
    mean = karcher_mean(made.curves)
    components = TangentPCA.fit(mean, 2)
    found = components.components.reshape(2, -1) / np.sqrt(mean.srvf.shape[-1])
    assert np.all(np.abs(np.sum(found * known_components(mean, d), axis=1)) >= 0.98)
    scores = components.scores(mean)
    for k in range(2):
        assert abs(np.corrcoef(scores[:, k], made.scores[:, k])[0, 1]) > 0.98
    assert float(elastic_distance(mean.curve, made.mean.astype(np.float32))) < 0.04


def test_other_curves_get_the_scores_of_their_shape(made, mean):
    components = TangentPCA.fit(mean, 2)
    assert np.abs(components.transform(made.curves[:5], FAST) - components.scores(mean)[:5]).max() < 0.03


def test_size_is_one_more_coordinate(made, mean):
    components = TangentPCA.fit(mean, size=0.5)
    back = components.inverse_transform(components.scores(mean))
    lengths = np.sum(np.linalg.norm(np.diff(back, axis=2, append=back[..., :1]), axis=1), axis=1)
    assert np.allclose(lengths / mean.lengths, 1, atol=0.03)


def test_samples_vary_as_the_curves_do(mean):
    components = TangentPCA.fit(mean, 2)
    made = components.sample(jax.random.key(0), 200)
    assert made.shape == (200, 2, 100)
    assert np.all(np.isfinite(made))


@pytest.mark.slow
def test_transport_keeps_lengths_and_angles(mean):
    components = TangentPCA.fit(mean, 3)
    other = karcher_mean(leaves(8, seed=9, apart=0.3).curves)
    moved = components.transported(other)
    gram = np.einsum("cdn,edn->ce", moved.components, moved.components) / moved.components.shape[-1]
    assert np.abs(gram - np.eye(3)).max() < 0.1
    assert closure(moved.srvfs(np.ones((1, 3)))) < 1e-6


def test_components_do_not_depend_on_order(made, mean):
    order = np.random.default_rng(2).permutation(24)
    again = karcher_mean(made.curves[order], aligner=FAST)
    first, second = TangentPCA.fit(mean, 2), TangentPCA.fit(again, 2)
    assert np.allclose(first.scores(mean)[order], second.scores(again), atol=1e-4)


def test_bad_input_gets_a_sentence(mean):
    components = TangentPCA.fit(mean, 2)
    with pytest.raises(ValueError, match="do not vary"):
        TangentPCA.fit(mean._replace(tangents=0 * mean.tangents))
    with pytest.raises(ValueError, match="have 1 to"):
        TangentPCA.fit(mean, 100)
    with pytest.raises(ValueError, match="give 2 or fewer"):
        components.inverse_transform(np.ones((1, 3)))
    with pytest.raises(ValueError, match="component = 2"):
        components.along(2)
    with pytest.raises(ValueError, match="dimensions"):
        components.transform(leaves(2, d=3).curves)
