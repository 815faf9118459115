"""Signatures: below every rigid distance, the same for a curve moved and begun elsewhere."""

import numpy as np
import pytest
from elastic.shapes import fourier, moved

from curvematch_jax.elastic import Aligner, Rigid, bounded, least_distance, pair_distances, signatures, tabulate

RIGID = Rigid(measured=False)


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 24)


def test_bounds_are_below_distances_and_near_them(curves):
    marks = signatures(tabulate(curves, RIGID))
    np.testing.assert_allclose(np.linalg.norm(marks, axis=1), 1, atol=1e-5)
    pairs = np.argwhere(np.ones((24, 24), bool))
    bounds = least_distance(marks @ marks.T).ravel()
    distances = pair_distances(curves, curves, pairs, RIGID)
    assert (bounds <= distances + 1e-6).all()
    apart = pairs[:, 0] != pairs[:, 1]
    assert np.median(bounds[apart] / distances[apart]) > 0.3
    np.testing.assert_array_equal(bounds[~apart], 0)


def test_plane_curves_are_bounded_too():
    time = 2 * np.pi * np.arange(50) / 50
    curves = np.stack(
        [[np.cos(time), a * np.sin(time) + b * np.sin(2 * time)] for a in (1, 0.5) for b in (0, 0.3, 0.6)]
    )
    tables = tabulate(curves.astype(np.float32), RIGID)
    pairs = np.argwhere(np.ones((6, 6), bool))
    marks = signatures(tables)
    assert (least_distance(marks @ marks.T).ravel() <= pair_distances(tables, tables, pairs, RIGID) + 1e-6).all()


def test_signatures_forget_rotation_scale_and_start(curves):
    there = np.stack([moved(curve, seed) for seed, curve in enumerate(curves)]).astype(np.float32)
    there = np.roll(there, 17, axis=-1)
    found, expected = (signatures(tabulate(some, RIGID)) for some in (there, curves))
    np.testing.assert_allclose(found, expected, atol=0.03)  # other places of the 64 tangents


@pytest.mark.parametrize("aligner", [Rigid(), Aligner.fast()], ids=["measured", "fast"])
def test_other_distances_have_no_signatures(curves, aligner):
    assert bounded(RIGID)
    assert not bounded(aligner)
    with pytest.raises(ValueError, match=r"bound the distances of Rigid\(measured=False\), not those of"):
        signatures(tabulate(curves[:2], aligner))
