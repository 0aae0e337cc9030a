"""Lit parts: lamps of vehicles and streets, traffic lights, lit windows and signs, with luminance and spectrum."""

from __future__ import annotations

import numpy as np

from fullwell.assets.materials.curves import WAVELENGTH_NM, reflectance_spectrum
from fullwell.assets.materials.model import Lamp, SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance
from fullwell.radiometry.illuminants import illuminant
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["lamp_materials"]

_CLEAR, _RED, _AMBER, _GREEN = (
    {"rutile": 0.3, "carbon_black": 0.02},
    {"dpp_red": 1.0},
    {"organic_orange": 1.0},
    {"phthalo_green": 1.0},
)
_LAMPS: dict[str, tuple[float, tuple[float, float], str, str, dict[str, float]]] = {
    "headlight_led": (6e4, (4e4, 9e4), "LED-B5", "headlights", _CLEAR),
    "headlight_halogen": (2.5e4, (2e4, 3e4), "blackbody:3200K", "headlights", _CLEAR),
    "daytime_running": (3e4, (1e4, 6e4), "LED-B5", "headlights", _CLEAR),
    "tail": (250.0, (24.0, 600.0), "led:630:8", "other", _RED),
    "brake": (8e3, (6e3, 1.2e4), "led:630:8", "other", _RED),
    "indicator": (1.2e4, (5e3, 3e4), "led:592:7", "other", _AMBER),
    "reverse": (1e4, (5e3, 3e4), "LED-B5", "other", _CLEAR),
    "street_led": (3.5e4, (2.5e4, 5e4), "LED-B3", "streetlights", _CLEAR),
    "street_hps": (2e4, (1e4, 3e4), "HP1", "streetlights", _CLEAR),
    "street_mh": (3e4, (2e4, 4e4), "HP4", "streetlights", _CLEAR),
    "traffic_red": (1e4, (3.2e3, 3.2e4), "led:630:8", "other", _RED),
    "traffic_amber": (1e4, (3.2e3, 3.2e4), "led:592:7", "other", _AMBER),
    "traffic_green": (1e4, (3.2e3, 3.2e4), "led:503:13", "other", _GREEN),
    "window_warm": (50.0, (10.0, 120.0), "LED-B1", "other", _CLEAR),
    "window_cool": (60.0, (10.0, 120.0), "LED-B3", "other", _CLEAR),
    "shop": (150.0, (40.0, 300.0), "LED-V2", "other", _CLEAR),
    "sign_panel": (250.0, (50.0, 600.0), "LED-B5", "other", {"rutile": 1.0, "carbon_black": 0.002}),
}


def lamp_materials() -> tuple[SpectralMaterial, ...]:
    """Return the lamps."""
    return tuple(_lamp(name) for name in _LAMPS)


def _lamp(name: str) -> SpectralMaterial:
    luminance, span, light, group, lens = _LAMPS[name]
    spd = _spd(light)
    return SpectralMaterial(
        name=f"lamp/{name}",
        title=name.replace("_", " "),
        kind="coated",
        basis="typical",
        source=spd.source,
        reflectance=reflectance_spectrum(mixture_reflectance(lens), PIGMENT_SOURCE),
        roughness=0.02,
        lamp=Lamp(luminance, span, spd, group),
        tags=("lamp", "light", *name.split("_")),
    )


def _spd(light: str) -> Spectrum:
    if not light.startswith("led:"):
        return illuminant(light)
    _, peak, width = light.split(":")
    fine = np.arange(WAVELENGTH_NM[0], WAVELENGTH_NM[-1] + 0.5, 1.0)
    values = 100.0 * np.exp(-0.5 * ((fine - float(peak)) / float(width)) ** 2)
    return Spectrum(fine, values, outside="zero", unit="relative", source=f"LED of {peak} nm, standard deviation {width} nm")
