"""The metrics as ISETCam (commit of 2021-06-05) computes them, for comparing numbers with it; not the default of anything.

Where they differ from the definitions: the edge response has no derivative correction, no angle correction and an MTF50 in
steps of 0.2 cycles/mm; S-CIELAB takes full widths for half widths, drops a row or column, wraps at the border and shifts the
blurred picture by a sample; the pixel's dynamic range takes dark volts for volts squared. See docs/physics/metrics_isetcam.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics.colour_difference import delta_e_2000

__all__ = [
    "SlantedEdge",
    "encode_srgb",
    "iso12233",
    "pixel_dynamic_range_db",
    "s_cielab",
    "s_cielab_difference",
    "s_cielab_filters",
    "samples_per_degree",
    "sensor_dynamic_range_db",
    "sensor_snr_db",
    "visual_snr",
    "xyz_to_lab",
    "xyz_to_linear_srgb",
]

Observer = Literal[2, 10]
"""Which of ISETCam's two XYZ to opponent matrices: "xyz2" or "xyz10" (its default)."""

_OPPONENT: Final[dict[int, NDArray[np.float64]]] = {
    2: np.array([[288.5613, 659.7617, -130.5654], [-464.8864, 326.2702, 62.4200], [79.8787, -554.7976, 481.4746]]) / 1000.0,
    10: np.array([[278.7336, 721.8031, -106.5520], [-448.7736, 289.8056, 77.1569], [85.9513, -589.9859, 501.1089]]) / 1000.0,
}
_HALF_WIDTHS: Final = (
    ((0.05, 1.00327), (0.225, 0.114416), (7.0, -0.117686)),
    ((0.0685, 0.616725), (0.826, 0.383275)),
    ((0.0920, 0.567885), (0.6451, 0.432115)),
)
"""(taken for half width at half maximum [deg], weight) of its "distribution" filters."""

_LAB_LIMIT: Final = 0.008856
_BINS: Final = 4
_MTF50_STEP_CYCLES_PER_MM: Final = 0.2
_METRES_PER_INCH: Final = 0.0254


# Edge response -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class SlantedEdge:
    """Result of `iso12233`.

    Attributes
    ----------
    frequency_cycles_per_mm, mtf
        (n,) from 0 to 1 cycle per pixel; the MTF of the luminance of a colour image.
    nyquist_cycles_per_mm, mtf50_cycles_per_mm
        Sampling limit, and where the MTF is nearest to 0.5, in steps of 0.2 below that limit.
    aliasing_percent
        Sum of the MTF (of green, in a colour image) from the sampling limit on, over the whole sum [%].
    """

    frequency_cycles_per_mm: NDArray[np.float64]
    mtf: NDArray[np.float64]
    nyquist_cycles_per_mm: float
    mtf50_cycles_per_mm: float
    aliasing_percent: float


def iso12233(
    image: ArrayLike, *, pixel_pitch_mm: float, luminance_weights: tuple[float, float, float] = (0.3, 0.6, 0.1)
) -> SlantedEdge:
    """Return the slanted-edge MTF of a (rows, cols) or (rows, cols, 3) image.

    The longer side is taken along the edge. Raises ShapeError for another shape or fewer than 6 rows or columns, FieldError
    for a pitch that is not > 0 or an image without an edge.
    """
    values = np.asarray(image, dtype=np.float64)
    if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] != 3) or min(values.shape[:2]) < 6:
        raise ShapeError(f"image has shape {values.shape}; must be (rows, cols) or (rows, cols, 3), at least 6 x 6.")
    if not 0 < pixel_pitch_mm < math.inf:
        message = f"pixel_pitch_mm is {pixel_pitch_mm}; must be > 0 and finite."
        raise FieldError(message, path="pixel_pitch_mm", value=pixel_pitch_mm)
    planes = [values] if values.ndim == 2 else [*np.moveaxis(values, 2, 0), values @ np.array(luminance_weights)]
    if values.shape[1] > values.shape[0]:
        planes = [plane.T for plane in planes]
    # Which side is bright is decided on the first plane; the right-hand sum has six columns, the left-hand one five.
    sign = -1.0 if planes[0][:, :5].sum() > planes[0][:, -6:].sum() else 1.0
    cols = planes[0].shape[1]
    count = round((_BINS * cols / 2 + 1) / 2 + 1e-6)  # halves away from zero, as ISETCam rounds
    size = _BINS * cols
    # Written as ISETCam writes them: whether the sample at the limit counts as below it hangs on their rounding.
    frequency = _BINS * np.arange(count) / (pixel_pitch_mm * size)
    curves = [_edge_mtf(plane, sign)[:count] for plane in planes]
    nyquist = size / (2.0 * pixel_pitch_mm * size)
    below = frequency < nyquist
    grid = _MTF50_STEP_CYCLES_PER_MM * np.arange(int(nyquist / _MTF50_STEP_CYCLES_PER_MM + 1e-6) + 1)
    grid = grid[grid <= frequency[below][-1]]
    nearest = int(np.argmin(np.abs(np.interp(grid, frequency[below], curves[-1][below]) - 0.5)))
    counted = curves[1] if len(curves) > 1 else curves[0]
    return SlantedEdge(
        frequency_cycles_per_mm=frequency,
        mtf=curves[-1],
        nyquist_cycles_per_mm=nyquist,
        mtf50_cycles_per_mm=float(grid[nearest]),
        aliasing_percent=100.0 * float(counted[~below].sum() / counted.sum()),
    )


def _edge_mtf(plane: NDArray[np.float64], sign: float) -> NDArray[np.float64]:
    rows, cols = plane.shape
    derivative = sign * _differences(plane, lag=1)
    place = np.full(rows, 0.5 * (cols + 1))
    slope = 0.0
    for _ in range(2):
        window = np.stack([_hamming(cols, centre) for centre in place])
        total = np.sum(derivative * window, axis=1)
        if not np.all(total != 0):
            raise FieldError("the image holds a row without an edge; choose a region that the edge crosses.", path="image")
        position = (derivative * window) @ np.arange(1, cols + 1) / total - 0.5
        slope, offset = np.polyfit(np.arange(rows), position, 1)
        place = offset + slope * np.arange(1, rows + 1)  # rows counted from 1 here and from 0 in the fit
    profile = _binned_profile(plane, float(slope))
    spread = sign * _differences(profile[None, :], lag=2)[0]
    size = spread.size
    centroid = float(np.sum(np.arange(1, size + 1) * spread) / np.sum(spread))
    shift = _round_half_away(centroid) - _round_half_away(0.5 * (size + 1))
    centred = np.zeros(size)
    centred[max(-shift, 0) : size - max(shift, 0)] = spread[max(shift, 0) : size - max(-shift, 0)]
    transform = np.abs(np.fft.fft(centred * _hamming(size, 0.5 * (size + 1))))
    return np.asarray(transform / transform[0])


def _differences(plane: NDArray[np.float64], *, lag: int) -> NDArray[np.float64]:
    """Return half the differences over `lag` samples along rows, same shape; the first ones repeat their neighbour."""
    out = np.zeros_like(plane)
    out[:, lag:] = 0.5 * (plane[:, lag:] - plane[:, :-lag])
    out[:, lag - 1] = out[:, lag]
    return out


def _hamming(size: int, centre: float) -> NDArray[np.float64]:
    reach = max(centre - 1.0, size - centre)
    return np.asarray(0.54 + 0.46 * np.cos(np.pi * (np.arange(1, size + 1) - centre) / reach))


def _binned_profile(plane: NDArray[np.float64], slope: float) -> NDArray[np.float64]:
    rows, cols = plane.shape
    offset = _round_half_away(-_BINS * (rows - 1) * slope)
    length, start = cols * _BINS, 1 + _round_half_away(0.5 * abs(offset))
    y, x = np.mgrid[:rows, :cols]
    index = np.ceil((x - y * slope) * _BINS).astype(np.int64) + 1 - min(offset, 0)
    size = max(int(index.max()) + 1, start + length + 1)
    shifted = index.ravel() - min(int(index.min()), 0)
    lead = -min(int(index.min()), 0)
    number = np.bincount(shifted, minlength=size + lead)[lead:].astype(np.float64)
    total = np.bincount(shifted, plane.ravel(), minlength=size + lead)[lead:]
    for k in range(start, start + length):
        if number[k] == 0:  # the counts of the neighbours, but no value: as ISETCam does, with its warning
            number[k] = 0.5 * (number[k - 1] + number[k + 1])
    part = slice(start, start + length)
    return np.divide(total[part], number[part], out=np.zeros(length), where=number[part] > 0)


def _round_half_away(value: float) -> int:
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


# Noise ---------------------------------------------------------------------------------------------------------------


def sensor_snr_db(
    volts: ArrayLike, *, conversion_gain_v_per_e: float, read_noise_v: float, dsnu_v: float, prnu_fraction: float
) -> NDArray[np.float64]:
    """Return the SNR [dB] of mean voltages, same shape: 10 log10 of e^2 / (e + read^2 + dsnu^2 + (prnu e)^2)."""
    electrons = np.asarray(volts, dtype=np.float64) / conversion_gain_v_per_e
    fixed = (read_noise_v / conversion_gain_v_per_e) ** 2 + (dsnu_v / conversion_gain_v_per_e) ** 2
    return np.asarray(10.0 * np.log10(electrons**2 / (electrons + fixed + (prnu_fraction * electrons) ** 2)))


def sensor_dynamic_range_db(
    *,
    voltage_swing_v: float,
    dark_voltage_v_per_s: float,
    exposure_time_s: float,
    conversion_gain_v_per_e: float,
    read_noise_v: float,
    dsnu_v: float,
) -> float:
    """Return the dynamic range [dB]: swing less dark voltage over the noise of a dark pixel."""
    dark_v = dark_voltage_v_per_s * exposure_time_s
    noise_v = math.sqrt(dark_v * conversion_gain_v_per_e + read_noise_v**2 + dsnu_v**2)
    return 20.0 * math.log10((voltage_swing_v - dark_v) / noise_v)


def pixel_dynamic_range_db(
    *, voltage_swing_v: float, dark_voltage_v_per_s: float, exposure_time_s: float, read_noise_v: float
) -> float:
    """Return the pixel's dynamic range [dB] with ISETCam's mixed units: dark volts added to read volts squared."""
    dark_v = dark_voltage_v_per_s * exposure_time_s
    return 20.0 * math.log10((voltage_swing_v - dark_v) / math.sqrt(dark_v + read_noise_v**2))


# S-CIELAB ------------------------------------------------------------------------------------------------------------


_XYZ_TO_SRGB: Final = np.array([[3.2410, -1.5374, -0.4986], [-0.9692, 1.8760, 0.0416], [0.0556, -0.2040, 1.0570]])
"""The draft of IEC 61966-2-1, with four decimals."""


def xyz_to_linear_srgb(xyz: ArrayLike) -> NDArray[np.float64]:
    """Return linear sRGB (..., 3), not clipped, of XYZ whose white has Y = 1 (..., 3)."""
    return np.asarray(np.asarray(xyz, dtype=np.float64) @ _XYZ_TO_SRGB.T)


def encode_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """Return sRGB-encoded values of linear ones, same shape, clipped to 0 to 1 first; 1 becomes 1.055 - 0.055."""
    clipped = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(clipped > 0.0031308, 1.055 * clipped ** (1 / 2.4) - 0.055, 12.92 * clipped)


def xyz_to_lab(xyz: ArrayLike, white_xyz: ArrayLike) -> NDArray[np.float64]:
    """Return CIELAB (..., 3) with the rounded constants of the older standard: 0.008856, 7.787 and 903.3."""
    ratio = np.asarray(xyz, dtype=np.float64) / np.asarray(white_xyz, dtype=np.float64)
    root = np.where(ratio > _LAB_LIMIT, np.cbrt(ratio), 7.787 * ratio + 16.0 / 116.0)
    lightness = np.where(ratio[..., 1] > _LAB_LIMIT, 116.0 * np.cbrt(ratio[..., 1]) - 16.0, 903.3 * ratio[..., 1])
    return np.stack([lightness, 500.0 * (root[..., 0] - root[..., 1]), 200.0 * (root[..., 1] - root[..., 2])], axis=-1)


def samples_per_degree(*, dots_per_inch: float, distance_m: float) -> int:
    """Return the samples per degree of visual angle, rounded; ISETCam takes the tangent of the small ratio."""
    return _round_half_away(1.0 / math.degrees(math.tan(_METRES_PER_INCH / dots_per_inch / distance_m)))


def s_cielab_filters(*, samples_per_degree: float, filter_size: int) -> tuple[NDArray[np.float64], ...]:
    """Return the three blur kernels, each (size, size) with sum 1; an even size is made odd by one less."""
    size = filter_size if filter_size % 2 else filter_size - 1
    offset = np.arange(size) - size // 2
    kernels = []
    for gaussians in _HALF_WIDTHS:
        kernel = np.zeros((size, size))
        for half_width_deg, weight in gaussians:
            sigma = half_width_deg * samples_per_degree / math.sqrt(2.0 * math.log(2.0))
            line = np.exp(-0.5 * (offset / sigma) ** 2)
            plane = np.outer(line, line)
            kernel += weight * plane / plane.sum()
        kernels.append(kernel / kernel.sum())
    return tuple(kernels)


def s_cielab(
    xyz: ArrayLike,
    white_xyz: ArrayLike,
    *,
    samples_per_degree: float,
    observer: Observer = 10,
    filter_size: int | None = None,
) -> NDArray[np.float64]:
    """Return the S-CIELAB image: clipped to 0 .. white, blurred circularly, at most one row and column shorter."""
    white = np.asarray(white_xyz, dtype=np.float64)
    clipped = np.clip(np.asarray(xyz, dtype=np.float64), 0.0, white)
    return xyz_to_lab(_blurred_xyz(clipped, samples_per_degree, observer, filter_size), white)


def s_cielab_difference(
    xyz: ArrayLike,
    other_xyz: ArrayLike,
    white_xyz: ArrayLike,
    *,
    samples_per_degree: float,
    observer: Observer = 10,
    filter_size: int | None = None,
) -> NDArray[np.float64]:
    """Return the map of CIEDE2000 differences of two pictures after the blur; nothing is clipped here."""
    white = np.asarray(white_xyz, dtype=np.float64)
    labs = [
        xyz_to_lab(_blurred_xyz(np.asarray(image, dtype=np.float64), samples_per_degree, observer, filter_size), white)
        for image in (xyz, other_xyz)
    ]
    return delta_e_2000(labs[0], labs[1])


def visual_snr(xyz: ArrayLike, white_xyz: ArrayLike, *, samples_per_degree: float, observer: Observer = 10) -> float:
    """Return 1 over the root of the summed variances of L*, a*, b* in the middle 80 % of a flat field's S-CIELAB image."""
    rows, cols = np.asarray(xyz).shape[:2]
    size = min(rows, cols) if min(rows, cols) < samples_per_degree else math.ceil(samples_per_degree)
    lab = s_cielab(xyz, white_xyz, samples_per_degree=samples_per_degree, observer=observer, filter_size=size)
    height, width = (_round_half_away(0.8 * side) for side in lab.shape[:2])
    top, left = (lab.shape[0] - height) // 2, (lab.shape[1] - width) // 2
    middle = lab[top : top + height, left : left + width]
    return 1.0 / math.sqrt(float(np.sum(np.var(middle, axis=(0, 1), ddof=1))))


def _blurred_xyz(
    xyz: NDArray[np.float64], samples_per_degree: float, observer: Observer, filter_size: int | None
) -> NDArray[np.float64]:
    if xyz.ndim != 3 or xyz.shape[2] != 3:
        raise ShapeError(f"xyz has shape {xyz.shape}; must be (rows, cols, 3).")
    matrix = _OPPONENT[observer]
    size = math.ceil(samples_per_degree) if filter_size is None else filter_size
    kernels = s_cielab_filters(samples_per_degree=samples_per_degree, filter_size=size)
    opponent = xyz @ matrix.T
    blurred = np.stack([_circular(opponent[..., k], kernels[k]) for k in range(3)], axis=-1)
    return np.asarray(blurred @ np.linalg.inv(matrix).T)


def _circular(plane: NDArray[np.float64], kernel: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the circular convolution of a plane, without its last row or column where the sizes differ by an odd number.

    A plane smaller than the kernel is mirrored out to the kernel's size first, and cut back.
    """
    kept = plane[tuple(slice(side - (side - kernel.shape[0]) % 2) for side in plane.shape)]
    outer = [max(0, (kernel.shape[0] - side) // 2) for side in kept.shape]
    padded = np.pad(kept, [(pad, pad) for pad in outer], mode="symmetric")
    inner = [(side - kernel.shape[0]) // 2 for side in padded.shape]
    wide = np.pad(kernel, [(pad, pad) for pad in inner])
    # fftshift on an odd size puts the kernel's middle on the last sample, not on the first: the picture moves by one.
    spectrum = np.fft.fft2(np.fft.fftshift(padded)) * np.fft.fft2(np.fft.fftshift(wide))
    moved = np.fft.ifftshift(np.real(np.fft.ifft2(spectrum)))
    return np.asarray(moved[outer[0] : moved.shape[0] - outer[0], outer[1] : moved.shape[1] - outer[1]])
