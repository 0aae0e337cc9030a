"""Flare: the star and veil that the aperture's blades, scratches and dust diffract about bright lights."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import NM_PER_M
from fullwell.core.errors import FieldError
from fullwell.core.rng import stream
from fullwell.optics.psf import PointImage
from fullwell.optics.wavefront import Wavefront, pupil_grid, pupil_point_image, wavefront_error_m

__all__ = ["Aperture", "aperture_mask", "flare_point_image", "flare_samples"]

_FEWEST_SAMPLES, _MOST_SAMPLES = 512, 1536
_FEWEST_BLADES, _MOST_BLADES = 3, 64
_MOST_MARKS = 10_000


@dataclass(frozen=True, slots=True)
class Aperture:
    """Shape and cleanliness of an aperture stop.

    Attributes
    ----------
    blades
        Straight edges, 3 to 64; 0 is a circle.
    rotation_deg
        Turns the polygon counter-clockwise; at 0 one corner points to the right.
    scratches, dust_grains
        Numbers of straight scratches across the pupil and of round grains on it.
    scratch_width, dust_diameter
        Mean width and mean diameter over the pupil's diameter, in (0, 0.5]; single ones vary by a factor 2 either way.
    opacity
        Share of the amplitude that scratches and grains take away, in [0, 1].
    seed
        Of the places of scratches and grains.
    """

    blades: int = 0
    rotation_deg: float = 0.0
    scratches: int = 0
    scratch_width: float = 0.004
    dust_grains: int = 0
    dust_diameter: float = 0.02
    opacity: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.blades != 0 and not _FEWEST_BLADES <= self.blades <= _MOST_BLADES:
            raise FieldError(
                f"blades is {self.blades}; must be 0 (a circle) or {_FEWEST_BLADES} to {_MOST_BLADES}. Set aperture.blades.",
                path="blades",
                value=self.blades,
            )
        _check_range("rotation_deg", self.rotation_deg, -360.0, 360.0)
        _check_range("opacity", self.opacity, 0.0, 1.0)
        for name in ("scratches", "dust_grains"):
            _check_range(name, getattr(self, name), 0, _MOST_MARKS)
        for name in ("scratch_width", "dust_diameter"):
            _check_range(name, getattr(self, name), 1e-5, 0.5)


def aperture_mask(aperture: Aperture, samples: int) -> NDArray[np.float64]:
    """Return the amplitude transmittance of the aperture on (samples, samples) cells that enclose its circle, in [0, 1].

    The polygon is inscribed in the circle of the lens's pupil: its corners keep the f-number. Row 0 is the top.
    """
    rho, theta, open_cells = pupil_grid(samples)
    mask = open_cells
    if aperture.blades:
        half = math.pi / aperture.blades
        # Angle from the middle of the nearest edge; corners lie at the rotation angle.
        from_middle = np.mod(theta - math.radians(aperture.rotation_deg), 2 * half) - half
        mask = (rho * np.cos(from_middle) <= math.cos(half)).astype(np.float64)
    rng = stream(aperture.seed, "aperture")
    x, y = rho * np.cos(theta), rho * np.sin(theta)
    for _ in range(aperture.scratches):
        angle, offset = rng.uniform(0, math.pi), rng.uniform(-1, 1)
        middle, half_length = rng.uniform(-1, 1), rng.uniform(0.1, 0.6)
        width = 2 * aperture.scratch_width * 2 ** rng.uniform(-1, 1)
        across = np.abs(x * math.sin(angle) - y * math.cos(angle) - offset)
        along = np.abs(x * math.cos(angle) + y * math.sin(angle) - middle)
        # The share of a cell that the scratch covers: scratches are often narrower than cells.
        covered = np.clip((width / 2 - across) * samples / 2 + 0.5, 0.0, min(1.0, width * samples / 2)) * (along < half_length)
        mask = mask * (1.0 - aperture.opacity * covered)
    for _ in range(aperture.dust_grains):
        radius, turn = math.sqrt(rng.uniform(0, 1)), rng.uniform(0, 2 * math.pi)
        grain = aperture.dust_diameter * 2 ** rng.uniform(-1, 1)
        away = np.hypot(x - radius * math.cos(turn), y - radius * math.sin(turn))
        covered = np.clip((grain - away) * samples / 2 + 0.5, 0.0, min(1.0, (grain * samples / 2) ** 2 * math.pi))
        mask = mask * (1.0 - aperture.opacity * covered)
    if not np.any(mask):
        raise FieldError(
            "the aperture lets no light through; use fewer scratches and dust grains. Set aperture.scratches.", path="scratches"
        )
    return np.asarray(mask)


def flare_samples(*, wavelength_nm: float, f_number: float, reach_m: float) -> int:
    """Return the samples across the pupil that let the flare reach `reach_m` on every side [m], within 512 to 1536.

    The transform's window is `samples` wavelengths times f-number wide.
    """
    wanted = math.ceil(2.0 * reach_m / (wavelength_nm / NM_PER_M * f_number))
    return min(_MOST_SAMPLES, max(_FEWEST_SAMPLES, wanted + wanted % 2))


def flare_point_image(
    mask: NDArray[np.float64],
    *,
    wavelength_nm: float,
    f_number: float,
    oversampling: int = 2,
    wavefront: Wavefront | None = None,
    pupil_diameter_m: float = 1.0,
) -> PointImage:
    """Return the image of a point through an aperture mask: |FFT|^2, weights of sum 1.

    Without wavefront error its form is the same at all wavelengths and its size grows with the wavelength.

    References
    ----------
    goodman2005, section 4.4; wu2021 for apertures with scratches and dust.
    """
    error_m = np.zeros_like(mask)
    if wavefront is not None:
        rho, theta, _ = pupil_grid(len(mask))
        error_m = wavefront_error_m(wavefront, rho, theta, wavelength_nm=wavelength_nm, pupil_diameter_m=pupil_diameter_m)
    return pupil_point_image(mask, error_m, wavelength_nm=wavelength_nm, f_number=f_number, oversampling=oversampling)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise FieldError(f"{name} is {value}; must be within {low:g} to {high:g}. Set aperture.{name}.", path=name, value=value)
