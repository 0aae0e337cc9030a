"""Spectra on the device: one table of cell means for a whole scene, looked up by row and wavelength cell."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry.spectrum import Spectrum
from fullwell.render.transport.upload import upload

__all__ = [
    "CELL_COUNT",
    "CELL_NM",
    "FIRST_EDGE_NM",
    "PACKET",
    "SpectraOnDevice",
    "SpectraTable",
    "cell_centres_nm",
    "cell_means",
    "look_up",
]

FIRST_EDGE_NM = 300.0
CELL_NM = 0.5
CELL_COUNT = 1600
"""Cells of 0.5 nm from 300 to 1100 nm hold every band that a grid may have. Within a cell a spectrum counts as its mean, so
that the power of a line of any width is kept."""

PACKET = 4
"""Rows that `SpectraTable.add_packets` keeps side by side and `SpectraOnDevice.packet` reads at once."""


def cell_centres_nm() -> NDArray[np.float64]:
    """Return the (CELL_COUNT,) middles of the cells [nm]."""
    return np.asarray(FIRST_EDGE_NM + CELL_NM * (np.arange(CELL_COUNT) + 0.5), dtype=np.float64)


def cell_means(spectrum: Spectrum) -> NDArray[np.float32]:
    """Return the (CELL_COUNT,) exact means of a spectrum over the cells, in the spectrum's own unit."""
    edges_nm = FIRST_EDGE_NM + CELL_NM * np.arange(CELL_COUNT + 1)
    means = spectrum.integral(edges_nm) / CELL_NM
    return np.asarray(np.maximum(means, 0.0) if np.all(spectrum.values >= 0) else means, dtype=np.float32)


class SpectraTable:
    """Collects the spectra of a scene on the host; `finish` puts them on the device.

    Equal spectra share a row. Row 0 is black, row 1 is 1 everywhere.
    """

    BLACK = 0
    ONE = 1

    def __init__(self) -> None:
        self._rows: list[NDArray[np.float32]] = [
            np.zeros(CELL_COUNT, dtype=np.float32),
            np.ones(CELL_COUNT, dtype=np.float32),
        ]
        self._known: dict[bytes, int] = {row.tobytes(): number for number, row in enumerate(self._rows)}
        self._of_spectrum: dict[int, tuple[Spectrum, int]] = {}

    def copy(self) -> SpectraTable:
        """Return a table with the same rows, which others may be added to."""
        other = SpectraTable()
        other._rows, other._known, other._of_spectrum = list(self._rows), dict(self._known), dict(self._of_spectrum)
        return other

    def add(self, spectrum: Spectrum) -> int:
        """Return the row of a spectrum."""
        known = self._of_spectrum.get(id(spectrum))
        if known is None:
            known = (spectrum, self.add_cells(cell_means(spectrum)))
            self._of_spectrum[id(spectrum)] = known
        return known[1]

    def add_cells(self, values: NDArray[np.float32]) -> int:
        """Return the row of (CELL_COUNT,) cell means."""
        content = np.ascontiguousarray(values, dtype=np.float32)
        key = content.tobytes()
        if key not in self._known:
            self._known[key] = len(self._rows)
            self._rows.append(content)
        return self._known[key]

    @property
    def count(self) -> int:
        """Number of rows so far."""
        return len(self._rows)

    def row(self, number: int) -> NDArray[np.float32]:
        """Return the cell means of a row."""
        return self._rows[number]

    def values(self) -> NDArray[np.float32]:
        """Return all rows, (rows, CELL_COUNT)."""
        return np.stack(self._rows)

    def add_packets(self, rows: list[NDArray[np.float32]]) -> int:
        """Add rows of cell means side by side, filled up with black to whole packets, and return the first packet's number."""
        black = self._rows[self.BLACK]
        while len(self._rows) % PACKET:
            self._rows.append(black)
        first = len(self._rows) // PACKET
        self._rows += rows
        return first

    def finish(self, mi: Any) -> SpectraOnDevice:
        """Return the table on the device."""
        return SpectraOnDevice(mi, self.values())


class SpectraOnDevice:
    """All rows of a table on the device, cell by cell: what a path looks up at one wavelength lies close together.

    `values`, flat: row r's value in cell c is at c x `stride` + r.
    """

    def __init__(self, mi: Any, values: NDArray[np.float32]) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        packets = -(-len(values) // PACKET)
        by_cell = np.zeros((CELL_COUNT, packets * PACKET), dtype=np.float32)
        by_cell[:, : len(values)] = values.T
        self.values = upload(mi.Float, by_cell)
        self.stride, self._packets = dr.opaque(mi.UInt32, packets * PACKET), dr.opaque(mi.UInt32, packets)

    def packet(self, packet: Any, cell: Any, active: Any) -> Any:
        """Return the values of a packet of rows in a cell, an Array4f."""
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        return dr.gather(dr.llvm.ad.Array4f, self.values, cell * self._packets + packet, active)


def look_up(mi: Any, spectra: SpectraOnDevice, row: Any, cells: list[Any]) -> Any:
    """Return the values of `row` (UInt32) at a path's wavelength `cells`, as an array of len(cells) components."""
    import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

    places = [cell * spectra.stride + row for cell in cells]
    return dr.llvm.ad.ArrayXf([dr.gather(mi.Float, spectra.values, place) for place in places])
