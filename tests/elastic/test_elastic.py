"""The settings of elastic alignment, and that more of them is not worse."""

import dataclasses

import numpy as np
import pytest
from elastic.aligners import LEAN
from elastic.shapes import fourier

from curvematch_jax.elastic import Aligner, Elastic, Round, align, alignment_distance


def test_presets_are_settings():
    assert Aligner.fast() == Elastic()
    assert Aligner.accurate() == Elastic.accurate()
    assert len({Aligner.fast(), Elastic(), Aligner.accurate()}) == 2
    assert Elastic.warps
    with pytest.raises(dataclasses.FrozenInstanceError):
        LEAN.chunk = 3


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"paths": 0}, "Elastic.paths = 0: it has to be 1 or more"),
        ({"steps": -1}, "Elastic.steps = -1: it has to be 0 or more"),
        ({"chunk": 0}, "Elastic.chunk = 0"),
        ({"nodes": 0}, "Elastic.nodes = 0"),
        ({"knots": 48}, "Elastic.knots = 48: it has to be a power of 2, 8 or more"),
        ({"knots": 4}, "Elastic.knots = 4"),
        ({"rounds": ()}, "Elastic needs rounds"),
        ({"rounds": (Round(2, 16, 4), Round(4, 32, 4))}, r"fewer and fewer paths, not \[2, 4, 1\]"),
        ({"rounds": (Round(2, 20, 4),)}, r"Elastic.rounds\[0\] = .*: slopes \* nodes has to divide 768"),
        ({"rounds": (Round(40, 16, 4),)}, r"Elastic.rounds\[0\] = .*no more paths than that"),
        ({"rounds": (Round(2, 16, 4),), "paths": 3}, r"not \[2, 3\]"),
        ({"rounds": (Round(2, 4, 4),)}, "Round.nodes = 4: it has to be 8 or more"),
        ({"rounds": (Round(2, 16, 0),)}, "Round.width = 0"),
        ({"rounds": (Round(2, 16, 4, 0),)}, "Round.slopes = 0"),
        ({"rounds": (Round(2, 16, 17),)}, r"Elastic.rounds\[0\].*twice the width at least"),
        ({"rounds": (Round(2, 32, 4), Round(1, 40, 4))}, r"Elastic.rounds\[1\].*multiple of the 32 nodes"),
    ],
)
def test_settings_that_make_no_search_are_refused(setting, message):
    with pytest.raises(ValueError, match=message):
        Elastic(**setting)


@pytest.mark.slow
def test_every_part_of_the_search_helps_and_none_is_needed():
    """In the median of eight pairs: without refinement, with little of it, and after a finer search."""
    curves, others = (fourier(s, 8).astype(np.float32) for s in (0, 100))
    plain = dataclasses.replace(LEAN, steps=0)
    finer = dataclasses.replace(LEAN, rounds=(Round(8, 32), Round(4, 64), Round(2, 128)), steps=6, knots=128)
    found = []
    for aligner in (plain, LEAN, finer):
        alignment = align(curves, others, aligner)
        found.append(np.asarray(alignment_distance(curves, others, *alignment[:3])))
    assert np.median(found[0] - found[1]) > 0
    assert np.median(found[1] - found[2]) > 0.005
