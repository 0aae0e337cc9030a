"""Draw the figures of the optics pages beside this file: ``python docs/physics/figures/draw_optics.py``. Needs matplotlib."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl
import numpy as np
import scipy.fft

from fullwell.optics import (
    Aperture,
    Wavefront,
    aperture_mask,
    cutoff_cycles_per_m,
    defocus,
    diffract_band,
    diffraction_otf,
    flare_point_image,
    wavefront_point_image,
)
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
WAVELENGTH_NM, F_NUMBER, PUPIL_M = 550.0, 2.0, 2e-3


def save(figure: plt.Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(HERE / name, dpi=90, metadata={"Software": None})
    plt.close(figure)


def ringing() -> None:
    """A lamp 1e4 times brighter than its ground, at 2.8 um and f/2."""
    pitch_m = 2.8e-6
    lamp = np.full((60, 80), 1e-4)
    lamp[28:32, 30:50] = 1.0
    radius = np.hypot(np.arange(60)[:, None] / 120, np.arange(80) / 160) / pitch_m
    otf = diffraction_otf(radius, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER)
    exact = scipy.fft.idctn(scipy.fft.dctn(lamp) * otf)
    held = diffract_band(lamp, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER, pitch_m=pitch_m)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2))
    for axis, image, title in zip(
        axes, (np.maximum(exact, 0), held), ("OTF alone, negative light cut off", "held"), strict=True
    ):
        shown = axis.imshow(np.log10(np.maximum(image, 1e-5)), vmin=-4.2, vmax=-1.5, cmap="magma")
        axis.set(title=title, xticks=[], yticks=[])
    figure.colorbar(shown, ax=list(axes), label="log10 of the light")
    figure.savefig(HERE / "ringing.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


def wavefront() -> None:
    figure, axes = plt.subplots(1, 4, figsize=(12, 3.1))
    cutoff = float(cutoff_cycles_per_m(WAVELENGTH_NM, F_NUMBER))
    frequency = np.linspace(0, cutoff, 120)
    shapes = (("defocus", 4), ("coma", 8), ("spherical", 12))
    for axis, (name, index) in zip(axes, shapes, strict=False):
        waves = Wavefront(((index, 0.2 * WAVELENGTH_NM * 1e-9),))
        image = wavefront_point_image(
            waves, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER, pupil_diameter_m=PUPIL_M, pitch_m=0.2e-6
        )
        middle, half = len(image.weights) // 2, round(4e-6 / image.spacing_m)
        window = slice(middle - half, middle + half + 1)
        axis.imshow(np.sqrt(image.weights[window, window]), cmap="gray", extent=(-4, 4, -4, 4))
        axis.set(title=f"{name}, 0.2 waves rms", xlabel="µm")
        axes[3].plot(frequency / 1e3, np.abs(image.transfer([0.0], frequency)[0]), label=name)
    axes[3].plot(
        frequency / 1e3, diffraction_otf(frequency, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER), "k--", label="none"
    )
    axes[3].set(xlabel="frequency across [cycles/mm]", ylabel="MTF")
    axes[3].legend(fontsize=7)
    save(figure, "wavefront.png")


def flare() -> None:
    figure, axes = plt.subplots(2, 4, figsize=(11, 5.4))
    apertures = (Aperture(), Aperture(5, 90.0), Aperture(6), Aperture(0, scratches=25, dust_grains=25))
    for (top, bottom), aperture in zip(axes.T, apertures, strict=True):
        mask = aperture_mask(aperture, 512)
        weights = flare_point_image(mask, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER).weights
        top.imshow(mask, cmap="gray")
        bottom.imshow(np.log10(weights[311:712, 311:712] / np.max(weights) + 1e-12), vmin=-7, vmax=-1, cmap="magma")
        for axis in (top, bottom):
            axis.set(xticks=[], yticks=[])
    save(figure, "flare.png")


def depth_layers() -> None:
    grid = WavelengthGrid(550.0, 550.0, 10.0)
    x, y = np.meshgrid(np.arange(120), np.arange(90))
    light, depth = 0.3 + 0.7 * ((x // 6 + y // 6) % 2), np.full((90, 120), 5.0)
    near = np.hypot(x - 45, y - 50) < 26
    light[near], depth[near] = 0.15 + 0.85 * ((y[near] // 4) % 2), 1.0
    scene = RadianceImage(light[:, :, None].astype(np.float32), grid, 2 * math.tan(math.radians(15)) / 120)
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 2.9))
    axes[0].imshow(light, cmap="gray", vmin=0, vmax=1)
    axes[0].set_title("pinhole")
    for axis, focus_m in zip(axes[1:], (1.0, 5.0), strict=True):
        lens = Lens("pinhole", 0.05, 1.4, focus_m, Spectrum.constant(1.0))
        axis.imshow(defocus(scene, depth, lens)[0].photons[:, :, 0], cmap="gray", vmin=0, vmax=1)
        axis.set_title(f"focus at {focus_m:g} m")
    for axis in axes:
        axis.set(xticks=[], yticks=[])
    save(figure, "defocus.png")


if __name__ == "__main__":
    ringing()
    wavefront()
    flare()
    depth_layers()
