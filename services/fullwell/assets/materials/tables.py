"""The published tables beside this module, read on first use; each entry names its source."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from fullwell.assets.materials.curves import WAVELENGTH_NM, Array, through_knots

__all__ = ["material_table", "measured_names", "measured_reflectance", "typical_reflectance"]

_LEAST_SHARE = 0.6
"""Of the first measured value, below the range of the measurement."""


@cache
def material_table(file: str) -> Any:
    """Return the document of data/<file>.json, not to be changed."""
    text = resources.files("fullwell.assets.materials").joinpath("data", f"{file}.json").read_text(encoding="utf-8")
    return json.loads(text)


def measured_names() -> tuple[str, ...]:
    """Return the materials that `measured_reflectance` knows."""
    return tuple(material_table("measured")["materials"])


def measured_reflectance(name: str) -> tuple[Array, str]:
    """Return a measured reflectance at WAVELENGTH_NM, and its source.

    Below the first measured wavelength the slope of the first 20 nm goes on: reflectance falls towards the ultraviolet.
    """
    entry = material_table("measured")["materials"][name]
    values = np.array(entry["reflectance"], dtype=np.float64)
    known_nm = entry["first_nm"] + entry["step_nm"] * np.arange(values.size)
    slope = (values[2] - values[0]) / (known_nm[2] - known_nm[0])
    below = values[0] + np.minimum(WAVELENGTH_NM - known_nm[0], 0.0) * slope
    within = np.interp(WAVELENGTH_NM, known_nm, values)
    continued = np.where(known_nm[0] > WAVELENGTH_NM, np.maximum(below, _LEAST_SHARE * values[0]), within)
    note = f"{entry['source']}: {entry['what']}; below {known_nm[0]:g} nm continued by its slope"
    return np.asarray(continued), note


def typical_reflectance(name: str) -> tuple[Array, str]:
    """Return a typical reflectance at WAVELENGTH_NM, and what it is shaped after."""
    entry = material_table("typical")["materials"][name]
    return through_knots([(nm, value) for nm, value in entry["knots"]]), str(entry["source"])
