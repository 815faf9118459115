"""Generated leaves: the formula, what moving does, and that the same seed gives the same."""

import numpy as np
import pytest

from curvematch_jax.datasets import leaves


def lengths(curves):
    return np.linalg.norm(np.diff(curves, axis=-1, append=curves[..., :1]), axis=-2)


@pytest.mark.parametrize("d", [2, 3])
def test_leaves_follow_their_formula(d):
    made = leaves(3, seed=1, n=400, d=d, moved=False)
    t = 2 * np.pi * np.arange(20000) / 20000
    for outline, (s1, s2) in zip(made.outlines[..., ::8], made.scores, strict=True):
        radius = 1 + 0.3 * np.cos(5 * t) + s1 * np.cos(2 * t) + s2 * np.sin(3 * t)
        leaf = np.stack([1.5 * radius * np.cos(t), radius * np.sin(t), 0.4 * np.cos(2 * t) + s1 * np.cos(3 * t)])[:d]
        assert np.linalg.norm(outline[:, :, None] - leaf[:, None], axis=0).min(axis=1).max() < 2e-3
    sides = lengths(made.outlines)
    assert np.ptp(sides, axis=1).max() < 0.02 * sides.mean()


@pytest.mark.parametrize("d", [2, 3])
def test_moved_leaves_are_turned_and_not_mirrored(d):
    made = leaves(6, seed=2, d=d, deviations=(0.0, 0.0))
    still = leaves(1, d=d, deviations=(0.0, 0.0), moved=False).outlines[0]
    area = lambda c: np.sum(c[0] * np.roll(c[1], -1) - c[1] * np.roll(c[0], -1)) / 2  # noqa: E731
    for curve in made.curves:
        scale = lengths(curve).sum() / lengths(still).sum()
        spread = np.linalg.svd(curve - curve.mean(axis=1, keepdims=True), compute_uv=False)
        assert np.allclose(spread / scale, np.linalg.svd(still, compute_uv=False), rtol=0.1)
        assert d == 3 or area(curve) / scale**2 == pytest.approx(area(still), rel=0.02)


def test_groups_differ_by_what_was_asked_and_seeds_repeat():
    made = leaves(400, seed=3, n=16, apart=0.5, moved=False)
    assert made.groups.tolist() == [0] * 200 + [1] * 200
    means = [made.scores[made.groups == group].mean(axis=0) for group in (0, 1)]
    assert means[1] - means[0] == pytest.approx([0.5, 0], abs=0.04)
    assert np.array_equal(leaves(3, seed=4).curves, leaves(3, seed=4).curves)
    assert not np.array_equal(leaves(3, seed=4).curves, leaves(3, seed=5).curves)


@pytest.mark.parametrize("wrong", [{"d": 4}, {"n": 7}, {"count": 0}])
def test_what_is_no_leaf_gets_a_sentence(wrong):
    with pytest.raises(ValueError, match="at least 1 leaf"):
        leaves(**{"count": 2, **wrong})
