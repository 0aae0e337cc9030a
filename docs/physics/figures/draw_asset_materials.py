"""Draw the pictures of the asset materials page: ``python docs/physics/figures/draw_asset_materials.py``. Needs matplotlib."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from fullwell.assets.materials.catalogue import asset_materials
from fullwell.assets.materials.colours import display_srgb, emission_srgb, seen_spectrum, spectrum_points
from fullwell.assets.materials.leaves import Leaf, leaf_reflectance
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.skin import SKIN_INDEX, skin_body_reflectance
from fullwell.assets.materials.surface import body_seen_through_coat

mpl.use("Agg")
import matplotlib.pyplot as plt

IMAGES = Path(__file__).parents[2] / "images" / "materials"
NM = np.arange(380.0, 1000.1, 5.0)
COLS = 6


def families() -> dict[str, list[SpectralMaterial]]:
    found: dict[str, list[SpectralMaterial]] = {}
    for material in asset_materials().values():
        found.setdefault(material.name.partition("/")[0], []).append(material)
    return found


def save(figure: plt.Figure, name: str) -> None:
    IMAGES.mkdir(parents=True, exist_ok=True)
    figure.savefig(IMAGES / name, dpi=80, metadata={"Software": None})
    plt.close(figure)


def spectra() -> None:
    shown = families()
    rows = -(-len(shown) // COLS)
    figure, grid = plt.subplots(rows, COLS, figsize=(17, 2.5 * rows), layout="constrained", sharex=True)
    for axes, (family, materials) in zip(grid.flat, shown.items(), strict=False):
        curves(axes, family, materials)
    for axes in list(grid.flat)[len(shown) :]:
        axes.axis("off")
    for axes in grid[-1]:
        axes.set_xlabel("wavelength [nm]")
    figure.suptitle(
        "Reflectance as seen along the normal without gloss; lamps: relative emission. Lines in the colour under D65"
    )
    save(figure, "spectra.png")


def curves(axes: Axes, family: str, materials: list[SpectralMaterial]) -> None:
    axes.set_facecolor("0.86")
    axes.axvspan(700, 1000, color="0.80", zorder=0)
    highest = 0.0
    for material in materials:
        points = spectrum_points(material)
        colour = emission_srgb(material) or display_srgb(material)
        values = [value for _, value, _ in points]
        highest = max(highest, *values)
        label = material.name.partition("/")[2]
        axes.plot([nm for nm, _, _ in points], values, color="0.2", linewidth=2.6)
        axes.plot([nm for nm, _, _ in points], values, color=colour, linewidth=1.8, label=label)
    axes.set_title(family, fontsize=10)
    axes.set(xlim=(380, 1000), ylim=(0, min(1.05, 1.12 * highest)))
    axes.tick_params(labelsize=7)
    if len(materials) <= 6:
        axes.legend(fontsize=6.5, ncols=2, framealpha=0.4, labelspacing=0.2, handlelength=1.2, columnspacing=0.8)


def swatches() -> None:
    shown = families()
    most = max(len(materials) for materials in shown.values())
    figure, axes = plt.subplots(figsize=(17, 0.52 * len(shown)), layout="constrained")
    for row, (family, materials) in enumerate(shown.items()):
        axes.text(-0.1, row + 0.45, family, ha="right", va="center", fontsize=9)
        for col, material in enumerate(materials):
            axes.add_patch(plt.Rectangle((col, row), 0.96, 0.62, color=display_srgb(material)))
            light = emission_srgb(material)
            if light is not None:
                axes.plot(col + 0.48, row + 0.31, "o", color=light, markersize=11)
            axes.text(col, row + 0.68, material.name.partition("/")[2], fontsize=6, va="top")
    axes.set(xlim=(-1.1, most), ylim=(len(shown), -0.1))
    axes.axis("off")
    figure.set_facecolor("0.8")
    save(figure, "swatches.png")


def models() -> None:
    figure, (leaves, skin, wet, cloth) = plt.subplots(1, 4, figsize=(16, 3.6), layout="constrained")
    for amount in (5, 20, 40, 80):
        leaves.plot(NM, leaf_reflectance(Leaf(1.6, amount, 0.22 * amount)), label=f"{amount} µg/cm²")
    leaves.set(title="leaf, chlorophyll", ylabel="reflectance")
    for share in (0.01, 0.05, 0.12, 0.28):
        body = skin_body_reflectance(melanin_share=share, blood_share=0.008)
        skin.plot(NM, body_seen_through_coat(body, SKIN_INDEX), label=f"melanin {share:.0%}")
    skin.set(title="skin, without gloss")
    for name in ("asphalt/worn", "asphalt/wet", "asphalt/new"):
        wet.plot(NM, seen_spectrum(asset_materials()[name]).values, label=name)
    wet.set(title="asphalt, dry, wet, new", ylim=(0, None))
    for name, look in (("cloth/black", "-"), ("cloth/denim", "-"), ("coating/black", "--"), ("rubber/tyre", "--")):
        cloth.plot(NM, seen_spectrum(asset_materials()[name]).values, look, label=name)
    cloth.set(title="dyes end before 800 nm, soot does not")
    for axes in (leaves, skin, wet, cloth):
        axes.set(xlabel="wavelength [nm]", xlim=(380, 1000))
        axes.legend(fontsize=8)
    save(figure, "models.png")


if __name__ == "__main__":
    spectra()
    swatches()
    models()
