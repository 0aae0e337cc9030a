"""How one recipe becomes many frames; overrides and paths."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fullwell.core import FieldError, digest_of
from fullwell.schema import RecipeBuilder, RecipeError, apply_override, build_frame, load_recipe
from fullwell.schema.paths import format_path, parse_path
from fullwell.schema.variation import frame_values

F_NUMBER = "cameras[front].lens.f_number"
HEIGHT = "scene.objects[ball].transform.translate_m[2]"


def test_a_grid_makes_every_combination_with_the_last_entry_fastest(recipe: dict[str, Any]) -> None:
    recipe["vary"] = {"grid": {F_NUMBER: [1, 2], "seed": [7, 8, 9]}}
    document = load_recipe(recipe)
    frames = [tuple(frame_values(document, index).values()) for index in range(document.frame_count())]
    assert frames == [(1, 7), (1, 8), (1, 9), (2, 7), (2, 8), (2, 9)]


def test_a_frame_holds_what_was_varied_and_a_recipe_without_vary(recipe: dict[str, Any]) -> None:
    recipe["vary"] = {"grid": {F_NUMBER: [1, 2.5]}}
    frame = build_frame(load_recipe(recipe), 1)
    assert frame.varied == ((F_NUMBER, 2.5),)
    assert (frame.index, frame.count) == (1, 2)
    assert frame.cameras[0].camera.lens.f_number == 2.5
    again = load_recipe(frame.recipe_json)
    assert again.vary is None
    assert again.canonical_json() == frame.recipe_json


def test_random_draws_do_not_depend_on_how_many_frames_there_are_nor_on_the_grid(recipe: dict[str, Any]) -> None:
    values = {HEIGHT: {"distribution": "uniform", "low": 0, "high": 1}}
    few = load_recipe(recipe | {"vary": {"random": {"frames": 3, "values": values}}})
    more = values | {F_NUMBER: {"distribution": "choice", "values": [1, 2]}}
    many = load_recipe(recipe | {"vary": {"grid": {"seed": [3]}, "random": {"frames": 100, "values": more}}})
    drawn = [frame_values(few, index)[HEIGHT] for index in range(3)]
    assert drawn == [frame_values(many, index)[HEIGHT] for index in range(3)]
    assert len(set(drawn)) == 3


def test_the_random_draws_of_every_grid_point_are_the_same(recipe: dict[str, Any]) -> None:
    values = {HEIGHT: {"distribution": "uniform", "low": 0, "high": 1}}
    recipe["vary"] = {"grid": {F_NUMBER: [1, 2]}, "random": {"frames": 3, "values": values}}
    document = load_recipe(recipe)
    drawn = [frame_values(document, index)[HEIGHT] for index in range(6)]
    assert drawn[:3] == drawn[3:]


def test_frames_are_the_same_in_any_order(recipe: dict[str, Any]) -> None:
    values = {HEIGHT: {"distribution": "normal", "mean": 0.2, "standard_deviation": 0.05}}
    recipe["vary"] = {"random": {"frames": 4, "values": values}}
    builder = RecipeBuilder(load_recipe(recipe))
    forwards = [digest_of(builder.frame(index)) for index in range(4)]
    backwards = [digest_of(build_frame(load_recipe(recipe), index)) for index in reversed(range(4))]
    assert forwards == backwards[::-1]
    assert len(set(forwards)) == 4


def test_another_seed_gives_other_draws(recipe: dict[str, Any]) -> None:
    values = {HEIGHT: {"distribution": "uniform", "low": 0, "high": 1}}
    recipe["vary"] = {"random": {"frames": 1, "values": values}}
    assert frame_values(load_recipe(recipe), 0) != frame_values(load_recipe(recipe | {"seed": 4}), 0)


def test_repeat_changes_only_the_index(recipe: dict[str, Any]) -> None:
    recipe["vary"] = {"repeat": 3}
    document = load_recipe(recipe)
    frames = [build_frame(document, index) for index in range(3)]
    assert [frame.index for frame in frames] == [0, 1, 2]
    assert len({frame.recipe_json for frame in frames}) == 1


@pytest.mark.parametrize(
    ("distribution", "low", "high"),
    [
        ({"distribution": "uniform", "low": -2, "high": 3}, -2, 3),
        ({"distribution": "log_uniform", "low": 0.1, "high": 10}, 0.1, 10),
        ({"distribution": "integer", "low": 2, "high": 4}, 2, 4),
        ({"distribution": "normal", "mean": 1, "standard_deviation": 2, "low": 0, "high": 2}, 0, 2),
        ({"distribution": "choice", "values": [1, 2, 3], "weights": [1, 1, 0]}, 1, 2),
    ],
)
def test_draws_fill_their_range_and_stay_within_it(
    recipe: dict[str, Any], distribution: dict[str, Any], low: float, high: float
) -> None:
    recipe["vary"] = {"random": {"frames": 300, "values": {"seed": distribution}}}
    document = load_recipe(recipe)
    drawn = [frame_values(document, index)["seed"] for index in range(300)]
    assert low <= min(drawn) < low + 0.1 * (high - low) + 0.02
    assert high >= max(drawn) > high - 0.1 * (high - low) - 0.02


def test_the_logarithm_of_a_log_uniform_draw_is_uniform(recipe: dict[str, Any]) -> None:
    distribution = {"distribution": "log_uniform", "low": 0.01, "high": 100}
    recipe["vary"] = {"random": {"frames": 1000, "values": {"seed": distribution}}}
    document = load_recipe(recipe)
    below_one = sum(frame_values(document, index)["seed"] < 1 for index in range(1000))
    assert abs(below_one - 500) < 5 * 16  # five standard deviations of a fair coin


def test_a_frame_that_does_not_exist_is_refused(recipe: dict[str, Any]) -> None:
    with pytest.raises(FieldError, match=r"frame 1 does not exist"):
        build_frame(load_recipe(recipe), 1)


def test_whole_sections_can_be_varied(recipe: dict[str, Any]) -> None:
    recipe["vary"] = {"grid": {"cameras[0].sensors[0].exposure": [{"time_s": 1}, {"auto": {"level": 0.5}}]}}
    frame = build_frame(load_recipe(recipe), 1)
    assert frame.cameras[0].sensors[0].exposure.level == 0.5  # type: ignore[union-attr]
    assert frame.varied == (("cameras[0].sensors[0].exposure", '{"auto":{"level":0.5}}'),)


# Overrides -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "text", "reached"),
    [
        ("cameras[0].lens.f_number", "4", lambda d: d.cameras[0].lens.f_number == 4.0),
        ("cameras[front].sensors[wide].exposure.time_s", "1e-3", lambda d: d.cameras[0].sensors[0].exposure.time_s == 1e-3),
        ("scene.objects[ball].transform.translate_m[0]", "0.5", lambda d: d.scene.objects[0].transform.translate_m[0] == 0.5),
        ("quality.max_depth", "3", lambda d: d.quality.max_depth == 3),
        ("spectral.step_nm", "5", lambda d: d.spectral.step_nm == 5),
        ("outputs", "[depth.exr]", lambda d: d.outputs == ["depth.exr"]),
        ("scene.objects[ball].class", "null", lambda d: d.scene.objects[0].semantic_class == ""),
        ("name", "other", lambda d: d.name == "other"),
    ],
)
def test_overrides_reach_their_field(recipe: dict[str, Any], path: str, text: str, reached: Any) -> None:
    assert reached(load_recipe(recipe, overrides={path: text}))


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("cameras[1].name", "has 1 items"),
        ("cameras[frnt].name", "did you mean 'front'"),
        ("name.x", "has no parts"),
        ("camera[0].name", "did you mean cameras"),
        ("qualty.max_depth", "did you mean quality"),
        ("", "not a path"),
        ("a[", "not a path"),
    ],
)
def test_overrides_that_lead_nowhere_are_answered(recipe: dict[str, Any], path: str, words: str) -> None:
    with pytest.raises(RecipeError, match=words):
        load_recipe(recipe, overrides={path: 5})


_KEYS = st.text(alphabet="abcxyz_ .-9", min_size=1, max_size=8)


@given(st.lists(_KEYS | st.integers(min_value=0, max_value=99), min_size=1, max_size=5))
def test_paths_survive_being_written_and_read(steps: list[str | int]) -> None:
    written = format_path((f"k{len(steps)}", *steps))
    assert parse_path(written) == (f"k{len(steps)}", *(str(step) for step in steps))


@settings(max_examples=50, deadline=None)
@given(
    radius_m=st.floats(min_value=1e-3, max_value=0.5),
    height_m=st.floats(min_value=-100, max_value=100),
    f_number=st.floats(min_value=0.5, max_value=64),
    seed=st.integers(min_value=0, max_value=2**53),
    reflectance=st.floats(min_value=0, max_value=1),
)
def test_recipes_survive_the_round_trip_through_their_canonical_text(
    radius_m: float, height_m: float, f_number: float, seed: int, reflectance: float
) -> None:
    recipe: dict[str, Any] = {
        "schema": "fullwell/recipe/v1",
        "name": "round trip",
        "seed": seed,
        "scene": {
            "objects": [
                {
                    "id": "ball",
                    "geometry": {"kind": "sphere", "radius_m": radius_m},
                    "material": {"kind": "diffuse", "reflectance": reflectance},
                    "transform": [{"translate_m": [0, 0, height_m]}, {"rotate_deg": [10, 20, 30]}],
                }
            ],
            "lights": [{"name": "sky", "kind": "constant_environment", "radiance_w_sr_m2_nm": 0.01}],
        },
        "cameras": [
            {
                "pose": {"origin_m": [0, -200, 0], "target_m": [0, 0, 0]},
                "lens": {"f_number": f_number, "hfov_deg": 30},
                "sensors": [{"model": "ideal-mono", "rows": 4, "cols": 4, "exposure": {"auto": {}}}],
            }
        ],
    }
    document = load_recipe(recipe)
    again = load_recipe(document.canonical_json())
    assert again == document
    assert digest_of(build_frame(again)) == digest_of(build_frame(document))


def test_apply_override_makes_missing_sections() -> None:
    data: dict[str, Any] = {}
    apply_override(data, "a.b.c", 1)
    assert data == {"a": {"b": {"c": 1}}}
    apply_override(data, "a.b.c", None)
    assert data == {"a": {"b": {}}}
