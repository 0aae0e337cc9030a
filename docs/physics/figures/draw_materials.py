"""Draw the figure of the materials page beside this file (python docs/physics/figures/draw_materials.py). Needs matplotlib."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from fullwell.radiometry.glasses import glass, glass_names
from fullwell.render.transport.albedo import (
    NODE_COUNT,
    coat_transmittance,
    entering,
    glass_albedo,
    hemisphere_mean,
    metal_albedo,
    mitsuba_internal,
)

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
ANGLE_DEG = np.degrees(np.arccos(np.linspace(0.0, 1.0, NODE_COUNT) ** 2))


def draw() -> None:
    figure, (metals, bodies, indices) = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    for alpha in (0.05, 0.2, 0.5, 1.0):
        metals.plot(ANGLE_DEG, metal_albedo(alpha), label=f"alpha {alpha:g}")
    metals.axhline(1.0, color="black", linestyle=":", label="compensated, any alpha")
    metals.set(title="white metal", ylabel="light returned by single scattering", ylim=(0, 1.05))
    for alpha, colour in ((0.1, "tab:blue"), (0.5, "tab:orange")):
        coated = white_plastic(alpha)
        bodies.plot(ANGLE_DEG, coated, color=colour, label=f"plastic, alpha {alpha:g}")
        bodies.plot(ANGLE_DEG, glass_albedo(alpha, 1.5), color=colour, linestyle="--", label=f"glass, alpha {alpha:g}")
    bodies.axhline(1.0, color="black", linestyle=":")
    bodies.set(title="white plastic and glass, index 1.5", ylim=(0, 1.05))
    for axes in (metals, bodies):
        axes.set(xlabel="angle of incidence [deg]", xlim=(0, 90))
        axes.legend(fontsize=8)
    wavelength_nm = np.linspace(380.0, 1000.0, 200)
    for name in glass_names():
        indices.plot(wavelength_nm, glass(name).at(wavelength_nm), label=name)
    indices.set(title="glasses by name", xlabel="wavelength [nm]", ylabel="refractive index")
    indices.legend(fontsize=8)
    figure.savefig(HERE / "materials.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


def white_plastic(alpha: float) -> np.ndarray:
    """Return the albedo of a white body under a coat whose facets mask light, without compensation."""
    through = entering(alpha, 1.5)
    body = hemisphere_mean(through) / 1.5**2 / (1.0 - mitsuba_internal(alpha, 1.5))
    return np.asarray(1.0 - coat_transmittance(alpha, 1.5) + through * body)


if __name__ == "__main__":
    draw()
