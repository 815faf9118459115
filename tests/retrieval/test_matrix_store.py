"""Matrices that are filled block by block: interrupted and resumed, extended, refused, and damaged."""

import dataclasses
import errno
import functools as ft
import os
from pathlib import Path

import numpy as np
import pytest

from curvematch_jax import retrieval
from curvematch_jax._files import locked
from curvematch_jax.retrieval import (
    Matching,
    StoredParts,
    load_matrix,
    matrix_status,
    save_parts,
)
from curvematch_jax.retrieval import _blocks as blocks_module
from curvematch_jax.retrieval import _matrix as matrix_module
from curvematch_jax.retrieval import _matrix_store as store_module

SETTINGS = Matching(candidates=0)
SLOW = pytest.mark.slow


build_matrix = ft.partial(retrieval.build_matrix, block=4)
dissimilarity_matrix = ft.partial(retrieval.dissimilarity_matrix, block=4)


@pytest.fixture(name="collection", scope="module")
def fixture_collection(make_parts):
    """Of 0 to 3 parts."""
    return [make_parts(f"o{k}", seed=k, parts=k % 4, noise=0.1) for k in range(11)]


@pytest.fixture(name="expected", scope="module")
def fixture_expected(collection):
    return dissimilarity_matrix(collection, SETTINGS)


@pytest.fixture(name="counted")
def fixture_counted(monkeypatch):
    """The blocks that are computed, as they are."""
    blocks: list[int] = []

    def counting(task):
        blocks.append(int(task.wanted.sum()))
        return blocks_module.block_distances(task)

    monkeypatch.setattr(matrix_module, "block_distances", counting)
    return blocks


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def stop_after(blocks: int, monkeypatch) -> None:
    """Let a run be killed, as far as it can tell, in the middle of the write of a block."""
    put, done = store_module.MatrixStore._write, []

    def write(self, rows, columns, cells):
        if len(done) >= blocks:
            raise KeyboardInterrupt
        done.append(1)
        put(self, rows, columns, cells)

    monkeypatch.setattr(store_module.MatrixStore, "_write", write)


def test_store_holds_what_memory_would(collection, expected, tmp_path, counted):
    path = tmp_path / "D.zarr"
    found = dissimilarity_matrix(collection, SETTINGS, store=path)
    np.testing.assert_array_equal(found, expected)
    saved = load_matrix(path)
    np.testing.assert_array_equal(saved.dissimilarity, expected)
    assert saved.names == tuple(p.name for p in collection)
    assert saved.notes == tuple(f"o{k} has no feature point" for k in (0, 4, 8))
    assert saved.settings["matching"]["candidates"] == 0
    assert len(counted) == 6
    before = contents(path)
    build_matrix(collection, path, SETTINGS)
    assert len(counted) == 6
    assert contents(path) == before


@pytest.mark.parametrize("writes", [0, *(pytest.param(k, marks=SLOW) for k in (1, 2, 6, 8)), 3])
def test_a_stopped_run_is_gone_on_with_to_the_same_bytes(collection, tmp_path, monkeypatch, counted, writes):
    build_matrix(collection, tmp_path / "whole.zarr", SETTINGS)
    counted.clear()
    path = tmp_path / "D.zarr"
    with monkeypatch.context() as patch:
        stop_after(writes, patch)
        with pytest.raises(KeyboardInterrupt):
            build_matrix(collection, path, SETTINGS)
    status = matrix_status(path)
    assert status.done + status.left == 6
    assert not status.complete
    with pytest.raises(ValueError, match=f"not finished, {status.done} of 6 blocks"):
        load_matrix(path)
    (path / "distances" / "0.abcdef.partial").touch()
    build_matrix(collection, path, SETTINGS)
    assert contents(path) == contents(tmp_path / "whole.zarr")
    assert len(counted) == 7  # The one in flight twice, no other.


@pytest.mark.parametrize("first", [1, *(pytest.param(k, marks=SLOW) for k in (3, 4, 8, 10)), 6])
def test_new_objects_are_added_alone(collection, expected, tmp_path, counted, first):
    path = tmp_path / "D.zarr"
    build_matrix(collection[:first], path, SETTINGS)
    counted.clear()
    found = dissimilarity_matrix(collection, SETTINGS, store=path)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
    everything, there = 11 * 10 // 2, first * (first - 1) // 2
    lacking = [k for k in range(11) if not len(collection[k].areas)]
    among = sum(1 for k in lacking for j in lacking if k < j and j >= first)
    # Two objects without parts have nothing to say of each other: that block may hold them already.
    assert everything - there - among <= sum(counted) <= everything - there
    assert not matrix_status(path).left


def test_growth_that_was_stopped_is_gone_on_with(collection, expected, tmp_path, monkeypatch):
    path = tmp_path / "D.zarr"
    build_matrix(collection[:6], path, SETTINGS)
    for stop in ("resize", "write"):
        with monkeypatch.context() as patch:
            if stop == "resize":
                import zarr

                patch.setattr(zarr.Array, "resize", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
            else:
                stop_after(2, patch)
            with pytest.raises(KeyboardInterrupt):
                build_matrix(collection, path, SETTINGS)
    found = dissimilarity_matrix(collection, SETTINGS, store=path)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_rows_are_in_the_order_of_the_objects_given(collection, expected, tmp_path):
    build_matrix(collection[5:], tmp_path / "D.zarr", SETTINGS)
    found = dissimilarity_matrix(collection, SETTINGS, store=tmp_path / "D.zarr")
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
    assert load_matrix(tmp_path / "D.zarr").names[:6] == tuple(p.name for p in collection[5:])


def test_other_inputs_and_settings_are_refused_by_name(collection, make_parts, tmp_path):
    path = tmp_path / "D.zarr"
    build_matrix(collection, path, SETTINGS)
    before = contents(path)
    changed = [*collection[:3], make_parts("o3", seed=99, parts=3), *collection[4:]]
    for parts, settings, message in (
        (collection[:-1], SETTINGS, "o10 is not among those given"),
        (changed, SETTINGS, "the parts of o3 have changed"),
        (
            collection,
            dataclasses.replace(SETTINGS, missing=0.7),
            r"missing = 0\.6, and is .* with missing = 0\.7",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            build_matrix(parts, path, settings)
    with pytest.raises(ValueError, match="the collection is empty"):
        build_matrix([], path, SETTINGS)
    assert contents(path) == before


def test_a_damaged_block_is_made_again(collection, expected, tmp_path):
    path = tmp_path / "D.zarr"
    with pytest.MonkeyPatch.context() as patch:
        stop_after(8, patch)
        with pytest.raises(KeyboardInterrupt):
            build_matrix(collection, path, SETTINGS)
    chunk = path / "distances" / "c" / "0" / "0" / "1"
    chunk.write_bytes(chunk.read_bytes()[:20])
    with pytest.raises(ValueError, match=r"c/0/0/1 was damaged .* has been removed: run the same command again"):
        build_matrix(collection, path, SETTINGS)
    np.testing.assert_array_equal(dissimilarity_matrix(collection, SETTINGS, store=path), expected)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS])
def test_no_room_is_one_sentence_and_the_store_stays_sound(collection, expected, tmp_path, monkeypatch, number):
    from zarr.storage import _local

    path, put, written = tmp_path / "D.zarr", _local._put, []

    def full(place, value, exclusive=False):
        if len(written) > 5:
            raise OSError(number, "No room", str(place))
        written.append(place)
        return put(place, value, exclusive)

    with monkeypatch.context() as patch:
        patch.setattr(_local, "_put", full)
        with pytest.raises(ValueError, match=r"D\.zarr: cannot be written \(No room\)"):
            build_matrix(collection, path, SETTINGS)
    assert matrix_status(path).left
    np.testing.assert_array_equal(dissimilarity_matrix(collection, SETTINGS, store=path), expected)


def test_one_process_at_a_time(collection, tmp_path):
    path = tmp_path / "D.zarr"
    with locked(path), pytest.raises(ValueError, match="another process is using it"):
        build_matrix(collection, path, SETTINGS)


def test_stored_parts_are_read_when_they_are_needed(collection, expected, tmp_path, monkeypatch):
    paths = [tmp_path / "parts" / f"{k}.npz" for k in range(11)]
    for parts, path in zip(collection, paths, strict=True):
        save_parts(parts, path)
    stored = StoredParts(paths, [f"n{k}" for k in range(11)])
    assert stored[3].name == stored[2:][1].name == "n3"
    assert StoredParts(paths)[3].name == "o3"
    build_matrix(stored, tmp_path / "D.zarr", SETTINGS)
    np.testing.assert_array_equal(load_matrix(tmp_path / "D.zarr").dissimilarity, expected)
    assert load_matrix(tmp_path / "D.zarr").names[3] == "n3"


def test_progress_counts_pairs_of_parts_and_what_was_there(collection, tmp_path, monkeypatch):
    counts = [k % 4 for k in range(11)]
    pairs = (sum(counts) ** 2 - sum(c * c for c in counts)) // 2
    told: list[tuple[int, int]] = []
    with monkeypatch.context() as patch:
        stop_after(4, patch)
        with pytest.raises(KeyboardInterrupt):
            build_matrix(collection, tmp_path / "D.zarr", SETTINGS, progress=lambda *at: told.append(at))
    assert told[0] == (0, pairs)
    reached, told = told[-1], []
    build_matrix(collection, tmp_path / "D.zarr", SETTINGS, progress=lambda *at: told.append(at))
    assert told[0] == reached
    assert (pairs, pairs) in told


def test_status_knows_the_rate_of_the_last_blocks(collection, tmp_path):
    path = tmp_path / "D.zarr"
    with pytest.MonkeyPatch.context() as patch:
        stop_after(5, patch)
        with pytest.raises(KeyboardInterrupt):
            build_matrix(collection, path, SETTINGS)
    for second, (one, other) in enumerate([(0, 0), (0, 1), (0, 2)]):
        for chunk in ((one, other), (other, one)):
            os.utime(path / "distances" / "c" / str(chunk[0]) / "0" / str(chunk[1]), (1e9 + 10 * second,) * 2)
    status = matrix_status(path)
    assert (status.done, status.left, status.rate) == (3, 3, pytest.approx(0.1))
    assert status.seconds_left == pytest.approx(30)


def test_somebody_s_folder_is_left_as_it_is(collection, tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.partial").write_text("dear")
    with pytest.raises(ValueError, match="not a curvematch matrix"):
        build_matrix(collection, tmp_path / "thesis", SETTINGS)
    assert (tmp_path / "thesis" / "chapter.partial").read_text() == "dear"


def test_a_block_that_cannot_be_read_now_is_not_removed(collection, tmp_path, monkeypatch):
    from zarr.storage import _local

    path = tmp_path / "D.zarr"
    with monkeypatch.context() as patch:
        stop_after(8, patch)
        with pytest.raises(KeyboardInterrupt):
            build_matrix(collection, path, SETTINGS)
    chunk = path / "distances" / "c" / "0" / "0" / "1"
    get = _local._get

    def failing(place, *rest):
        if place == chunk:
            raise OSError(errno.EIO, "Input/output error", str(place))
        return get(place, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(_local, "_get", failing)
        with pytest.raises(OSError, match="Input/output error"):
            build_matrix(collection, path, SETTINGS)
    assert chunk.exists()
