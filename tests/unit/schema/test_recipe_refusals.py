"""Nonsense recipes: each gives one error with the path of the field."""

# ruff: noqa: E501 - one line per case reads better than eight

from __future__ import annotations

import math
import pickle
import time
from typing import Any

import pytest

from fullwell.schema import RecipeError, apply_override, load_recipe, validate

HANGING_S = 20.0
"""A refusal that takes this long hangs. An idle machine needs a second at most; speed itself is a benchmark's business."""

QUAD = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
TETRAHEDRON = {
    "kind": "mesh",
    "vertices_m": [[-1, -1, -1], [5, -1, -1], [-1, 5, -1], [-1, -1, 5]],
    "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
}
LIGHT = "scene.lights[sky]"
BALL = "scene.objects[ball]"

CASES: list[tuple[str, Any, str, str]] = [
    # (where, what is put there, path of the error, words of the message)
    ("name", None, "name", "is missing"),
    ("name", 5, "name", "Put it in quotes"),
    ("name", "a/b", "name", "letters, digits"),
    ("seed", -1, "seed", "must be >= 0"),
    ("seed", 1.5, "seed", "whole number"),
    ("seed", True, "seed", "must be a whole number"),
    ("seeed", 1, "seeed", "did you mean seed"),
    ("scene", 5, "scene", "must be a mapping"),
    ("scene", None, "scene", "is missing"),
    ("spectral.step_nm", 7, "spectral.step_nm", "whole number of steps"),
    ("spectral.step_nm", 0, "spectral.step_nm", "must be >= 1"),
    ("spectral.last_nm", 1200, "spectral.last_nm", "<= 1000"),
    ("spectral.first_nm", 300, "spectral.first_nm", ">= 380"),
    ("spectral", {"first_nm": 700, "last_nm": 400}, "spectral.last_nm", ">= first_nm"),
    ("outputs", ["imag.png"], "outputs[0]", "did you mean 'image.png'"),
    ("outputs", [], "outputs", "at least 1"),
    ("quality.samples_per_pixel", 0, "quality.samples_per_pixel", ">= 1 and <= 65536"),
    ("quality.max_depth", 2000, "quality.max_depth", "<= 1000"),
    ("quality.samples", 4, "quality.samples", "did you mean samples_per_pixel"),
    ("quality", {"samples_per_pixel": 8, "noise_ratio": 0.5}, "quality.samples_per_pixel", "is 8, and noise_ratio is 0.5: samples are either equal"),
    ("quality", {"noise_ratio": 0}, "quality.noise_ratio", "must be >= 0.01 and <= 100"),
    ("quality", {"noise_ratio": math.nan}, "quality.noise_ratio", "must be finite"),
    ("quality", {"nose_ratio": 1}, "quality.nose_ratio", "did you mean noise_ratio"),
    ("quality", {"max_samples_per_pixel": 3}, "quality.max_samples_per_pixel", "must be >= 4"),
    ("quality", {"max_samples_per_pixel": 12.5}, "quality.max_samples_per_pixel", "whole number"),
    ("quality", {"time_limit_s": 0}, "quality.time_limit_s", "must be > 0"),
    ("quality", {"max_sample_saturation": 0.5}, "quality.max_sample_saturation", "must be >= 1"),
    ("scene.light_groups", {"skye": 0.5}, "scene.light_groups.skye", "known are: default"),
    ("scene.light_groups", {"default": -1}, "scene.light_groups.default", "must be >= 0"),
    ("scene.light_groups", {"default": math.inf}, "scene.light_groups.default", "must be finite"),
    ("scene.light_groups", {"default": "bright"}, "scene.light_groups.default", "must be a number"),
    ("scene.light_groups", {"a b": 1}, 'scene.light_groups."a b"', "lower-case letters"),
    ("scene.light_groups", [1], "scene.light_groups", "must be a mapping"),
    # objects
    ("scene.objects", [], "", ""),  # a sky alone is legal
    (f"{BALL}.id", "a b", "scene.objects[0].id", "letters"),
    (f"{BALL}.id", "sky", "scene.lights[0].name", "must differ"),
    (f"{BALL}.geometry", None, "scene.objects[0]", "neither geometry nor parts"),
    (f"{BALL}.geometry.kind", "sphre", "scene.objects[0].geometry.kind", "Did you mean sphere"),
    (f"{BALL}.geometry.kind", None, "scene.objects[0].geometry.kind", "is missing"),
    (f"{BALL}.geometry.radius_m", -1, "scene.objects[0].geometry.radius_m", "is -1; must be > 0"),
    (f"{BALL}.geometry.radius_m", math.nan, "scene.objects[0].geometry.radius_m", "is nan; must be finite"),
    (f"{BALL}.geometry.radius_m", math.inf, "scene.objects[0].geometry.radius_m", "is inf; must be finite"),
    (f"{BALL}.geometry.radius_m", "big", "scene.objects[0].geometry.radius_m", "'big'; must be a number"),
    (f"{BALL}.geometry.radius_m", 10**400, "scene.objects[0].geometry.radius_m", "must be finite"),
    (f"{BALL}.geometry", {"kind": "cube", "size_m": [1, 0, 1]}, "scene.objects[0].geometry.size_m[1]", "must be > 0"),
    (f"{BALL}.geometry", {"kind": "quad", "corners_m": QUAD[:3]}, "scene.objects[0].geometry.corners_m[3]", "is missing"),
    (f"{BALL}.geometry", {"kind": "quad", "corners_m": [QUAD[i] for i in (0, 2, 1, 3)]}, "scene.objects[0].geometry.corners_m", "convex"),
    (f"{BALL}.geometry", {"kind": "quad", "corners_m": [QUAD[0]] * 4}, "scene.objects[0].geometry.corners_m", "coincide"),
    (f"{BALL}.geometry", {"kind": "quad", "corners_m": [*QUAD[:3], [0, 1, 1]]}, "scene.objects[0].geometry.corners_m", "not flat"),
    (
        f"{BALL}.geometry",
        TETRAHEDRON | {"faces": [[0, 1, 4]]},
        "scene.objects[0].geometry.faces[0][2]",
        "is 4; must be <= 3",
    ),
    (f"{BALL}.geometry", TETRAHEDRON | {"faces": [[0, 1]]}, "scene.objects[0].geometry.faces[0]", "must have 3"),
    (f"{BALL}.geometry", TETRAHEDRON | {"faces": [[0, 1, 1]]}, "scene.objects[0].geometry.faces[0]", "without area"),
    (
        f"{BALL}.geometry",
        TETRAHEDRON | {"vertices_m": [[0, 0, 0], [1, 0, 0], [0, math.nan, 0], [0, 0, 1]]},
        "scene.objects[0].geometry.vertices_m[2][1]",
        "is nan",
    ),
    (f"{BALL}.geometry", {"kind": "model", "file": "car.glb"}, "scene.objects[0].geometry.file", "no folder"),
    (f"{BALL}.geometry", {"kind": "model", "file": "asset:car"}, "scene.objects[0].geometry.file", "kind: asset, id: car"),
    (f"{BALL}.transform", {}, "scene.objects[0].transform", "is empty"),
    (f"{BALL}.transform", {"scale": 0}, "scene.objects[0].transform.scale", "must be > 0"),
    (f"{BALL}.transform", {"scale": [1, 1, 1e-8]}, "scene.objects[0].transform", "singular"),
    (f"{BALL}.transform", {"matrix": [[0.0] * 4] * 4}, "scene.objects[0].transform.matrix", "last row"),
    (f"{BALL}.transform", {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 1]]}, "scene.objects[0].transform.matrix", "singular"),
    (f"{BALL}.transform", [{"translate_m": [0, 0, 0]}, {"rotate_deg": {"axis": [0, 0, 0], "angle_deg": 1}}], "scene.objects[0].transform[1].rotate_deg.axis", "null vector"),
    (f"{BALL}.transform", {"translate_m": [0, 0, 1e9]}, "scene.objects[0].transform.translate_m[2]", "<= 1e+07"),
    (f"{BALL}.transform", {"look_at": {"origin_m": [0, 0, 0], "target_m": [0, 0, 0]}}, "scene.objects[0].transform.look_at.target", "must differ"),
    (f"{BALL}.transform", {"move": [0, 0, 0]}, "scene.objects[0].transform.move", "not a known key"),
    (f"{BALL}.inside_ok", "no", "scene.objects[0].inside_ok", "true or false"),
    ("scene.classes", ["bal"], "scene.objects[0].class", "did you mean 'bal'"),
    ("scene.classes", ["ball", "ball"], "scene.classes[1]", "must differ"),
    # materials and spectra
    (f"{BALL}.material", None, "scene.objects[0].material", "is missing"),
    (f"{BALL}.material", "pain", "scene.objects[0].material", "did you mean 'paint'"),
    (f"{BALL}.material", {"kind": "difuse"}, "scene.objects[0].material.kind", "Did you mean diffuse"),
    (f"{BALL}.materials", {"wheel*": "paint"}, "scene.objects[0].materials", "model files only"),
    ("scene.materials.paint.reflectance", 1.2, "scene.materials.paint.reflectance", "<= 1"),
    ("scene.materials.paint.reflectance", -0.1, "scene.materials.paint.reflectance", "must be >= 0"),
    ("scene.materials.paint.reflectance", "cornell:whit", "scene.materials.paint.reflectance", "did you mean 'cornell:white'"),
    ("scene.materials.paint.reflectance", "#12345", "scene.materials.paint.reflectance", "#rrggbb"),
    ("scene.materials.paint.reflectance", {"srgb": [0, 128, 255]}, "scene.materials.paint.reflectance.srgb[1]", "<= 1"),
    ("scene.materials.paint.reflectance", {"wavelength_nm": [400, 500, 600], "values": [0, 1.5, 0]}, "scene.materials.paint.reflectance", "1.5 at 500 nm"),
    ("scene.materials.paint.reflectance", {"wavelength_nm": [400, 400], "values": [0, 1]}, "scene.materials.paint.reflectance.wavelength_nm[1]", "before it"),
    ("scene.materials.paint.reflectance", {"wavelength_nm": [400, 500], "values": [0]}, "scene.materials.paint.reflectance.values", "as many as"),
    ("scene.materials.paint.reflectance", {"wavelength_nm": [400], "values": ["x"]}, "scene.materials.paint.reflectance.values[0]", "a number"),
    ("scene.materials.paint.reflectance", [0.5], "scene.materials.paint.reflectance", "must be a number from 0 to 1"),
    ("scene.materials.paint.rougness", 0.5, "scene.materials.paint.rougness", "not a known key"),
    ("scene.materials.paint", {"kind": "conductor"}, "scene.materials.paint", "needs metal"),
    ("scene.materials.paint", {"kind": "conductor", "metal": "gol"}, "scene.materials.paint.metal", "did you mean 'gold'"),
    ("scene.materials.paint", {"kind": "emissive"}, "scene.materials.paint", "radiance_w_sr_m2_nm or luminance_cd_m2"),
    ("scene.materials.paint", {"kind": "emissive", "luminance_cd_m2": 5}, "scene.materials.paint.spd", "is missing"),
    # lights
    ("scene.lights", [], "scene.lights", "nothing would be lit"),
    (f"{LIGHT}.kind", "constant", "scene.lights[0].kind", "constant_environment"),
    (f"{LIGHT}.luminance_cd_m2", -5, "scene.lights[0].luminance_cd_m2", "must be >= 0"),
    (f"{LIGHT}.luminance_cd_m2", None, "scene.lights[0]", "radiance_w_sr_m2_nm, luminance_cd_m2 or illuminance_lux"),
    (f"{LIGHT}.illuminance_lux", 5, "scene.lights[0].illuminance_lux", "exactly one"),
    (f"{LIGHT}.spd", None, "scene.lights[0].spd", "is missing"),
    (f"{LIGHT}.spd", "d66", "scene.lights[0].spd", "did you mean 'D65'"),
    (f"{LIGHT}.spd", "blackbody:0K", "scene.lights[0].spd", "500"),
    (f"{LIGHT}.spd", {"wavelength_nm": [400, 500], "values": [1, -1]}, "scene.lights[0].spd", "-1 at 500 nm"),
    (f"{LIGHT}.spd", {"wavelength_nm": [900, 950], "values": [1, 1]}, "scene.lights[0].spd", "no luminance"),
    (f"{LIGHT}.group", "Sky", "scene.lights[0].group", "lower-case"),
    (LIGHT, {"name": "s", "kind": "spot", "position_m": [0, 0, 1], "direction": [0, 0, -1], "beam_deg": 40, "cutoff_deg": 30, "intensity_w_sr_nm": 1}, "scene.lights[0].beam_deg", "must be < cutoff_deg"),
    (LIGHT, {"name": "s", "kind": "point", "position_m": [0, 0, 1], "intensity_w_sr_nm": 1, "spd": "d65"}, "scene.lights[0].spd", "holds the spectrum already"),
    (LIGHT, {"name": "s", "kind": "sun_sky"}, "scene.lights[0]", "where the sun is"),
    (LIGHT, {"name": "s", "kind": "sun_sky", "sun_elevation_deg": -19, "sun_azimuth_deg": 0}, "scene.lights[0].sun_elevation_deg", "must be >= -18"),
    (LIGHT, {"name": "s", "kind": "sun_sky", "time_utc": "2024-06-21T00:00:00Z", "latitude_deg": 40, "longitude_deg": 0}, "scene.lights[0].time_utc", "below the horizon"),
    (LIGHT, {"name": "s", "kind": "sun_sky", "time_utc": "noon", "latitude_deg": 50, "longitude_deg": 0}, "scene.lights[0].time_utc", "must be a time"),
    (LIGHT, {"name": "s", "kind": "image_environment", "file": "sky.exr", "radiance_w_sr_m2_nm": 1}, "scene.lights[0].file", "no folder"),
    # cameras
    ("cameras", [], "cameras", "at least 1"),
    ("cameras[0].pose.target_m", [0, -1, 0.1], "cameras[0].pose.target_m", "must differ"),
    ("cameras[0].pose.up", [0, 1, 0], "cameras[0].pose.up", "parallel"),
    ("cameras[0].pose.target_m", None, "cameras[0].pose", "is incomplete"),
    ("cameras[0].pose.origin_m", [0, -1], "cameras[0].pose.origin_m", "list of 3 numbers"),
    ("cameras[0].pose.origin_m[1]", "-inf", "cameras[0].pose.origin_m[1]", "must be a number"),
    ("cameras[0].pose", {"matrix": [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}, "cameras[0].pose.matrix", "not a rotation"),
    ("cameras[0].lens.f_number", -2.0, "cameras[0].lens.f_number", "is -2.0; must be > 0"),
    ("cameras[0].lens.f_nubmer", 2.0, "cameras[0].lens.f_nubmer", "did you mean f_number"),
    ("cameras[0].lens.hfov_deg", 180, "cameras[0].lens.hfov_deg", "< 170"),
    ("cameras[0].lens.hfov_deg", None, "cameras[0].lens", "exactly one"),
    ("cameras[0].lens.focal_length_m", 0.05, "cameras[0].lens.hfov_deg", "exactly one"),
    ("cameras[0].lens", {"f_number": 2, "focal_length_m": 0.05, "focus_distance_m": 0.04}, "cameras[0].lens.focus_distance_m", "must be > the focal length"),
    ("cameras[0].lens", {"kind": "thin_lens", "f_number": 2, "focal_length_m": 2.0}, "cameras[0].lens.focus_distance_m", "not beyond"),
    ("cameras[0].lens.transmittance", 2, "cameras[0].lens.transmittance", "must be >= 0 and <= 1"),
    ("cameras[0].sensors", [], "cameras[0].sensors", "at least 1"),
    ("cameras[0].sensors[0].model", "imx364", "cameras[0].sensors[0].model", "did you mean 'imx363'"),
    ("cameras[0].sensors[0].read_noise_e", -1, "cameras[0].sensors[0].read_noise_e", "must be >= 0"),
    ("cameras[0].sensors[0].rows", 10**9, "cameras[0].sensors[0].rows", "<= 20000"),
    ("cameras[0].sensors[0].exposure", {}, "cameras[0].sensors[0].exposure", "exactly one"),
    ("cameras[0].sensors[0].exposure.time_s", 0, "cameras[0].sensors[0].exposure.time_s", "must be > 0"),
    ("cameras[0].sensors[0].exposure", {"auto": {"method": "ful"}}, "cameras[0].sensors[0].exposure.auto.method", "Did you mean full"),
    # the camera inside an object
    ("cameras[0].pose.origin_m", [0, 0.05, 0.1], "cameras[0].pose", "inside the opaque object 'ball'"),
    (f"{BALL}.geometry", {"kind": "cube", "size_m": [4, 4, 4]}, "cameras[0].pose", "inside_ok"),
    (f"{BALL}.geometry", TETRAHEDRON | {"vertices_m": [[-3, -3, -3], [9, -3, -3], [-3, 9, -3], [-3, -3, 9]]}, "cameras[0].pose", "inside"),
    # variation
    ("vary", {"grid": {"seed": []}}, "vary.grid.seed", "at least 1"),
    ("vary", {"grid": {"a..b": [1]}}, 'vary.grid."a..b"', "not a path"),
    ("vary", {"grid": {"vary.repeat": [1]}}, 'vary.grid."vary.repeat"', "no place to vary"),
    ("vary", {"repeat": 2_000_000}, "vary", "<= 1000000"),
    ("vary", {"grid": {"cameras[0].lens.f_numbr": [1]}}, "cameras[0].lens.f_numbr", "did you mean f_number"),
    ("vary", {"grid": {"cameras[0].lens.f_number": [1, 2, -1]}}, "cameras[0].lens.f_number", "vary.grid"),
    ("vary", {"grid": {"scene.materials.paint.reflectance": [0.5, "gray"]}}, "scene.materials.paint.reflectance", "[1] sets"),
    ("vary", {"random": {"frames": 2, "values": {"seed": {"distribution": "unifrom"}}}}, "vary.random.values.seed.distribution", "Did you mean uniform"),
    ("vary", {"random": {"frames": 2, "values": {"cameras[0].lens.f_number": {"distribution": "uniform", "low": -1, "high": 2}}}}, "cameras[0].lens.f_number", "vary sets"),
    ("vary", {"random": {"frames": 2, "values": {"seed": {"distribution": "integer", "low": 3, "high": 2}}}}, "vary.random.values.seed.low", "<= high"),
]  # fmt: skip


@pytest.mark.parametrize(("where", "given", "path", "words"), CASES, ids=[f"{c[0]}={str(c[1])[:40]}" for c in CASES])
def test_nonsense_gives_one_clear_error_with_its_path(
    recipe: dict[str, Any], where: str, given: Any, path: str, words: str
) -> None:
    apply_override(recipe, where, given)
    if not path:
        validate(load_recipe(recipe))
        return
    started = time.perf_counter()
    with pytest.raises(RecipeError) as caught:
        validate(load_recipe(recipe))
    assert time.perf_counter() - started < HANGING_S
    assert caught.value.path == path
    assert words in caught.value.message
    assert path.split(".", maxsplit=1)[0] in caught.value.message
    copy = pickle.loads(pickle.dumps(caught.value))
    assert (type(copy), copy.message, copy.path, copy.errors) == (RecipeError, caught.value.message, path, caught.value.errors)


def test_a_thousand_million_pixels_are_refused_at_once(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["sensors"][0] |= {"rows": 20_000, "cols": 20_000}
    with pytest.raises(RecipeError, match=r"must be <= 6\.4e"):
        validate(load_recipe(recipe))


def test_more_radiance_than_memory_is_refused(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["sensors"][0] |= {"rows": 6000, "cols": 8000}
    recipe["spectral"] = {"first_nm": 400, "last_nm": 700, "step_nm": 5}
    with pytest.raises(RecipeError, match="GiB"):
        validate(load_recipe(recipe))


def test_oversampling_counts_into_the_film(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["sensors"][0] |= {"rows": 2000, "cols": 3000}
    recipe["quality"]["oversampling"] = 4
    with pytest.raises(RecipeError, match="oversampling 4"):
        validate(load_recipe(recipe))


def test_an_empty_scene_is_refused(recipe: dict[str, Any]) -> None:
    point = {"name": "p", "kind": "point", "position_m": [0, 0, 1], "intensity_w_sr_nm": 1}
    recipe["scene"] = {"lights": [point]}
    with pytest.raises(RecipeError, match="nothing can be seen"):
        validate(load_recipe(recipe))


def test_two_skies_are_refused(recipe: dict[str, Any]) -> None:
    recipe["scene"]["lights"].append({"name": "sky2", "kind": "constant_environment", "radiance_w_sr_m2_nm": 1})
    with pytest.raises(RecipeError, match=r"scene\.lights\[1\] is an environment"):
        validate(load_recipe(recipe))


def test_a_sky_model_beyond_its_table_is_refused(recipe: dict[str, Any]) -> None:
    recipe["scene"]["lights"] = [{"name": "sun", "kind": "sun_sky", "sun_elevation_deg": 30, "sun_azimuth_deg": 180}]
    validate(load_recipe(recipe))
    recipe["spectral"] = {"last_nm": 1000}
    validate(load_recipe(recipe))
    recipe["spectral"] = {"first_nm": 400, "last_nm": 1000, "step_nm": 100}
    with pytest.raises(RecipeError, match=r"spectral\.step_nm is 100.* cover 350 to 1050 nm.* to 1040 nm"):
        validate(load_recipe(recipe))


def test_several_problems_are_all_listed(recipe: dict[str, Any]) -> None:
    recipe["seed"] = -1
    recipe["cameras"][0]["lens"]["f_number"] = 0
    with pytest.raises(RecipeError) as caught:
        load_recipe(recipe)
    assert [problem.path for problem in caught.value.errors] == ["seed", "cameras[0].lens.f_number"]


@pytest.mark.parametrize(
    "allowed",
    [
        {"inside_ok": True},
        {"material": {"kind": "dielectric"}},
        {"material": {"kind": "emissive", "radiance_w_sr_m2_nm": 1}},
        {"geometry": {"kind": "cylinder", "radius_m": 4, "height_m": 8}},
        {"geometry": TETRAHEDRON | {"faces": TETRAHEDRON["faces"][:3]}},  # an open room
    ],
)
def test_a_camera_may_be_inside_rooms_domes_glass_and_open_bodies(recipe: dict[str, Any], allowed: dict[str, Any]) -> None:
    recipe["scene"]["objects"][0]["geometry"] = {"kind": "sphere", "radius_m": 4}
    recipe["scene"]["objects"][0] |= allowed
    validate(load_recipe(recipe))
