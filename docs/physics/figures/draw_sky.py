"""Draw the figure of the sky page beside this file: ``python docs/physics/figures/draw_sky.py``. Needs matplotlib."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl
import numpy as np

from fullwell.radiometry import (
    SkyRadiance,
    Spectrum,
    clear_sky,
    colour_matching_functions,
    illuminance_lux,
    linear_to_srgb,
)

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
XYZ_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
"""IEC 61966-2-1."""

MEDIAN_SHOWN = 0.25
"""Linear value of the median pixel; the aureole is clipped."""


def sky_at(elevation_deg: float, turbidity: float = 3.0) -> SkyRadiance:
    elevation = math.radians(elevation_deg)
    south = (0.0, -math.cos(elevation), math.sin(elevation))
    return clear_sky(south, turbidity=turbidity, ground_albedo=0.2, rows=128, cols=256)


def picture(sky: SkyRadiance) -> np.ndarray:
    """Return the upper half as sRGB, its median at a mid grey, from north through east, south and west."""
    wavelength_nm = np.arange(380.0, 781.0, 5.0)
    basis = np.stack([np.interp(wavelength_nm, sky.wavelength_nm, curve) for curve in sky.basis])
    observer = np.stack([curve.at(wavelength_nm) for curve in colour_matching_functions()])
    xyz = sky.coefficients[:64].astype(float) @ (basis @ observer.T)
    rgb = xyz @ XYZ_TO_SRGB.T / np.median(xyz[..., 1]) * MEDIAN_SHOWN
    clockwise_from_east = rgb[:, ::-1]
    return np.asarray(linear_to_srgb(np.clip(np.roll(clockwise_from_east, rgb.shape[1] // 4, axis=1), 0.0, 1.0)))


def draw() -> None:
    figure = plt.figure(figsize=(10, 6.2), layout="constrained")
    top, bottom = figure.subfigures(2, 1)
    for column, elevation_deg in enumerate((5, 20, 60)):
        axes = top.add_subplot(1, 3, column + 1)
        axes.imshow(picture(sky_at(elevation_deg)), extent=(0, 360, 0, 90), aspect="auto")
        axes.set(title=f"sun at {elevation_deg} deg", xlabel="azimuth from north, clockwise [deg]", ylabel="elevation [deg]")
    spectra(bottom.add_subplot(1, 2, 1))
    daylight(bottom.add_subplot(1, 2, 2))
    figure.savefig(HERE / "sky.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


def spectra(axes: plt.Axes) -> None:
    sky = sky_at(30.0)
    axes.plot(sky.wavelength_nm, sky.sun_irradiance(), color="tab:orange", label="sun, normal [W m$^{-2}$ nm$^{-1}$]")
    axes.plot(sky.wavelength_nm, sky.sky_irradiance(), color="tab:blue", label="sky, horizontal [W m$^{-2}$ nm$^{-1}$]")
    axes.plot(
        sky.wavelength_nm,
        10 * sky.radiance()[0].mean(axis=0),
        "k",
        lw=0.9,
        label="zenith, ten times [W m$^{-2}$ sr$^{-1}$ nm$^{-1}$]",
    )
    axes.axvline(720.0, color="grey", ls=":", lw=0.8)
    axes.set(xlabel="wavelength [nm]", title="sun at 30 deg, turbidity 3", ylim=(0, None), xlim=(360, 1000))
    axes.legend(fontsize=7)


def daylight(axes: plt.Axes) -> None:
    elevation_deg = np.concatenate([np.arange(1, 10, 1.5), np.arange(10, 91, 5)])
    for turbidity, colour in ((2.0, "tab:blue"), (3.0, "tab:green"), (6.0, "tab:brown")):
        total, diffuse = [], []
        for elevation in elevation_deg:
            sky = sky_at(float(elevation), turbidity)
            lit = [sky.sky_irradiance(), sky.sun_irradiance() * sky.sun_direction[2]]
            lux = [illuminance_lux(Spectrum(sky.wavelength_nm, values, outside="zero")) for values in lit]
            total.append(sum(lux) / 1e3)
            diffuse.append(lux[0] / 1e3)
        axes.semilogy(elevation_deg, total, color=colour, label=f"turbidity {turbidity:g}")
        axes.semilogy(elevation_deg, diffuse, "--", color=colour)
    high = np.arange(20, 91, 5.0)
    usno = 10 ** np.polyval([1.47, -4.07, 3.97, 3.74], high / 90) / 1e3
    axes.semilogy(high, usno, "k.", label="USNO circular 171")
    low = np.arange(5, 20, 2.5)
    axes.semilogy(low, 10 ** np.polyval([64.33, -45.98, 13.28, 3.05], low / 90) / 1e3, "k.")
    axes.set(xlabel="elevation of the sun [deg]", ylabel="[klx]", title="horizontal: sun and sky, sky alone (dashed)")
    axes.legend(fontsize=7)


if __name__ == "__main__":
    draw()
