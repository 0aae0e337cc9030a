"""Defocus by depth layers: the depth of field of a thin lens from a pinhole picture and its depths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.optics.psf import disc_kernel
from fullwell.radiometry.images import RadianceImage
from fullwell.scene.camera import Lens

__all__ = ["MAX_SKIPPED_BLUR_PX", "DefocusLayers", "circle_of_confusion_px", "defocus", "defocus_layers"]

MAX_SKIPPED_BLUR_PX: Final = 0.5
"""Where no circle of confusion is wider than this, nothing is done."""

_LAYER_PX = 1.0
"""Step of the circle's diameter from layer to layer: the error of a pixel's diameter is at most half a pixel."""

_NO_COVERAGE = 1e-9
"""Coverage below this is the rounding of a transform."""

_MOST_LAYERS = 256
_WIDEST_SHARE = 1.0
"""Of the picture's longer side: wider circles of confusion are refused, as nearly all their light comes from outside."""


@dataclass(frozen=True, slots=True, eq=False)
class DefocusLayers:
    """A picture's pixels by their blur.

    Attributes
    ----------
    diameter_px
        (layers,) diameter of the circle of confusion [samples], nearest layer first. Layers are equally spaced in dioptres.
    index
        (rows, cols) layer of each sample.
    worst_error_px
        Largest difference between a sample's own diameter and that of its layer.
    """

    diameter_px: NDArray[np.float64]
    index: NDArray[np.int64]
    worst_error_px: float


def circle_of_confusion_px(depth_z_m: NDArray[np.floating[Any]], lens: Lens, *, tangent_pitch: float) -> NDArray[np.float64]:
    """Return the diameter of the image of a point at depths along the axis [samples]; positive before the plane in focus.

    pupil diameter |1 / depth - 1 / focus distance|, as a tangent of the field angle, over the tangent's spacing. Depths may
    be +inf. By similar triangles; derived in docs/physics/defocus.md.
    """
    nearness = 1.0 / np.asarray(depth_z_m, dtype=np.float64) - 1.0 / lens.focus_distance_m
    return np.asarray(lens.pupil_diameter_m * nearness / tangent_pitch)


def defocus_layers(depth_z_m: NDArray[np.floating[Any]], lens: Lens, *, tangent_pitch: float) -> DefocusLayers:
    """Return the layers of a depth map, equally spaced in dioptres so that no diameter is wrong by more than half a sample.

    Raises
    ------
    FieldError
        A depth is NaN or not positive, or a blur is wider than the picture.
    """
    if not np.all(depth_z_m > 0):
        raise FieldError(
            f"depth_z_m goes down to {np.min(depth_z_m)}; must be > 0 everywhere, +inf where nothing is. "
            "Give depths along the axis.",
            path="depth_z_m",
            value=float(np.min(depth_z_m)),
        )
    signed = circle_of_confusion_px(depth_z_m, lens, tangent_pitch=tangent_pitch)
    widest = float(np.max(np.abs(signed)))
    if widest > _WIDEST_SHARE * max(signed.shape):
        raise FieldError(
            f"a circle of confusion is {widest:.0f} samples wide in a picture of {signed.shape[1]} x {signed.shape[0]}; "
            "render with lens.kind thin_lens instead, or stop the lens down.",
            path="depth_z_m",
            value=widest,
        )
    # Layers stand at whole steps from the plane in focus, so that what is in focus stays exactly sharp.
    step = max(_LAYER_PX, float(np.ptp(signed)) / _MOST_LAYERS)
    number = np.rint(signed / step).astype(np.int64)
    present, inverse = np.unique(-number, return_inverse=True)
    diameter = np.abs(present * step)
    index = inverse.reshape(signed.shape)
    worst = float(np.max(np.abs(np.abs(signed) - diameter[index])))
    return DefocusLayers(diameter, index, worst)


def defocus(
    radiance: RadianceImage, depth_z_m: NDArray[np.floating[Any]], lens: Lens, *, workers: int = 1
) -> tuple[RadianceImage, str]:
    """Return the picture with the depth of field of the lens, and the note that says what was done.

    Layers are composed from the nearest on: each is spread over its circle of confusion together with its coverage, and
    what lies behind shows through where the coverage is below 1. So a sharp foreground keeps its edge, without light
    of the blurred background on it. What a nearer object hides is guessed from the visible part of the layers behind it
    nearby. A uniform picture stays uniform to rounding.

    Parameters
    ----------
    radiance
        Rendered through a pinhole, everything in focus.
    depth_z_m
        (rows, cols) depth along the optical axis at the sample centres [m], +inf where nothing is hit.

    Raises
    ------
    ShapeError, FieldError
        The depths do not fit the picture, are not positive, or blur more than the picture's size.
    """
    if depth_z_m.shape != radiance.photons.shape[:2]:
        raise ShapeError(f"depth_z_m has shape {depth_z_m.shape}; must be {radiance.photons.shape[:2]}, as the radiance.")
    layers = defocus_layers(depth_z_m, lens, tangent_pitch=radiance.tangent_pitch)
    widest = float(np.max(np.abs(circle_of_confusion_px(depth_z_m, lens, tangent_pitch=radiance.tangent_pitch))))
    if widest <= MAX_SKIPPED_BLUR_PX:
        return radiance, (
            f"defocus: left out; no circle of confusion is wider than {widest:.2g} samples "
            f"(bound {MAX_SKIPPED_BLUR_PX} samples)."
        )
    photons = _Composition(layers, workers).compose(radiance.photons)
    image = RadianceImage(photons, radiance.grid, radiance.tangent_pitch, radiance.standard_error)
    return image, (
        f"defocus: {len(layers.diameter_px)} depth layers up to {widest:.3g} samples wide; their diameters are wrong by at "
        f"most {layers.worst_error_px:.2g} samples. What near objects hide is guessed."
    )


class _Composition:
    """Layers spread and laid over one another; what does not depend on the band is computed once.

    At each sample the rays through the pupil are shared out among the layers from the nearest on: a layer takes what its spread
    coverage asks for, as long as rays are left. Rays still left have passed a near object's edge and meet what it hides;
    they are given the mean of the layers that are partly hidden there.
    """

    def __init__(self, layers: DefocusLayers, workers: int) -> None:
        self._index, self._workers = layers.index, workers
        self._kernels = [disc_kernel(d) for d in layers.diameter_px]
        self._fill = disc_kernel(2.0 * float(np.max(layers.diameter_px)) + 3.0)
        reach = max(len(k) for k in (*self._kernels, self._fill)) // 2
        self._reach = reach
        self._size = tuple(scipy.fft.next_fast_len(n + 2 * reach, real=True) for n in layers.index.shape)
        self._transfers = [self._transfer(k) for k in self._kernels]
        self._fill_transfer = self._transfer(self._fill)
        self._shares, self._fill_shares, self._scale = self._visibility()

    def compose(self, photons: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the composed picture (rows, cols, bands), >= 0."""
        composed = np.empty_like(photons)
        for band in range(photons.shape[2]):
            light = photons[:, :, band].astype(np.float64)
            total = np.zeros_like(light)
            for layer, share in enumerate(self._shares):
                spectrum = self._spectrum(np.where(self._index == layer, light, 0.0))
                total += share * self._convolved(spectrum, self._transfers[layer])
                fill = self._fill_shares[layer]
                if fill is not None:
                    total += fill * self._convolved(spectrum, self._fill_transfer)
            composed[:, :, band] = np.maximum(total * self._scale, 0.0)
        return composed

    def _visibility(self) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64] | None], NDArray[np.float64]]:
        """Return per layer the factors of its spread light and of its light as a fill, and the last normalisation."""
        left = np.ones(self._index.shape)
        shares, hidden = [], []
        for layer, transfer in enumerate(self._transfers):
            own = self._spectrum((self._index == layer).astype(np.float64))
            coverage = self._convolved(own, transfer)
            taken = np.minimum(coverage, left)
            shares.append(np.divide(taken, coverage, out=np.zeros_like(left), where=coverage > _NO_COVERAGE))
            left = np.maximum(left - shares[-1] * coverage, 0.0)
            # Rays of this layer that land on something nearer, where the layer is in sight nearby.
            behind = self._convolved(self._spectrum((self._index < layer).astype(np.float64)), transfer)
            hidden.append((behind * (behind > _NO_COVERAGE), self._convolved(own, self._fill_transfer)))
        wanted = sum((behind * near for behind, near in hidden), np.zeros_like(left))
        known = wanted > _NO_COVERAGE
        per_ray = np.divide(left, wanted, out=np.zeros_like(left), where=known)
        fills = [behind * per_ray if np.any((behind * left)[known] > _NO_COVERAGE) else None for behind, _ in hidden]
        given = 1.0 - left
        for fill, (_, near) in zip(fills, hidden, strict=True):
            if fill is not None:
                given = given + fill * near
        return shares, fills, np.divide(1.0, given, out=np.ones_like(left), where=given > _NO_COVERAGE)

    def _transfer(self, kernel: NDArray[np.float64]) -> NDArray[np.complex128]:
        centred = np.zeros(self._size)
        half = len(kernel) // 2
        centred[: len(kernel), : len(kernel)] = kernel
        return np.asarray(scipy.fft.rfft2(np.roll(centred, (-half, -half), axis=(0, 1)), workers=self._workers))

    def _spectrum(self, plane: NDArray[np.float64]) -> NDArray[np.complex128]:
        mirrored = np.pad(plane, self._reach, mode="symmetric")
        return np.asarray(scipy.fft.rfft2(mirrored, s=self._size, workers=self._workers))

    def _convolved(self, spectrum: NDArray[np.complex128], transfer: NDArray[np.complex128]) -> NDArray[np.float64]:
        full = scipy.fft.irfft2(spectrum * transfer, s=self._size, workers=self._workers, overwrite_x=True)
        rows, cols = self._index.shape
        window = full[self._reach : self._reach + rows, self._reach : self._reach + cols]
        return np.asarray(np.maximum(window, 0.0))
