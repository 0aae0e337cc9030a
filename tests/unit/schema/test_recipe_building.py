"""Recipes as the numerics see them: geometry, units of light, lenses, files."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fullwell.radiometry import Spectrum, clear_sky, illuminance_lux, luminance_cd_m2, luminous_flux_lm
from fullwell.scene import (
    ConstantEnvironment,
    Diffuse,
    DirectionalLight,
    ImageEnvironment,
    Mesh,
    PointLight,
    Principled,
    SpotLight,
    SunSky,
)
from fullwell.schema import RecipeError, build_frame, load_recipe, validate
from fullwell.schema.conversion.lights import spot_solid_angle_sr
from fullwell.schema.conversion.solar import sun_angles_deg

ROUNDING = 1e-12


def _light(recipe: dict[str, Any], **light: Any) -> Any:
    recipe["scene"]["lights"] = [{"name": "light", **light}]
    frame = build_frame(load_recipe(recipe))
    return frame.scene.lights[0] if frame.scene.lights else frame.scene.objects[-1]


def _matrix(recipe: dict[str, Any], transform: Any) -> Any:
    recipe["scene"]["objects"][0]["transform"] = transform
    return build_frame(load_recipe(recipe)).scene.objects[0].to_world


# Transforms ----------------------------------------------------------------------------------------------------------


def test_one_step_scales_then_turns_then_moves(recipe: dict[str, Any]) -> None:
    step = {"scale": 2, "rotate_deg": {"axis": "z", "angle_deg": 90}, "translate_m": [0, 0, 5]}
    assert _matrix(recipe, step) @ [1, 0, 0, 1] == pytest.approx([0, 2, 5, 1], abs=ROUNDING)


def test_a_list_of_steps_is_applied_from_the_first(recipe: dict[str, Any]) -> None:
    steps = [{"translate_m": [1, 0, 0]}, {"rotate_deg": {"axis": [0, 0, 2], "angle_deg": 90}}]
    assert _matrix(recipe, steps) @ [0, 0, 0, 1] == pytest.approx([0, 1, 0, 1], abs=ROUNDING)


def test_three_angles_turn_about_fixed_x_then_y_then_z(recipe: dict[str, Any]) -> None:
    # x takes y to z, y takes z to x, z takes x to y.
    assert _matrix(recipe, {"rotate_deg": [90, 90, 90]}) @ [0, 1, 0, 1] == pytest.approx([0, 1, 0, 1], abs=ROUNDING)
    assert _matrix(recipe, {"rotate_deg": [90, 90, 0]}) @ [0, 1, 0, 1] == pytest.approx([1, 0, 0, 1], abs=ROUNDING)


def test_quarter_turns_are_exact(recipe: dict[str, Any]) -> None:
    matrix = _matrix(recipe, {"rotate_deg": {"axis": "x", "angle_deg": -270}})
    assert matrix.tolist() == [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]


def test_look_at_turns_the_normal_to_the_target_and_y_upwards(recipe: dict[str, Any]) -> None:
    matrix = _matrix(recipe, {"look_at": {"origin_m": [1, 5, 3], "target_m": [1, 9, 3]}})
    assert matrix @ [0, 0, 1, 0] == pytest.approx([0, 1, 0, 0], abs=ROUNDING)
    assert matrix @ [0, 1, 0, 0] == pytest.approx([0, 0, 1, 0], abs=ROUNDING)
    assert matrix @ [0, 0, 0, 1] == pytest.approx([1, 5, 3, 1])
    assert np.linalg.det(matrix) == pytest.approx(1)


def test_a_quad_faces_the_side_from_which_it_runs_counter_clockwise(recipe: dict[str, Any]) -> None:
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    recipe["scene"]["objects"][0]["geometry"] = {"kind": "quad", "corners_m": corners}
    mesh = build_frame(load_recipe(recipe)).scene.objects[0].parts[0].geometry
    assert isinstance(mesh, Mesh)
    a, b, c = mesh.vertices_m[mesh.faces[0]]
    assert np.cross(b - a, c - a)[2] > 0


# Light ---------------------------------------------------------------------------------------------------------------


def test_an_area_light_of_1000_lumen_emits_1000_lumen(recipe: dict[str, Any]) -> None:
    lamp = _light(
        recipe,
        kind="area",
        geometry={"kind": "disk", "radius_m": 0.1},
        transform={"scale": 3},
        luminous_flux_lm=1000,
        spd="blackbody:3000K",
        group="lamp",
    )
    emission = lamp.parts[0].emission
    area_m2 = math.pi * 0.3**2
    assert luminous_flux_lm(emission.radiance.scaled(math.pi * area_m2)) == pytest.approx(1000)
    assert (lamp.id, emission.group) == ("light", "lamp")
    assert isinstance(lamp.parts[0].material, Diffuse)


@pytest.mark.parametrize(
    ("geometry", "transform", "area_m2"),
    [
        ({"kind": "sphere", "radius_m": 1}, None, 4 * math.pi),
        ({"kind": "rectangle", "size_m": [2, 3]}, {"scale": [2, 1, 1]}, 12.0),
        ({"kind": "cube", "size_m": [1, 2, 3]}, None, 22.0),
        ({"kind": "cylinder", "radius_m": 1, "height_m": 2}, {"rotate_deg": [10, 20, 30]}, 4 * math.pi),
    ],
)
def test_flux_is_spread_over_the_whole_surface(
    recipe: dict[str, Any], geometry: dict[str, Any], transform: Any, area_m2: float
) -> None:
    lamp = _light(recipe, kind="area", geometry=geometry, transform=transform, luminous_flux_lm=10, spd="E")
    radiance = lamp.parts[0].emission.radiance
    assert luminance_cd_m2(radiance) == pytest.approx(10 / (math.pi * area_m2))


def test_a_point_light_of_100_lumen_has_100_over_4_pi_candela(recipe: dict[str, Any]) -> None:
    light = _light(recipe, kind="point", position_m=[0, 0, 1], luminous_flux_lm=100, spd="A")
    assert isinstance(light, PointLight)
    assert luminance_cd_m2(light.intensity) == pytest.approx(100 / (4 * math.pi))
    assert light.intensity.unit == "W sr^-1 nm^-1"


def test_the_flux_of_a_spot_is_the_integral_of_its_falloff(recipe: dict[str, Any]) -> None:
    beam_deg, cutoff_deg = 10.0, 25.0
    angle = np.radians(np.linspace(0, cutoff_deg, 200_001))
    falloff = np.clip((np.radians(cutoff_deg) - angle) / np.radians(cutoff_deg - beam_deg), 0, 1)
    solid_angle_sr = 2 * np.pi * np.trapezoid(falloff * np.sin(angle), angle)
    assert spot_solid_angle_sr(beam_deg, cutoff_deg) == pytest.approx(solid_angle_sr, rel=1e-8)
    light = _light(
        recipe, kind="spot", position_m=[0, 0, 2], target_m=[0, 0, 0], beam_deg=10, cutoff_deg=25, luminous_flux_lm=50, spd="E"
    )
    assert isinstance(light, SpotLight)
    assert light.direction == (0.0, 0.0, -1.0)
    assert luminance_cd_m2(light.intensity) == pytest.approx(50 / solid_angle_sr, rel=1e-8)


def test_directional_light_has_the_given_illuminance(recipe: dict[str, Any]) -> None:
    light = _light(recipe, kind="directional", direction=[0, 3, -4], illuminance_lux=1e5, spd="d65")
    assert isinstance(light, DirectionalLight)
    assert illuminance_lux(light.irradiance) == pytest.approx(1e5)
    assert light.direction == pytest.approx((0, 0.6, -0.8))


def test_the_illuminance_of_a_constant_sky_is_pi_times_its_luminance(recipe: dict[str, Any]) -> None:
    light = _light(recipe, kind="constant_environment", illuminance_lux=1000, spd="d65")
    assert isinstance(light, ConstantEnvironment)
    assert luminance_cd_m2(light.radiance) == pytest.approx(1000 / math.pi)


def test_absolute_spectra_keep_their_numbers(recipe: dict[str, Any]) -> None:
    table = {"wavelength_nm": [400, 700], "values": [0.1, 0.4]}
    light = _light(recipe, kind="constant_environment", radiance_w_sr_m2_nm=table)
    assert light.radiance.at([399, 400, 550, 700, 701]) == pytest.approx([0, 0.1, 0.25, 0.4, 0])


def test_azimuth_runs_clockwise_from_north(recipe: dict[str, Any]) -> None:
    light = _light(recipe, kind="sun_sky", sun_elevation_deg=30, sun_azimuth_deg=90)
    assert isinstance(light, SunSky)
    assert light.sun_direction == pytest.approx((math.cos(math.radians(30)), 0, 0.5), abs=ROUNDING)


PLACE = {"latitude_deg": 48.1, "longitude_deg": 11.6}


@pytest.mark.parametrize(
    ("given", "lux"),
    [
        ({"illuminance_lux": 8000}, 8000.0),
        ({"luminance_cd_m2": 3000}, 3000.0 * 7 * math.pi / 9),
        ({"sun_elevation_deg": 30}, 10_800.0),
        ({"time_utc": "2026-12-21T11:00:00Z", **PLACE}, 300.0 + 21_000.0 * math.sin(math.radians(18.4))),
    ],
    ids=["illuminance", "zenith", "sun", "time"],
)
def test_an_overcast_sky_gives_level_ground_its_illuminance(recipe: dict[str, Any], given: dict[str, Any], lux: float) -> None:
    light = _light(recipe, kind="overcast_sky", group="sky", **given)
    assert isinstance(light, ImageEnvironment)
    rows = light.pixels.shape[0]
    down = (np.arange(rows) + 0.5) * np.pi / rows
    shares = light.pixels[:, 0, 0].astype(float)
    zenith = luminance_cd_m2(light.radiance)
    received = zenith * float(np.sum(shares * np.cos(down) * np.sin(down)) * np.pi / rows * 2 * np.pi)
    assert received == pytest.approx(lux, rel=2e-3)
    assert np.ptp(light.pixels, axis=(1, 2)).max() == 0
    assert shares[0] == pytest.approx(1.0, abs=1e-3)
    assert shares[rows // 2 - 1] == pytest.approx(1 / 3, abs=5e-3)
    assert np.all(shares[rows // 2 :] == 0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "exactly one"),
        ({"illuminance_lux": 1, "sun_elevation_deg": 3}, "exactly one"),
        ({"time_utc": "2026-12-21T11:00:00Z"}, "all three"),
        ({"time_utc": "2026-12-21T11:00:00Z", "illuminance_lux": 1, **PLACE}, "twice"),
        ({"time_utc": "2026-12-21T22:00:00Z", **PLACE}, "below the horizon"),
    ],
)
def test_an_overcast_sky_without_one_brightness_is_refused(recipe: dict[str, Any], given: dict[str, Any], said: str) -> None:
    with pytest.raises(RecipeError, match=said):
        _light(recipe, kind="overcast_sky", **given)


@pytest.mark.slow
def test_twilight_has_no_sun_and_gets_darker_smoothly_to_the_published_levels(recipe: dict[str, Any]) -> None:
    """Glossary of Meteorology: 2 to 3.5 lx at the end of civil, 0.008 at that of nautical, 0.0006 of astronomical twilight."""
    lux = []
    elevations_deg = [0.5, 0.0, -1.0, -3.0, -6.0, -9.0, -12.0, -15.0, -18.0]
    for elevation_deg in elevations_deg:
        light = _light(recipe, kind="sun_sky", sun_elevation_deg=elevation_deg, sun_azimuth_deg=270, sky_weight=2.0)
        assert isinstance(light, SunSky)
        sky = clear_sky(light.sun_direction, turbidity=3.0, ground_albedo=0.2)
        irradiance = 0.5 * light.sky_weight * sky.sky_irradiance()
        lux.append(illuminance_lux(Spectrum(sky.wavelength_nm, irradiance, outside="zero")))
        assert (light.sun_weight == 0) == (elevation_deg <= 0)
    slopes = np.diff(np.log10(lux)) / -np.diff(elevations_deg)
    assert np.all(slopes < 0)
    assert np.min(slopes) > -0.8  # a factor of six a degree
    at = dict(zip(elevations_deg, lux, strict=True))
    assert 400 < at[0.0] < 1200
    assert 2.0 < at[-6.0] < 3.5
    assert at[-12.0] == pytest.approx(8e-3, rel=0.01)
    assert at[-18.0] == pytest.approx(6e-4, rel=0.01)


def test_twilight_by_time_and_place(recipe: dict[str, Any]) -> None:
    light = _light(recipe, kind="sun_sky", time_utc="2026-06-21T19:40:00Z", **PLACE)
    assert isinstance(light, SunSky)
    assert light.sun_weight == 0
    assert 0 < light.sky_weight < 0.3
    assert light.sun_direction[2] == pytest.approx(0.0, abs=1e-9)


def test_the_sun_is_where_the_almanac_says() -> None:
    # Meeus, Astronomical Algorithms (2nd ed.), example 25.a: 1992 October 13, 0 h TD: declination -7.78507 deg.
    # At local noon on the equator the elevation is 90 deg - |declination|, the sun to the south.
    noon = [
        sun_angles_deg(datetime(1992, 10, 13, 0, 0, tzinfo=UTC), latitude_deg=0, longitude_deg=lon) for lon in (176, 176.6, 177)
    ]
    assert max(elevation for elevation, _ in noon) == pytest.approx(90 - 7.785, abs=0.02)
    assert noon[1][1] == pytest.approx(180, abs=3)


def test_the_june_sun_of_the_northern_tropic_stands_overhead_and_in_the_east_in_the_morning() -> None:
    assert sun_angles_deg(datetime(2024, 6, 20, 12, 2, tzinfo=UTC), latitude_deg=23.44, longitude_deg=0)[0] > 89.5
    elevation_deg, azimuth_deg = sun_angles_deg(datetime(2024, 6, 20, 8, 0, tzinfo=UTC), latitude_deg=23.44, longitude_deg=0)
    assert 30 < elevation_deg < 40
    assert 70 < azimuth_deg < 90


def test_a_table_that_ends_inside_the_grid_gives_a_warning(recipe: dict[str, Any]) -> None:
    recipe["spectral"] = {"last_nm": 1000}
    assert any("scene.lights[0].spd" in warning for warning in validate(load_recipe(recipe)))


# Materials -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("colour", ["#ff0000", {"srgb": [1, 0, 0]}])
def test_srgb_colours_are_upsampled_and_flagged(recipe: dict[str, Any], colour: Any) -> None:
    recipe["scene"]["materials"]["paint"]["reflectance"] = colour
    frame = build_frame(load_recipe(recipe))
    material = frame.scene.objects[0].parts[0].material
    assert isinstance(material, Diffuse)
    assert material.reflectance.upsampled  # type: ignore[union-attr]
    assert any("scene.materials.paint.reflectance is an sRGB colour" in warning for warning in frame.warnings)


def test_equal_materials_become_one(recipe: dict[str, Any]) -> None:
    objects = recipe["scene"]["objects"]
    inline = {"kind": "diffuse", "reflectance": 0.5}
    objects.append(objects[0] | {"id": "other", "material": inline})
    first, second = build_frame(load_recipe(recipe)).scene.objects
    assert first.parts[0].material is second.parts[0].material


def test_an_object_may_have_several_parts(recipe: dict[str, Any]) -> None:
    item = recipe["scene"]["objects"][0]
    geometry, material = item.pop("geometry"), item.pop("material")
    item["parts"] = [
        {"name": "low", "geometry": geometry, "material": material},
        {"name": "high", "geometry": geometry, "material": material, "transform": {"translate_m": [0, 0, 1]}},
    ]
    parts = build_frame(load_recipe(recipe)).scene.objects[0].parts
    assert [part.name for part in parts] == ["low", "high"]
    assert parts[1].to_object[2, 3] == 1


# Cameras -------------------------------------------------------------------------------------------------------------


def test_the_field_of_view_sets_the_focal_length_for_the_focus_distance(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["lens"] = {"kind": "thin_lens", "f_number": 2, "hfov_deg": 40, "focus_distance_m": 0.5}
    camera = build_frame(load_recipe(recipe)).cameras[0].camera
    half_width_m = camera.film.cols * camera.film.pitch_m / 2
    assert math.degrees(math.atan(half_width_m / camera.lens.image_distance_m)) == pytest.approx(20)
    assert camera.lens.focus_distance_m == 0.5


def test_a_thin_lens_focuses_on_the_target_and_a_pinhole_at_infinity(recipe: dict[str, Any]) -> None:
    assert build_frame(load_recipe(recipe)).cameras[0].camera.lens.focus_distance_m == math.inf
    recipe["cameras"][0]["lens"]["kind"] = "thin_lens"
    assert build_frame(load_recipe(recipe)).cameras[0].camera.lens.focus_distance_m == pytest.approx(1.0)


def test_the_film_covers_the_largest_sensor_at_the_finest_pitch(recipe: dict[str, Any]) -> None:
    sensors = recipe["cameras"][0]["sensors"]
    sensors[0] |= {"rows": 100, "cols": 100, "pixel_pitch_m": 2e-6}
    sensors.append(sensors[0] | {"name": "coarse", "rows": 60, "cols": 80, "pixel_pitch_m": 6e-6})
    recipe["quality"]["oversampling"] = 2
    film = build_frame(load_recipe(recipe)).cameras[0].camera.film
    assert (film.rows, film.cols, film.pitch_m) == (360, 480, 1e-6)


def test_sensor_numbers_of_the_recipe_replace_those_of_the_catalogue(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["sensors"][0] |= {"model": "imx363", "read_noise_e": 0, "adc_bits": 12}
    rig = build_frame(load_recipe(recipe)).cameras[0].sensors[0]
    assert (rig.name, rig.model.read_noise_e, rig.model.adc_bits, rig.model.rows) == ("wide", 0.0, 12, 48)
    assert rig.model.well_capacity_e == 6000


def test_outputs_come_in_one_order(recipe: dict[str, Any]) -> None:
    assert build_frame(load_recipe(recipe)).outputs == ("image.png", "raw.npz")


# Files ---------------------------------------------------------------------------------------------------------------

OBJ = "o tri\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\n"


@pytest.fixture
def with_model(recipe: dict[str, Any], tmp_path: Path) -> dict[str, Any]:
    (tmp_path / "shape.obj").write_text(OBJ)
    item = recipe["scene"]["objects"][0]
    item["geometry"] = {"kind": "model", "file": "shape.obj", "unit_m": 0.01, "up_axis": "z"}
    del item["material"]
    return recipe


def test_model_files_bring_their_shape_and_material(with_model: dict[str, Any], tmp_path: Path) -> None:
    frame = build_frame(load_recipe(with_model), base_dir=tmp_path)
    part = frame.scene.objects[0].parts[0]
    assert isinstance(part.geometry, Mesh)
    assert part.geometry.vertices_m.max() == pytest.approx(0.01)
    assert isinstance(part.material, Principled)


def test_a_pattern_replaces_the_material_of_matching_parts(with_model: dict[str, Any], tmp_path: Path) -> None:
    item = with_model["scene"]["objects"][0]
    item["materials"] = {"*": "paint"}
    frame = build_frame(load_recipe(with_model), base_dir=tmp_path)
    assert isinstance(frame.scene.objects[0].parts[0].material, Diffuse)
    item["materials"] = {"wheel*": "paint"}
    with pytest.raises(RecipeError, match="matches no part"):
        build_frame(load_recipe(with_model), base_dir=tmp_path)


def test_files_are_recorded_by_digest_and_a_changed_one_is_refused(with_model: dict[str, Any], tmp_path: Path) -> None:
    frame = build_frame(load_recipe(with_model), base_dir=tmp_path)
    stored = load_recipe(frame.recipe_json)
    assert list(stored.files) == ["shape.obj"]
    build_frame(stored, base_dir=tmp_path)
    (tmp_path / "shape.obj").write_text(OBJ + "\n")
    with pytest.raises(RecipeError, match="It was changed"):
        build_frame(stored, base_dir=tmp_path)


@pytest.mark.parametrize("by_link", [False, True])
def test_a_recipe_from_elsewhere_reads_nothing_outside_its_folder(
    with_model: dict[str, Any], tmp_path: Path, by_link: bool
) -> None:
    folder = tmp_path / "job"
    folder.mkdir()
    (folder / "link.obj").symlink_to(tmp_path / "shape.obj")
    with_model["scene"]["objects"][0]["geometry"]["file"] = "link.obj" if by_link else "../shape.obj"
    with pytest.raises(RecipeError, match="outside the recipe's folder"):
        build_frame(load_recipe(with_model), base_dir=folder)
    (folder / "recipe.json").write_text(json.dumps(with_model))
    build_frame(load_recipe(folder / "recipe.json"))  # its owner may


def test_a_missing_file_is_answered_with_the_nearest_name(with_model: dict[str, Any], tmp_path: Path) -> None:
    with_model["scene"]["objects"][0]["geometry"]["file"] = "shap.obj"
    with pytest.raises(RecipeError, match=r"geometry\.file is 'shap.obj', which does not exist; did you mean shape.obj"):
        build_frame(load_recipe(with_model), base_dir=tmp_path)


def test_a_damaged_model_is_refused_with_its_path(with_model: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "shape.obj").write_text("f 1 2 3\n")
    with pytest.raises(RecipeError) as caught:
        build_frame(load_recipe(with_model), base_dir=tmp_path)
    assert caught.value.path == "scene.objects[0].geometry.file"


def test_environment_pictures_become_linear(recipe: dict[str, Any], tmp_path: Path) -> None:
    np.save(tmp_path / "sky.npy", np.full((2, 4, 3), 0.25, dtype=np.float32))
    recipe["scene"]["lights"] = [
        {"name": "sky", "kind": "image_environment", "file": "sky.npy", "luminance_cd_m2": 10, "spd": "d65"}
    ]
    light = build_frame(load_recipe(recipe), base_dir=tmp_path).scene.lights[0]
    assert isinstance(light, ImageEnvironment)
    assert light.pixels.shape == (2, 4, 3)
    assert float(light.pixels.max()) == 0.25


def test_a_radiance_picture_is_decoded(recipe: dict[str, Any], tmp_path: Path) -> None:
    header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n"
    run_length_coded = b"\x02\x02\x00\x08" + b"\x88\x80" + b"\x88\x40" + b"\x08" + bytes(range(8)) + b"\x88\x81"
    (tmp_path / "sky.hdr").write_bytes(header + run_length_coded)
    recipe["scene"]["lights"] = [{"name": "s", "kind": "image_environment", "file": "sky.hdr", "radiance_w_sr_m2_nm": 1}]
    pixels = build_frame(load_recipe(recipe), base_dir=tmp_path).scene.lights[0].pixels  # type: ignore[union-attr]
    assert pixels[0, :, 0] == pytest.approx([1.0] * 8)  # 128 / 256 * 2^1
    assert pixels[0, :, 2] == pytest.approx(np.arange(8) / 128)


@pytest.mark.parametrize("name", ["sky.npy", "sky.png", "sky.hdr", "sky.exr", "sky.doc"])
def test_a_damaged_picture_is_refused_with_its_path(recipe: dict[str, Any], tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"garbage")
    recipe["scene"]["lights"] = [{"name": "s", "kind": "image_environment", "file": name, "radiance_w_sr_m2_nm": 1}]
    with pytest.raises(RecipeError) as caught:
        build_frame(load_recipe(recipe), base_dir=tmp_path)
    assert caught.value.path == "scene.lights[0].file"
