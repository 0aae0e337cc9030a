"""Plots of benchmarks, all in one style; needs matplotlib (a development tool)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["calibration_plot", "error_plots", "scaling_plot"]

Record = dict[str, Any]

_COLOURS = {
    "mitsuba": "#444444",
    "uniform": "#1f77b4",
    "uniform-channels": "#17becf",
    "adaptive-no-skip": "#ff7f0e",
    "adaptive": "#d62728",
    "denoised": "#9467bd",
}


def _pyplot() -> Any:
    import matplotlib as mpl  # noqa: PLC0415 - slow to load

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    return plt


def error_plots(runs: Mapping[str, Mapping[str, Sequence[Record]]], folder: Path, measures: Mapping[str, str]) -> None:
    """Draw error against CPU-seconds of each scene, one panel for each measure, into error_<scene>.png."""
    plt = _pyplot()
    for scene, curves in runs.items():
        figure, axes = plt.subplots(1, len(measures), figsize=(4.2 * len(measures), 3.8), sharex=True)
        for axis, (measure, title) in zip(axes, measures.items(), strict=True):
            for engine, records in curves.items():
                _error_curve(axis, engine, records, measure)
            axis.set(xscale="log", yscale="log", title=title, xlabel="CPU-seconds")
            axis.grid(True, which="both", alpha=0.25)
        axes[0].set_ylabel("error / noise of the sensor")
        axes[-1].legend(fontsize=7)
        figure.suptitle(scene)
        _save(figure, folder / f"error_{scene}.png")


def _error_curve(axis: Any, engine: str, records: Sequence[Record], measure: str) -> None:
    """Draw an engine's runs as points, and the line through the geometric means of its budgets."""
    colour = _COLOURS.get(engine)
    points = [(record["cpu_s"], max(record[measure], 1e-3)) for record in records]
    axis.plot(*zip(*points, strict=True), ".", color=colour, markersize=4, alpha=0.5)
    budgets: dict[float, list[tuple[float, float]]] = {}
    for record, point in zip(records, points, strict=True):
        budgets.setdefault(record["noise_ratio"] or record["samples"], []).append(point)
    means = sorted(tuple(np.exp(np.mean(np.log(same), axis=0))) for same in budgets.values())
    style = "--" if engine == "denoised" else "-"
    axis.plot(*zip(*means, strict=True), style, color=colour, label=engine + (" (biased)" if engine == "denoised" else ""))


def calibration_plot(bins: Mapping[str, tuple[ArrayLike, ArrayLike]], path: Path) -> None:
    """Draw measured against predicted error over noise: (predicted, measured) of bins of tiles, by scene."""
    plt = _pyplot()
    figure, axis = plt.subplots(figsize=(5.2, 4.8))
    everything = [np.asarray(values) for pair in bins.values() for values in pair if len(np.asarray(values))]
    low = min((float(values[values > 0].min()) for values in everything if (values > 0).any()), default=0.1)
    high = max((float(values.max()) for values in everything), default=1.0)
    line = np.array([low, high])
    axis.fill_between(line, line / 1.2, line * 1.2, color="#cccccc", alpha=0.5, label="within 20 %")
    axis.plot(line, line, "-", color="#888888", linewidth=1)
    for scene, (predicted, measured) in bins.items():
        axis.plot(predicted, measured, ".-", label=scene, markersize=5, linewidth=0.8)
    axis.set(xscale="log", yscale="log", xlabel="predicted error / noise", ylabel="measured error / noise, rms of the bin")
    axis.grid(True, which="both", alpha=0.25)
    axis.legend(fontsize=7)
    _save(figure, path)


def scaling_plot(title: str, xlabel: str, x: ArrayLike, series: Mapping[str, ArrayLike], path: Path) -> None:
    """Draw CPU-seconds of several stages against what grows, log-log, with a line of proportionality."""
    plt = _pyplot()
    figure, axis = plt.subplots(figsize=(5.2, 4.0))
    places = np.asarray(x, dtype=np.float64)
    largest = max(float(np.nanmax(np.asarray(values, dtype=np.float64))) for values in series.values())
    axis.plot(places, largest * places / places.max(), ":", color="#888888", label="in proportion")
    for name, values in series.items():
        axis.plot(places, np.maximum(np.asarray(values, dtype=np.float64), 1e-4), ".-", label=name)
    axis.set(xscale="log", yscale="log", title=title, xlabel=xlabel, ylabel="CPU-seconds")
    axis.grid(True, which="both", alpha=0.25)
    axis.legend(fontsize=7)
    _save(figure, path)


def _save(figure: Any, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    _pyplot().close(figure)
