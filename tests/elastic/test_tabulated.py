"""Tables of curves stand for the curves."""

import numpy as np
import pytest
from elastic.aligners import LEAN, RIGID, StartOnly
from elastic.shapes import fourier

from curvematch_jax.elastic import Aligner, Rigid, Tables, align, pair_distances, tabulate

PAIRS = np.random.default_rng(0).integers(0, 9, size=(30, 2))
ESTIMATE = Rigid(chunk=8, measured=False)


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 9).astype(np.float32)


@pytest.mark.parametrize("aligner", [RIGID, ESTIMATE, StartOnly(), LEAN], ids=["rigid", "estimate", "other", "lean"])
def test_distances_of_tables_are_those_of_curves(curves, aligner):
    tables = tabulate(curves, aligner)
    expected = pair_distances(curves, curves, PAIRS, aligner)
    np.testing.assert_array_equal(pair_distances(tables, tables, PAIRS, aligner), expected)
    np.testing.assert_allclose(pair_distances(curves, tables, PAIRS, aligner), expected, atol=1e-6)


@pytest.mark.parametrize("aligner", [RIGID, LEAN], ids=["rigid", "lean"])
def test_distances_are_those_of_alignments(curves, aligner):
    one, other = PAIRS.T
    expected = np.asarray(align(curves[one], curves[other], aligner).distance)
    np.testing.assert_allclose(pair_distances(curves, curves, PAIRS, aligner), expected, atol=1e-5)


def test_pieces_of_tables_are_tables_of_pieces(curves):
    tables, some = tabulate(curves, RIGID), np.array([4, 0, 7])
    for found, expected in zip(tables[some].curves.curve, tabulate(curves[some], RIGID).curves.curve, strict=True):
        np.testing.assert_array_equal(found, expected)
    again = Tables.joined([tables[slice(0, 2)], tables[slice(2, 9)]])
    assert len(again) == 9
    assert (again.dimension, again.aligner, again.dtype) == (3, RIGID, np.float32)
    np.testing.assert_array_equal(again.keys, tables.keys)
    expected = pair_distances(tables, tables, PAIRS, RIGID)
    np.testing.assert_array_equal(pair_distances(again, again, PAIRS, RIGID), expected)


def test_tables_for_estimates_are_small(curves):
    """Whatever the number of samples: 768 bytes a curve."""
    for some in (curves, fourier(0, 9, n=400).astype(np.float32)):
        tables = tabulate(some, ESTIMATE).curves
        assert tables.curve is None
        assert tables.tangents.nbytes == 9 * 3 * 64 * 4


def test_tables_of_another_aligner_or_metric_are_refused(curves):
    tables = tabulate(curves, RIGID)
    with pytest.raises(ValueError, match="give curves"):
        pair_distances(tables, tables, PAIRS, Aligner.fast())
    with pytest.raises(ValueError, match="give curves"):
        pair_distances(curves, tables, PAIRS, RIGID, metric="projected")
    with pytest.raises(ValueError, match="2 and of 3 dimensions"):
        pair_distances(curves[:, :2], tables, PAIRS, RIGID)
