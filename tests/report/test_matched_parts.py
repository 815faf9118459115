"""What a report says and draws of pairs: against rankings of the other objects, and against the meshes themselves."""

import base64
import dataclasses

import numpy as np
import pytest

from curvematch_jax.datasets import creature
from curvematch_jax.report import Limits, report_page
from curvematch_jax.report._pairs import explained
from curvematch_jax.report._surfaces import packed_surface
from curvematch_jax.retrieval import Matching, SavedMatrix, rank, run_settings
from curvematch_jax.surface import Extraction, Parts, extract_parts

EXTRACTION = Extraction(samples=16, levels=6)


@pytest.fixture(name="models", scope="module")
def fixture_models():
    return [creature(kind, pose, vertices=400) for kind in ("hand", "snake") for pose in (0, 1)]


@pytest.fixture(name="parts", scope="module")
def fixture_parts(models) -> list[Parts]:
    return [extract_parts(model.mesh, EXTRACTION) for model in models]


def decoded(text, kind):
    return np.frombuffer(base64.b64decode(text), f"<{kind}")


def test_beliefs_are_those_of_a_ranking_of_the_others(parts):
    """One-way, what is said of the others does not depend on whether the query is among them."""
    matching = Matching(fusion="belief", witnesses=())
    found = explained(parts, {1: [0, 2, 3]}, matching)["1"]
    expected = rank(parts[1], [parts[0], parts[2], parts[3]], matching)
    assert found["conflict"] == pytest.approx(expected.conflict, rel=1e-3)
    assert found["open"] == pytest.approx(expected.ignorance, rel=1e-3)
    assert found["ignorance"] == pytest.approx(1 - expected.masses.sum(axis=1), rel=1e-3)
    for k, j in enumerate([0, 2, 3]):
        shown = found["objects"][str(j)]
        assert shown["probability"] == pytest.approx(expected.probability[k], rel=1e-3)
        for (part, other, distance, mass, pignistic), match in zip(shown["matches"], expected.explain(k), strict=True):
            assert (part, other) == (match.part, match.other)
            assert distance == pytest.approx(match.distance, rel=1e-3)
            assert mass == pytest.approx(match.mass, rel=1e-3)
            assert pignistic == pytest.approx(match.mass + (1 - expected.masses[part].sum()) / 3, rel=1e-3)


def test_both_directions_leave_the_query_out_of_the_belief(parts):
    found = explained(parts, {0: [1, 2, 3]}, Matching())["0"]
    probabilities = [found["objects"][str(j)]["probability"] for j in (1, 2, 3)]
    assert sum(probabilities) == pytest.approx(1, abs=1e-3)
    assert probabilities[0] == max(probabilities)  # The other hand.


@pytest.mark.parametrize("matching", [Matching(), Matching(fusion="belief", witnesses=())], ids=lambda m: m.fusion)
def test_what_has_no_parts_matches_nothing(parts, matching):
    found = explained([without_parts(parts[0]), *parts[1:]], {0: [1], 1: [0, 2]}, matching)
    assert found["0"]["ignorance"] == []
    assert found["0"]["objects"]["1"]["matches"] == found["1"]["objects"]["0"]["matches"] == []
    assert len(found["1"]["objects"]["2"]["matches"]) == len(parts[1].areas)


def test_surfaces_come_back_within_a_step(models, parts):
    mesh = models[0].mesh
    found = packed_surface(parts[0], mesh, vertices=5000)
    vertices = decoded(found["vertices"], "u2").reshape(-1, 3) / 65535
    points = decoded(found["points"], "u2").reshape(-1, 3) / 65535
    side = np.ptp(np.concatenate([mesh.vertices, parts[0].points]), axis=0).max()
    both = np.concatenate([vertices, points]) * side
    real = np.concatenate([mesh.vertices, parts[0].points])
    np.testing.assert_allclose(both - both[0], real - real[0], atol=2.5 * side / 65535)
    assert decoded(found["faces"], "u2").reshape(-1, 3).tolist() == mesh.faces.tolist()


def test_vertices_belong_to_the_part_of_the_tip_that_is_nearest(models, parts):
    """On a hand the tips of fingers are far from each other."""
    found = packed_surface(parts[0], models[0].mesh, vertices=5000)
    owners = decoded(found["part"], "u1")
    for i, point in enumerate(parts[0].points):
        nearest = np.linalg.norm(models[0].mesh.vertices - point, axis=1).argmin()
        assert owners[nearest] == i
    assert set(decoded(found["curvePart"], "u1")) <= set(range(len(parts[0].areas)))


def test_large_surfaces_are_decimated(models):
    pytest.importorskip("fast_simplification")
    found = packed_surface(None, models[0].mesh, vertices=150)
    count = len(decoded(found["vertices"], "u2")) // 3
    assert 100 < count < 200
    assert decoded(found["faces"], "u2").max() == count - 1
    assert set(decoded(found["part"], "u1")) == {255}


def without_parts(parts):
    return dataclasses.replace(
        parts,
        **{
            name: getattr(parts, name)[:0]
            for name in ("curves", "mask", "lengths", "level_set_lengths", "centres", "areas", "points")
        },
        feature_distances=np.zeros((0, 0), np.float32),
    )


def test_an_object_without_parts_is_drawn_without_curves(models, parts):
    found = packed_surface(without_parts(parts[0]), models[0].mesh, vertices=5000)
    assert found["curves"] == found["points"] == ""
    assert len(found["vertices"]) > 0


def test_settings_have_to_be_those_of_the_matrix(parts):
    saved = SavedMatrix(np.eye(4), tuple("abcd"), run_settings(EXTRACTION, Matching()))
    with pytest.raises(ValueError, match="made with fusion = 'cohort'"):
        report_page(saved, parts=parts, matching=Matching(fusion="belief", witnesses=()))
    other = SavedMatrix(np.eye(4), tuple("abcd"), run_settings(Extraction(), Matching()))
    with pytest.raises(ValueError, match="made with levels = 23"):
        report_page(other, parts=parts)


def test_meshes_are_looked_up_only_where_they_are_shown(models, parts):
    class Meshes(dict):
        asked = []  # noqa: RUF012

        def get(self, name, default=None):
            self.asked.append(name)
            return super().get(name, default)

    saved = SavedMatrix(1 - np.eye(4), tuple("abcd"), run_settings(EXTRACTION, Matching()))
    meshes = Meshes(a=models[0].mesh)
    page = report_page(saved, meshes=meshes, limits=Limits(explained=1, pairs=1, surfaces=2))
    assert meshes.asked == ["a", "b"]
    assert "1 of 4 objects are drawn" in page
