"""Settings: what is refused, and what distances are turned into."""

import numpy as np
import pytest

from curvematch_jax.elastic import Rigid
from curvematch_jax.retrieval import Matching
from curvematch_jax.retrieval._ranking import fuse


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"candidates": -1}, "candidates must be a whole number"),
        ({"length_weight": -0.1}, "length_weight must be 0 or more"),
        ({"decay": float("nan")}, "decay must be 0 or more"),
        ({"missing": float("inf")}, "missing must be 0 or more"),
        ({"isometry_limit": -1.0}, "isometry_limit must be 0 or more"),
        ({"scale": 0.0}, "scale must be more than 0"),
        ({"aligner": Rigid(mirror=True)}, "parts are compared without mirror images, found Rigid"),
    ],
)
def test_settings_out_of_range_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Matching(**changes)


def test_unknown_fusion_is_refused():
    # A TypeError comes from the annotations, which are executed in tests.
    with pytest.raises((ValueError, TypeError), match="fusion"):
        Matching(fusion="median")  # type: ignore[arg-type]


def test_normalised_distances_lie_in_the_unit_interval():
    settings = Matching.paper()
    values = settings.normalised(np.array([0.0, 0.1, settings.max_distance]))
    assert values[0] == 0
    assert values[0] < values[1] < values[2] <= 1


def test_the_paper_compares_shapes_alone():
    assert not Matching.paper().sized
    assert Matching().sized
    assert Matching.elastic().aligner != Matching().aligner


def test_a_part_that_is_close_speaks_louder_in_the_partial_preset():
    # One close part and one far, against two half-way; others that are no better.
    distances = np.concatenate([[[0.1, 0.6], [1.2, 0.6]], np.full((2, 8), 0.65)], axis=1)
    present, areas = np.ones(10, bool), np.full(2, 0.5)
    partial, whole = (fuse(distances, areas, present, each) for each in (Matching.partial(), Matching()))
    assert partial.dissimilarity[0] < partial.dissimilarity[1]
    assert whole.dissimilarity[0] > whole.dissimilarity[1]
