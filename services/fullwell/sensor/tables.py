"""Tables beside this package."""

from __future__ import annotations

from importlib import resources

import numpy as np
from numpy.typing import NDArray

__all__ = ["read_table"]


def read_table(file: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return wavelengths (n,) [nm] and the other columns (n, k) of a table in the folder `data`."""
    text = resources.files("fullwell.sensor").joinpath("data", file).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    numbers = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return numbers[:, 0], numbers[:, 1:]
