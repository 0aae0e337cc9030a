"""Recipes draw assets: by conditions, by seed, among pins; with the catalogue's materials and lamps."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_in_memory import MemoryAssets, small_car
from fullwell.assets.model import LoadedPart
from fullwell.radiometry import luminance_cd_m2
from fullwell.scene import Diffuse, Principled, RoughPlastic
from fullwell.schema import RecipeBuilder, RecipeError, build_frame, load_recipe, validate
from fullwell.schema.assets import asks_for_assets, pin_assets
from fullwell.schema.conversion.assets import _one_sided

DRAW: dict[str, Any] = {"kind": "asset", "class": "car"}


def street(*geometries: dict[str, Any], **more: Any) -> dict[str, Any]:
    objects = [{"id": f"car{number}", "geometry": geometry} for number, geometry in enumerate(geometries)]
    return {
        "schema": "fullwell/recipe/v1",
        "name": "street",
        "seed": 3,
        "scene": {
            "objects": objects,
            "lights": [{"kind": "constant_environment", "name": "sky", "luminance_cd_m2": 100, "spd": "d65"}],
        },
        "cameras": [
            {
                "name": "main",
                "pose": {"origin_m": [-12, 3, 2], "target_m": [0, 0, 0.7]},
                "lens": {"hfov_deg": 30, "f_number": 4},
                "sensors": [{"name": "main", "model": "ideal-rgb", "cols": 32, "rows": 24, "exposure": {"time_s": 0.01}}],
            }
        ],
        **more,
    }


@pytest.fixture
def assets(tmp_path: Path) -> MemoryAssets:
    return MemoryAssets(
        small_car("sedan-a"),
        small_car("sedan-b", paint="paint/red", licence="CC-BY-4.0"),
        small_car("suv-a", tags=("suv",), length_m=4.8),
        folder=tmp_path,
    )


def drawn(frame: Any) -> list[str]:
    return [item["geometry"]["id"] for item in json.loads(frame.recipe_json)["scene"]["objects"]]


def test_a_named_asset_brings_class_size_licence_and_materials(assets: MemoryAssets) -> None:
    frame = build_frame(load_recipe(street({"kind": "asset", "id": "sedan-b"})), assets=assets)
    (car,) = frame.scene.objects
    assert car.semantic_class == "car"
    assert car.licences == ("CC-BY-4.0 (Sedan-B, The testers)",)
    parts = {part.name: part for part in car.parts}
    assert isinstance(parts["body"].material, RoughPlastic)  # a paint under its clear coat
    red = parts["body"].material.reflectance
    assert red.at(650.0) > 2 * red.at(500.0)  # type: ignore[union-attr]
    assert isinstance(parts["bumper"].material, Principled)
    assert parts["taillight_left"].emission is None
    assert any("made up" in warning for warning in frame.warnings)


def test_lamps_that_are_lit_emit_what_the_catalogue_says(assets: MemoryAssets) -> None:
    geometry = {"kind": "asset", "id": "sedan-a", "lit": ["taillight_*"]}
    frame = build_frame(load_recipe(street(geometry)), assets=assets)
    (lamp,) = [part for part in frame.scene.objects[0].parts if part.emission is not None]
    assert lamp.name == "taillight_left"
    assert lamp.emission is not None
    assert 10 < luminance_cd_m2(lamp.emission.radiance) < 2000
    with pytest.raises(RecipeError, match=r"lit\[0\] matches no lamp of sedan-a.*taillight_left"):
        build_frame(load_recipe(street(geometry | {"lit": ["taillights"]})), assets=assets)


def test_the_same_seed_draws_the_same_and_ids_draw_for_themselves(assets: MemoryAssets) -> None:
    recipe = street(*[DRAW] * 12)
    first = drawn(build_frame(load_recipe(recipe), assets=assets))
    assert drawn(build_frame(load_recipe(recipe), assets=assets)) == first
    assert len({pin.split("@")[0] for pin in first}) == 3
    assert drawn(build_frame(load_recipe(recipe | {"seed": 4}), assets=assets)) != first
    without = street(*[DRAW] * 12)
    del without["scene"]["objects"][3]
    assert drawn(build_frame(load_recipe(without), assets=assets)) == first[:3] + first[4:]


def test_draws_follow_conditions_and_weights(assets: MemoryAssets) -> None:
    def names(**conditions: Any) -> Counter[str]:
        frame = build_frame(load_recipe(street(*[DRAW | conditions] * 60)), assets=assets)
        return Counter(pin.split("@")[0] for pin in drawn(frame))

    assert set(names(tags=["sedan"])) == {"sedan-a", "sedan-b"}
    assert set(names(without_tags=["sedan"])) == {"suv-a"}
    assert set(names(licence=["cc-by-4.0"])) == {"sedan-b"}
    assert set(names(length_m=[4.7, None])) == {"suv-a"}
    assert set(names(weights={"sedan": 0})) == {"suv-a"}
    assert set(names(weights={"sedan": 0, "suv-a": 5})) == {"suv-a"}
    counts = names(weights={"suv": 8})  # 8 of 10
    assert 36 < counts["suv-a"] < 58
    with pytest.raises(RecipeError, match="weights leave none of the 3 assets"):
        names(weights={"car": 1, "sedan": 0, "suv": 0})


def test_only_approved_assets_are_drawn_unless_the_recipe_says_otherwise(tmp_path: Path) -> None:
    pending = MemoryAssets(small_car("sedan-a"), folder=tmp_path, state="pending")
    with pytest.raises(RecipeError, match=r"scene\.objects\[0\]\.geometry finds no asset \(approved\) with class 'car'"):
        build_frame(load_recipe(street(DRAW)), assets=pending)
    build_frame(load_recipe(street(DRAW | {"state": ["approved", "pending"]})), assets=pending)


def test_a_pinned_recipe_draws_the_same_whatever_the_catalogue_holds_later(assets: MemoryAssets, tmp_path: Path) -> None:
    recipe = load_recipe(street(*[DRAW] * 6, vary={"grid": {"seed": [1, 2]}}))
    assert asks_for_assets(recipe)
    pinned = pin_assets(recipe, assets)
    first = drawn(build_frame(pinned, 1, assets=assets))
    later = MemoryAssets(*assets.prepared.values(), small_car("hatch-a"), small_car("zoe"), folder=tmp_path)
    stored = load_recipe(json.loads(pinned.canonical_json()))  # as a service keeps it
    assert drawn(build_frame(stored, 1, assets=later)) == first
    assert later.searches == 0
    assert pin_assets(pinned, later) is pinned


def test_pins_cover_what_vary_may_ask_for(assets: MemoryAssets, tmp_path: Path) -> None:
    recipe = load_recipe(street(DRAW, vary={"grid": {"scene.objects[0].geometry.tags": [["sedan"], ["suv"]]}}))
    pinned = pin_assets(recipe, assets)
    searches = assets.searches
    assert drawn(build_frame(pinned, 0, assets=assets))[0].startswith("sedan")
    assert drawn(build_frame(pinned, 1, assets=assets))[0].startswith("suv")
    assert assets.searches == searches


def test_a_frames_recipe_names_what_was_drawn_and_makes_the_same_scene(assets: MemoryAssets, tmp_path: Path) -> None:
    frame = build_frame(load_recipe(street(DRAW, DRAW | {"lit": ["taillight_left"]})), assets=assets)
    bare = MemoryAssets(*assets.prepared.values(), folder=tmp_path)
    again = build_frame(load_recipe(json.loads(frame.recipe_json)), assets=bare)
    assert bare.searches == 0
    assert again.recipe_json == frame.recipe_json
    for one, other in zip(frame.scene.objects, again.scene.objects, strict=True):
        np.testing.assert_array_equal(one.parts[0].geometry.vertices_m, other.parts[0].geometry.vertices_m)  # type: ignore[union-attr]


def test_seeds_that_vary_draw_anew_and_sensors_that_vary_do_not(assets: MemoryAssets) -> None:
    builder = RecipeBuilder(load_recipe(street(*[DRAW] * 8, vary={"grid": {"seed": [1, 2, 3]}})), assets=assets)
    assert len({tuple(drawn(builder.frame(index))) for index in range(3)}) == 3
    times = {"cameras[0].sensors[0].exposure.time_s": [0.01, 0.02]}
    builder = RecipeBuilder(load_recipe(street(*[DRAW] * 8, vary={"grid": times})), assets=assets)
    assert builder.frame(0).scene is builder.frame(1).scene


def test_catalogued_materials_have_names_that_every_object_may_use(assets: MemoryAssets) -> None:
    recipe = street({"kind": "asset", "id": "sedan-a"})
    recipe["scene"]["objects"][0]["materials"] = {"body": "paint/green"}
    recipe["scene"]["objects"].append({"id": "ground", "geometry": {"kind": "disk", "radius_m": 9}, "material": "asphalt/worn"})
    car, ground = build_frame(load_recipe(recipe), assets=assets).scene.objects
    green = car.parts[0].material.reflectance  # type: ignore[union-attr]
    assert green.at(530.0) > green.at(630.0)
    assert isinstance(ground.parts[0].material, Diffuse | RoughPlastic)
    recipe["scene"]["objects"][1]["material"] = "asphalt/warn"
    with pytest.raises(RecipeError, match=r"objects\[1\]\.material.*asphalt/worn"):
        build_frame(load_recipe(recipe), assets=assets)


@pytest.mark.parametrize(
    ("geometry", "path", "says"),
    [
        ({"id": "sedan-z"}, "scene.objects[0].geometry", "finds no asset"),
        ({"id": "sedan-a@12"}, "scene.objects[0].geometry.id", "64 hexadecimal"),
        ({"id": "sedan-a@" + "0" * 64}, "scene.objects[0].geometry", "no asset with the digest"),
        ({"id": "sedan-a@" + "0" * 64, "tags": ["suv"]}, "scene.objects[0].geometry.tags", "pinned id"),
        ({"class": "cat"}, "scene.objects[0].geometry", "car"),
        ({"class": "car", "tags": ["No Good"]}, "scene.objects[0].geometry", "lower-case"),
        ({"class": "car", "length_m": [5, 4]}, "scene.objects[0].geometry", "must not be above"),
        ({"class": "car", "state": ["fine"]}, "scene.objects[0].geometry.state[0]", "approved"),
        ({"class": "car", "level": -1}, "scene.objects[0].geometry.level", ">= 0"),
        ({"class": "car", "weights": {"suv": -1}}, "scene.objects[0].geometry.weights", ">= 0"),
    ],
)
def test_nonsense_is_refused_with_its_path(assets: MemoryAssets, geometry: dict[str, Any], path: str, says: str) -> None:
    with pytest.raises(RecipeError, match=says) as caught:
        validate(load_recipe(street({"kind": "asset"} | geometry)), assets=assets)
    assert caught.value.path.startswith(path)


def test_without_a_store_the_error_says_what_is_missing() -> None:
    with pytest.raises(RecipeError, match="no asset store is at hand"):
        build_frame(load_recipe(street(DRAW)))


def test_an_unpinned_draw_where_nothing_can_be_searched_is_refused(assets: MemoryAssets) -> None:
    class Stored:
        manifest, level_file = assets.manifest, assets.level_file

    with pytest.raises(RecipeError, match="holds no pins and no catalogue"):
        build_frame(load_recipe(street(DRAW)), assets=Stored())
    build_frame(pin_assets(load_recipe(street(DRAW)), assets), assets=Stored())


def test_a_lamp_that_was_flattened_keeps_its_outer_side(tmp_path: Path) -> None:
    flat = np.array([[-2.0, 0, 1], [-2.0, 1, 1], [-2.0, 0, 2], [-1.0, 0, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 1], [0, 1, 3]], dtype=np.uint32)
    both = LoadedPart("taillight_left", flat, faces, None, None, (1.0, 0.0, 0.0), None, 0.5, 0.0, None, True)
    kept = _one_sided(both)
    # Of the pair the triangle that faces -x, away from the middle of the car; the third has no twin.
    assert kept.faces.tolist() == [[0, 2, 1], [0, 1, 3]]
    assert _one_sided(kept) is kept
