"""Lit parts: lamps of vehicles and streets, traffic lights, lit windows and signs, with luminance and spectrum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from fullwell.assets.materials.curves import DOMAIN_NM, reflectance_spectrum
from fullwell.assets.materials.model import Lamp, SpectralMaterial
from fullwell.assets.materials.pigments import mixture_reflectance
from fullwell.radiometry.illuminants import illuminant
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["lamp_materials"]


@dataclass(frozen=True, slots=True)
class _Lit:
    """Luminance and its range [cd m^-2], spectrum, light group, lens when unlit, and where the luminance is from."""

    luminance_cd_m2: float
    range_cd_m2: tuple[float, float]
    light: str
    group: str
    lens: str
    source: str


_TYPE_APPROVAL: Final = "luminous intensity of UN Regulation 148 over a typical area of the lamp"
_STREET: Final = "range of luminaires in service"
_HEADLAMP: Final = "range of headlamps in service"
_SIGNAL: Final = "100 to 1000 cd (EN 12368, performance levels 1 to 3) over a roundel of 200 mm"
_SIGNAL_RANGE: Final = (3.2e3, 3.2e4)
_INTERIOR: Final = "range of lit windows seen from the street at night"

_LAMPS: Final[dict[str, _Lit]] = {
    "headlight_led": _Lit(6e4, (4e4, 9e4), "LED-B5", "headlights", "reflector", _HEADLAMP),
    "headlight_halogen": _Lit(2.5e4, (2e4, 3e4), "blackbody:3200K", "headlights", "reflector", _HEADLAMP),
    "daytime_running": _Lit(3e4, (1e4, 6e4), "LED-B5", "headlights", "reflector", _TYPE_APPROVAL),
    "tail": _Lit(250.0, (24.0, 600.0), "led:630:8", "other", "red", "0.04 to 1 % of the headlight"),
    "brake": _Lit(9e3, (6e3, 1.2e4), "led:630:8", "other", "red", "10 to 20 % of the headlight"),
    "indicator": _Lit(1.2e4, (5e3, 3e4), "led:592:7", "other", "amber", _TYPE_APPROVAL),
    "reverse": _Lit(1e4, (5e3, 3e4), "LED-B5", "other", "reflector", _TYPE_APPROVAL),
    "street_led": _Lit(3.5e4, (2.5e4, 5e4), "LED-B3", "streetlights", "reflector", _STREET),
    "street_hps": _Lit(2e4, (1e4, 3e4), "HP1", "streetlights", "opal", _STREET),
    "street_mh": _Lit(3e4, (2e4, 4e4), "HP4", "streetlights", "opal", _STREET),
    "street_mercury": _Lit(1.2e4, (6e3, 2e4), "mercury", "streetlights", "opal", _STREET),
    "traffic_red": _Lit(1e4, _SIGNAL_RANGE, "led:630:8", "other", "dark_red", _SIGNAL),
    "traffic_amber": _Lit(1e4, _SIGNAL_RANGE, "led:592:7", "other", "dark_amber", _SIGNAL),
    "traffic_green": _Lit(1e4, _SIGNAL_RANGE, "led:503:13", "other", "dark_green", _SIGNAL),
    "window_warm": _Lit(50.0, (10.0, 120.0), "LED-B1", "other", "pane", _INTERIOR),
    "window_cool": _Lit(60.0, (10.0, 120.0), "LED-B3", "other", "pane", _INTERIOR),
    "shop": _Lit(150.0, (40.0, 300.0), "LED-V2", "other", "pane", "range of shop windows at night"),
    "sign_panel": _Lit(250.0, (50.0, 600.0), "LED-B5", "other", "panel", "range of illuminated advertising at night"),
}

_LENSES: Final[dict[str, dict[str, float]]] = {
    "reflector": {"rutile": 1.0, "carbon_black": 0.008},
    "opal": {"rutile": 1.0, "carbon_black": 0.003},
    "panel": {"rutile": 1.0, "carbon_black": 0.0006},
    "red": {"dpp_red": 1.0, "carbon_black": 0.004},
    "amber": {"organic_orange": 1.0, "bismuth_vanadate": 0.2, "carbon_black": 0.002},
    "dark_red": {"dpp_red": 0.3, "carbon_black": 0.08, "rutile": 0.01},
    "dark_amber": {"organic_orange": 0.3, "bismuth_vanadate": 0.1, "carbon_black": 0.08},
    "dark_green": {"phthalo_green": 0.1, "carbon_black": 0.05, "bismuth_vanadate": 0.03},
    "pane": {"carbon_black": 0.1, "rutile": 0.12},
}
"""What is behind the clear face of an unlit lamp, as pigments that look like it. Signals are dark: no phantom light."""

_SODIUM_NM: Final = 819.0
_SODIUM_SHARE: Final = {"HP1": 0.10, "HP4": 0.04}
"""Power in sodium's near infrared doublet at 818.3 and 819.5 nm over that of 380 to 780 nm, a rough figure."""


def lamp_materials() -> tuple[SpectralMaterial, ...]:
    """Return the lamps."""
    return tuple(_lamp(name, lit) for name, lit in _LAMPS.items())


def _lamp(name: str, lit: _Lit) -> SpectralMaterial:
    spd = _relative_power(lit.light)
    source = f"luminance: {lit.source}; spectrum: {spd.source}"
    return SpectralMaterial(
        name=f"lamp/{name}",
        title=f"lamp, {name.replace('_', ' ')}",
        kind="coated",
        basis="typical",
        source=source,
        reflectance=reflectance_spectrum(mixture_reflectance(_LENSES[lit.lens]), "looks of an unlit lamp"),
        roughness=0.02,
        lamp=Lamp(lit.luminance_cd_m2, lit.range_cd_m2, spd, lit.group),
        tags=("lamp", "light", "emitter", *name.split("_")),
    )


@cache
def _relative_power(light: str) -> Spectrum:
    """Return relative spectral power over 380 to 1000 nm, 0 outside."""
    if light == "mercury":
        return _mercury()
    if light.startswith("led:"):
        return _coloured_led(*(float(figure) for figure in light.split(":")[1:]))
    known = illuminant(light)
    if known.wavelength_nm[-1] >= DOMAIN_NM[1]:
        return known
    return _continued(light, known)


_MERCURY_LINES: Final = {404.7: 0.45, 407.8: 0.04, 435.8: 0.85, 546.1: 1.0, 577.0: 0.47, 579.1: 0.48}
_VANADATE_LINES: Final = {594.0: 0.06, 615.5: 0.26, 619.4: 0.46, 650.0: 0.05, 699.0: 0.11, 704.5: 0.11}
"""Powers over that of the green line: of the discharge, and of a coating of yttrium vanadate with europium that turns its
ultraviolet to red. Representative: the coating is chosen to give the 4 000 K of lamps for streets."""

_MERCURY_WIDTH_NM: Final = 1.2
_MERCURY_CONTINUUM: Final = 1.2e-3
"""Per nanometre, over the green line's power."""


def _mercury() -> Spectrum:
    wavelength_nm = np.arange(DOMAIN_NM[0], DOMAIN_NM[1] + 0.25, 0.5)
    values = np.full(wavelength_nm.shape, _MERCURY_CONTINUUM)
    for centre_nm, power in (_MERCURY_LINES | _VANADATE_LINES).items():
        off = (wavelength_nm - centre_nm) / _MERCURY_WIDTH_NM
        values += power * np.exp(-0.5 * off**2) / (_MERCURY_WIDTH_NM * np.sqrt(2.0 * np.pi))
    source = "high-pressure mercury lamp with a vanadate coating, from its lines; representative powers"
    return Spectrum(wavelength_nm, 100.0 * values, outside="zero", unit="relative", source=source)


def _coloured_led(peak_nm: float, deviation_nm: float) -> Spectrum:
    wavelength_nm = np.arange(DOMAIN_NM[0], DOMAIN_NM[1] + 0.5, 1.0)
    values = 100.0 * np.exp(-0.5 * ((wavelength_nm - peak_nm) / deviation_nm) ** 2)
    source = f"light-emitting diode, {peak_nm:g} nm, {2.355 * deviation_nm:.0f} nm wide at half height"
    return Spectrum(wavelength_nm, values, outside="zero", unit="relative", source=source)


def _continued(light: str, known: Spectrum) -> Spectrum:
    """Return a table that ends at 780 nm, continued to 1000 nm.

    Phosphors go on fading as over the last 60 nm; discharge lamps keep their last level, and sodium's doublet is added.
    """
    last_nm = float(known.wavelength_nm[-1])
    beyond_nm = np.arange(last_nm + 1.0, DOMAIN_NM[1] + 0.5, 1.0)
    if light in _SODIUM_SHARE:
        level = float(np.median(known.at(np.arange(last_nm - 60.0, last_nm + 1.0, 5.0))))
        power = _SODIUM_SHARE[light] * float(known.integral([DOMAIN_NM[0], last_nm])[0])
        line = power / (2.0 * np.sqrt(2.0 * np.pi)) * np.exp(-0.5 * ((beyond_nm - _SODIUM_NM) / 2.0) ** 2)
        beyond, note = level + line, f"level held beyond {last_nm:g} nm, with sodium's doublet at {_SODIUM_NM:g} nm"
    else:
        first, last = known.at([last_nm - 60.0, last_nm])
        beyond = last * (last / first) ** ((beyond_nm - last_nm) / 60.0)
        note = f"fading on beyond {last_nm:g} nm"
    wavelength_nm, values = np.append(known.wavelength_nm, beyond_nm), np.append(known.values, beyond)
    return Spectrum(wavelength_nm, values, outside="zero", unit="relative", source=f"{known.source}; {note}")
