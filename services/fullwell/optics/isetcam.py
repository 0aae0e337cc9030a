"""ISETCam's optics, number for number: the compatibility mode. The physical model is in `optics.model`.

What is wrong with it on purpose is listed in docs/validation/isetcam.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RegularGridInterpolator

from fullwell.core.constants import NM_PER_M
from fullwell.core.errors import FieldError, ShapeError, unknown_name_message
from fullwell.radiometry.images import RadianceImage
from fullwell.radiometry.isetcam import check_wavelengths, round_half_away
from fullwell.radiometry.spectrum import Spectrum
from fullwell.scene.camera import Lens
from fullwell.scene.images import OpticalImage
from fullwell.scene.isetcam import IsetcamOpticalImage, IsetcamScene, scene_from_radiance

__all__ = [
    "Blur",
    "IsetcamLens",
    "OffAxis",
    "OtfTable",
    "compute_irradiance",
    "compute_optical_image",
    "diffraction_psf",
    "frequency_support",
    "gaussian_otf_table",
    "off_axis_map",
    "otf_table",
    "radiance_to_irradiance_sr",
    "transfer_function",
    "wavefront_lens",
    "wavefront_psf",
]

Blur: TypeAlias = Literal["diffraction", "shift_invariant", "skip"]
OffAxis: TypeAlias = Literal["cos4th", "skip"]

_FOCAL_LENGTH_M: Final = 0.003862755099228297
"""ISETCam's default lens. Focused at its default distance of 1.2 m the image lies at 3.8752293174 mm."""

_BORDER_LEVEL: Final = 1e-9
"""The border's photons as a share of the largest value of the image in any band."""

_FAR_DIAGONALS: Final = 10.0
"""Beyond this many image diagonals of image distance the plain cos^4 law is used."""

_EYE_FOCAL_LENGTH_M: Final = 0.017
_EYE_PLANE_MM: Final = 16.212
_EYE_SAMPLES: Final = 201
_MEASURED_PUPIL_MM: Final = 8.0
_MEASURED_WAVELENGTH_NM: Final = 550.0
"""ISETCam's wavefront defaults: focal length, width and samples of the pupil plane, pupil for which the Zernike coefficients
hold, and the wavelength for which the width of the plane holds (found from optics_shift_invariant.json)."""


@dataclass(frozen=True, slots=True, eq=False)
class OtfTable:
    """An optical transfer function per wavelength on a square grid of frequencies.

    Attributes
    ----------
    otf
        (bands, n, n) complex, frequency 0 in the middle (index n // 2).
    frequency_cycles_per_m
        (n,) of both axes, increasing.
    wavelength_nm
        (bands,) [nm].
    """

    otf: NDArray[np.complex128]
    frequency_cycles_per_m: NDArray[np.float64]
    wavelength_nm: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = self.frequency_cycles_per_m.size
        if self.otf.shape != (self.wavelength_nm.size, n, n):
            raise ShapeError(f"otf has shape {self.otf.shape}; must be ({self.wavelength_nm.size}, {n}, {n}).")


@dataclass(frozen=True, slots=True, eq=False)
class IsetcamLens:
    """ISETCam's lens, always focused at the scene.

    Attributes
    ----------
    f_number, focal_length_m
        > 0; the f-number sets the irradiance and, without the magnification, the diffraction limit.
    transmittance
        Sampled at the wavelengths, in [0, 1].
    off_axis
        "cos4th" or "skip".
    blur
        "diffraction", "shift_invariant" (needs `otf`) or "skip", which also sets the magnification to -1 and adds no border.
    otf
        The table of "shift_invariant"; `gaussian_otf_table` is ISETCam's default.
    """

    f_number: float = 4.0
    focal_length_m: float = _FOCAL_LENGTH_M
    transmittance: Spectrum = field(default_factory=lambda: Spectrum.constant(1.0))
    off_axis: OffAxis = "cos4th"
    blur: Blur = "diffraction"
    otf: OtfTable | None = None

    def __post_init__(self) -> None:
        for name in ("f_number", "focal_length_m"):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise FieldError(f"{name} is {value}; must be > 0 and finite. Set lens.{name}.", path=name, value=value)
        if not (np.min(self.transmittance.values) >= 0 and np.max(self.transmittance.values) <= 1):
            raise FieldError("transmittance must be in [0, 1]. Set lens.transmittance.", path="transmittance")
        for name, known in (("off_axis", get_args(OffAxis)), ("blur", get_args(Blur))):
            value = getattr(self, name)
            if value not in known:
                raise FieldError(unknown_name_message(name, value, known), path=name, value=value)
        if (self.blur == "shift_invariant") != (self.otf is not None):
            raise FieldError("otf must be given for blur 'shift_invariant' and for no other.", path="otf")

    def image_distance_m(self, scene_distance_m: float) -> float:
        """Return 1 / (1/f - 1/d) [m]. Raises FieldError where the scene is not beyond the focal length."""
        if not scene_distance_m > self.focal_length_m:
            raise FieldError(
                f"scene_distance_m is {scene_distance_m}; must be greater than focal_length_m = {self.focal_length_m}, or no "
                "real image forms.",
                path="scene_distance_m",
                value=scene_distance_m,
            )
        return 1.0 / (1.0 / self.focal_length_m - 1.0 / scene_distance_m)

    def magnification(self, scene_distance_m: float) -> float:
        """Return -d_i / d, or -1 where the blur is skipped."""
        return -1.0 if self.blur == "skip" else -self.image_distance_m(scene_distance_m) / scene_distance_m


def compute_optical_image(radiance: RadianceImage, lens: Lens, *, scene_distance_m: float) -> OpticalImage:
    """Return the optical image of a rendered radiance as ISETCam computes it.

    Parameters
    ----------
    radiance
        Its band means are taken as samples at the band centres.
    lens
        `f_number`, `focal_length_m`, `transmittance` (sampled at the band centres) and `diffraction` (off: no blur, but the
        border and the magnification stay) count. ISETCam focuses at the scene: `focus_distance_m` is not used, nor is `kind`.
    scene_distance_m
        Distance of the whole scene [m].

    Returns
    -------
    The image with ISETCam's dark border: larger than the radiance by a quarter. Double precision.

    Raises
    ------
    FieldError
        As `compute_irradiance`.
    """
    scene = scene_from_radiance(radiance, distance_m=scene_distance_m)
    compatible = IsetcamLens(f_number=lens.f_number, focal_length_m=lens.focal_length_m, transmittance=lens.transmittance)
    image = _form_image(scene, compatible, diffract=lens.diffraction)
    note = "model isetcam: scene flat at one distance and in focus; dark border of an eighth on each side."
    return image.on_grid(radiance.grid, notes=(note,))


def compute_irradiance(scene: IsetcamScene, lens: IsetcamLens) -> IsetcamOpticalImage:
    """Return ISETCam's optical image of a scene: camera equation, off-axis falloff, border, transfer function.

    Raises
    ------
    FieldError
        The image with its border has a single row or column and the blur is on: ISETCam gives NaN. Or the scene is nearer
        than the focal length.
    """
    return _form_image(scene, lens, diffract=True)


def radiance_to_irradiance_sr(f_number: float, magnification: float) -> float:
    """Return pi / (1 + 4 N^2 (1 + |m|)^2) [sr]."""
    return math.pi / (1.0 + 4.0 * f_number**2 * (1.0 + abs(magnification)) ** 2)


def off_axis_map(
    *, rows: int, cols: int, hfov_deg: float, image_distance_m: float, f_number: float, magnification: float
) -> NDArray[np.float64]:
    """Return ISETCam's relative illumination at the samples, (rows, cols).

    The extended-source law with s = 1 / (1 + 4 N^2 (1 + |m|)^2) where s^2 is meant, or cos^4 where the image distance is
    more than 10 image diagonals. ISETCam passes the focal length as image distance. Its own map carries the rounding of a
    difference of nearly equal numbers, about 1e-15 N^4; the form here, equal in exact arithmetic, does not.
    """
    pitch_m = 2.0 * image_distance_m * math.tan(math.radians(hfov_deg / 2)) / cols
    x = (np.arange(cols) + 0.5 - cols / 2) * pitch_m
    y = (np.arange(rows) + 0.5 - rows / 2) * pitch_m
    squared = x[None, :] ** 2 + y[:, None] ** 2
    if image_distance_m > _FAR_DIAGONALS * math.hypot(pitch_m * cols, pitch_m * rows):
        return np.asarray((image_distance_m / np.sqrt(image_distance_m**2 + squared)) ** 4)
    s = 1.0 / (1.0 + 4.0 * (f_number * (1.0 + abs(magnification))) ** 2)
    cos_squared = 1.0 - s * s
    tan_squared = s * s / cos_squared
    field_squared = squared / image_distance_m**2
    near = 1.0 - tan_squared + field_squared
    root = np.sqrt(field_squared**2 + 2.0 * field_squared * (1.0 - tan_squared) + 1.0 / cos_squared**2)
    return np.asarray(2.0 / (cos_squared * root * (root + near)))


def frequency_support(samples: int) -> NDArray[np.float64]:
    """Return ISETCam's frequencies in units of the Nyquist frequency, (samples,), frequency 0 at index samples // 2.

    -1 to 1 - 2/n where n is even; -1 to 1 where n is odd, which stretches the spacing by n / (n - 1).

    Raises
    ------
    FieldError
        One sample: 0 / 0 in ISETCam.
    """
    if samples < 2:
        raise FieldError(
            "an image of a single row or column has no frequencies (ISETCam gives NaN); use at least 2 x 2 samples or blur "
            "'skip'.",
            path="rows",
            value=samples,
        )
    half = samples // 2
    return np.asarray(np.arange(-half, samples - half, dtype=np.float64) / half)


def transfer_function(frequency_cycles_per_m: ArrayLike, *, wavelength_nm: float, f_number: float) -> NDArray[np.float64]:
    """Return the diffraction-limited OTF, same shape; the cut-off 1 / (wavelength N) leaves out the magnification."""
    cutoff = NM_PER_M / (wavelength_nm * f_number)
    v = np.minimum(np.asarray(frequency_cycles_per_m, dtype=np.float64) / cutoff, 1.0)
    return np.asarray((2.0 / np.pi) * (np.arccos(v) - v * np.sqrt(1.0 - v * v)))


def diffraction_psf(
    *, wavelength_nm: float, f_number: float, half_samples: int = 25, oversampling: float = 4.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ISETCam's point image of the diffraction-limited lens: positions (n,) [m] and values (n, n) of sum 1.

    The OTF is sampled at n = 2 `half_samples` frequencies up to `oversampling` times its cut-off.
    """
    n = 2 * half_samples
    frequency = frequency_support(n) * (oversampling * NM_PER_M / (wavelength_nm * f_number))
    otf = transfer_function(_radial(frequency, frequency), wavelength_nm=wavelength_nm, f_number=f_number)
    psf = np.abs(scipy.fft.fftshift(scipy.fft.ifft2(scipy.fft.ifftshift(otf))))
    position_m = np.arange(-half_samples, half_samples) / (2.0 * frequency[-1])
    return np.asarray(position_m, dtype=np.float64), np.asarray(psf)


def gaussian_otf_table(
    wavelength_nm: ArrayLike, *, sigma_per_wavelength: float = 1e-6 / 400.0, samples: int = 128, pitch_m: float = 0.25e-6
) -> OtfTable:
    """Return the table of a Gaussian point image whose sigma is `sigma_per_wavelength` [m/nm] times the wavelength.

    The Gaussian is centred between the four middle samples, which shifts the image by half a `pitch_m`, as in ISETCam.
    """
    wave = check_wavelengths(wavelength_nm)
    x = (np.arange(samples) - (samples - 1) / 2) * pitch_m
    profile = np.exp(-0.5 * (x[None, :] / (sigma_per_wavelength * wave[:, None])) ** 2)
    return otf_table(profile[:, :, None] * profile[:, None, :], wavelength_nm=wave, pitch_m=pitch_m)


def otf_table(psf: ArrayLike, *, wavelength_nm: ArrayLike, pitch_m: float) -> OtfTable:
    """Return the transfer function of point images (bands, n, n) sampled every `pitch_m`; each is normalised to sum 1.

    Raises
    ------
    FieldError, ShapeError
        Point images that are not square, hold NaN, or whose sum is not positive.
    """
    wave, images = check_wavelengths(wavelength_nm), np.asarray(psf, dtype=np.float64)
    if images.ndim != 3 or images.shape[0] != wave.size or images.shape[1] != images.shape[2]:
        raise ShapeError(f"psf has shape {images.shape}; must be ({wave.size}, n, n).")
    total = np.sum(images, axis=(1, 2), keepdims=True)
    if not np.all((total > 0) & np.isfinite(total)):
        raise FieldError("psf must be finite and have a positive sum at each wavelength.", path="psf")
    axes = (1, 2)
    otf = scipy.fft.fftshift(scipy.fft.fft2(scipy.fft.ifftshift(images / total, axes=axes)), axes=axes)
    return OtfTable(np.asarray(otf), scipy.fft.fftshift(scipy.fft.fftfreq(images.shape[1], pitch_m)), wave)


def wavefront_psf(
    zernike_um: Sequence[float] = (0.0,),
    *,
    wavelength_nm: float = _MEASURED_WAVELENGTH_NM,
    pupil_mm: float = 3.0,
    measured_pupil_mm: float = _MEASURED_PUPIL_MM,
    samples: int = _EYE_SAMPLES,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the point image of a pupil with aberrations: positions (n,) [m] and values (n, n) of sum 1.

    Parameters
    ----------
    zernike_um
        Coefficients by OSA/ANSI index 0, 1, 2, ... [um], for a pupil of `measured_pupil_mm`; the fifth (index 4) is defocus.
    wavelength_nm
        The pupil plane is scaled with it, so that point images of all wavelengths have the same pitch. The eye's
        longitudinal chromatic aberration is not added.
    pupil_mm
        Diameter that is open, at most `measured_pupil_mm`.

    Raises
    ------
    FieldError
        A pupil larger than the measured one, or coefficients that are not finite.
    """
    if not 0 < pupil_mm <= measured_pupil_mm:
        raise FieldError(
            f"pupil_mm is {pupil_mm}; must be > 0 and at most measured_pupil_mm = {measured_pupil_mm}.",
            path="pupil_mm",
            value=pupil_mm,
        )
    if not np.all(np.isfinite(zernike_um)):
        raise FieldError("zernike_um must be finite.", path="zernike_um")
    plane_mm = _EYE_PLANE_MM * wavelength_nm / _MEASURED_WAVELENGTH_NM
    position_mm = (np.arange(samples) - samples // 2) * (plane_mm / samples)
    radius_mm = np.hypot(position_mm[:, None], position_mm[None, :])
    angle = np.arctan2(position_mm[:, None], position_mm[None, :])
    error_um = np.zeros((samples, samples))
    for index, coefficient in enumerate(zernike_um):
        if coefficient != 0:
            error_um += coefficient * _zernike(index, radius_mm / (measured_pupil_mm / 2), angle)
    pupil = (radius_mm <= pupil_mm / 2) * np.exp(-2j * np.pi * error_um / (wavelength_nm * 1e-3))
    psf = np.abs(scipy.fft.fftshift(scipy.fft.fft2(pupil))) ** 2
    degrees = math.degrees(wavelength_nm * 1e-6 / plane_mm)
    pitch_m = degrees * _EYE_FOCAL_LENGTH_M * math.tan(math.radians(1.0))
    return np.asarray((np.arange(samples) - samples // 2) * pitch_m, dtype=np.float64), np.asarray(psf / np.sum(psf))


def wavefront_lens(zernike_um: Sequence[float] = (0.0,), *, wavelength_nm: ArrayLike, pupil_mm: float = 3.0) -> IsetcamLens:
    """Return the shift-invariant lens of `wavefront_psf`: focal length 17 mm, f-number 17 mm / pupil."""
    wave = check_wavelengths(wavelength_nm)
    position_m, _ = wavefront_psf(zernike_um, pupil_mm=pupil_mm)
    images = [wavefront_psf(zernike_um, wavelength_nm=float(w), pupil_mm=pupil_mm)[1] for w in wave]
    table = otf_table(np.stack(images), wavelength_nm=wave, pitch_m=float(position_m[1] - position_m[0]))
    f_number = _EYE_FOCAL_LENGTH_M * 1e3 / pupil_mm
    return IsetcamLens(f_number=f_number, focal_length_m=_EYE_FOCAL_LENGTH_M, blur="shift_invariant", otf=table)


def _form_image(scene: IsetcamScene, lens: IsetcamLens, *, diffract: bool) -> IsetcamOpticalImage:
    magnification = lens.magnification(scene.distance_m)
    transmittance = lens.transmittance.at(scene.wavelength_nm)
    photons = scene.photons * (radiance_to_irradiance_sr(lens.f_number, magnification) * transmittance)
    if lens.off_axis == "cos4th":
        falloff = off_axis_map(
            rows=scene.rows,
            cols=scene.cols,
            hfov_deg=scene.hfov_deg,
            image_distance_m=lens.focal_length_m,
            f_number=lens.f_number,
            magnification=magnification,
        )
        photons *= falloff[:, :, None]
    hfov_deg = scene.hfov_deg
    if lens.blur != "skip":
        photons, hfov_deg = _bordered(photons, hfov_deg)
        if diffract:
            photons = _blurred(photons, scene.wavelength_nm, hfov_deg, lens)
    image_distance_m = lens.image_distance_m(scene.distance_m)
    pitch_m = 2.0 * image_distance_m * math.tan(math.radians(hfov_deg / 2)) / photons.shape[1]
    return IsetcamOpticalImage(photons, scene.wavelength_nm, pitch_m, image_distance_m, lens.focal_length_m)


def _bordered(photons: NDArray[np.float64], hfov_deg: float) -> tuple[NDArray[np.float64], float]:
    """Return the image with its border and the field of view with it."""
    rows, cols = photons.shape[:2]
    border_rows, border_cols = (int(round_half_away(n / 8)) for n in (rows, cols))
    widths = ((border_rows, border_rows), (border_cols, border_cols), (0, 0))
    bordered = np.pad(photons, widths, constant_values=_BORDER_LEVEL * float(np.max(photons)))
    ratio = bordered.shape[1] / cols
    return bordered, 2.0 * math.degrees(math.atan(ratio * math.tan(math.radians(hfov_deg / 2))))


def _frequencies(rows: int, cols: int, hfov_deg: float, distance_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the frequencies of rows and columns [cycles/m]; those of rows go through degrees, as in ISETCam."""
    width_m = 2.0 * distance_m * math.tan(math.radians(hfov_deg / 2))
    vfov_deg = 2.0 * math.degrees(math.atan(width_m / cols * rows / 2 / distance_m))
    per_degree = hfov_deg / width_m
    row_frequency = np.asarray(frequency_support(rows) * (rows / 2 / vfov_deg * per_degree))
    return row_frequency, np.asarray(frequency_support(cols) * (cols / 2 / hfov_deg * per_degree))


def _blurred(
    photons: NDArray[np.float64], wavelength_nm: NDArray[np.float64], hfov_deg: float, lens: IsetcamLens
) -> NDArray[np.float64]:
    rows, cols = photons.shape[:2]
    fy, fx = _frequencies(rows, cols, hfov_deg, lens.focal_length_m)
    radial = _radial(fy, fx)
    blurred = np.empty_like(photons)
    for k, wavelength in enumerate(wavelength_nm):
        if lens.otf is None:
            otf: NDArray[np.generic] = transfer_function(radial, wavelength_nm=float(wavelength), f_number=lens.f_number)
        else:
            otf = _interpolated(lens.otf, float(wavelength), fy, fx)
        spectrum = scipy.fft.fft2(photons[:, :, k]) * scipy.fft.ifftshift(otf)
        blurred[:, :, k] = np.abs(scipy.fft.ifft2(spectrum, overwrite_x=True))
    return blurred


def _interpolated(
    table: OtfTable, wavelength_nm: float, fy: NDArray[np.float64], fx: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return the table's OTF at the image's frequencies, bilinear, 0 beyond the table."""
    matches = np.flatnonzero(np.abs(table.wavelength_nm - wavelength_nm) < 1e-6)
    if matches.size == 0:
        raise FieldError(
            f"the OTF table has no wavelength {wavelength_nm:g} nm; make it for the wavelengths of the scene.",
            path="otf",
            value=wavelength_nm,
        )
    axis = table.frequency_cycles_per_m
    look_up = RegularGridInterpolator((axis, axis), table.otf[matches[0]], bounds_error=False, fill_value=0)
    points = np.stack(np.broadcast_arrays(fy[:, None], fx[None, :]), axis=-1)
    return np.asarray(look_up(points))


def _radial(fy: NDArray[np.float64], fx: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.sqrt(fy[:, None] ** 2 + fx[None, :] ** 2)


def _zernike(index: int, radius: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Zernike polynomial of an OSA/ANSI index, of unit variance over the unit disc.

    References
    ----------
    ISO 24157:2008, table of ordered Zernike functions: j = (n (n + 2) + m) / 2.
    """
    n = math.ceil((-3 + math.sqrt(9 + 8 * index)) / 2)
    m = 2 * index - n * (n + 2)
    order = abs(m)
    radial = np.zeros_like(radius)
    for k in range((n - order) // 2 + 1):
        numerator = (-1) ** k * math.factorial(n - k)
        halves = math.factorial((n + order) // 2 - k) * math.factorial((n - order) // 2 - k)
        radial += numerator / (math.factorial(k) * halves) * radius ** (n - 2 * k)
    norm = math.sqrt((n + 1) * (1 if m == 0 else 2))
    return norm * radial * (np.cos(m * angle) if m >= 0 else np.sin(order * angle))
