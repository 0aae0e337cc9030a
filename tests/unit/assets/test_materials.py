"""The catalogue of materials: names, domain, bounds, and anchors from publications."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fullwell.assets.materials.catalogue import asset_material, asset_material_names, asset_materials
from fullwell.assets.materials.colours import seen_spectrum
from fullwell.assets.materials.curves import DOMAIN_NM, WAVELENGTH_NM
from fullwell.core.errors import FieldError
from fullwell.radiometry.illuminants import illuminant
from fullwell.radiometry.metals import normal_reflectance
from fullwell.radiometry.photometry import chromaticity, luminance_cd_m2, scale_to_luminance, tristimulus

NAMES = asset_material_names()
STEEPEST_PER_NM = 0.022
"""Dyes and chlorophyll take at least 40 nm from dark to bright; a typing error in a table is steeper."""

STARTER_NAMES = """
paint: white black grey silver red blue brown green yellow orange beige
coating: white black grey green red yellow blue orange
plastic: black grey white red green blue yellow orange
rubber: tyre
metal: chrome aluminium rim_alloy steel_galvanised steel_brushed copper brass cast_iron rust
mirror: silver
glass: tinted window clear
asphalt: new worn wet
concrete: light grey
brick: red yellow dark
plaster: white cream ochre grey rose
stone: sandstone granite limestone
roof: tile_red tile_dark slate metal
wood: oak pine painted_white weathered
bark: oak birch pine
foliage: broadleaf birch conifer hedge dry autumn
grass: green dry meadow
soil: earth
skin: light medium dark deep
hair: black brown blond grey
fur: deer dog_brown dog_black white
cloth: white black grey navy denim red green yellow beige brown hi_vis_yellow hi_vis_orange
leather: black brown
sign: white yellow red blue green black brown
paper: white poster_blue poster_red poster_green poster_yellow
line: white_thermoplastic yellow_thermoplastic
lamp: headlight_led headlight_halogen daytime_running tail brake indicator reverse street_led street_hps street_mh traffic_red
lamp: traffic_amber traffic_green window_warm window_cool shop sign_panel
"""
"""What generators of the starter library ask for."""


def seen(name: str, wavelength_nm: float) -> float:
    return float(seen_spectrum(asset_material(name)).at(wavelength_nm))


def luminance_factor(name: str) -> float:
    light = illuminant("D65")
    return float(tristimulus(light.times(seen_spectrum(asset_material(name))))[1] / tristimulus(light)[1])


def test_every_name_that_generators_use_is_there() -> None:
    wanted = {
        f"{family}/{member}"
        for family, members in (line.split(": ") for line in STARTER_NAMES.strip().splitlines())
        for member in members.split()
    }
    assert wanted <= set(NAMES)


def test_names_are_those_of_the_entries_and_families_stand_together() -> None:
    assert all(name == entry.name for name, entry in asset_materials().items())
    families = [name.partition("/")[0] for name in NAMES]
    changes = sum(first != second for first, second in itertools.pairwise(families))
    assert changes == len(set(families)) - 1


def test_case_and_blanks_do_not_matter() -> None:
    assert asset_material(" Paint/RED ") is asset_material("paint/red")


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="did you mean 'paint/grey'") as caught:
        asset_material("paint/gray", "parts[2].material")
    assert caught.value.path == "parts[2].material"


@pytest.mark.parametrize("name", NAMES)
def test_what_a_kind_needs_is_there_and_names_its_source(name: str) -> None:
    material = asset_material(name)
    has_reflectance = material.kind in ("diffuse", "translucent", "coated", "mirror")
    assert (material.transmittance is not None) == (material.kind == "translucent")
    assert (material.reflectance is not None) == has_reflectance
    assert (material.eta is not None and material.k is not None) == (material.kind == "metal")
    assert 0.0 <= material.roughness <= 1.0
    assert material.kind != "coated" or material.roughness > 0
    assert 1.3 <= material.interior_index <= 1.6
    assert len(material.source) > 10
    assert material.tags
    assert material.title


@pytest.mark.parametrize("name", NAMES)
def test_spectra_cover_the_domain_within_bounds(name: str) -> None:
    material = asset_material(name)
    for curve in (material.reflectance, material.eta, material.k):
        if curve is not None:
            assert curve.wavelength_nm[0] <= DOMAIN_NM[0]
            assert curve.wavelength_nm[-1] >= DOMAIN_NM[1]
            assert not curve.upsampled
    if material.reflectance is not None:
        assert material.reflectance.values.min() >= 0
        assert material.reflectance.values.max() <= 1
    if material.eta is not None and material.k is not None:
        reflected = normal_reflectance(material.eta.at(WAVELENGTH_NM), material.k.at(WAVELENGTH_NM))
        assert reflected.min() > 0.3
        assert reflected.max() < 1


@pytest.mark.parametrize("name", NAMES)
def test_no_spectrum_jumps(name: str) -> None:
    values = seen_spectrum(asset_material(name)).values
    assert np.abs(np.diff(values)).max() / 5.0 < STEEPEST_PER_NM


ANCHORS = [
    # name, wavelength [nm], lowest, highest: as a spectrophotometer sees it, gloss of coats left out.
    ("asphalt/new", 550, 0.04, 0.06),  # Herold et al. 2004
    ("asphalt/worn", 550, 0.10, 0.18),  # Herold et al. 2004
    ("concrete/light", 550, 0.30, 0.40),
    ("concrete/grey", 550, 0.20, 0.30),
    ("brick/red", 550, 0.08, 0.18),  # Meerdink et al. 2019
    ("brick/red", 700, 0.25, 0.45),
    ("foliage/broadleaf", 550, 0.08, 0.15),  # Hosgood et al. 1995 (LOPEX)
    ("foliage/broadleaf", 670, 0.03, 0.06),
    ("foliage/broadleaf", 800, 0.40, 0.55),
    ("foliage/birch", 550, 0.08, 0.15),
    ("foliage/conifer", 800, 0.40, 0.55),
    ("foliage/hedge", 800, 0.40, 0.55),
    ("grass/green", 550, 0.08, 0.15),
    ("grass/green", 800, 0.40, 0.55),
    ("grass/dry", 800, 0.25, 0.50),
    ("skin/light", 450, 0.20, 0.35),  # Cooksey et al. 2017: 100 forearms, the range of all is wider
    ("skin/light", 550, 0.28, 0.42),
    ("skin/light", 650, 0.45, 0.65),
    ("skin/light", 800, 0.50, 0.68),
    ("skin/dark", 550, 0.06, 0.15),
    ("skin/deep", 550, 0.02, 0.08),
    ("skin/deep", 800, 0.15, 0.35),
    ("rubber/tyre", 550, 0.03, 0.05),
    ("soil/earth", 550, 0.08, 0.20),
    ("bark/birch", 550, 0.40, 0.65),
    ("roof/slate", 550, 0.07, 0.14),
    ("line/white_thermoplastic", 550, 0.45, 0.75),
    ("cloth/black", 550, 0.02, 0.06),
]


@pytest.mark.parametrize(("name", "wavelength_nm", "lowest", "highest"), ANCHORS)
def test_reflectance_is_in_the_published_range(name: str, wavelength_nm: float, lowest: float, highest: float) -> None:
    assert lowest <= seen(name, wavelength_nm) <= highest


@pytest.mark.parametrize(
    ("name", "lowest", "highest"),
    [
        ("paint/white", 0.70, 0.86), ("paint/silver", 0.30, 0.50), ("paint/grey", 0.06, 0.14), ("paint/black", 0.0, 0.01),
        ("paint/red", 0.05, 0.12), ("paint/yellow", 0.45, 0.65), ("paint/blue", 0.02, 0.08),
        # EN 12899-1: least luminance factors of sheeting RA2: white 0.27, yellow 0.16, red 0.03, blue 0.01, green 0.03,
        # brown 0.03 to 0.09.
        ("sign/white", 0.27, 0.50), ("sign/yellow", 0.16, 0.40), ("sign/red", 0.03, 0.10), ("sign/blue", 0.01, 0.06),
        ("sign/green", 0.03, 0.10), ("sign/brown", 0.03, 0.09),
    ],
)  # fmt: skip
def test_luminance_factor_is_in_range(name: str, lowest: float, highest: float) -> None:
    assert lowest <= luminance_factor(name) <= highest


@pytest.mark.parametrize("name", ["foliage/broadleaf", "foliage/birch", "foliage/conifer", "foliage/hedge", "grass/green"])
def test_red_edge_is_where_chlorophyll_puts_it(name: str) -> None:
    values = seen_spectrum(asset_material(name)).values
    steepest_nm = WAVELENGTH_NM[:-1][np.argmax(np.diff(values))] + 2.5
    assert 700 <= steepest_nm <= 740
    assert seen(name, 750) > 8 * seen(name, 675)


def test_dead_leaves_have_no_red_edge() -> None:
    assert seen("foliage/dry", 750) < 2 * seen("foliage/dry", 675)


@pytest.mark.parametrize("member", ["black", "navy", "denim", "red", "green", "brown", "grey"])
def test_dyed_cloth_is_bright_in_the_near_infrared(member: str) -> None:
    assert seen(f"cloth/{member}", 850) > 0.4
    assert seen(f"cloth/{member}", 850) > 1.05 * seen(f"cloth/{member}", 650)


def test_carbon_black_stays_dark_in_the_near_infrared() -> None:
    for name in ("rubber/tyre", "plastic/black", "paint/black", "coating/black"):
        assert seen(name, 900) < 0.05


def test_skin_shows_haemoglobin_and_darkens_with_melanin() -> None:
    light = seen_spectrum(asset_material("skin/light"))
    # Two bands of oxygenated haemoglobin with a saddle between them.
    assert light.at(560) > light.at(542)
    assert light.at(560) > light.at(577)
    levels = [luminance_factor(f"skin/{shade}") for shade in ("light", "medium", "dark", "deep")]
    assert levels == sorted(levels, reverse=True)


def test_wet_asphalt_is_darker_than_dry() -> None:
    assert luminance_factor("asphalt/wet") < 0.7 * luminance_factor("asphalt/worn")


def test_only_sign_sheeting_is_retroreflective() -> None:
    assert {entry.name.partition("/")[0] for entry in asset_materials().values() if entry.retroreflective} == {"sign"}


# Lamps ---------------------------------------------------------------------------------------------------------------

LAMPS = [name for name in NAMES if name.startswith("lamp/")]


def test_lamps_and_only_lamps_can_be_lit() -> None:
    assert [name for name, entry in asset_materials().items() if entry.lamp is not None] == LAMPS


@pytest.mark.parametrize("name", LAMPS)
def test_luminance_is_in_its_range_and_the_spectrum_can_be_scaled_to_it(name: str) -> None:
    lamp = asset_material(name).lamp
    assert lamp is not None
    assert lamp.range_cd_m2[0] <= lamp.luminance_cd_m2 <= lamp.range_cd_m2[1]
    assert lamp.group in ("headlights", "streetlights", "other")
    assert lamp.spd.values.min() >= 0
    assert lamp.spd.wavelength_nm[0] <= DOMAIN_NM[0]
    assert lamp.spd.wavelength_nm[-1] >= DOMAIN_NM[1]
    scaled = scale_to_luminance(lamp.spd, lamp.luminance_cd_m2)
    assert luminance_cd_m2(scaled) == pytest.approx(lamp.luminance_cd_m2, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "lowest", "highest"),
    [
        ("headlight_led", 4e4, 9e4), ("headlight_halogen", 2e4, 3e4), ("street_hps", 1e4, 3e4), ("street_mh", 2e4, 4e4),
        ("street_led", 2.5e4, 5e4), ("window_warm", 10, 120), ("window_cool", 10, 120), ("shop", 40, 300),
    ],
)  # fmt: skip
def test_published_ranges_of_luminance_stand(name: str, lowest: float, highest: float) -> None:
    lamp = asset_material(f"lamp/{name}").lamp
    assert lamp is not None
    assert lamp.range_cd_m2 == (lowest, highest)


def test_tail_and_brake_lights_are_their_share_of_the_headlight() -> None:
    head, tail, brake = (asset_material(f"lamp/{name}").lamp for name in ("headlight_led", "tail", "brake"))
    assert head is not None
    assert tail is not None
    assert brake is not None
    assert 0.0004 <= tail.luminance_cd_m2 / head.luminance_cd_m2 <= 0.01
    assert 0.10 <= brake.luminance_cd_m2 / head.luminance_cd_m2 <= 0.20


@pytest.mark.parametrize("name", ["traffic_red", "tail", "brake"])
def test_red_signals_are_in_the_regulated_red(name: str) -> None:
    lamp = asset_material(f"lamp/{name}").lamp
    assert lamp is not None
    x, y = chromaticity(lamp.spd)
    assert y <= 0.335  # UN Regulation 148, annex 2: limit towards yellow
    assert y >= 0.980 - x - 1e-3  # and towards purple


@pytest.mark.parametrize("name", ["traffic_amber", "indicator"])
def test_amber_signals_are_in_the_regulated_amber(name: str) -> None:
    lamp = asset_material(f"lamp/{name}").lamp
    assert lamp is not None
    x, y = chromaticity(lamp.spd)
    assert 0.39 <= y <= x - 0.12  # UN Regulation 148, annex 2
    assert y >= 0.79 - 0.67 * x


def test_green_signals_are_in_the_regulated_green() -> None:
    lamp = asset_material("lamp/traffic_green").lamp
    assert lamp is not None
    x, y = chromaticity(lamp.spd)
    assert y <= 0.726 - 0.726 * x + 0.02  # EN 12368: limits towards yellow, white and blue
    assert x <= 0.625 * y - 0.041
    assert y >= 0.400


def test_sodium_lamps_shine_at_819_nm_and_phosphor_lamps_do_not_shine_beyond_850() -> None:
    sodium, white = (asset_material(f"lamp/{name}").lamp for name in ("street_hps", "street_led"))
    assert sodium is not None
    assert white is not None
    assert sodium.spd.at(819) > 3 * sodium.spd.at(790)
    assert white.spd.integral([850.0, 1000.0])[0] < 0.002 * white.spd.integral([380.0, 780.0])[0]


def test_green_leaves_pass_green_and_infrared_and_make_no_light() -> None:
    """Broad leaves: LOPEX93 (Hosgood et al. 1995) has transmittances near 0.1 in the green and 0.4 to 0.5 beyond 750 nm."""
    leaf = asset_material("foliage/broadleaf")
    assert leaf.reflectance is not None
    assert leaf.transmittance is not None
    green, red, infrared = leaf.transmittance.at([550.0, 680.0, 850.0])
    assert 0.05 < green < 0.15
    assert red < 0.02
    assert 0.38 < infrared < 0.52
    for name in ("broadleaf", "birch", "conifer", "hedge", "autumn"):
        material = asset_material(f"foliage/{name}")
        assert material.reflectance is not None
        assert material.transmittance is not None
        assert np.all(material.reflectance.values + material.transmittance.values < 1.0)
