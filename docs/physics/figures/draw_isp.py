"""Draw the figures of image processing beside this file: ``python docs/physics/figures/draw_isp.py``. Needs matplotlib."""

from __future__ import annotations

from pathlib import Path

import colour
import matplotlib as mpl
import numpy as np

from fullwell.isp import ToneCurve
from fullwell.isp.colour_matrix import (
    adapted_srgb_targets,
    channel_responses,
    fit_colour_matrix,
    noise_amplification,
    xyz_to_linear_srgb_matrix,
)
from fullwell.isp.demosaic import demosaic
from fullwell.isp.tone import apply_tone
from fullwell.isp.white_balance import gains_for_white
from fullwell.radiometry import DEFAULT_GRID, illuminant, linear_to_srgb
from fullwell.sensor import sensor

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent


def save(figure: plt.Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(HERE / name, dpi=90, metadata={"Software": None})
    plt.close(figure)


def lab(linear: np.ndarray) -> np.ndarray:
    xyz = np.clip(linear, 0, 1) @ np.linalg.inv(xyz_to_linear_srgb_matrix()).T
    return np.asarray(colour.XYZ_to_Lab(xyz, np.array([0.3127, 0.3290])))


def colour_noise() -> None:
    figure, axes = plt.subplots(figsize=(5, 3.2))
    curves = tuple(curve for _, curve in sensor("imx363").cfa.channels)
    for light in ("D65", "A"):
        responses = channel_responses(curves, illuminant(light), DEFAULT_GRID)
        balanced, gains = responses / responses[0], gains_for_white(responses[0])
        targets = adapted_srgb_targets(illuminant(light), adapt_white=True)
        points = []
        for noise in (0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.2):
            matrix = fit_colour_matrix(balanced, targets, channel_noise=noise * gains)
            error = np.mean(colour.delta_E(lab(balanced[1:] @ matrix.T), lab(targets[1:]), method="CIE 2000"))
            points.append((noise_amplification(matrix, gains), error))
            if light == "A" and noise in (0, 0.01, 0.02, 0.05, 0.1):
                axes.annotate(f"σ = {noise:g}", points[-1], xytext=(6, 3), textcoords="offset points", fontsize=7)
        axes.plot(*np.array(points).T, "o-", ms=3, label=f"IMX363 under {light}")
    axes.set(xlabel="noise amplification", ylabel="CIEDE2000, mean of 24 patches", xlim=(0, 4.6), ylim=(0, None))
    axes.legend()
    save(figure, "colour-noise.png")


def demosaicing() -> None:
    size = 128
    y, x = np.mgrid[0:size, 0:size] / size
    wave = 0.5 + 0.4 * np.cos(np.pi * 0.8 * size * (x**2 + y**2) / 2)
    planes = np.stack([wave * (0.6 + 0.3 * x), wave * 0.8, wave * (0.5 + 0.3 * y)], axis=2)
    mosaic = planes[:, :, 1].copy()
    mosaic[::2, ::2], mosaic[1::2, 1::2] = planes[::2, ::2, 0], planes[1::2, 1::2, 2]
    figure, axes = plt.subplots(1, 4, figsize=(10, 2.8))
    axes[0].imshow(linear_to_srgb(planes), interpolation="nearest")
    axes[0].set_title("scene", fontsize=9)
    for axis, method in zip(axes[1:], ("bilinear", "malvar2004", "menon2007"), strict=True):
        found = demosaic(mosaic, (("R", "G"), ("G", "B")), ("R", "G", "B"), method=method)
        inner = (slice(4, -4), slice(4, -4))
        psnr_db = -10 * np.log10(np.mean((found[inner] - planes[inner]) ** 2))
        axis.imshow(linear_to_srgb(np.clip(found, 0, 1)), interpolation="nearest")
        axis.set_title(f"{method}: {psnr_db:.1f} dB", fontsize=9)
    for axis in axes:
        axis.set_axis_off()
    save(figure, "demosaic.png")


def tone() -> None:
    light = np.linspace(0, 1, 500)
    figure, axes = plt.subplots(figsize=(5, 3.2))
    for curve, label in (
        (ToneCurve(), "srgb"),
        (ToneCurve("linear"), "linear"),
        (ToneCurve("gamma"), "gamma 2.2"),
        (ToneCurve("filmic", exposure_ev=2.0), "filmic, +2 EV"),
        (ToneCurve(exposure_ev=2.0), "srgb, +2 EV"),
        (ToneCurve("s_curve"), "s_curve, contrast 1.5"),
    ):
        axes.plot(light, apply_tone(light, curve), label=label)
    axes.set(xlabel="linear value, 1 = saturation", ylabel="display value")
    axes.legend(fontsize=7)
    save(figure, "tone.png")


if __name__ == "__main__":
    for draw in (colour_noise, demosaicing, tone):
        draw()
