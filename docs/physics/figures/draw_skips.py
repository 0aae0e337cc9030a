"""Draw the figure of the page on skips beside this file (python docs/physics/figures/draw_skips.py). Needs matplotlib."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from fullwell.pipeline.path_depth import tail_bound

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent

MEASURED = {
    0.1: ((12, 0.14, 0.0054), (25, 0.037, 0.0014), (50, 0.011, 0.00040), (100, 0.0031, 0.00011)),
    0.3: ((12, 0.24, 0.0055), (25, 0.083, 0.0015), (50, 0.031, 0.00042), (100, 0.012, 0.000097)),
    0.5: ((12, 0.74, 0.0065), (25, 0.35, 0.0018), (50, 0.18, 0.00045), (100, 0.088, 0.00014)),
}
"""By reflectance: distance [m], bound and measured change of what a wall gets when four boxes behind the camera go."""


def draw() -> None:
    figure, (reach, measured, depth) = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    ratio = np.geomspace(2, 1e4, 100)
    for value in (0.0, 0.1, 0.3, 0.5, 0.7):
        reach.loglog(ratio, ratio ** (-2 * (1 - value)), label=f"reflectance {value:g}")
    reach.axhline(2e-3, color="k", linestyle=":")
    reach.set(xlabel="distance over radius of the ball", ylabel="bound: share of walks that enter it", ylim=(1e-6, 1))
    reach.legend(fontsize=8)
    for colour, (value, rows) in zip(("C1", "C2", "C3"), MEASURED.items(), strict=True):
        distance_m, bound, change = np.array(rows).T
        measured.loglog(distance_m, bound, "--", color=colour, label=f"bound, reflectance {value:g}")
        measured.loglog(distance_m, change, "o-", color=colour, label="measured")
    measured.set(xlabel="distance behind the camera [m]", ylabel="change over full irradiance", ylim=(2e-7, 2))
    measured.minorticks_off()
    measured.set_xticks([12, 25, 50, 100], labels=["12", "25", "50", "100"])
    measured.legend(fontsize=7, loc="lower left")
    segments = np.arange(2, 17)
    for value in (0.1, 0.3, 0.5, 0.7, 0.9):
        depth.semilogy(segments, [tail_bound(value, int(n)) for n in segments], label=f"reflectance {value:g}")
    depth.axhline(1e-3, color="k", linestyle=":")
    depth.set(xlabel="segments", ylabel="light of longer paths, at most", ylim=(1e-6, 10))
    depth.legend(fontsize=8)
    figure.savefig(HERE / "skips.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


if __name__ == "__main__":
    draw()
