"""Matrices and lists of pairs: the entries, their order, bounded traces, progress."""

import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import LEAN, RIGID
from elastic.shapes import ellipse, fourier, moved
from hypothesis import given, settings
from hypothesis import strategies as st

from curvematch_jax.elastic import _batch as batch
from curvematch_jax.elastic import _chunks as chunks
from curvematch_jax.elastic import _tables as tables
from curvematch_jax.elastic import align, distance_matrix, pair_distances

N = 24


@pytest.fixture(name="curves", scope="module")
def fixture_curves():
    return fourier(0, 7, n=N).astype(np.float32)


@pytest.fixture(name="others", scope="module")
def fixture_others():
    return fourier(50, 5, n=N).astype(np.float32)


def test_entries_are_the_distances_of_the_pairs(curves, others):
    found = distance_matrix(curves, others, RIGID)
    assert isinstance(found, np.ndarray)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, align(curves[:, None], others[None], RIGID).distance, atol=1e-5)


def test_a_matrix_with_itself_is_the_rectangular_one_with_a_zero_diagonal(curves):
    square = distance_matrix(curves, aligner=LEAN)
    rectangle = distance_matrix(curves, curves.copy(), LEAN)
    off = ~np.eye(7, dtype=bool)
    np.testing.assert_allclose(square[off], rectangle[off], atol=1e-6)
    np.testing.assert_array_equal(np.diag(square), 0)
    np.testing.assert_array_equal(square, square.T)
    np.testing.assert_allclose(rectangle, rectangle.T, atol=5e-7)


def test_twelve_curves_in_both_orders(curves, others):
    """A pair and its exchange lie on different lanes of a chunk, which may round differently."""
    twelve = np.concatenate([curves, others])
    matrix = distance_matrix(twelve, twelve.copy(), LEAN)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-5)
    assert matrix[~np.eye(12, dtype=bool)].min() > 0.2


def test_listed_pairs_are_entries_of_the_matrix(curves, others):
    pairs = np.random.default_rng(0).integers([0, 0], [7, 5], size=(19, 2))
    found = pair_distances(curves, others, pairs, LEAN)
    np.testing.assert_allclose(found, distance_matrix(curves, others, LEAN)[pairs[:, 0], pairs[:, 1]], atol=1e-6)
    within = pair_distances(curves, curves, np.array([[0, 3], [3, 0]]), LEAN)
    assert within[0] == within[1]


def test_an_empty_list_and_single_curves(curves, others):
    assert pair_distances(curves, others, np.zeros((0, 2), int), RIGID).shape == (0,)
    assert distance_matrix(curves[:1], aligner=RIGID).tolist() == [[0.0]]
    assert distance_matrix(curves[:1], others[:1], RIGID).shape == (1, 1)


def test_ragged_sizes_do_not_trace_again(curves, others):
    distance_matrix(curves, others, RIGID)
    before = batch._distance_chunk._cache_size(), tables._tables._cache_size()
    for a, b in ((1, 5), (3, 3), (7, 2)):
        distance_matrix(curves[:a], others[:b], RIGID)
        distance_matrix(curves[:a], aligner=RIGID)
    pair_distances(curves, others, np.array([[0, 0], [1, 1], [6, 4]]), RIGID)
    distance_matrix(np.concatenate([curves, others]), aligner=RIGID)
    assert (batch._distance_chunk._cache_size(), tables._tables._cache_size()) == before


@pytest.mark.parametrize("square", [True, False])
def test_progress_grows_to_the_total(curves, others, square):
    calls = []
    distance_matrix(curves, None if square else others, RIGID, progress=lambda *call: calls.append(call))
    total = 21 if square else 35
    assert calls[-1] == (total, total)
    done = [call[0] for call in calls]
    assert done == sorted(done)
    assert len(calls) == -(-total // RIGID.chunk)
    assert {call[1] for call in calls} == {total}


def test_progress_of_listed_pairs(curves, others):
    calls = []
    pairs = np.zeros((9, 2), int)
    pair_distances(curves, others, pairs, RIGID, progress=lambda *call: calls.append(call))
    assert calls[-1] == (9, 9)


def test_a_bar_is_drawn_on_stderr(curves, capsys):
    distance_matrix(curves, aligner=RIGID, progress=True)
    shown = capsys.readouterr()
    assert "aligning" in shown.err
    assert shown.out == ""


def test_moved_copies_are_near_and_others_are_not(curves):
    found = distance_matrix(curves, moved(curves, 1).astype(np.float32), RIGID)
    assert np.diag(found).max() < 0.02
    assert found[~np.eye(7, dtype=bool)].min() > 0.1


def test_repeated_samples_and_callers_arrays(curves, others):
    repeated = curves.copy()
    repeated[:, :, 6] = repeated[:, :, 5]
    kept = repeated.copy()
    found = distance_matrix(repeated, others, RIGID)
    np.testing.assert_array_equal(repeated, kept)
    np.testing.assert_allclose(found, align(repeated[:, None], others[None], RIGID).distance, atol=1e-5)


@pytest.mark.parametrize("pairs", [np.zeros((3, 3), int), np.zeros(4, int), np.zeros((2, 2))])
def test_pairs_have_to_be_integers_by_two(curves, others, pairs):
    with pytest.raises(ValueError, match=r"pairs has shape.*integers"):
        pair_distances(curves, others, pairs, RIGID)


@pytest.mark.parametrize("pair", [[7, 0], [0, 5], [-1, 0], [0, -1]])
def test_pairs_have_to_point_at_curves(curves, others, pair):
    with pytest.raises(IndexError, match="7 curves in a and 5 in b"):
        pair_distances(curves, others, np.array([[0, 0], pair]), RIGID)


def test_what_is_no_batch_of_closed_curves_is_refused(curves):
    with pytest.raises(ValueError, match=r"^a has shape \(3, 24\)"):
        distance_matrix(curves[0], aligner=RIGID)
    with pytest.raises(ValueError, match=r"^b has shape \(1, 7, 3, 24\)"):
        distance_matrix(curves, curves[None], RIGID)
    broken = curves.copy()
    broken[4, 0, 0] = np.nan
    with pytest.raises(ValueError, match=r"^b holds NaN or infinity in curve 4 of 7"):
        distance_matrix(curves, broken, RIGID)
    with pytest.raises(ValueError, match=r"^a is open in curve 0 of 1"):
        pair_distances(ellipse(40)[None, :, :24], curves, np.array([[0, 0]]), RIGID)
    with pytest.raises(ValueError, match=r"\(3, 24\) and \(3, 23\)"):
        distance_matrix(curves, curves[..., :-1], RIGID)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(1, 12), st.integers(1, 12), st.integers(1, 9))
def test_chunks_cover_every_pair_once(rows, columns, size):
    def listed(parts):
        return [(i, j) for part in parts for i, j in zip(part.rows.tolist(), part.columns.tolist(), strict=True)]

    assert listed(batch._rectangle(rows, columns, size)) == [(i, j) for i in range(rows) for j in range(columns)]
    assert listed(batch._triangle(rows, size)) == [(i, j) for i in range(rows) for j in range(i + 1, rows)]
    assert all(len(part.rows) <= size for part in batch._rectangle(rows, columns, size))


def test_chunks_are_padded_with_their_last_entry():
    array = np.arange(6).reshape(3, 2)
    assert chunks.padded(array, 3) is array
    np.testing.assert_array_equal(chunks.padded(array, 5), [[0, 1], [2, 3], [4, 5], [4, 5], [4, 5]])


def test_work_is_taken_as_it_is_done_and_not_all_at_once():
    """An endless list of work: a few items are under way, however many follow; and all of them come once."""
    taken = []

    def items():
        for k in range(10_000):
            taken.append(k)
            yield k

    results = chunks.run(lambda k: jnp.asarray(k * k), items())
    first = [next(results) for _ in range(5)]
    assert len(taken) < 200
    assert all(int(value) == item * item for item, value in first)
    results.close()
    assert sorted(item for item, _ in chunks.run(lambda k: k, range(50))) == list(range(50))


def test_errors_of_the_work_reach_the_caller():
    def fail(item):
        raise RuntimeError(f"item {item}")

    with pytest.raises(RuntimeError, match="item 0"):
        list(chunks.run(fail, [0]))
