"""Shift-invariant point spread functions: from arrays, files and formulas to filters of an image's samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import AssetError, FieldError, ShapeError
from fullwell.optics.ringing import without_negative_light, without_ringing

__all__ = [
    "PointImage",
    "PointSpread",
    "PointSpreadFilter",
    "disc_kernel",
    "gaussian_psf",
    "pillbox_psf",
    "read_psf",
    "write_psf",
]

_ROUNDING = 1e-9
"""Below this a number is what rounding left of nothing."""

_CORE_SAMPLES = 257
"""Spread functions larger than this keep their exact transfer function for the middle; the rest, smooth at the scale of the
film's samples, is summed into them."""

_THREE_CELLS = 0.25
"""Variance of a disc two samples wide [square samples]."""

_MARGIN = 24
"""Film samples about a spread function in which the band-limited kernel fades out."""

_MOVED_SAMPLES = 0.5
"""Centroid of a point image from which on it counts as moving the picture."""

_MAX_KERNEL = 8191

_RINGING_BOUND = 0.5
"""How far the result may depart from the smooth image, as a share of that. Wider than for diffraction alone: the smooth filter
here is the integral over cells, which is blurred more."""

_CUT_OTF = 0.25
"""OTF at the edge of the Nyquist square from which on samples count as coarse; there the bound holds in full."""


@dataclass(frozen=True, slots=True, eq=False)
class PointImage:
    """The image of a point at one wavelength.

    Attributes
    ----------
    weights
        (rows, cols) float64, >= 0, sum 1 to 1e-9: shares of the light. The chief ray meets the middle of the array, sample
        ((rows - 1) / 2, (cols - 1) / 2); a centroid elsewhere shifts the image. Row 0 is the top of the upright image.
    spacing_m
        Distance of the samples on the sensor plane [m].
    """

    weights: NDArray[np.float64]
    spacing_m: float

    def transfer(self, down_cycles_per_m: ArrayLike, across_cycles_per_m: ArrayLike) -> NDArray[np.complex128]:
        """Return the OTF on the grid of two lists of frequencies: (down, across), complex, 1 at zero frequency."""
        down, across = (
            np.exp(-2j * np.pi * np.multiply.outer(np.asarray(f, dtype=np.float64), _positions(n) * self.spacing_m))
            for f, n in zip((down_cycles_per_m, across_cycles_per_m), self.weights.shape, strict=True)
        )
        return np.asarray(down @ self.weights @ across.T)

    def centroid_m(self) -> tuple[float, float]:
        """Return the centroid's distance from the chief ray (down, right) [m]."""
        rows, cols = (_positions(n) * self.spacing_m for n in self.weights.shape)
        return float(np.sum(self.weights, axis=1) @ rows), float(np.sum(self.weights, axis=0) @ cols)


@dataclass(frozen=True, slots=True, eq=False)
class PointSpread:
    """Point images at some wavelengths, all on one spacing; linear in wavelength between them, held beyond.

    Attributes
    ----------
    values
        (wavelengths, rows, cols), finite, >= 0, each of positive sum (normalised on use); or (rows, cols) for all wavelengths.
    spacing_m
        Distance of the samples on the sensor plane [m].
    wavelengths_nm
        Increasing; None with one image for all wavelengths.
    """

    values: NDArray[np.float64]
    spacing_m: float
    wavelengths_nm: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        stack = self.values if self.wavelengths_nm is not None else self.values[None]
        if stack.ndim != 3 or 0 in stack.shape or len(stack) != len(self.wavelengths_nm or (0,)):
            raise ShapeError(
                f"values has shape {self.values.shape} for {self.wavelengths_nm} nm; must be (wavelengths, rows, cols), or "
                "(rows, cols) without wavelengths_nm."
            )
        if not 0 < self.spacing_m < math.inf:
            raise FieldError(
                f"spacing_m is {self.spacing_m}; must be > 0 and finite. Set psf.spacing_m.",
                path="spacing_m",
                value=self.spacing_m,
            )
        waves = np.asarray(self.wavelengths_nm or (0.0,))
        if not np.all(np.isfinite(waves)) or np.any(np.diff(waves) <= 0):
            raise FieldError(
                f"wavelengths_nm is {self.wavelengths_nm}; must increase. Sort psf.wavelengths_nm.", path="wavelengths_nm"
            )
        low, sums = float(np.min(stack)), np.sum(stack, axis=(1, 2))
        if not (low >= 0 and np.all(np.isfinite(sums)) and np.all(sums > 0)):
            raise FieldError(
                f"values go down to {low} with sums {sums.tolist()}; must be finite, >= 0 and not all 0. "
                "Correct the psf's values.",
                path="values",
                value=low,
            )

    def at(self, wavelength_nm: float) -> PointImage:
        """Return the normalised point image at a wavelength."""
        if self.wavelengths_nm is None:
            return PointImage(_unit_sum(self.values), self.spacing_m)
        waves = np.asarray(self.wavelengths_nm)
        place = float(np.interp(wavelength_nm, waves, np.arange(len(waves))))
        first = min(int(place), len(waves) - 1)
        second = min(first + 1, len(waves) - 1)
        share = place - first
        mixed = (1 - share) * _unit_sum(self.values[first]) + share * _unit_sum(self.values[second])
        return PointImage(_unit_sum(mixed), self.spacing_m)


def gaussian_psf(sigma_m: float) -> PointSpread:
    """Return a round Gaussian of standard deviation `sigma_m` [m], cut off at 6 sigma (2e-9 of the light)."""
    _check_length("sigma_m", sigma_m)
    x = np.arange(-36, 37) / 6.0
    line = np.exp(-0.5 * x**2)
    return PointSpread(np.outer(line, line), sigma_m / 6.0)


def pillbox_psf(diameter_m: float) -> PointSpread:
    """Return a uniformly lit disc of `diameter_m` [m]; its rim is resolved to 1/64 of the diameter, with partial cells."""
    _check_length("diameter_m", diameter_m)
    return PointSpread(_disc(64.0, 65), diameter_m / 64.0)


def read_psf(path: Path) -> PointSpread:
    """Return the spread function in a .npz file with `values`, `spacing_m` and, optionally, `wavelengths_nm`.

    Raises
    ------
    AssetError
        The file cannot be read or lacks an entry.
    """
    try:
        with np.load(path, allow_pickle=False) as entries:
            waves = tuple(float(w) for w in entries["wavelengths_nm"]) if "wavelengths_nm" in entries else None
            return PointSpread(entries["values"].astype(np.float64), float(entries["spacing_m"]), waves)
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        raise AssetError(
            f"{path} is not a spread function: {error}. Write one with fullwell.optics.write_psf: an .npz file with values "
            "(wavelengths, rows, cols), spacing_m and wavelengths_nm."
        ) from error


def write_psf(path: Path, psf: PointSpread) -> None:
    """Write a spread function as `read_psf` reads it."""
    entries: dict[str, Any] = {"values": psf.values, "spacing_m": psf.spacing_m}
    if psf.wavelengths_nm is not None:
        entries["wavelengths_nm"] = np.asarray(psf.wavelengths_nm)
    np.savez_compressed(path, **entries)


class PointSpreadFilter:
    """The filter that one point image is for images of one sample pitch.

    The transfer function is that of the point image up to the Nyquist frequency. Where it does not vanish there the
    result is held within a factor 1.5 of that of the point image integrated over cells, so that highlights do not ring.
    The image continues beyond its border as its own mirror image, so that uniform images stay uniform. The sum is conserved
    where the point image's centroid lies within half a sample of the chief ray; other point images move the image, and light
    crosses the border. The kernel is as large as the point image needs, and the padding as the kernel: nothing
    wraps around.
    """

    def __init__(self, image: PointImage, *, pitch_m: float) -> None:
        self.contrast_loss = _worst_contrast_loss(image, pitch_m)
        """Largest |1 - OTF| up to the Nyquist frequency along a row or column, shifts included."""
        self._exact, self._smooth = _kernels(image, pitch_m)
        self._bound = _ringing_bound(image, pitch_m)
        self._centred = max(abs(d) for d in image.centroid_m()) < _MOVED_SAMPLES * pitch_m

    @property
    def reach(self) -> int:
        """Samples from the middle of the kernel to its border."""
        return int(max(self._exact.shape)) // 2

    def apply(self, band: NDArray[np.float64], *, workers: int = 1) -> NDArray[np.float64]:
        """Return the blurred band, (rows, cols), >= 0, in the unit it came in."""
        padded = _Padded(band, self._exact.shape, workers)
        exact = padded.convolved(self._exact)
        total, found = (math.fsum(np.sum(a, axis=1)) for a in (band, exact))
        if not self._centred:
            total = found
        elif found > 0:
            # What a lopsided point image loses at one border it need not gain at the other; the difference is tiny.
            exact *= total / found
        if math.isinf(self._bound):
            return without_negative_light(exact, total=total)
        return without_ringing(exact, padded.convolved(self._smooth), bound=self._bound, total=total)


class _Padded:
    """The spectrum of an image with its mirrored surroundings."""

    def __init__(self, band: NDArray[np.float64], kernel_shape: tuple[int, ...], workers: int) -> None:
        self._workers, self._shape = workers, band.shape
        self._reach = tuple(n // 2 for n in kernel_shape)
        mirrored = np.pad(band, [(r, r) for r in self._reach], mode="symmetric")
        self._size = tuple(scipy.fft.next_fast_len(n, real=True) for n in mirrored.shape)
        self._spectrum = scipy.fft.rfft2(mirrored, s=self._size, workers=workers)

    def convolved(self, kernel: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the convolution on the image's own samples."""
        transfer = scipy.fft.rfft2(kernel, s=self._size, workers=self._workers)
        transfer *= self._spectrum
        full = scipy.fft.irfft2(transfer, s=self._size, workers=self._workers, overwrite_x=True)
        # The kernel's middle stands at its index `reach`, the image's corner at the same one of the mirrored array.
        (top, left), (rows, cols) = (tuple(2 * r for r in self._reach), self._shape)
        return np.ascontiguousarray(full[top : top + rows, left : left + cols])


def _positions(count: int) -> NDArray[np.float64]:
    return np.arange(count, dtype=np.float64) - (count - 1) / 2


def _unit_sum(values: NDArray[np.float64]) -> NDArray[np.float64]:
    # Dividing by the peak first keeps the sum of very large values finite.
    scaled = np.asarray(values, dtype=np.float64) / np.max(values)
    return np.asarray(scaled / math.fsum(np.sum(scaled, axis=1)))


def _check_length(name: str, value: float) -> None:
    if not 0 < value < math.inf:
        raise FieldError(f"{name} is {value}; must be > 0 and finite. Set psf.{name}.", path=name, value=value)


def disc_kernel(diameter: float) -> NDArray[np.float64]:
    """Return the uniformly lit disc of `diameter` [samples] as shares of the light per sample, (odd, odd), sum 1, >= 0.

    Sharing light out between whole cells widens a disc by the variance of a cell, 1/12; the disc is narrowed for it, so
    that the kernel's variance is that of the disc, diameter^2 / 16 along each axis. Below two samples the variance is all
    that a disc has, and three cells along each axis have just that.
    """
    variance = diameter**2 / 16.0
    if variance <= _THREE_CELLS:
        line = np.array([variance / 2.0, 1.0 - variance, variance / 2.0])
        return np.outer(line, line) if variance > 0 else np.ones((1, 1))
    narrowed = math.sqrt(diameter**2 - 4.0 / 3.0)
    covered = _disc(narrowed, 2 * math.ceil((narrowed - 1.0) / 2.0) + 1)
    return np.asarray(covered / np.sum(covered))


def _disc(diameter: float, size: int) -> NDArray[np.float64]:
    """Return the share of each of (size, size) unit cells that a centred disc covers, by 8 x 8 points per cell."""
    inner = 8
    x = (np.arange(size * inner) + 0.5) / inner - size / 2
    inside = (x[:, None] ** 2 + x**2 <= diameter**2 / 4).reshape(size, inner, size, inner)
    return np.asarray(inside.mean(axis=(1, 3)))


def _refined(weights: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    """Return weights on a spacing `factor` times finer, linear between the given ones, of the same sum."""
    tent = 1.0 - np.abs(np.arange(1 - factor, factor)) / factor
    fine = weights
    for axis in (0, 1):
        count = fine.shape[axis]
        spread = np.zeros((count, (count + 1) * factor - 1))
        for k in range(count):
            spread[k, k * factor : k * factor + 2 * factor - 1] = tent
        fine = np.moveaxis(np.tensordot(fine, spread, axes=(axis, 0)), -1, axis)
    return np.asarray(fine / factor**2, dtype=np.float64)


def _kernels(image: PointImage, pitch_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the kernel with the exact transfer function and the one without negative weights, both (odd, odd), sum 1."""
    reach = tuple(_reach(n, image.spacing_m, pitch_m) for n in image.weights.shape)
    if 2 * max(reach) + 1 > _MAX_KERNEL:
        raise FieldError(
            f"the spread function covers {2 * max(reach) + 1} samples of the image; must be at most {_MAX_KERNEL}. Crop it.",
            path="psf",
            value=2 * max(reach) + 1,
        )
    core, rest = _core_and_rest(image.weights)
    # Samples farther apart than the film's say nothing about its highest frequencies.
    factor = math.ceil(image.spacing_m / pitch_m - _ROUNDING)
    if factor > 1:
        core = _refined(core, factor)
    spacing_m = image.spacing_m / max(1, factor)
    exact = _band_limited(PointImage(core, spacing_m), pitch_m, reach)
    smooth = _summed_into_samples(core, spacing_m, pitch_m, reach)
    if rest is not None:
        far = _summed_into_samples(rest, image.spacing_m, pitch_m, reach)
        exact, smooth = exact + far, smooth + far
    return exact / np.sum(exact), smooth / np.sum(smooth)


def _reach(count: int, spacing_m: float, pitch_m: float) -> int:
    return math.ceil(0.5 * count * spacing_m / pitch_m) + _MARGIN


def _core_and_rest(weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    if max(weights.shape) <= _CORE_SAMPLES:
        return weights, None
    # An even number is left out on both sides together, so that the middle stays the middle.
    sizes = [n if n <= _CORE_SAMPLES else _CORE_SAMPLES - (n - _CORE_SAMPLES) % 2 for n in weights.shape]
    window = tuple(slice((n - s) // 2, (n + s) // 2) for n, s in zip(weights.shape, sizes, strict=True))
    rest = weights.copy()
    rest[window] = 0.0
    return weights[window], rest


def _band_limited(image: PointImage, pitch_m: float, reach: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the kernel with the point image's transfer function up to Nyquist.

    What rings beyond the point image itself fades within `_MARGIN` samples: cut off hard, a lopsided point image's
    ringing would shift the image by up to a tenth of a sample.
    """
    inner = tuple(min(r, _reach(n, image.spacing_m, pitch_m)) for r, n in zip(reach, image.weights.shape, strict=True))
    down, across = (scipy.fft.fftfreq(2 * r + 1, pitch_m) for r in inner)
    kernel = np.fft.fftshift(scipy.fft.ifft2(image.transfer(down, across)).real)
    kernel *= np.outer(*(_fading(r) for r in inner))
    return np.pad(kernel, [(r - i, r - i) for r, i in zip(reach, inner, strict=True)])


def _fading(reach: int) -> NDArray[np.float64]:
    outside = np.abs(np.arange(-reach, reach + 1)) - (reach - _MARGIN)
    return np.asarray(np.cos(0.5 * np.pi * np.clip(outside / (_MARGIN + 1.0), 0.0, 1.0)) ** 2)


def _summed_into_samples(
    weights: NDArray[np.float64], spacing_m: float, pitch_m: float, reach: tuple[int, ...]
) -> NDArray[np.float64]:
    """Return the light of the point image shared between the film samples next to it, linearly: sum and centroid stay.

    It is the mean over a film sample of the image of a uniformly lit one.
    """
    down, across = (_shares(n, spacing_m / pitch_m, r) for n, r in zip(weights.shape, reach, strict=True))
    return np.asarray((across @ (down @ weights).T).T)


def _shares(count: int, spacing: float, reach: int) -> scipy.sparse.csr_array:
    place = _positions(count) * spacing + reach
    below = np.floor(place).astype(np.int64)
    above_share = place - below
    columns = np.arange(count)
    data = np.concatenate([1.0 - above_share, above_share])
    index = (np.concatenate([below, below + 1]), np.concatenate([columns, columns]))
    return scipy.sparse.csr_array((data, index), shape=(2 * reach + 1, count))


def _along_axes(image: PointImage, cycles_per_m: NDArray[np.float64]) -> NDArray[np.complex128]:
    return np.concatenate([image.transfer([0.0], cycles_per_m).ravel(), image.transfer(cycles_per_m, [0.0]).ravel()])


def _worst_contrast_loss(image: PointImage, pitch_m: float) -> float:
    return float(np.max(np.abs(1.0 - _along_axes(image, np.linspace(0.0, 0.5 / pitch_m, 9)))))


def _ringing_bound(image: PointImage, pitch_m: float) -> float:
    cut = min(1.0, float(np.max(np.abs(_along_axes(image, np.array([0.5 / pitch_m]))))) / _CUT_OTF)
    return _RINGING_BOUND / cut if cut > _ROUNDING else math.inf
