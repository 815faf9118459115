"""What is said of settings that differ."""

import dataclasses
import json

import pytest

from curvematch_jax.elastic import Aligner
from curvematch_jax.retrieval import Matching, first_difference, require_same
from curvematch_jax.retrieval._settings import preset_of
from curvematch_jax.surface import Extraction

WHAT = ("D: was made", "and is asked for")


def stored(settings):
    """As a file has it."""
    return json.loads(json.dumps(dataclasses.asdict(settings)))


def said(one, other):
    with pytest.raises(ValueError, match=r"^D: was made with") as caught:
        require_same(one, other, WHAT, "stop")
    return str(caught.value)


def test_presets_are_named():
    message = "D: was made with the preset default, and is asked for with the preset elastic: stop"
    assert said(stored(Matching()), Matching.elastic()) == message
    assert preset_of(stored(Matching.paper())) == "paper"
    assert preset_of(Matching(decay=0.5)) is None
    assert preset_of(Extraction()) is None


def test_other_settings_are_named_one_by_one():
    one = Matching(aligner=Aligner.fast(), decay=0.5)
    other = dataclasses.replace(one, aligner=dataclasses.replace(one.aligner, knots=one.aligner.knots * 2))
    name, first, second = first_difference(one, stored(other))
    assert (name, second) == ("aligner.knots", 2 * first)
    assert (
        said(one, other)
        == f"D: was made with aligner.knots = {first}, and is asked for with aligner.knots = {second}: stop"
    )
    assert said(Matching(), Matching(decay=0.5)).startswith("D: was made with decay = 0.0, ")
    # An aligner of another kind has no setting in common: what is said stays short.
    assert len(said(Matching(decay=0.5), one)) < 300
    require_same(one, stored(one), WHAT, "stop")
