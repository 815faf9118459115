"""Tables of curves stand for the curves."""

import numpy as np
import pytest
from elastic.shapes import fourier

from curvematch_jax.elastic import Aligner, Stage, Tables, align, pair_distances, tabulate

RIGID = Aligner.rigid()
LEAN = Aligner(grid=16, seeds=2, slope=2, stages=(Stage(1, 2, 24),), table=4, chunk=8)
PAIRS = np.random.default_rng(0).integers(0, 9, size=(30, 2))


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 9)


@pytest.mark.parametrize("aligner", [RIGID, LEAN], ids=["rigid", "warps"])
def test_distances_of_tables_are_those_of_curves(curves, aligner):
    tables = tabulate(curves, aligner)
    expected = pair_distances(curves, curves, PAIRS, aligner)
    np.testing.assert_array_equal(pair_distances(tables, tables, PAIRS, aligner), expected)
    np.testing.assert_allclose(pair_distances(curves, tables, PAIRS, aligner), expected, atol=1e-6)


def test_distances_are_those_of_alignments(curves):
    one, other = PAIRS.T
    expected = np.asarray(align(curves[one], curves[other], RIGID).distance)
    np.testing.assert_allclose(pair_distances(curves, curves, PAIRS, RIGID), expected, atol=2e-4)  # cosines near 1


def test_pieces_of_tables_are_tables_of_pieces(curves):
    tables = tabulate(curves, RIGID)
    some = np.array([4, 0, 7])
    np.testing.assert_array_equal(tables[some].curves.tangents, tabulate(curves[some], RIGID).curves.tangents)
    again = Tables.joined([tables[slice(0, 2)], tables[slice(2, 9)]])
    np.testing.assert_array_equal(again.curves.tangents, tables.curves.tangents)
    assert again.shape == (9, 3, RIGID.grid)


def test_tables_without_warps_are_small(curves):
    assert sum(table.nbytes for table in tabulate(curves, RIGID).curves) == 9 * 3 * 64 * 4


def test_tables_of_another_aligner_or_kind_are_refused(curves):
    tables = tabulate(curves, RIGID)
    with pytest.raises(ValueError, match="give curves"):
        pair_distances(tables, tables, PAIRS, Aligner.fast())
    with pytest.raises(ValueError, match="give curves"):
        pair_distances(curves, tables, PAIRS, RIGID, kind="projected")
    with pytest.raises(ValueError, match="2 and of 3 dimensions"):
        pair_distances(curves[:, :2], tables, PAIRS, RIGID)
