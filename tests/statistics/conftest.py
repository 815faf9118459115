"""What the statistics' tests share: leaves and their mean, by an aligner that compiles once."""

import pytest
from elastic.aligners import FAST

from curvematch_jax.datasets import leaves
from curvematch_jax.statistics import karcher_mean


@pytest.fixture(name="made", scope="package")
def fixture_made():
    return leaves(24, seed=3, apart=0.2)


@pytest.fixture(name="mean", scope="package")
def fixture_mean(made):
    return karcher_mean(made.curves, aligner=FAST)
