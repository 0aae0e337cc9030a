"""Materials as curves and colours: what the spectrum plot, the swatches and the choice of materials show."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from fullwell.assets.materials.catalogue import asset_material, asset_materials
from fullwell.assets.materials.colours import display_srgb, emission_srgb, spectrum_points
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.records import MaterialChoice
from fullwell.core import FieldError
from fullwell.radiometry.upsample import reflectance_from_srgb

__all__ = ["Curve", "MaterialLine", "chart_options", "curve_of", "material_lines", "material_title", "swatch"]

SHORTEST_NM: Final = 380
LONGEST_NM: Final = 1000
STEP_NM: Final = 5
NAMED_NM: Final = list(range(400, LONGEST_NM + 1, 100))
EYE_ENDS_NM: Final = 700
"""Where the plot begins to mark what people do not see."""

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Curve:
    """A spectrum to plot: points (nm, value), what the value is, and the colour [CSS] of what it belongs to."""

    title: str
    quantity: str
    points: tuple[tuple[float, float], ...]
    colour: str


@dataclass(frozen=True, slots=True)
class MaterialLine:
    """One material in the list to choose from; `words` are what a search looks in."""

    name: str
    title: str
    family: str
    about: str
    colour: str
    words: str


def material_title(choice: MaterialChoice) -> str:
    """Return what a part is made of, for people."""
    if not choice.name:
        return "texture of the file" if choice.origin == "texture" else "colour of the file"
    material = _known(choice.name)
    return choice.name if material is None else material.title


@cache
def _colour_of(name: str) -> str:
    material = _known(name)
    return "" if material is None else _css(_shown_colour(material))


def swatch(choice: MaterialChoice) -> str:
    """Return the colour [CSS] of a part's material under D65."""
    return (_colour_of(choice.name) if choice.name else "") or _css(choice.base_color_srgb)


def curve_of(choice: MaterialChoice) -> Curve:
    """Return the spectrum of a part's material: of the catalogue, or made up from the colour of the file."""
    material = _known(choice.name) if choice.name else None
    if material is not None:
        points = spectrum_points(material)
        return Curve(material.title, points[0][2], tuple((nm, value) for nm, value, _ in points), swatch(choice))
    wavelength_nm = np.arange(SHORTEST_NM, LONGEST_NM + 1, STEP_NM, dtype=np.float64)
    values = reflectance_from_srgb(choice.base_color_srgb).at(wavelength_nm)
    pairs = tuple((float(nm), float(value)) for nm, value in zip(wavelength_nm, values, strict=True))
    return Curve(f"{material_title(choice)}, made up from sRGB", "reflectance", pairs, swatch(choice))


@cache
def material_lines() -> tuple[MaterialLine, ...]:
    """Return the catalogue as lines to choose from, in its own order."""
    return tuple(
        MaterialLine(
            name=material.name,
            title=material.title,
            family=material.name.partition("/")[0].replace("_", " "),
            about=_about(material),
            colour=_colour_of(material.name),
            words=" ".join((material.name, material.title, material.kind, *material.tags)).casefold(),
        )
        for material in asset_materials().values()
    )


def chart_options(curves: list[Curve]) -> dict[str, Any]:
    """Return the plot of curves over 380 to 1000 nm; its colours suit light and dark pages."""
    quantities = list(dict.fromkeys(curve.quantity for curve in curves))
    highest = max((value for curve in curves for _, value in curve.points), default=1.0)
    soft, line = "#7d8b9a", "rgba(125,139,154,.22)"
    axis = {
        "axisLine": {"lineStyle": {"color": soft}},
        "axisLabel": {"color": soft},
        "splitLine": {"lineStyle": {"color": line}},
    }
    name = {"nameTextStyle": {"color": soft}}
    return {
        "animation": False,
        "grid": {"left": 44, "right": 14, "top": 28, "bottom": 42},
        "tooltip": {"trigger": "axis", "confine": True},
        "xAxis": {
            "type": "value",
            "min": SHORTEST_NM,
            "max": LONGEST_NM,
            "axisTick": {"customValues": NAMED_NM},
            "axisLabel": {"color": soft, "customValues": NAMED_NM, "formatter": "{value}"},
            "name": "wavelength, nm",
            "nameLocation": "middle",
            "nameGap": 26,
            "axisLine": {"lineStyle": {"color": soft}},
            "splitLine": {"show": False},
            **name,
        },
        "yAxis": {
            "type": "value",
            "min": 0,
            "max": _ceiling(highest),
            "name": " and ".join(quantities),
            "nameLocation": "end",
            "nameTextStyle": {"color": soft, "align": "left", "padding": [0, 0, 0, -34]},
            **axis,
        },
        "series": [_series(curve, first=number == 0) for number, curve in enumerate(curves)],
    }


def _series(curve: Curve, *, first: bool) -> dict[str, Any]:
    series: dict[str, Any] = {
        "type": "line",
        "name": curve.title,
        "showSymbol": False,
        "data": [[nm, round(value, 5)] for nm, value in curve.points],
        # Every material's own colour would vanish on one of the two backgrounds: a curve is drawn in the page's colour.
        "lineStyle": {"width": 2.2, "color": "#2f81d9" if first else "#c2693f"},
        "itemStyle": {"color": "#2f81d9" if first else "#c2693f"},
    }
    if first:
        series["markArea"] = {
            "silent": True,
            "itemStyle": {"color": "rgba(190,60,60,.08)"},
            "label": {"color": "#7d8b9a", "position": "insideTop", "fontSize": 11},
            "data": [[{"name": "near infrared", "xAxis": EYE_ENDS_NM}, {"xAxis": LONGEST_NM}]],
        }
    return series


def _ceiling(highest: float) -> float:
    steps = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)
    return next((step for step in steps if highest <= step), 1.0)


def _known(name: str) -> SpectralMaterial | None:
    # A manifest can be older, or newer, than this catalogue.
    try:
        return asset_material(name)
    except FieldError:
        return None


def _shown_colour(material: SpectralMaterial) -> Colour:
    return emission_srgb(material) or display_srgb(material)


def _about(material: SpectralMaterial) -> str:
    words = [material.kind, {"measured": "measured", "model": "computed", "typical": "typical"}[material.basis]]
    if material.lamp is not None:
        words.append(f"lamp, {material.lamp.luminance_cd_m2:,.0f} cd/m²".replace(",", " "))
    if material.retroreflective:
        words.append("retroreflective")
    return ", ".join(words)


def _css(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * min(1.0, max(0.0, value))):02x}" for value in colour)
