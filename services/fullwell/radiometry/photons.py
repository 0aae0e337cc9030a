"""Energy to photons and back: a photon of wavelength lambda carries h c / lambda."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["band_photons", "energy_to_photons", "photon_energy_j", "photons_to_energy"]


def photon_energy_j(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return the energy of one photon [J], same shape. Raises FieldError where a wavelength is not finite and > 0."""
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    if not np.all(np.isfinite(wavelength)) or np.any(wavelength <= 0):
        raise FieldError("wavelength_nm must be finite and > 0 everywhere.", path="wavelength_nm")
    return np.asarray(PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M / wavelength)


def energy_to_photons(energy: ArrayLike, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return photons for energies [J, or W as photons s^-1, per whatever the energy is per].

    The last axis of `energy` runs over `wavelength_nm`, (bands,), or both broadcast. Raises ShapeError where they do not.
    """
    quantum = photon_energy_j(wavelength_nm)
    values = np.asarray(energy, dtype=np.float64)
    _check_broadcast(values, quantum, "energy")
    return np.asarray(values / quantum)


def photons_to_energy(photons: ArrayLike, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return energies [J] for photons: the inverse of `energy_to_photons`, to one rounding."""
    quantum = photon_energy_j(wavelength_nm)
    values = np.asarray(photons, dtype=np.float64)
    _check_broadcast(values, quantum, "photons")
    return np.asarray(values * quantum)


def band_photons(energy: Spectrum, grid: WavelengthGrid) -> NDArray[np.float64]:
    """Return (bands,) means over the grid's bands of a spectral energy as photons [photons nm^-1 per the energy's unit].

    Exact: every wavelength within a band counts with its own photon energy, which matters where a line does not lie at
    the band's centre (a line 5 nm off centre at 400 nm would be wrong by 1.2 %).
    """
    edges = grid.edges_nm
    ramp = Spectrum(edges[[0, -1]], 1.0 / photon_energy_j(edges[[0, -1]]), outside="hold", unit="photons J^-1")
    return energy.integral_of_product(ramp, edges) / grid.step_nm


def _check_broadcast(values: NDArray[np.float64], quantum: NDArray[np.float64], name: str) -> None:
    try:
        np.broadcast_shapes(values.shape, quantum.shape)
    except ValueError:
        raise ShapeError(
            f"{name} has shape {values.shape} and wavelength_nm {quantum.shape}; the last axis of {name} must be (bands,)."
        ) from None
