"""Draw the figure of metrics_edge_sfr.md: ``python docs/physics/figures/draw_metrics.py``. Needs matplotlib."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from fullwell.core import stream
from fullwell.metrics import edge_sfr, isetcam

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
SLANT_DEG = 5.0


def lens_and_pixel(frequency: NDArray[np.float64], *, f_number: float, pitch_um: float) -> NDArray[np.float64]:
    """Return the MTF of a diffraction-limited lens at 550 nm times that of a square pixel, along the edge's normal."""
    share = np.minimum(frequency * 0.55 * f_number / pitch_um, 1.0)
    diffraction = 2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2))
    along, across = np.cos(np.radians(SLANT_DEG)), np.sin(np.radians(SLANT_DEG))
    return np.asarray(diffraction * np.sinc(frequency * along) * np.sinc(frequency * across))


def edge_image(side: int, frequency: NDArray[np.float64], transfer: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a slanted edge from 100 to 900 with this transfer function."""
    row, col = np.mgrid[:side, :side] - (side - 1) / 2
    distance = col * np.cos(np.radians(SLANT_DEG)) + row * np.sin(np.radians(SLANT_DEG))
    middle = 0.5 * (frequency[1:] + frequency[:-1])
    weight = np.interp(middle, frequency, transfer) / (np.pi * middle) * np.diff(frequency)
    places = np.linspace(distance.min(), distance.max(), 6001)
    return np.asarray(100 + 800 * np.interp(distance, places, 0.5 + np.sin(2 * np.pi * np.outer(places, middle)) @ weight))


def main() -> None:
    """Draw an edge, its profile, and the MTF found against the one put in."""
    frequency = np.linspace(0, 4, 12001)
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.3), width_ratios=[1, 1.2, 2])
    for f_number, colour in ((2.0, "tab:blue"), (4.0, "tab:orange"), (8.0, "tab:green")):
        transfer = lens_and_pixel(frequency, f_number=f_number, pitch_um=1.4)
        image = edge_image(160, frequency, transfer)
        noisy = image + stream(0, "figure", str(f_number)).normal(0, 4, image.shape)
        response = edge_sfr(noisy, window="tukey")
        middle.plot(response.profile_distance_px, response.profile, color=colour, lw=1)
        right.plot(frequency, transfer, color=colour, lw=1, label=f"f/{f_number:g}, put in")
        right.plot(response.frequency_cycles_per_px[::8], response.mtf[::8], "o", color=colour, ms=3)
        theirs = isetcam.iso12233(noisy[:, 30:-30], pixel_pitch_mm=1.0)
        right.plot(theirs.frequency_cycles_per_mm, theirs.mtf, "x", color=colour, ms=4)
    left.imshow(noisy, cmap="gray")
    left.axis("off")
    middle.set(xlim=(-8, 8), xlabel="distance from the edge [px]", ylabel="edge profile [DN]")
    right.axvline(0.5, color="grey", lw=0.7)
    right.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="frequency [cycles/px]", ylabel="MTF (dots: edge_sfr, crosses: ISETCam's)")
    right.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(HERE / "metrics-edge.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


if __name__ == "__main__":
    main()
