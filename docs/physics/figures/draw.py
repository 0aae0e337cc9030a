"""Draw the figures of docs/physics beside this file: ``python docs/physics/figures/draw.py``. Needs matplotlib."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np

from fullwell.core import stream
from fullwell.isp import IspSettings, develop
from fullwell.isp.colour_matrix import adapted_srgb_targets
from fullwell.isp.tone import encode_srgb
from fullwell.optics import cos_fourth, cutoff_cycles_per_m, diffract_band, diffraction_otf, disc_falloff
from fullwell.radiometry import COLORCHECKER_PATCHES, DEFAULT_GRID, WavelengthGrid, band_photons, illuminant, reflectance
from fullwell.sensor import AutoExposure, OpticalImage, capture, expose, fixed_pattern_stream, sensor

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent


def save(figure: plt.Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(HERE / name, dpi=90, metadata={"Software": None})
    plt.close(figure)


def falloff() -> None:
    field_deg = np.linspace(0, 60, 200)
    tan_field = np.tan(np.radians(field_deg))
    figure, axes = plt.subplots(figsize=(5, 3.2))
    axes.plot(field_deg, cos_fourth(tan_field), "k--", label="cos⁴ (pinhole)")
    for f_number in (4.0, 1.8, 0.95):
        axes.plot(field_deg, disc_falloff(tan_field, tan_pupil=0.5 / f_number), label=f"f/{f_number:g}")
    axes.set(xlabel="field angle [deg]", ylabel="irradiance over that on the axis", ylim=(0, 1.02))
    axes.legend()
    save(figure, "falloff.png")


def diffraction() -> None:
    wavelength_nm, f_number = 550.0, 4.0
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(10, 3.2))
    cutoff = float(cutoff_cycles_per_m(wavelength_nm, f_number))
    frequency = np.linspace(0, 1.1 * cutoff, 300)
    left.plot(frequency / 1e3, diffraction_otf(frequency, wavelength_nm=wavelength_nm, f_number=f_number))
    left.set(xlabel="frequency [cycles/mm]", ylabel="OTF at 550 nm, f/4")
    for pitch_um, marker in ((0.25, "-"), (1.4, "o-"), (3.0, "s-")):
        samples = round(60 / pitch_um) // 2 * 2 + 1
        x = (np.arange(samples) - samples // 2) * pitch_um
        edge = np.repeat((x > 0)[None, :].astype(float) + 0.5 * (x == 0), 3, axis=0)
        point = np.zeros((samples, samples))
        point[samples // 2, samples // 2] = 1.0
        options = {"wavelength_nm": wavelength_nm, "f_number": f_number, "pitch_m": pitch_um * 1e-6}
        middle.plot(x, diffract_band(edge, **options)[1], marker, ms=3, label=f"{pitch_um:g} µm samples")
        row = diffract_band(point, **options)[samples // 2]
        right.plot(x, row / np.max(row), marker, ms=3)
    middle.set(xlim=(-8, 8), xlabel="position [µm]", ylabel="edge")
    middle.legend(fontsize=7)
    right.set(xlim=(-8, 8), yscale="symlog", xlabel="position [µm]", ylabel="point image over its peak")
    right.set_yscale("log")
    right.set_ylim(1e-4, 1.5)
    save(figure, "diffraction.png")


def imx363() -> None:
    figure, axes = plt.subplots(figsize=(5, 3.2))
    for (name, curve), colour in zip(sensor("imx363").cfa.channels, ("tab:red", "tab:green", "tab:blue"), strict=True):
        axes.plot(curve.wavelength_nm, curve.values, color=colour, label=name)
    axes.set(xlabel="wavelength [nm]", ylabel="quantum efficiency [e-/photon]", ylim=(0, None))
    axes.legend()
    save(figure, "imx363.png")


def photon_transfer() -> None:
    model = replace(sensor("imx363"), rows=200, cols=200)
    grid = WavelengthGrid(550.0, 550.0, 10.0)
    optical = OpticalImage(np.full((200, 200, 1), 1e16, np.float32), grid, 1.4e-6)
    mean, temporal, total = [], [], []
    for time_s in np.geomspace(2e-5, 0.09, 40):
        one, two = (
            capture(optical, model, float(time_s), rng=stream(0, "figure", k), fixed_pattern_rng=fixed_pattern_stream(model))
            .dn[::2, 1::2]
            .astype(float)
            for k in (0, 1)
        )
        mean.append(one.mean() - 63.95)
        temporal.append(np.var(one - two) / 2)
        total.append(np.var(one))
    step_e = model.voltage_swing_v / 1023 / model.conversion_gain_v_per_e
    line = np.geomspace(1, 1000, 100)
    figure, axes = plt.subplots(figsize=(5, 3.4))
    axes.loglog(mean, np.sqrt(total), "s", ms=3, label="one frame")
    axes.loglog(mean, np.sqrt(temporal), "o", ms=3, label="difference of two frames")
    dark = (model.read_noise_e / step_e) ** 2 + 1 / 12
    axes.loglog(line, np.sqrt(line / step_e + dark), "k-", lw=0.8, label="shot and read noise")
    fixed = (model.prnu_fraction * line) ** 2 + (model.dsnu_v / model.voltage_swing_v * 1023) ** 2
    axes.loglog(line, np.sqrt(line / step_e + dark + fixed), "k--", lw=0.8, label="with DSNU and PRNU")
    axes.set(xlabel="mean over black level, green pixels [DN]", ylabel="standard deviation [DN]", xlim=(1, 1200), ylim=(5, 40))
    axes.legend(fontsize=7)
    save(figure, "photon-transfer.png")


def colorchecker() -> None:
    light = illuminant("D65")
    patches = np.stack([reflectance(f"colorchecker:{name}").band_average(DEFAULT_GRID) for name in COLORCHECKER_PATCHES])
    photons = patches * band_photons(light, DEFAULT_GRID)
    chart = np.kron(photons.reshape(4, 6, -1) / np.max(photons) * 1e16, np.ones((30, 30, 1))).astype(np.float32)
    figure, all_axes = plt.subplots(1, 3, figsize=(10, 2.6))
    for axes, name in zip(all_axes, ("imx363", "ideal-rgb"), strict=False):
        model = replace(sensor(name), rows=120, cols=180, pixel_pitch_m=1.4e-6)
        streams = {"rng": stream(0, "figure"), "fixed_pattern_rng": fixed_pattern_stream(model)}
        raw = expose(
            OpticalImage(chart, DEFAULT_GRID, 1.4e-6), model, AutoExposure("full", level=0.9, max_time_s=10), **streams
        )
        axes.imshow(develop(raw, IspSettings(light)).rgb)
        axes.set_title(name)
    wanted = adapted_srgb_targets(light, adapt_white=True)[1:].reshape(4, 6, 3)
    all_axes[2].imshow(np.kron(encode_srgb(wanted), np.ones((30, 30, 1), np.uint8)))
    all_axes[2].set_title("colorimetry")
    for axes in all_axes:
        axes.axis("off")
    save(figure, "colorchecker.png")


if __name__ == "__main__":
    for draw in (falloff, diffraction, imx363, photon_transfer, colorchecker):
        draw()
