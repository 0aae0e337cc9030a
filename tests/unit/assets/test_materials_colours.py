"""Colours of materials on a display, and the points of their curves."""

from __future__ import annotations

import colorsys

import numpy as np
import pytest

from fullwell.assets.materials.catalogue import asset_material, asset_material_names
from fullwell.assets.materials.colours import (
    display_lab,
    display_srgb,
    emission_srgb,
    lab_of_srgb,
    seen_spectrum,
    spectrum_points,
)
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.upsample import reflectance_from_srgb

HUES_DEG = {
    "red": (340, 20),
    "orange": (8, 35),
    "yellow": (42, 62),
    "green": (90, 170),
    "blue": (200, 240),
}
"""Of HSV, where people name the colour so; the first may be beyond 360."""


def diffuse(reflectance: Spectrum) -> SpectralMaterial:
    return SpectralMaterial("test/one", "one", "diffuse", "typical", "test", reflectance=reflectance)


def test_a_perfect_diffuser_is_white_and_grey_is_neutral() -> None:
    assert display_srgb(diffuse(Spectrum.constant(1.0))) == pytest.approx((1, 1, 1), abs=1e-6)
    red, green, blue = display_srgb(diffuse(Spectrum.constant(0.18)))
    assert red == pytest.approx(green, abs=1e-6)
    assert green == pytest.approx(blue, abs=1e-6)
    assert green == pytest.approx(0.4613, abs=1e-3)


def test_colours_return_from_their_spectra() -> None:
    wanted = (0.55, 0.42, 0.31)
    # The spectrum is sampled every 5 nm for display.
    assert display_srgb(diffuse(reflectance_from_srgb(wanted))) == pytest.approx(wanted, abs=1e-3)


def test_lab_of_white_and_of_a_known_colour() -> None:
    assert lab_of_srgb((1, 1, 1)) == pytest.approx([100, 0, 0], abs=1e-6)
    assert lab_of_srgb((1, 0, 0)) == pytest.approx([53.24, 80.09, 67.20], abs=0.05)


@pytest.mark.parametrize("name", asset_material_names())
def test_every_material_has_a_colour_a_web_page_can_show(name: str) -> None:
    colour = display_srgb(asset_material(name))
    assert all(0 <= value <= 1 for value in colour)


COLOURED = [
    name
    for name in asset_material_names()
    if name.partition("/")[0] in ("paint", "coating", "plastic", "sign", "cloth") and name.partition("/")[2] in HUES_DEG
]


def test_the_coloured_families_are_all_looked_at() -> None:
    assert len(COLOURED) >= 20


@pytest.mark.parametrize("name", COLOURED)
def test_a_colour_by_name_has_the_hue_of_its_name(name: str) -> None:
    colour = name.partition("/")[2]
    hue, saturation, _ = colorsys.rgb_to_hsv(*display_srgb(asset_material(name)))
    low, high = HUES_DEG[colour]
    assert ((hue * 360 - low) % 360) <= ((high - low) % 360)
    assert saturation > 0.3


@pytest.mark.parametrize("name", ["paint/white", "paint/grey", "paint/silver", "paint/black", "plastic/white", "coating/grey"])
def test_greys_are_nearly_neutral(name: str) -> None:
    assert np.hypot(*display_lab(asset_material(name))[1:]) < 6


def test_metals_are_as_bright_as_their_index_says() -> None:
    assert display_lab(asset_material("metal/aluminium"))[0] > 94
    assert 75 < display_lab(asset_material("metal/chrome"))[0] < 85
    red, green, blue = display_srgb(asset_material("metal/copper"))
    assert red > green > blue


def test_clear_glass_shows_what_it_lets_through() -> None:
    assert display_lab(asset_material("glass/clear"))[0] == pytest.approx(96.7, abs=0.5)


def test_only_lamps_have_a_colour_of_light() -> None:
    assert emission_srgb(asset_material("paint/red")) is None
    red = emission_srgb(asset_material("lamp/tail"))
    assert red is not None
    assert max(red) == pytest.approx(1.0)
    assert red[0] > 5 * red[1]


def test_points_of_a_curve_go_from_380_to_1000_nm() -> None:
    points = spectrum_points(asset_material("foliage/broadleaf"))
    wavelengths = [nm for nm, _, _ in points]
    assert wavelengths == list(np.arange(380.0, 1001.0, 5.0))
    assert {label for _, _, label in points} == {"reflectance"}
    values = seen_spectrum(asset_material("foliage/broadleaf")).values
    assert [value for _, value, _ in points] == pytest.approx(values.tolist())


def test_points_of_a_lamp_are_its_emission() -> None:
    points = spectrum_points(asset_material("lamp/traffic_green"))
    assert max(value for _, value, _ in points) == 1.0
    assert max(points, key=lambda point: point[1])[0] == 505.0
    assert {label for _, _, label in points} == {"relative emission"}
