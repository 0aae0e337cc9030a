"""Depth of field composed from depth layers: closed forms, occlusion, and the renderer's own thin lens."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError
from fullwell.optics import OpticsOptions, circle_of_confusion_px, compute_irradiance, defocus, defocus_layers
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Camera, Diffuse, Emission, Film, Lens, Mesh, Part, SceneDescription, SceneObject, look_at

ROUNDING = 1e-6
"""Relative; the radiance is stored in single precision."""

RENDERED_TOLERANCE = 0.05
"""Of the brightest, root mean square: diameters known to half a sample, a guess of what near objects hide, and edges that
all lie on the borders of samples, where a disc of diameter d spills 0.106 d into the next sample and a kernel of the same
variance less."""

RENDERED_LIGHT_TOLERANCE = 0.01
"""Of the sum over the picture: what enters at the border is a guess, and light hidden and unhidden need not balance."""

GRID = WavelengthGrid(550.0, 550.0, 10.0)
TANGENT_PITCH = 2 * math.tan(math.radians(15.0)) / 64


def lens(focus_m: float, kind: str = "pinhole", focal_m: float = 0.1) -> Lens:
    return Lens(kind, focal_m, 1.4, focus_m, Spectrum.constant(1.0))


def picture(values: np.ndarray) -> RadianceImage:
    return RadianceImage(values[:, :, None].astype(np.float32), GRID, TANGENT_PITCH)


def blurred(values: np.ndarray, depth_m: np.ndarray, focus_m: float) -> np.ndarray:
    return defocus(picture(values), depth_m, lens(focus_m))[0].photons[:, :, 0].astype(float)


def test_the_circle_of_confusion_follows_from_similar_triangles() -> None:
    """Behind the lens: the cone of a point at z converges at its image distance; the film cuts it elsewhere."""
    one = lens(2.0)
    for depth_m in (0.5, 1.0, 2.0, 10.0, math.inf):
        image_m = 1 / (1 / one.focal_length_m - 1 / depth_m)
        cut_m = one.pupil_diameter_m * abs(image_m - one.image_distance_m) / image_m
        pitch_m = TANGENT_PITCH * one.image_distance_m
        found = abs(float(circle_of_confusion_px(np.array(depth_m), one, tangent_pitch=TANGENT_PITCH)))
        assert found == pytest.approx(cut_m / pitch_m, rel=1e-9, abs=1e-12)


def test_layers_are_wrong_by_at_most_half_a_sample() -> None:
    depth = np.linspace(0.7, 12.0, 64 * 48).reshape(48, 64)
    layers = defocus_layers(depth, lens(2.0), tangent_pitch=TANGENT_PITCH)
    own = np.abs(circle_of_confusion_px(depth, lens(2.0), tangent_pitch=TANGENT_PITCH))
    assert np.max(np.abs(own - layers.diameter_px[layers.index])) <= 0.5
    assert layers.worst_error_px <= 0.5
    nearest, farthest = layers.index[0, 0], layers.index[-1, -1]
    assert (nearest, farthest) == (0, len(layers.diameter_px) - 1)


def test_a_uniform_picture_stays_uniform_whatever_the_depths() -> None:
    rng = np.random.default_rng(0)
    depth = rng.choice([0.8, 1.0, 1.7, 2.0, 6.0, np.inf], size=(48, 64))
    found = blurred(np.full((48, 64), 5e15), depth, 2.0)
    np.testing.assert_allclose(found, 5e15, rtol=ROUNDING)


def test_light_is_conserved_at_one_depth() -> None:
    values = np.random.default_rng(1).random((48, 64)) ** 6
    found = blurred(values, np.full((48, 64), 1.2), 4.0)
    assert np.sum(found) == pytest.approx(np.sum(values), rel=ROUNDING)
    assert np.max(found) < 0.5 * np.max(values)


def test_a_point_becomes_a_disc_of_the_right_size() -> None:
    values = np.zeros((65, 65))
    values[32, 32] = 1.0
    found = blurred(values, np.full((65, 65), 1.0), 4.0)
    diameter = float(circle_of_confusion_px(np.array(1.0), lens(4.0), tangent_pitch=TANGENT_PITCH))
    x = np.arange(65) - 32
    variance = found.sum(axis=0) @ x**2
    assert 4 * math.sqrt(variance) == pytest.approx(diameter, abs=0.6)


def test_a_sharp_foreground_keeps_its_edge_without_light_from_behind() -> None:
    values, depth = np.full((48, 64), 100.0), np.full((48, 64), 4.0)
    values[:, :32], depth[:, :32] = 1.0, 1.0
    found = blurred(values, depth, 1.0)
    np.testing.assert_allclose(found[:, :32], 1.0, rtol=1e-5)
    np.testing.assert_allclose(found[:, 32:], 100.0, rtol=1e-5)


def test_a_blurred_foreground_is_seen_through_at_its_edge() -> None:
    values, depth = np.full((48, 64), 9.0), np.full((48, 64), 4.0)
    values[:, :32], depth[:, :32] = 1.0, 1.0
    row = blurred(values, depth, 4.0)[24]
    assert np.all(np.diff(row) >= -1e-5)
    assert row[31] == pytest.approx(10.0 - row[32], rel=1e-4)
    np.testing.assert_allclose(row[[20, 44]], [1.0, 9.0], rtol=1e-5)


def test_a_slanted_surface_blurs_as_one_surface() -> None:
    """Layers of one surface must not cover one another: a ramp of light on it stays what it is."""
    depth = 1 / np.broadcast_to(np.linspace(1.0, 0.4, 64), (48, 64))
    ramp = np.broadcast_to(np.linspace(1.0, 2.0, 64), (48, 64))
    found = blurred(np.array(ramp), depth, 2.5)
    np.testing.assert_allclose(found[:, 8:-8], ramp[:, 8:-8], rtol=0.01)


def test_nothing_is_done_below_half_a_sample_and_the_note_says_so() -> None:
    scene = picture(np.random.default_rng(2).random((48, 64)))
    same, note = defocus(scene, np.full((48, 64), 2.01), lens(2.0, focal_m=0.02))
    assert same is scene
    assert "left out" in note
    assert "0.5 samples" in note


def test_the_optics_stage_defocuses_first() -> None:
    values = np.random.default_rng(3).random((48, 64)) * 1e16
    depth = np.full((48, 64), 1.0)
    focused = lens(4.0)
    # Behind the layers stands the pupil of a thin lens, with its falloff.
    expected = compute_irradiance(defocus(picture(values), depth, focused)[0], lens(4.0, "thin_lens"))
    found = compute_irradiance(picture(values), focused, OpticsOptions(depth_z_m=depth))
    np.testing.assert_array_equal(found.photons, expected.photons)
    assert found.notes[0].startswith("defocus: 1 depth layers")


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan])
def test_depths_that_cannot_be_are_refused(bad: float) -> None:
    depth = np.full((48, 64), 2.0)
    depth[3, 4] = bad
    with pytest.raises(FieldError, match="depth_z_m"):
        blurred(np.ones((48, 64)), depth, 2.0)


def test_depths_of_another_picture_are_refused() -> None:
    with pytest.raises(ShapeError, match="depth_z_m"):
        blurred(np.ones((48, 64)), np.ones((64, 48)), 2.0)


def test_a_picture_that_has_its_depth_of_field_is_refused() -> None:
    with pytest.raises(FieldError, match="pinhole"):
        compute_irradiance(picture(np.ones((48, 64))), lens(2.0, "thin_lens"), OpticsOptions(depth_z_m=np.ones((48, 64))))


def test_blur_wider_than_the_picture_is_refused() -> None:
    with pytest.raises(FieldError, match="thin_lens"):
        blurred(np.ones((48, 64)), np.full((48, 64), 0.05), 4.0)


# Against the renderer -------------------------------------------------------------------------------------------------


def sheet(name: str, depth_m: float, columns: tuple[int, int], rows: tuple[int, int], radiance_w: float) -> SceneObject:
    """Return a glowing rectangle that covers whole samples of the 64 x 48 picture."""
    (left, right), (top, bottom) = columns, rows
    corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
    vertices = [[(x - 32) * TANGENT_PITCH * depth_m, (24 - y) * TANGENT_PITCH * depth_m, -depth_m] for x, y in corners]
    glow = Emission(Spectrum.constant(radiance_w, unit="W sr^-1 m^-2 nm^-1"))
    mesh = Mesh(np.array(vertices), np.array([[0, 1, 2], [0, 2, 3]]))
    return SceneObject(name, "", (Part(mesh, Diffuse(Spectrum.constant(0.0)), emission=glow),), np.eye(4))


def scene() -> SceneDescription:
    bars = [sheet(f"bar{k}", 4.0, (8 * k, 8 * k + 4), (-20, 70), 1.0 + k % 3) for k in range(8)]
    return SceneDescription(
        (sheet("front", 1.0, (14, 34), (16, 60), 3.0), *bars, sheet("wall", 4.2, (-40, 100), (-40, 90), 0.2))
    )


def camera(kind: str, focus_m: float) -> Camera:
    one = lens(focus_m, kind)
    pose = look_at(np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
    return Camera("main", pose, one, Film(48, 64, TANGENT_PITCH * one.image_distance_m))


@pytest.mark.parametrize("focus_m", [1.0, 2.0, 4.0])
def test_layers_agree_with_the_renderers_thin_lens(focus_m: float) -> None:
    render = pytest.importorskip("fullwell.render")
    rendered, _ = render.render_radiance(
        scene(), camera("thin_lens", focus_m), GRID, samples_per_pixel=512, max_depth=1, seed=1
    )
    sharp, _ = render.render_radiance(scene(), camera("pinhole", focus_m), GRID, samples_per_pixel=64, max_depth=1, seed=2)
    hits = render.query_surfaces(scene(), camera("pinhole", focus_m))
    x, y = (np.arange(64) - 31.5) * TANGENT_PITCH, (np.arange(48) - 23.5) * TANGENT_PITCH
    depth = hits.range_m / np.sqrt(1 + x**2 + y[:, None] ** 2)
    found = defocus(sharp, depth, lens(focus_m))[0].photons[8:40, 8:56, 0].astype(float)
    expected = rendered.photons[8:40, 8:56, 0].astype(float)
    untouched = sharp.photons[8:40, 8:56, 0].astype(float)
    brightest = np.max(expected)
    error = np.sqrt(np.mean((found - expected) ** 2)) / brightest
    assert error < RENDERED_TOLERANCE
    assert error < 0.4 * np.sqrt(np.mean((untouched - expected) ** 2)) / brightest
    assert np.sum(found) == pytest.approx(np.sum(expected), rel=RENDERED_LIGHT_TOLERANCE)
