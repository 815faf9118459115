from dataclasses import replace

import numpy as np
import pytest
from surface.shapes import limbed

from curvematch_jax.datasets import creature
from curvematch_jax.surface import Extraction, MeshError, extract_parts
from curvematch_jax.surface._topology import is_closed_manifold

pytest.importorskip("manifold3d")

from benchmarks import shortcut


def genus(mesh):
    return 1 - (len(mesh.vertices) - len(mesh.faces) // 2) // 2


@pytest.mark.parametrize(("kind", "handles", "least"), [("human", 0, 2.5), ("teapot", 1, 1.4)])
def test_a_short_cut_is_one_more_handle(kind, handles, least):
    mesh = creature(kind, 1, vertices=1500).mesh
    joined, gain = shortcut.with_short_cut(mesh, 0.03)
    assert genus(mesh) == handles
    assert genus(joined) == handles + 1
    assert is_closed_manifold(joined.vertices, joined.faces)
    assert gain > least
    np.testing.assert_array_equal(shortcut.with_short_cut(mesh, 0.03)[0].vertices, joined.vertices)


def test_a_bridge_as_wide_as_the_body_fits_nowhere():
    with pytest.raises(MeshError, match="limbed: no place for a bridge"):
        shortcut.with_short_cut(limbed(subdivisions=3), 3.0)


def test_what_changes_between_parts(monkeypatch):
    monkeypatch.setattr(shortcut, "elastic", lambda first, _: [0.25] * len(first))  # takes long to compile
    before = extract_parts(limbed(subdivisions=3), Extraction(radius=0.4, levels=3, samples=32, vertices=640))
    same = shortcut.changes([(before, before, 6.0)])
    assert same["points_found"] == 1
    assert same["points_new"] == same["levels_changed"] == same["log_length_ratio"] == 0
    assert same["curve_distance"] == 0.25
    fewer = replace(
        before, **{k: getattr(before, k)[1:] for k in ("curves", "mask", "points")}, lengths=2 * before.lengths[1:]
    )
    other = shortcut.changes([(before, fewer, 6.0)])
    assert other["points_found"] == pytest.approx(1 - 1 / len(before.points))
    assert other["log_length_ratio"] == pytest.approx(np.log(2))
