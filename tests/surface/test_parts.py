import numpy as np
import pytest
from surface.shapes import AXES, cube, joined, limbed, moved, sphere, torus, without

from curvematch_jax.surface import Extraction, Mesh, MeshError, Parts, extract_parts
from curvematch_jax.surface._parts import area_share, normalise

SETTINGS = Extraction(radius=0.4, levels=6, spacing=1.0, samples=64, vertices=2500)


@pytest.fixture(scope="module")
def parts() -> Parts:
    return extract_parts(limbed(), SETTINGS)


def redrawn(parts: Parts, part: int, level: int) -> np.ndarray:
    scale = parts.lengths[part, level] * parts.diameter
    return parts.curves[part, level] * scale + parts.centres[part, level][:, None]


def assert_sound(parts: Parts) -> None:
    count, levels = parts.mask.shape
    samples = parts.settings.samples
    assert parts.curves.shape == (count, levels, 3, samples)
    assert parts.lengths.shape == (count, levels)
    assert parts.centres.shape == (count, levels, 3)
    assert parts.areas.shape == (count,)
    assert parts.points.shape == (count, 3)
    for array in (parts.curves, parts.lengths, parts.centres, parts.areas, parts.points):
        assert array.dtype == (np.float64 if array is parts.centres or array is parts.points else np.float32)
        assert np.isfinite(array).all()
    assert (parts.lengths[parts.mask] > 0).all()
    assert (parts.level_set_lengths >= parts.lengths * (1 - 1e-2)).all()  # sampled curves cut corners
    assert parts.feature_distances.shape == (count, count)
    np.testing.assert_array_equal(parts.feature_distances, parts.feature_distances.T)
    assert not np.diag(parts.feature_distances).any()
    assert (parts.areas > 0).all()
    assert (parts.areas <= 1).all()
    assert not parts.curves[~parts.mask].any()
    assert not parts.lengths[~parts.mask].any()
    assert not parts.centres[~parts.mask].any()


def test_curves_are_centred_of_unit_length_and_evenly_sampled(parts):
    assert_sound(parts)
    assert len(parts.mask) == 6
    steps = np.linalg.norm(np.roll(parts.curves, -1, axis=-1) - parts.curves, axis=-2)[parts.mask]
    np.testing.assert_allclose(steps.sum(axis=-1), 1, atol=1e-5)
    assert steps.max() < 1.01 / parts.settings.samples * 1.1
    np.testing.assert_allclose(parts.curves.mean(axis=-1), 0, atol=1e-6)


def test_curves_redrawn_lie_on_the_surface_around_their_limb(parts):
    mesh = limbed()
    for part in range(len(parts.mask)):
        axis = AXES[np.argmax(AXES @ parts.points[part])]
        for level in np.flatnonzero(parts.mask[part]):
            curve = redrawn(parts, part, level).T
            nearest = np.linalg.norm(mesh.vertices[None] - curve[:, None], axis=2).min(axis=1)
            assert nearest.max() < 0.25
            assert np.cross(curve, np.roll(curve, -1, axis=0)).sum(axis=0) @ axis > 0
        if parts.mask[part, :2].all():
            assert (parts.centres[part, 0] - parts.centres[part, 1]) @ axis > 0


def test_areas_are_equal_by_symmetry_and_small(parts):
    np.testing.assert_allclose(parts.areas, parts.areas.mean(), rtol=0.05)
    assert 0.05 < parts.areas.mean() < 0.5


@pytest.mark.parametrize("scale", [1e-3, 1e6])
def test_parts_do_not_depend_on_the_unit(scale):
    mesh = limbed(np.array([[1, 0, 0], [-1, 0.3, 0.1], [0.2, 1, 0.7], [0, 0.1, -1]]))  # no ties by symmetry
    parts, other = extract_parts(mesh, SETTINGS), extract_parts(moved(mesh, scale=scale), SETTINGS)
    assert other.diameter == pytest.approx(scale * parts.diameter)
    np.testing.assert_array_equal(other.mask, parts.mask)
    np.testing.assert_allclose(other.points, parts.points * scale, rtol=1e-5, atol=1e-5 * scale)
    np.testing.assert_allclose(other.lengths, parts.lengths, rtol=1e-4)
    np.testing.assert_allclose(other.curves, parts.curves, atol=1e-4)


def test_extraction_is_deterministic(parts):
    again = extract_parts(limbed(), SETTINGS)
    for name in ("curves", "mask", "lengths", "level_set_lengths", "centres", "areas", "points", "feature_distances"):
        np.testing.assert_array_equal(getattr(again, name), getattr(parts, name))


def test_notes_say_what_was_cleaned(parts):
    assert extract_parts(sphere(4), SETTINGS).notes[:-1] == ()
    dirty = joined(without(limbed(), np.array([5])), moved(sphere(1), (9, 9, 9), 0.1))
    notes = extract_parts(dirty, SETTINGS).notes
    assert "1 holes closed" in notes
    assert any(note.startswith("1 smaller components dropped") for note in notes)


@pytest.mark.parametrize(
    "mesh", [sphere(4), torus(), cube(20), moved(cube(), scale=1e-4)], ids=["sphere", "torus", "cube", "coarse cube"]
)
def test_shapes_without_limbs_have_parts_too(mesh):
    found = extract_parts(mesh, Extraction(levels=4, samples=32, vertices=2500))
    assert_sound(found)
    assert len(found.mask) >= 1
    assert found.mask.any()


def test_what_is_no_surface_is_refused():
    with pytest.raises(MeshError, match="triangle: 1 faces cannot enclose a volume"):
        extract_parts(Mesh(np.eye(3), np.array([[0, 1, 2]]), "triangle"))


@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        ({"epsilon": 0.0}, "epsilon must lie between 0 and 1"),
        ({"radius": 1.5}, "radius must lie between 0 and 1"),
        ({"spacing": 0.0}, "spacing must be more than 0, found 0.0"),
        ({"min_parts": 0}, "min_parts must be an integer of at least 1, found 0"),
        ({"levels": 0}, "levels must be an integer of at least 1, found 0"),
        ({"samples": 3}, "samples must be an integer of at least 8"),
        ({"vertices": 10}, "vertices must be an integer of at least 100"),
    ],
)
def test_settings_are_checked_when_they_are_made(setting, reason):
    with pytest.raises(ValueError, match=reason):
        Extraction(**setting)


def test_a_circle_in_the_plane():
    angle = 2 * np.pi * np.arange(1000) / 1000
    circle = 3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) + [1, 2, 3]
    (curve,), (length,), (centre,) = normalise([circle], 100)
    assert length == pytest.approx(6 * np.pi, rel=1e-3)
    assert centre == pytest.approx([1, 2, 3])
    assert np.linalg.norm(curve, axis=0) == pytest.approx(1 / (2 * np.pi), rel=1e-3)


def test_repeated_points_change_nothing():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    for one, other in normalise([square, np.repeat(square, 3, axis=0)], 40):
        np.testing.assert_allclose(one, other, atol=1e-12)


@pytest.mark.parametrize("value", [0.0, 0.3, 0.5, 1.0, 1.7, 2.5, 3.0])
def test_area_below_a_plane_that_cuts_the_cube(value):
    box = cube(7)
    function = box.vertices.sum(axis=1)
    # A side through the origin is cut by x + y = value, a side opposite to it by x + y = value - 1.
    inner = value**2 / 2 if value <= 1 else 1 - (2 - value) ** 2 / 2 if value <= 2 else 1.0
    shifted = value - 1
    outer = 0.0 if shifted <= 0 else shifted**2 / 2 if shifted <= 1 else 1 - (2 - shifted) ** 2 / 2
    assert float(area_share(box, function, value)) == pytest.approx((3 * inner + 3 * outer) / 6)
    assert float(area_share(box, function, 9.0)) == pytest.approx(1)


def test_levels_are_denser_next_to_the_feature_point_as_asked():
    even, dense = Extraction(levels=7, spacing=1.0).radii, Extraction(levels=7, spacing=1.5).radii
    np.testing.assert_allclose(even, np.arange(2, 9) * 0.1)
    np.testing.assert_allclose(dense, 0.8 * (np.arange(2, 9) / 8) ** 1.5)


def test_farthest_points_make_up_for_missing_feature_points():
    few, more = (
        extract_parts(torus(), Extraction(min_parts=1, levels=2)),
        extract_parts(torus(), Extraction(min_parts=5, levels=2)),
    )
    assert len(few.areas) < 5 == len(more.areas)
    np.testing.assert_array_equal(more.points[: len(few.points)], few.points)
    assert any("farthest points" in note for note in more.notes)
    assert more.feature_distances[np.triu_indices(5, 1)].min() > 0.2
