"""From names and colours of parts to materials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.assets.classes import ASSET_CLASSES
from fullwell.assets.materials.catalogue import asset_material_names
from fullwell.assets.materials.colours import display_srgb, lab_of_srgb
from fullwell.assets.materials.names import has_words, words_of
from fullwell.assets.materials.rule_table import MATERIAL_RULES
from fullwell.assets.materials.rules import choose_material, choose_with_reason, colour_distance, is_paintable
from fullwell.assets.packaged import packaged_model, packaged_model_names
from fullwell.assets.records import MaterialChoice
from fullwell.core.errors import FieldError

Colour = tuple[float, float, float]
GREY: Colour = (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class Surface:
    base_color_srgb: Colour = GREY
    base_color_texture: NDArray[np.uint8] | None = None
    roughness: float = 0.5
    metallic: float = 0.0
    emissive_srgb: Colour | None = None
    material_name: str = ""


TEXTURE = np.full((2, 2, 3), 128, dtype=np.uint8)


def named(part: str, kind: str, colour: Colour = GREY, **more: object) -> str:
    return choose_material(part, kind, Surface(colour, **more)).name  # type: ignore[arg-type]


# Words ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("wheelFrontLeft_02", ("wheel", "front", "left")),
        ("/car/geo/_8_windowMax", ("car", "geo", "window", "max")),
        ("lights.red", ("light", "red")),
        ("GLASS-Rear", ("glass", "rear")),
        ("LEDLamp", ("led", "lamp")),
        ("Körper", ("körper",)),
        ("", ()),
    ],
)
def test_names_are_split_at_case_digits_and_punctuation(name: str, words: tuple[str, ...]) -> None:
    assert words_of(name) == words


def test_glued_words_count_where_they_are_long() -> None:
    assert has_words(words_of("frontwindow"), "window")
    assert has_words(words_of("wheelfl"), "wheel")
    assert not has_words(words_of("entire"), "tire")
    assert not has_words(words_of("template"), "plate")
    assert has_words(words_of("rear_light_left"), "light rear")
    assert not has_words(words_of("rear_left"), "light rear")


# The table -----------------------------------------------------------------------------------------------------------


def test_rules_name_materials_and_classes_that_exist() -> None:
    groups = {entry.group for entry in ASSET_CLASSES.values()}
    for rule in MATERIAL_RULES:
        assert rule.materials
        assert set(rule.materials) <= set(asset_material_names())
        assert set(rule.classes) <= set(ASSET_CLASSES) | groups
        assert rule.reason.endswith(".")
        assert rule.words or rule.classes
        assert all(entry == entry.strip() and entry for entry in (*rule.words, *rule.without))


def test_no_rule_is_hidden_by_its_own_exceptions() -> None:
    for rule in MATERIAL_RULES:
        for wanted in rule.words:
            assert not any(has_words(words_of(wanted), unwanted) for unwanted in rule.without), (wanted, rule.reason)


# Choices -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "kind", "colour", "expected"),
    [
        ("tyre_front_left", "car", (0.1, 0.1, 0.1), "rubber/tyre"),
        ("Tires", "lorry", (0.15, 0.15, 0.15), "rubber/tyre"),
        ("wheel_front_left", "car", (0.1, 0.1, 0.1), "rubber/tyre"),
        ("/car/wheel1/geo/_2_greyLightMax", "car", (0.7, 0.7, 0.7), "metal/rim_alloy"),
        ("windscreen", "car", (0.2, 0.3, 0.4), "glass/tinted"),
        ("window_front", "bus", GREY, "glass/tinted"),
        ("window_frame_left", "bus", (0.05, 0.05, 0.05), "paint/black"),
        ("headlight_left", "car", (0.9, 0.9, 0.9), "lamp/headlight_led"),
        ("taillight_left", "car", (0.8, 0.1, 0.1), "lamp/tail"),
        ("brakelight_left", "car", (0.8, 0.1, 0.1), "lamp/brake"),
        ("indicator_front_left", "car", (0.9, 0.5, 0.1), "lamp/indicator"),
        ("lights.red", "car", (0.9, 0.1, 0.1), "lamp/tail"),
        ("lights", "car", (0.82, 0.82, 0.74), "lamp/headlight_led"),
        ("plate_rear", "car", (0.9, 0.9, 0.9), "sign/white"),
        ("numberplate", "car", (0.9, 0.8, 0.1), "sign/yellow"),
        ("chrome_strip", "car", (0.8, 0.8, 0.8), "metal/chrome"),
        ("bumper_front", "car", (0.1, 0.1, 0.1), "plastic/black"),
        ("trunk", "tree", (0.4, 0.35, 0.3), "bark/oak"),
        ("leaves_3", "tree", (0.6, 0.42, 0.2), "foliage/autumn"),
        ("hedge_left", "bush", (0.2, 0.3, 0.1), "foliage/hedge"),
        ("needles", "tree", (0.1, 0.3, 0.1), "foliage/conifer"),
        ("roof_main", "building", (0.55, 0.3, 0.2), "roof/tile_red"),
        ("wall_south", "building", (0.95, 0.95, 0.92), "plaster/white"),
        ("window_2_3", "building", GREY, "glass/window"),
        ("road_surface", "road", (0.3, 0.3, 0.3), "asphalt/new"),
        ("kerb", "road", (0.7, 0.69, 0.65), "concrete/light"),
        ("pole", "street_light", (0.55, 0.54, 0.52), "metal/steel_galvanised"),
        ("lamp_lens", "street_light", (0.9, 0.9, 0.9), "lamp/street_led"),
        ("light_red", "traffic_light", (0.8, 0.1, 0.1), "lamp/traffic_red"),
        ("Green", "traffic_light", (0.27, 0.89, 0.15), "lamp/traffic_green"),
        ("face", "traffic_sign", (0.8, 0.1, 0.1), "sign/red"),
        ("face", "pedestrian", (0.85, 0.68, 0.58), "skin/light"),
        ("hair", "pedestrian", (0.1, 0.08, 0.06), "hair/black"),
        ("jacket", "pedestrian", (0.1, 0.1, 0.3), "cloth/navy"),
        ("cone_body", "cone", (0.95, 0.4, 0.1), "plastic/orange"),
        ("rusty_barrel", "clutter", (0.5, 0.3, 0.2), "metal/rust"),
    ],
)
def test_a_part_is_made_of_what_its_name_says(part: str, kind: str, colour: Colour, expected: str) -> None:
    choice, reason = choose_with_reason(part, kind, Surface(colour))
    assert choice.name == expected, reason
    assert choice.origin == "rule"
    assert choice.base_color_srgb == colour


@pytest.mark.parametrize(
    ("colour", "paint"),
    [
        ((1.0, 1.0, 1.0), "white"), ((0.0, 0.0, 0.0), "black"), ((0.35, 0.36, 0.38), "grey"), ((0.7, 0.71, 0.72), "silver"),
        ((1.0, 0.0, 0.0), "red"), ((0.72, 0.22, 0.23), "red"), ((0.0, 0.0, 1.0), "blue"), ((0.22, 0.25, 0.72), "blue"),
        ((0.0, 1.0, 0.0), "green"), ((0.1, 0.4, 0.2), "green"), ((1.0, 1.0, 0.0), "yellow"), ((0.86, 0.75, 0.18), "yellow"),
        ((1.0, 0.45, 0.0), "orange"), ((0.35, 0.2, 0.15), "brown"), ((0.75, 0.68, 0.52), "beige"),
    ],
)  # fmt: skip
def test_a_body_has_the_paint_of_its_colour(colour: Colour, paint: str) -> None:
    assert named("body", "car", colour) == f"paint/{paint}"


def test_a_body_in_the_colour_of_a_paint_has_that_paint() -> None:
    from fullwell.assets.materials.catalogue import asset_materials

    for name, material in asset_materials().items():
        if name.startswith("paint/"):
            assert named("bodywork", "van", display_srgb(material)) == name


def test_the_name_of_the_files_material_is_looked_at_too() -> None:
    assert named("Object_12", "car", material_name="Tyre_Mat") == "rubber/tyre"


def test_a_words_rule_goes_before_the_class_alone() -> None:
    # The last group says nothing; the whole name says wheel; the class alone would say paint.
    assert named("/van/wheel2/mesh_1", "van", (0.12, 0.12, 0.12)) == "rubber/tyre"


def test_a_texture_stays_unless_the_part_is_one_material_for_sure() -> None:
    choice, reason = choose_with_reason("body", "car", Surface(base_color_texture=TEXTURE))
    assert (choice.origin, choice.name) == ("texture", "")
    assert "made up" in reason
    assert named("tyre", "car", base_color_texture=TEXTURE) == "rubber/tyre"
    assert named("windscreen", "car", base_color_texture=TEXTURE) == "glass/tinted"


def test_what_no_rule_knows_is_upsampled_and_says_so() -> None:
    choice, reason = choose_with_reason("Object_3", "other", Surface((0.3, 0.6, 0.9), roughness=0.2, metallic=0.4))
    assert choice == MaterialChoice("upsampled", "", (0.3, 0.6, 0.9), 0.2, 0.4)
    assert "made up" in reason


def test_a_colour_that_the_class_does_not_have_is_upsampled() -> None:
    assert choose_material("Object_1", "tree", Surface((0.1, 0.1, 0.9))).origin == "upsampled"
    assert choose_material("Object_1", "tree", Surface((0.25, 0.35, 0.2))).name.startswith("foliage/")


def test_a_lit_part_is_a_lamp() -> None:
    assert named("Object_5", "car", emissive_srgb=(1.0, 0.05, 0.05)) == "lamp/tail"
    assert named("Object_5", "car", (0.9, 0.9, 0.9), emissive_srgb=(0.0, 0.0, 0.0)) == "paint/white"
    assert named("window_4", "building", emissive_srgb=(1.0, 0.7, 0.35)) == "lamp/window_warm"


def test_a_metallic_part_of_furniture_is_metal() -> None:
    assert named("Object_1", "bench", (0.95, 0.78, 0.7), metallic=1.0) == "metal/copper"


@pytest.mark.parametrize("kind", ASSET_CLASSES)
def test_every_class_gets_an_answer_for_odd_names(kind: str) -> None:
    for part in ("", "/", "mesh_0", "Ünïcödé", "a" * 500, "wheel window light body leaf red"):
        choice, reason = choose_with_reason(part, kind, Surface())
        assert choice.origin in ("rule", "upsampled")
        assert reason.endswith(".")


def test_an_unknown_class_is_refused() -> None:
    with pytest.raises(FieldError, match="asset class"):
        choose_material("body", "cra", Surface())


def test_hue_counts_more_than_lightness() -> None:
    green, dark_green, yellow = (lab_of_srgb(colour) for colour in ((0, 1, 0), (0, 0.3, 0.15), (0.9, 0.8, 0.0)))
    assert colour_distance(green, dark_green) < colour_distance(green, yellow)
    assert colour_distance(green, green) == pytest.approx(0.0)
    assert colour_distance(green, yellow) == pytest.approx(colour_distance(yellow, green))


# Painting ------------------------------------------------------------------------------------------------------------


def test_the_painted_body_may_be_painted_anew_and_nothing_else() -> None:
    def paintable(part: str, kind: str, colour: Colour) -> bool:
        return is_paintable(part, kind, choose_material(part, kind, Surface(colour)))

    assert paintable("body", "car", (0.5, 0.5, 0.5))
    assert paintable("bodyColor", "tram", (0.86, 0.75, 0.18))
    assert paintable("_7_redMax", "car", (0.72, 0.22, 0.23))
    assert not paintable("_9_greyLightMax", "car", (0.65, 0.65, 0.65))
    assert not paintable("_3_redMax", "emergency_vehicle", (0.72, 0.22, 0.23))
    assert not paintable("tyre", "car", (0.1, 0.1, 0.1))
    assert not paintable("wall", "building", (0.9, 0.2, 0.2))


# Models of an installed package --------------------------------------------------------------------------------------


@pytest.mark.skipif(not packaged_model_names(), reason="needs eclipse-sumo")
def test_cars_that_the_sumo_package_ships_need_no_fallback() -> None:
    from fullwell.assets.meshes import load_model

    model = load_model(packaged_model("sumo:car-normal-citrus").path)
    chosen = {part.name: choose_material(part.name, "car", part).name for part in model.parts}
    assert chosen["carmaterial_citrus"] == "paint/yellow"
    assert chosen["windows"] == "glass/tinted"
    assert chosen["tires"] == "rubber/tyre"
    assert all(chosen.values())
