"""Blocks on a real cluster of two worker processes: the same bits, and a worker that is killed loses nothing."""

import os
import signal
import warnings

import numpy as np
import pytest

from curvematch_jax.retrieval import Matching, build_matrix, dissimilarity_matrix, load_matrix, matrix_status
from curvematch_jax.retrieval import _executors as cluster_module
from curvematch_jax.retrieval._executors import connect, on_cluster

distributed = pytest.importorskip("distributed")
# What distributed and its event loop leave behind is not ours to mend.
pytestmark = pytest.mark.filterwarnings("ignore")

SETTINGS = Matching(candidates=0)


@pytest.fixture(name="client", scope="module")
def fixture_client():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with (
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
            ) as cluster,
            connect(cluster.scheduler_address) as client,
        ):
            yield client


@pytest.fixture(name="collection", scope="module")
def fixture_collection(make_parts):
    return [make_parts(f"o{k}", seed=k, parts=1 + k % 3, noise=0.1) for k in range(12)]


def test_the_same_bits_as_here(client, collection, tmp_path):
    expected = dissimilarity_matrix(collection, SETTINGS, block=4)
    found = dissimilarity_matrix(collection, SETTINGS, store=tmp_path / "D.zarr", client=client, block=4)
    np.testing.assert_array_equal(found, expected)


def test_a_killed_worker_loses_nothing(client, collection, tmp_path):
    killed = []

    def kill_one(done: int, total: int) -> None:
        if done and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    build_matrix(collection, tmp_path / "D.zarr", SETTINGS, progress=kill_one, client=client, block=4)
    assert killed
    assert matrix_status(tmp_path / "D.zarr").complete
    expected = dissimilarity_matrix(collection, SETTINGS, block=4)
    np.testing.assert_array_equal(load_matrix(tmp_path / "D.zarr").dissimilarity, expected)


def test_an_error_costs_its_task_alone(client):
    outcomes = sorted(on_cluster(client, divide, iter([1, 0, 2])))
    assert outcomes == [(0, 1.0, None), (1, None, "ZeroDivisionError: division by zero"), (2, 0.5, None)]


def test_few_tasks_are_on_the_way_at_a_time(client):
    taken = []
    tasks = (taken.append(k) or k + 1 for k in range(50))
    results = on_cluster(client, divide, tasks)
    next(results)
    assert len(taken) <= 10
    assert len(list(results)) == 49


def test_nobody_there_is_one_sentence(monkeypatch):
    monkeypatch.setattr(cluster_module, "_PATIENCE", 1)
    with pytest.raises(ValueError, match="no dask scheduler answers there"):
        connect("tcp://127.0.0.1:1")


def divide(by):
    return 1 / by
