"""The published tables beside this file, read on first use: each names its source and is evenly spaced."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Literal

import numpy as np

from fullwell.radiometry.spectrum import Spectrum

__all__ = ["TABLE_FILES", "table_names", "table_spectrum"]

TABLE_FILES = ("colorchecker", "cornell", "daylight_basis", "illuminants", "mallett2019", "observer")


@cache
def _document(file: str) -> tuple[str, dict[str, tuple[float, float, tuple[float, ...]]]]:
    text = resources.files("fullwell.radiometry").joinpath("data", f"{file}.json").read_text(encoding="utf-8")
    document = json.loads(text)
    tables = {
        name: (float(table["first_nm"]), float(table["step_nm"]), tuple(table["values"]))
        for name, table in document["tables"].items()
    }
    return str(document["source"]), tables


def table_names(file: str) -> tuple[str, ...]:
    """Return the names of the tables in one of `TABLE_FILES`, in the order of the publication."""
    return tuple(_document(file)[1])


@cache
def table_spectrum(file: str, name: str, outside: Literal["zero", "hold"], unit: str) -> Spectrum:
    """Return one published table as a spectrum, with its source."""
    source, tables = _document(file)
    first_nm, step_nm, values = tables[name]
    wavelength_nm = first_nm + step_nm * np.arange(len(values), dtype=np.float64)
    return Spectrum(wavelength_nm, np.array(values), outside=outside, unit=unit, source=f"{name}: {source}")
