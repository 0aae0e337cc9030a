"""Draw the figures of the sensor pages beside this file: ``python docs/physics/figures/draw_sensors.py``. Needs matplotlib."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np

from fullwell.core import stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    BracketExposure,
    FixedExposure,
    OpticalImage,
    SensorModel,
    expected_electrons,
    expose,
    fixed_pattern_stream,
    sensor,
)
from fullwell.sensor.channel_sets import channel_set

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
GRID = WavelengthGrid(550.0, 550.0, 10.0)
LEVELS = np.geomspace(3.0, 2e6, 70)
COLOURS = {"R": "tab:red", "G": "tab:green", "B": "tab:blue", "Y": "gold", "Cy": "tab:cyan", "NIR": "tab:brown", "C": "black"}


def save(figure: plt.Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(HERE / name, dpi=90, metadata={"Software": None})
    plt.close(figure)


def snr_db(model: SensorModel, exposure: object = None) -> np.ndarray:
    """Return the signal-to-noise ratio at each of LEVELS, photo-electrons of the reference in 10 ms; NaN where saturated."""
    model = replace(model, rows=80, cols=80)
    light = OpticalImage(np.full((80, 80, 1), 1e16, np.float32), GRID, model.pixel_pitch_m)
    green = expected_electrons(light, model, 0.01)[0, 1]
    found = []
    for level in LEVELS:
        optical = OpticalImage(light.photons * np.float32(level / green), GRID, model.pixel_pitch_m)
        streams = {"rng": stream(0, "figure", str(level)), "fixed_pattern_rng": fixed_pattern_stream(model)}
        raw = expose(optical, model, exposure or FixedExposure(0.01), **streams)  # type: ignore[arg-type]
        signal = raw.dn[0::2, 1::2].astype(float) - raw.black_level_dn
        saturated = np.mean(signal) > 0.99 * (raw.white_level_dn - raw.black_level_dn)
        found.append(np.nan if saturated else 20 * np.log10(np.mean(signal) / np.std(signal)))
    return np.array(found)


def hdr() -> None:
    split = sensor("imx490")
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), sharey=True)
    for name, photodiodes in (("large alone", split.photodiodes[:1]), ("both", split.photodiodes)):
        for combination, style in (("select", "-"), ("weighted", "--")):
            if name == "both" or combination == "select":
                model = replace(split, photodiodes=photodiodes, combination=combination)
                label = name if name != "both" else f"both, {combination}"
                left.semilogx(LEVELS, snr_db(model), style, lw=1.2, label=label)
    left.set(title="imx490: split pixel", xlabel="photo-electrons of the large photodiode", ylabel="SNR [dB]")
    mono = replace(
        sensor("ideal-mono"), read_noise_e=3.0, analog_offset_v=0.01, well_capacity_e=20e3, conversion_gain_v_per_e=4.9e-5
    )
    right.semilogx(LEVELS, snr_db(mono), lw=1.2, label="one exposure")
    for combination, style in (("select", "-"), ("weighted", "--")):
        bracket = BracketExposure(FixedExposure(0.01), (1.0, 1 / 8, 1 / 64), combination)  # type: ignore[arg-type]
        right.semilogx(LEVELS, snr_db(mono, bracket), style, lw=1.2, label=f"bracket 1, 1/8, 1/64, {combination}")
    right.set(title="well of 20 000 e-, bracket", xlabel="photo-electrons in the longest exposure", ylim=(0, None))
    for axes in (left, right):
        axes.semilogx(LEVELS, 10 * np.log10(LEVELS), "k:", lw=0.8, label="shot noise alone")
        axes.legend(fontsize=7)
    save(figure, "hdr-snr.png")


def channels() -> None:
    figure, axes = plt.subplots(figsize=(6, 3.4))
    for name, curve in channel_set("representative").items():
        if name in COLOURS:
            axes.plot(curve.wavelength_nm, curve.values, color=COLOURS[name], lw=1.2, label=name)
    for name, curve in channel_set("mt9v024").items():
        if name in "RGB":
            axes.plot(curve.wavelength_nm, curve.values, ":", color=COLOURS[name], lw=1.2)
    axes.set(xlabel="wavelength [nm]", ylabel="quantum efficiency [e-/photon]", ylim=(0, None))
    axes.legend(fontsize=7, title="representative; dotted: mt9v024", title_fontsize=7)
    save(figure, "channel-sets.png")


if __name__ == "__main__":
    for draw in (hdr, channels):
        draw()
