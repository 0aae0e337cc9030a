"""How much work a recipe asks of the renderer, and which light groups it weights."""

from __future__ import annotations

from typing import Any

import pytest

from fullwell.schema import RecipeError, build_frame, load_recipe


def quality_of(recipe: dict[str, Any], quality: dict[str, Any] | None) -> Any:
    changed = dict(recipe)
    if quality is None:
        changed.pop("quality")
    else:
        changed["quality"] = quality
    return build_frame(load_recipe(changed)).quality


@pytest.mark.parametrize("quality", [None, {}, {"max_depth": 8}, {"max_samples_per_pixel": 4096}])
def test_without_a_word_the_error_is_half_of_the_sensors_noise(recipe: dict[str, Any], quality: dict[str, Any] | None) -> None:
    found = quality_of(recipe, quality)
    assert (found.noise_ratio, found.samples_per_pixel, found.max_samples_per_pixel) == (0.5, None, 4096)


def test_equal_samples_are_not_adaptive(recipe: dict[str, Any]) -> None:
    found = quality_of(recipe, {"samples_per_pixel": 32})
    assert (found.noise_ratio, found.samples_per_pixel) == (None, 32)


def test_all_of_the_quality_reaches_the_frame(recipe: dict[str, Any]) -> None:
    asked = {
        "noise_ratio": 0.25,
        "max_samples_per_pixel": 64,
        "time_limit_s": 10.0,
        "max_sample_saturation": 4.0,
        "max_depth": 3,
    }
    found = quality_of(recipe, asked)
    assert {name: getattr(found, name) for name in asked} == asked


def test_an_override_of_one_way_needs_the_other_taken_back(recipe: dict[str, Any]) -> None:
    adaptive = recipe | {"quality": {"noise_ratio": 1.0}}
    with pytest.raises(RecipeError, match="either equal everywhere or follow the noise"):
        load_recipe(adaptive, overrides={"quality.samples_per_pixel": "4"})
    both = {"quality.samples_per_pixel": "4", "quality.noise_ratio": "null"}
    assert load_recipe(adaptive, overrides=both).quality.samples_per_pixel == 4


def test_weights_of_light_groups_reach_the_frame_in_order(recipe: dict[str, Any]) -> None:
    sky = recipe["scene"]["lights"][0]
    recipe["scene"]["lights"].append(sky | {"name": "lamp", "kind": "point", "group": "lamps", "position_m": [0, 0, 2]})
    del recipe["scene"]["lights"][1]["luminance_cd_m2"]
    recipe["scene"]["lights"][1]["luminous_intensity_cd"] = 10.0
    recipe["scene"]["light_groups"] = {"lamps": 0.5, "default": 2}
    frame = build_frame(load_recipe(recipe))
    assert frame.group_weights == (("default", 2.0), ("lamps", 0.5))
    assert frame.views == ()


def test_an_unknown_light_group_is_answered_with_the_nearest(recipe: dict[str, Any]) -> None:
    recipe["scene"]["lights"][0]["group"] = "daylight"
    recipe["scene"]["light_groups"] = {"daylihgt": 0.5}
    with pytest.raises(RecipeError, match="did you mean 'daylight'"):
        build_frame(load_recipe(recipe))
