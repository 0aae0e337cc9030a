"""Validate the camera chain on the Cornell box: make the figures beside this file and the numbers that its page quotes.

Run: python docs/validation/cornell_box.py [--quick] [FOLDER]   (default folder: docs/validation/figures)

Every section compares what the product computes with something that is not the product: another renderer's numbers, a closed
form, or an integral written out here. --quick renders with few samples, for continuous integration. Needs matplotlib.
"""

from __future__ import annotations

import io
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import colour
import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.special import j1

from fullwell.core import atomic_write, stream
from fullwell.core.constants import BOLTZMANN_J_PER_K, LUMINOUS_EFFICACY_LM_PER_W, NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.isp import develop
from fullwell.isp.demosaic import demosaic_bilinear
from fullwell.metrics import channel_mask, edge_sfr, mosaic_edge_sfr, relative_illumination
from fullwell.optics import OpticalImage, compute_irradiance
from fullwell.radiometry import COLORCHECKER_PATCHES, DEFAULT_GRID, RadianceImage, Spectrum, WavelengthGrid
from fullwell.render import render_radiance
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Diffuse,
    Emission,
    Film,
    Lens,
    Mesh,
    Part,
    SceneDescription,
    SceneObject,
    look_at,
)
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.schema.frame import FrameDescription
from fullwell.sensor import (
    AutoExposure,
    RawImage,
    SensorModel,
    capture,
    channel_currents,
    expected_electrons,
    exposure_time,
    fixed_pattern_stream,
    sensor,
)

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "examples"
COLOURS = {"R": "tab:red", "G": "tab:green", "B": "tab:blue"}
CHANNELS = tuple(COLOURS)

F_NUMBER, FOCAL_LENGTH_M, PITCH_M = 1.73, 4.38e-3, 1.4e-6
"""Main camera of the Google Pixel 4a, whose sensor is the IMX363 (lyu2022)."""

MONO = WavelengthGrid(550.0, 550.0, 0.1)
"""So narrow that the wavelength drawn within the band makes no noise: photons are proportional to it."""

PHOTON_J_M = PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S
SECOND_RADIATION_M_K = PHOTON_J_M / BOLTZMANN_J_PER_K
FINE_NM = np.arange(3800, 7301) / 10.0
"""Steps of the integrals written out here [nm]: all tables have their wavelengths on it."""

Numbers = dict[str, Any]


@dataclass(frozen=True)
class Effort:
    """How much work the sections do."""

    bleeding_runs: int = 4
    bleeding_samples: int = 384
    direct_samples: int = 512
    edge_samples: int = 64
    edge_offsets_dioptre: tuple[float, ...] = (-1.5, -1.0, -0.6, -0.3, -0.15, 0.0, 0.15, 0.3, 0.6, 1.0, 1.5)
    chart_samples: int = 512
    noise_patch_px: int = 64


QUICK = Effort(2, 36, 36, 9, (-1.0, -0.3, 0.0, 0.3, 1.0), 36, 32)


def camera_lens(*, focus_distance_m: float, f_number: float = F_NUMBER, kind: str = "thin_lens") -> Lens:
    return Lens(kind, FOCAL_LENGTH_M, f_number, focus_distance_m, Spectrum.constant(1.0))


def streams(model: SensorModel, *names: str | int) -> dict[str, np.random.Generator]:
    return {"rng": stream(0, "cornell validation", *names), "fixed_pattern_rng": fixed_pattern_stream(model)}


def frame_of(example: str, overrides: dict[str, str], index: int = 0) -> FrameDescription:
    document = load_recipe(EXAMPLES / example, overrides=overrides)
    return RecipeBuilder(document, base_dir=EXAMPLES).frame(index)


# Tables, read and integrated without the product's own code -----------------------------------------------------------


def sensor_efficiency() -> NDArray[np.float64]:
    """Return the IMX363's quantum efficiency on FINE_NM, (3, n): filters, infrared filter, channel correction of lyu2022."""
    text = files("fullwell.sensor").joinpath("data/imx363.csv").read_text()
    rows = [line.split(",") for line in text.splitlines() if line[:1].isdigit()]
    table = np.array(rows, dtype=float)
    correction = np.array([[0.56, 0.08, 0.01], [0.0, 0.59, 0.0], [0.0, 0.25, 0.71]])
    curves = (table[:, 1:4] * table[:, 4:]) @ correction
    return np.stack([np.interp(FINE_NM, table[:, 0], curve, left=0, right=0) for curve in curves.T])


def on_fine(distribution: Any) -> NDArray[np.float64]:
    """Return a table of colour-science on FINE_NM, linear between its wavelengths."""
    return np.interp(FINE_NM, distribution.wavelengths, distribution.values)


def integral(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.trapezoid(values, FINE_NM, axis=-1)


def photopic(power: NDArray[np.float64]) -> float:
    """Return lumens per unit of the spectral power on FINE_NM [W nm^-1]."""
    return LUMINOUS_EFFICACY_LM_PER_W * float(integral(power * on_fine(colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"])))


def electrons_per_s(radiance: NDArray[np.float64], *, solid_angle_sr: float, pitch_m: float) -> NDArray[np.float64]:
    """Return (..., 3) electrons per second of a pixel on the axis, for radiance (..., n) on FINE_NM [W m^-2 sr^-1 nm^-1]."""
    photons = radiance * FINE_NM / NM_PER_M / PHOTON_J_M
    return integral(photons[..., None, :] * sensor_efficiency()) * solid_angle_sr * pitch_m**2


def on_axis_sr(f_number: float, magnification: float = 0.0) -> float:
    return np.pi / (1.0 + 4.0 * (f_number * (1.0 + magnification)) ** 2)


# 1. Surface inter-reflection ------------------------------------------------------------------------------------------

LINES = {"A": ("back wall, 0.45 m above the centre", 1.0, 0.45), "B": ("floor, 0.15 m from its front edge", -0.85, -1.0)}
"""Name: (where, y [m], z [m]); both run along x."""

HALF_WIDTH_ROWS = 4
WITHIN_M = 0.97
"""Pixels nearer to the side walls than 3 cm may see them."""


@dataclass(frozen=True)
class Box:
    """The rendered box and what turns it into electrons."""

    frame: FrameDescription
    full: RadianceImage
    runs: list[RadianceImage]
    direct: RadianceImage
    time_s: float

    @property
    def model(self) -> SensorModel:
        return self.frame.cameras[0].sensors[0].model

    @property
    def lens(self) -> Lens:
        return self.frame.cameras[0].camera.lens

    def electrons(self, radiance: RadianceImage, terms: tuple[str, ...]) -> NDArray[np.float64]:
        """Return (channels, rows, cols) [e-], every channel at every place, without noise."""
        optical = compute_irradiance(radiance, self.lens, terms=terms)
        return channel_currents(optical, self.model.cfa).electrons * self.model.pixel_pitch_m**2 * self.time_s

    def row(self, line: str) -> int:
        _, y_m, z_m = LINES[line]
        return int(self.full.rows / 2 - z_m / (3.9 + y_m) / self.full.tangent_pitch)

    def x_m(self, line: str) -> NDArray[np.float64]:
        """Return where on the line each column looks [m]."""
        columns = np.arange(self.full.cols) + 0.5 - self.full.cols / 2
        return columns * self.full.tangent_pitch * (3.9 + LINES[line][1])

    def along(self, line: str, image: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean over the rows beside the line; rows are the axis before the last but one."""
        row = self.row(line)
        return image[:, row - HALF_WIDTH_ROWS : row + HALF_WIDTH_ROWS + 1].mean(axis=1)


def render_box(effort: Effort) -> Box:
    frame = frame_of("01_cornell_box.yaml", {"cameras[main].lens.f_number": str(F_NUMBER)})
    rig = frame.cameras[0]

    def render(seed: int, depth: int, samples: int) -> RadianceImage:
        image, _ = render_radiance(frame.scene, rig.camera, frame.grid, samples_per_pixel=samples, max_depth=depth, seed=seed)
        return image

    runs = [render(seed, 8, effort.bleeding_samples) for seed in range(effort.bleeding_runs)]
    full = replace(runs[0], photons=np.mean([run.photons for run in runs], axis=0, dtype=np.float64).astype(np.float32))
    optical = compute_irradiance(full, rig.camera.lens)
    model = rig.sensors[0].model
    time_s = exposure_time(optical, model, rig.sensors[0].exposure)
    return Box(frame, full, runs, render(99, 2, effort.direct_samples), time_s)


def block_means(image: RadianceImage) -> RadianceImage:
    rows, cols, bands = image.photons.shape
    means = image.photons.astype(float).reshape(6, rows // 6, 6, cols // 6, bands).mean(axis=(1, 3))
    return RadianceImage(means.astype(np.float32), image.grid, image.tangent_pitch * cols / 6)


def reference_blocks(like: RadianceImage) -> tuple[RadianceImage, RadianceImage]:
    """Return the other renderer's block radiances and their standard errors, as photons."""
    numbers = json.loads((HERE / "cornell_box_pbrt.json").read_text())
    photons_per_j = np.array(numbers["wavelength_nm"]) / NM_PER_M / PHOTON_J_M
    mean, error = (np.array(numbers[key]) * photons_per_j for key in ("block_mean", "block_standard_error"))
    return tuple(replace(like, photons=values.astype(np.float32)) for values in (mean, error))


def lamp_form_factor(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) irradiance of places (n, 3) on the back wall over pi times the lamp's radiance (lambert1760)."""
    corners = np.array([[-0.25, -0.26, 0.99], [-0.25, 0.24, 0.99], [0.25, 0.24, 0.99], [0.25, -0.26, 0.99]])
    rays = corners - places[:, None]
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    after = np.roll(rays, -1, axis=1)
    normal = np.cross(rays, after)
    angle = np.arctan2(np.linalg.norm(normal, axis=2), np.sum(rays * after, axis=2))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.abs(np.sum(angle * (normal @ np.array([0.0, -1.0, 0.0])), axis=1)) / (2 * np.pi)


def wall_electrons_per_s(box: Box, line: str) -> NDArray[np.float64]:
    """Return (3, cols): direct light of the lamp on the back wall, the mean over the rows beside the line [e- s^-1]."""
    depth_m = 3.9 + LINES[line][1]
    rows = box.row(line) + np.arange(-HALF_WIDTH_ROWS, HALF_WIDTH_ROWS + 1)
    z_m = (box.full.rows / 2 - rows - 0.5) * box.full.tangent_pitch * depth_m
    x, z = np.broadcast_arrays(box.x_m(line), z_m[:, None])
    form_factor = lamp_form_factor(np.stack([x.ravel(), np.full(x.size, LINES[line][1]), z.ravel()], axis=1))
    falloff = (1 + (x**2 + z**2) / depth_m**2) ** -2
    wavelength_m = FINE_NM / NM_PER_M
    lamp = wavelength_m**-5 / np.expm1(SECOND_RADIATION_M_K / (wavelength_m * 3000.0))
    lamp *= 1464.17 / photopic(lamp)
    white = box.frame.scene.objects[0].parts[0].material.reflectance
    wall = lamp * np.interp(FINE_NM, white.wavelength_nm, white.values)
    on_axis = electrons_per_s(wall, solid_angle_sr=on_axis_sr(F_NUMBER), pitch_m=box.model.pixel_pitch_m)
    return on_axis[:, None] * (form_factor.reshape(x.shape) * falloff).mean(axis=0)


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def relative(values: NDArray[np.float64]) -> Numbers:
    """Return mean, root mean square and largest of relative deviations, in percent."""
    return {
        "mean_percent": 100 * float(np.mean(values)),
        "rms_percent": 100 * rms(values),
        "largest_percent": 100 * float(np.max(np.abs(values))),
    }


NO_BLUR = ("relative_illumination",)
"""Closed forms of uniform surfaces are compared without diffraction, whose halo carries light from one to the next."""

ALL_TERMS = (*NO_BLUR, "diffraction")


def bleeding(effort: Effort) -> tuple[plt.Figure, Numbers]:
    box = render_box(effort)
    raw = capture(compute_irradiance(box.full, box.lens), box.model, box.time_s, **streams(box.model, "box"))
    # Falloff is left out for the blocks: it does not commute with their means.
    ours = box.electrons(block_means(box.full), ())
    runs = np.stack([box.electrons(block_means(run), ()) for run in box.runs])
    mean, error = reference_blocks(block_means(box.full))
    theirs = box.electrons(mean, ())
    closed = wall_electrons_per_s(box, "A") * box.time_s
    direct_ratio = float(closed[0, 0] / closed[1, 0])
    wall = np.abs(box.x_m("A")) < WITHIN_M
    direct, formula = (image[:, wall] for image in (box.along("A", box.electrons(box.direct, NO_BLUR)), closed))
    numbers: Numbers = {
        "exposure_time_s": box.time_s,
        "direct_light_against_closed_form": relative(direct / formula - 1),
        "direct_r_over_g_against_closed_form": relative(direct[0] / direct[1] / direct_ratio - 1),
        "blocks_against_pbrt": relative(ours / theirs - 1),
        "our_standard_error_percent": 100 * rms(runs.std(axis=0, ddof=1) / ours) / np.sqrt(effort.bleeding_runs),
        # The bands' errors added as if they were one: an upper bound.
        "pbrt_standard_error_percent_at_most": 100 * rms(box.electrons(error, ()) / theirs),
        "block_r_over_g_against_pbrt": relative((ours[0] / ours[1]) / (theirs[0] / theirs[1]) - 1),
    }
    full, direct = box.electrons(box.full, ALL_TERMS), box.electrons(box.direct, ALL_TERMS)
    for line in LINES:
        numbers[f"line_{line}"] = line_numbers(box, line, full=full, direct=direct, direct_ratio=direct_ratio)
    return plot_bleeding(box, raw, full=full, direct=direct, closed=closed, ours=ours, theirs=theirs), numbers


def line_numbers(
    box: Box, line: str, *, full: NDArray[np.float64], direct: NDArray[np.float64], direct_ratio: float
) -> Numbers:
    """Return the ends of the bleeding profile, and what share of the line's light has met two surfaces or more."""
    seen = np.abs(box.x_m(line)) < WITHIN_M
    along, first = box.along(line, full)[:, seen], box.along(line, direct)[:, seen]
    ratio = along[0] / along[1] / direct_ratio
    share = 1 - np.sum(first, axis=1) / np.sum(along, axis=1)
    return {
        "r_over_g_at_red_wall": float(ratio[:5].mean()),
        "r_over_g_at_green_wall": float(ratio[-5:].mean()),
        "inter_reflected_share": dict(zip(CHANNELS, share.tolist(), strict=True)),
    }


def plot_bleeding(box: Box, raw: RawImage, **e: NDArray[np.float64]) -> plt.Figure:
    figure, ((picture, profile), (ratio, blocks)) = plt.subplots(2, 2, figsize=(10, 7.6))
    picture.imshow(develop(raw, box.frame.cameras[0].sensors[0].isp).rgb)
    for line in LINES:
        picture.axhline(box.row(line), color="black" if line == "A" else "tab:blue", lw=1, ls="--")
        picture.text(4, box.row(line) - 4, line, color="white", fontsize=11, weight="bold")
    picture.set(title="one raw frame, developed", xticks=[], yticks=[])
    planes = demosaic_bilinear(raw.dn - raw.black_level_dn, raw.pattern, CHANNELS).transpose(2, 0, 1) * raw.electrons_per_dn
    plot_profile(profile, box, planes, full=e["full"], direct=e["direct"], closed=e["closed"])
    direct_ratio = float(e["closed"][0, 0] / e["closed"][1, 0])
    plot_ratio(ratio, box, direct_ratio, full=e["full"], direct=e["direct"])
    for row, colour_name in ((2, "black"), (3, "tab:orange"), (5, "tab:blue")):
        for key, style in (("ours", "-"), ("theirs", "o")):
            values = e[key][0, row] / e[key][1, row] / direct_ratio
            label = f"row {row + 1} of 6" if key == "ours" else None
            blocks.plot(np.arange(1, 7), values, style, color=colour_name, lw=1.1, mfc="none", label=label)
    blocks.plot([], [], "ko", mfc="none", label="pbrt-v4")
    blocks.set(xlabel="block, left to right", ylabel="R / G over that of direct light", title="blocks of 48 × 48 pixels")
    blocks.legend(fontsize=8)
    return figure


def plot_profile(axes: plt.Axes, box: Box, raw: NDArray[np.float64], **e: NDArray[np.float64]) -> None:
    wall = np.abs(box.x_m("A")) < 1
    x_m = box.x_m("A")[wall]
    noisy, full, direct = (box.along("A", image)[:, wall] for image in (raw, e["full"], e["direct"]))
    for k, name in enumerate(CHANNELS):
        axes.plot(x_m, noisy[k], ".", color=COLOURS[name], ms=2, alpha=0.5)
        axes.plot(x_m, full[k], color=COLOURS[name], lw=1.2, label=name)
        axes.plot(x_m, direct[k], color=COLOURS[name], lw=1, ls="--")
        axes.plot(x_m, e["closed"][k, wall], color="black", lw=0.8, ls=":")
    for style, label in (("k.", "raw, demosaiced, mean of 9 rows"), ("k-", "noise-free"), ("k--", "direct light only")):
        axes.plot([], [], style, ms=3, lw=1.1, label=label)
    axes.plot([], [], "k:", lw=0.9, label="closed form of it")
    axes.set(xlabel="position on line A [m]", ylabel="signal [e-]", ylim=(0, 7600), title="line A: back wall")
    axes.legend(fontsize=7, ncols=2, loc="upper center")


def plot_ratio(axes: plt.Axes, box: Box, direct_ratio: float, **e: NDArray[np.float64]) -> None:
    for line, colour_name in (("A", "black"), ("B", "tab:blue")):
        seen = np.abs(box.x_m(line)) < WITHIN_M
        for key, style in (("full", "-"), ("direct", "--")):
            along = box.along(line, e[key])[:, seen]
            label = f"{line}: {LINES[line][0]}" if key == "full" else None
            axes.plot(box.x_m(line)[seen], along[0] / along[1] / direct_ratio, style, color=colour_name, lw=1.1, label=label)
    axes.plot([], [], "k--", lw=1.1, label="direct light only")
    axes.set(xlabel="position [m]", ylabel="R / G over that of direct light", title="bleeding along the lines")
    axes.legend(fontsize=8)


# 2. Depth of focus ----------------------------------------------------------------------------------------------------

FOCUS_M = (0.3, 0.5)
SLANT_DEG = 5.0
EDGE_ROWS, EDGE_COLS, EDGE_OVERSAMPLING = 128, 160, 4
EDGE_FRAMES, EDGE_SERIALS = 16, 8
EDGE_EXPOSURE = AutoExposure("full", level=0.8)
WAVELENGTH_M = 550e-9


def edge_scene(distance_m: float) -> SceneDescription:
    """Return two coplanar lights, 5 : 1, that meet along a line 5 degrees off the vertical, facing the origin."""
    half_m, lean_m = 0.2 * distance_m, 0.2 * distance_m * np.tan(np.radians(SLANT_DEG))
    sides = {"dark": (0.2, (-half_m, -half_m), (-lean_m, lean_m)), "bright": (1.0, (-lean_m, lean_m), (half_m, half_m))}
    objects = []
    for name, (radiance, (left, left_up), (right, right_up)) in sides.items():
        corners = [(left, -half_m), (right, -half_m), (right_up, half_m), (left_up, half_m)]
        mesh = Mesh(np.array([(x, distance_m, z) for x, z in corners]), np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32))
        part = Part(mesh, Diffuse(Spectrum.constant(0.0)), emission=Emission(Spectrum.constant(radiance)))
        objects.append(SceneObject(name, "", (part,)))
    return SceneDescription(tuple(objects))


def edge_image(distance_m: float, lens: Lens, samples: int) -> OpticalImage:
    pose = look_at(np.zeros(3), np.array([0, 1.0, 0]), np.array([0, 0, 1.0]))
    pitch_m = PITCH_M / EDGE_OVERSAMPLING
    film = Film(EDGE_ROWS * EDGE_OVERSAMPLING, EDGE_COLS * EDGE_OVERSAMPLING, pitch_m)
    camera = Camera("main", pose, lens, film)
    radiance, _ = render_radiance(edge_scene(distance_m), camera, MONO, samples_per_pixel=samples, max_depth=1, seed=3)
    return compute_irradiance(radiance, lens)


def blur_diameter_m(lens: Lens, distance_m: float) -> float:
    """Return the diameter of the circle of confusion on the film [m]."""
    return lens.pupil_diameter_m * lens.image_distance_m * abs(1 / lens.focus_distance_m - 1 / distance_m)


def pixel_mtf(frequency_cycles_per_px: NDArray[np.float64]) -> NDArray[np.float64]:
    slant = np.radians(SLANT_DEG)
    return np.sinc(frequency_cycles_per_px * np.cos(slant)) * np.sinc(frequency_cycles_per_px * np.sin(slant))


def geometric_mtf(frequency_cycles_per_px: NDArray[np.float64], lens: Lens, distance_m: float) -> NDArray[np.float64]:
    """Return circle of confusion x diffraction x pixel: what the model claims."""
    frequency = frequency_cycles_per_px / PITCH_M
    argument = np.pi * blur_diameter_m(lens, distance_m) * frequency
    defocus = np.divide(2 * j1(argument), argument, out=np.ones_like(argument), where=argument > 1e-9)
    working = lens.f_number * (1 + abs(lens.magnification))
    share = np.minimum(frequency * WAVELENGTH_M * working, 1.0)
    diffraction = 2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2))
    return np.abs(defocus * diffraction * pixel_mtf(frequency_cycles_per_px))


def wave_mtf(frequency_cycles_per_px: NDArray[np.float64], lens: Lens, distance_m: float) -> NDArray[np.float64]:
    """Return pixel x modulus of the OTF of a circular pupil with defocus (goodman2005, 6.4): what nature does."""
    pupil_radius_m = lens.pupil_diameter_m / 2
    path_m = 0.5 * pupil_radius_m**2 * (1 / lens.focus_distance_m - 1 / distance_m)
    working = lens.f_number * (1 + abs(lens.magnification))
    share = frequency_cycles_per_px / PITCH_M * WAVELENGTH_M * working
    otf = np.zeros_like(share)
    for k, v in enumerate(share):
        if v < 1:
            # Along the overlap of the two shifted pupils the phase is linear: its integral is a sine.
            y = np.sqrt(1 - v**2) * np.cos(np.pi * (np.arange(4000) + 0.5) / 4000)
            half = np.sqrt(1 - y**2) - v
            rate = 8 * np.pi * path_m / WAVELENGTH_M * v
            inner = 2 * half * np.sinc(rate * half / np.pi)
            weight = np.sqrt(np.maximum(1 - v**2 - y**2, 0)) * np.pi / 4000
            otf[k] = np.sum(inner * weight) / np.pi
    return np.abs(otf * pixel_mtf(frequency_cycles_per_px))


def mtf50(frequency: NDArray[np.float64], mtf: NDArray[np.float64]) -> float:
    below = int(np.argmax(mtf <= 0.5))
    share = (mtf[below - 1] - 0.5) / (mtf[below - 1] - mtf[below])
    return float(frequency[below - 1] + share * (frequency[below] - frequency[below - 1]))


FREQUENCY = np.arange(0, 1.0, 0.0025)
UP_TO_NYQUIST = 0.5


@dataclass(frozen=True)
class EdgePoint:
    """One distance: the response measured without noise, and in the mean of 16 raw frames, as mosaic and demosaiced."""

    distance_m: float
    lens: Lens
    response: Any
    noisy: Any
    demosaiced: Any


def edge_sensor(serial: int = 0) -> SensorModel:
    return replace(sensor("imx363"), rows=EDGE_ROWS, cols=EDGE_COLS, serial=serial)


def mean_raw(optical: OpticalImage, model: SensorModel, time_s: float, distance_m: float) -> NDArray[np.float64]:
    """Return the mean of 16 raw frames above black [DN]; the fixed pattern stays."""
    name = f"{distance_m:.4f}"
    frames = [capture(optical, model, time_s, **streams(model, "edge", name, model.serial, k)) for k in range(EDGE_FRAMES)]
    return np.mean([frame.dn for frame in frames], axis=0) - frames[0].black_level_dn


def measure_edge(lens: Lens, distance_m: float, samples: int) -> EdgePoint:
    model = edge_sensor()
    optical = edge_image(distance_m, lens, samples)
    time_s = exposure_time(optical, model, EDGE_EXPOSURE)
    raw, pattern = mean_raw(optical, model, time_s, distance_m), model.cfa.pattern
    return EdgePoint(
        distance_m,
        lens,
        mosaic_edge_sfr(expected_electrons(optical, model, time_s), pattern=pattern, channel="G"),
        mosaic_edge_sfr(raw, pattern=pattern, channel="G"),
        edge_sfr(demosaic_bilinear(raw, pattern, CHANNELS)[:, :, 1]),
    )


def focus(effort: Effort) -> tuple[plt.Figure, Numbers]:
    numbers: Numbers = {}
    series = {}
    for focus_m in FOCUS_M:
        lens = camera_lens(focus_distance_m=focus_m)
        distances = [1 / (1 / focus_m + offset) for offset in effort.edge_offsets_dioptre]
        points = [measure_edge(lens, distance_m, effort.edge_samples) for distance_m in distances]
        series[focus_m] = points
        numbers[f"focus_{focus_m:g}_m"] = focus_numbers(lens, points)
    numbers["sensor_serials"] = serial_numbers(series[FOCUS_M[1]][0].lens, effort)
    return plot_focus(series), numbers


def serial_numbers(lens: Lens, effort: Effort) -> Numbers:
    """Return what the fixed pattern of the single sensor does to the MTF50 of one edge, slightly out of focus."""
    distance_m = 1 / (1 / lens.focus_distance_m + 0.15)
    optical = edge_image(distance_m, lens, effort.edge_samples)
    found = []
    for serial in range(EDGE_SERIALS):
        model = edge_sensor(serial)
        raw = mean_raw(optical, model, exposure_time(optical, model, EDGE_EXPOSURE), distance_m)
        found.append(mosaic_edge_sfr(raw, pattern=model.cfa.pattern, channel="G").mtf50_cycles_per_px)
    return {
        "serials": EDGE_SERIALS,
        "distance_m": distance_m,
        "closed_form": mtf50(FREQUENCY, geometric_mtf(FREQUENCY, lens, distance_m)),
        "mean": float(np.mean(found)),
        "standard_deviation": float(np.std(found, ddof=1)),
    }


def focus_numbers(lens: Lens, points: list[EdgePoint]) -> Numbers:
    curve_error, level_error, rows = [], [], []
    for point in points:
        response = point.response
        kept = response.frequency_cycles_per_px <= UP_TO_NYQUIST
        expected = geometric_mtf(response.frequency_cycles_per_px, lens, point.distance_m)
        curve_error.append(float(np.max(np.abs(response.mtf - expected)[kept])))
        closed, wave = (mtf50(FREQUENCY, law(FREQUENCY, lens, point.distance_m)) for law in (geometric_mtf, wave_mtf))
        level_error.append(response.mtf50_cycles_per_px / closed - 1)
        rows.append(
            {
                "distance_m": point.distance_m,
                "blur_px": blur_diameter_m(lens, point.distance_m) / PITCH_M,
                "mtf50_cycles_per_px": response.mtf50_cycles_per_px,
                "closed_form": closed,
                "wave_optics": wave,
                "raw_frames": point.noisy.mtf50_cycles_per_px,
                "raw_frames_demosaiced": point.demosaiced.mtf50_cycles_per_px,
            }
        )
    # The blur's variance grows with the square of the dioptres, and 1 / MTF50^2 nearly with the variance.
    nearness = np.array([1 / point.distance_m for point in points])
    spread = np.array([point.response.mtf50_cycles_per_px**-2 for point in points])
    curvature, slope, _ = np.polyfit(nearness, spread, 2)
    sharpest = max(points, key=lambda point: point.response.mtf50_cycles_per_px)
    return {
        "largest_mtf_difference_up_to_nyquist": max(curve_error),
        "mtf50_against_closed_form": relative(np.array(level_error)),
        "sharpest_distance_m": sharpest.distance_m,
        "fitted_peak_m": float(-2 * curvature / slope),
        "points": rows,
    }


def plot_focus(series: dict[float, list[EdgePoint]]) -> plt.Figure:
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.9), width_ratios=(1.4, 1, 1))
    for (focus_m, points), colour_name in zip(series.items(), ("tab:blue", "tab:orange"), strict=True):
        lens = points[0].lens
        distance = 1 / np.linspace(1 / points[0].distance_m, 1 / points[-1].distance_m, 121)
        for law, style, width in ((geometric_mtf, "-", 1.2), (wave_mtf, ":", 1.0)):
            left.plot(
                distance, [mtf50(FREQUENCY, law(FREQUENCY, lens, d)) for d in distance], style, color=colour_name, lw=width
            )
        measured = [point.response.mtf50_cycles_per_px for point in points]
        left.plot([p.distance_m for p in points], measured, "o", color=colour_name, ms=4, label=f"focus at {focus_m:g} m")
        left.plot([p.distance_m for p in points], [p.noisy.mtf50_cycles_per_px for p in points], "x", color=colour_name, ms=5)
        left.axvline(focus_m, color=colour_name, lw=0.6, alpha=0.6)
    left.plot([], [], "kx", ms=5, label="mean of 16 raw frames")
    left.plot([], [], "k-", lw=1.2, label="circle of confusion × diffraction × pixel")
    left.plot([], [], "k:", lw=1.0, label="defocused pupil × pixel")
    left.set(xscale="log", xlabel="distance of the edge [m]", ylabel="MTF50, green pixels [cycles/pixel]", ylim=(0, 0.56))
    ticks = (0.2, 0.3, 0.5, 1.0, 2.0)
    left.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    left.minorticks_off()
    left.legend(fontsize=7, loc="upper right")
    points = series[FOCUS_M[1]]
    chosen = sorted({0, len(points) // 4, len(points) // 2})
    for k, colour_name in zip(reversed(chosen), ("tab:green", "tab:purple", "tab:red"), strict=False):
        point, response = points[k], points[k].response
        kept = response.frequency_cycles_per_px <= UP_TO_NYQUIST
        frequency = response.frequency_cycles_per_px[kept]
        middle.plot(
            frequency, response.mtf[kept], color=colour_name, lw=2.5, alpha=0.45, label=f"edge at {point.distance_m:.2f} m"
        )
        middle.plot(frequency, geometric_mtf(frequency, point.lens, point.distance_m), color=colour_name, lw=1)
        spread = np.gradient(response.profile, response.profile_distance_px)
        right.plot(
            response.profile_distance_px, spread / spread.sum() / np.diff(response.profile_distance_px)[0], color=colour_name
        )
    middle.plot([], [], "k-", lw=1, label="closed form")
    middle.set(
        xlabel="frequency [cycles/pixel]", ylabel="MTF", ylim=(0, 1.02), title=f"focus at {FOCUS_M[1]:g} m", xlim=(0, 0.5)
    )
    middle.legend(fontsize=7)
    right.set(
        xlabel="distance from the edge [pixel]", ylabel="line spread [1/pixel]", xlim=(-20, 20), title="measured line spread"
    )
    return figure


# 3. Relative illumination ---------------------------------------------------------------------------------------------

COARSER = 8


def pupil_falloff(tan_field: NDArray[np.float64], pupil_radius: float) -> NDArray[np.float64]:
    """Return the irradiance from a Lambertian disc of that radius at unit distance over that on the axis, summed over it."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    radius = 0.5 * pupil_radius * (nodes + 1)
    angle = 2 * np.pi * np.arange(96) / 96
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    share = (weights * radius)[:, None] * np.ones_like(angle)
    values = [np.sum(share / (1 + (t - x) ** 2 + y**2) ** 2) for t in np.append(0.0, tan_field)]
    return np.array(values[1:]) / values[0]


def flat_field(lens: Lens) -> tuple[OpticalImage, SensorModel]:
    """Return the picture of a uniform scene over the whole IMX363, in pixels eight times as wide."""
    full = sensor("imx363")
    model = replace(full, rows=full.rows // COARSER, cols=full.cols // COARSER, pixel_pitch_m=full.pixel_pitch_m * COARSER)
    scene = SceneDescription((), (ConstantEnvironment(Spectrum.constant(1.0)),))
    pose = look_at(np.zeros(3), np.array([0, 1.0, 0]), np.array([0, 0, 1.0]))
    camera = Camera("main", pose, lens, Film(model.rows, model.cols, model.pixel_pitch_m))
    radiance, _ = render_radiance(scene, camera, MONO, samples_per_pixel=4, max_depth=2, seed=1)
    return compute_irradiance(radiance, lens, terms=NO_BLUR), model


@dataclass(frozen=True)
class Falloff:
    """Rings of one raw frame of a flat field, and what they should be; all 1 on the axis."""

    field_deg: NDArray[np.float64]
    measured: NDArray[np.float64]
    expected: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    curve: tuple[NDArray[np.float64], NDArray[np.float64]]
    numbers: Numbers


def measure_falloff(lens: Lens) -> Falloff:
    optical, model = flat_field(lens)
    time_s = exposure_time(optical, model, AutoExposure("full", level=0.8))
    raw = capture(optical, model, time_s, **streams(model, "flat", lens.kind, str(lens.f_number)))
    green = np.where(channel_mask(raw, "G"), raw.dn - raw.black_level_dn, np.nan)
    found = relative_illumination(green)
    x, y = (
        (np.arange(count) + 0.5 - count / 2) * model.pixel_pitch_m / lens.image_distance_m for count in (model.cols, model.rows)
    )
    tangent = np.hypot(x, y[:, None])
    table = np.linspace(0, tangent.max(), 400)
    pupil = 1e-6 if lens.kind == "pinhole" else lens.pupil_diameter_m / 2 / lens.image_distance_m
    law = pupil_falloff(table, pupil)
    expected = np.interp(tangent, table, law)
    photons = optical.photons[:, :, 0].astype(float)
    middle = (slice(model.rows // 2 - 1, model.rows // 2 + 1), slice(model.cols // 2 - 1, model.cols // 2 + 1))
    noise_free = photons / photons[middle].mean()
    # A ring's mean is not the value at its mean radius: the expectation is averaged over the same pixels.
    ring = rings(expected, np.isfinite(green), found.radius_px.size)
    # The fitted value on the axis has an error that all rings would share.
    ratio, weight = found.ratio / ring, (ring / found.standard_error) ** 2
    scale = float(np.sum(ratio * weight) / np.sum(weight))
    z = (ratio / scale - 1) * np.sqrt(weight)
    numbers = {
        "corner_field_deg": float(np.degrees(np.arctan(tangent.max()))),
        "corner_ratio_expected": float(expected[0, 0]),
        "corner_ratio_from_raw": found.corner_ratio / scale,
        "cos4_at_corner": float((1 + tangent.max() ** 2) ** -2),
        "noise_free_largest_difference": float(np.max(np.abs(noise_free - expected))),
        "rings_rms_z": rms(z),
        "rings_largest_z": float(np.max(np.abs(z))),
    }
    angles = (np.degrees(np.arctan(t)) for t in (found.radius_px * model.pixel_pitch_m / lens.image_distance_m, table))
    field_deg, table_deg = angles
    return Falloff(field_deg, found.ratio / scale, ring, found.standard_error, (table_deg, law), numbers)


def falloff(effort: Effort) -> tuple[plt.Figure, Numbers]:
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8))
    numbers: Numbers = {}
    cases = (("thin_lens", 0.95, "tab:orange"), ("thin_lens", F_NUMBER, "tab:blue"), ("pinhole", F_NUMBER, "black"))
    for shift, (kind, f_number, colour_name) in zip((-0.25, 0.0, 0.25), cases, strict=True):
        found = measure_falloff(camera_lens(focus_distance_m=0.5, f_number=f_number, kind=kind))
        label = "pinhole" if kind == "pinhole" else f"thin lens, f/{f_number:g}"
        left.plot(*found.curve, color=colour_name, lw=1)
        left.plot(found.field_deg, found.measured, "o", color=colour_name, ms=4, mfc="none", label=label)
        right.errorbar(
            found.field_deg + shift,
            100 * (found.measured / found.expected - 1),
            100 * found.standard_error / found.expected,
            color=colour_name,
            fmt="o",
            ms=3,
            lw=0.8,
        )
        numbers[label] = found.numbers
    left.plot([], [], "k-", lw=1, label="summed over the pupil")
    left.set(xlabel="field angle [deg]", ylabel="irradiance over that on the axis", ylim=(0, 1.03))
    left.legend(fontsize=8)
    right.axhline(0, color="black", lw=0.6)
    right.set(xlabel="field angle [deg]", ylabel="raw over expected - 1 [%]", title="rings of one raw frame, standard errors")
    return figure, numbers


def rings(image: NDArray[np.float64], used: NDArray[np.bool_], count: int) -> NDArray[np.float64]:
    """Return the means of `image` over rings of equal width from the middle to the corner, over the pixels used."""
    rows, cols = np.mgrid[: image.shape[0], : image.shape[1]]
    radius = np.hypot(cols + 0.5 - image.shape[1] / 2, rows + 0.5 - image.shape[0] / 2)
    index = np.minimum((radius / radius.max() * count).astype(int), count - 1)[used]
    return np.bincount(index, image[used], count) / np.bincount(index, minlength=count)


# 4. Channel responses: 24 patches under 3 lights ----------------------------------------------------------------------

LIGHTS = ("D65", "A", "FL11")
LUX = 1000.0
CHART_TIME_S = 0.02


@dataclass(frozen=True)
class Chart:
    """The chart under one light: its picture, and the electrons of each patch and channel that the tables give.

    `banded_e` is the sum over the picture's bands with the mean efficiency of each, `expected_e` the integral.
    """

    light: str
    radiance: RadianceImage
    model: SensorModel
    camera: Camera
    expected_e: NDArray[np.float64]
    banded_e: NDArray[np.float64]

    def optical(self, terms: tuple[str, ...] = ALL_TERMS) -> OpticalImage:
        return compute_irradiance(self.radiance, self.camera.lens, terms=terms)


def expected_patches(
    light: str, camera: Camera, model: SensorModel, bands: WavelengthGrid | None = None
) -> NDArray[np.float64]:
    """Return (24, 3) electrons on the axis: lamp at 45 degrees x reflectance x lens x efficiency, integrated at 0.1 nm.

    With `bands`, the efficiency is its mean over each band and 0 outside them: the approximation that the bands are.
    """
    power = on_fine(colour.SDS_ILLUMINANTS[light])
    irradiance = power * LUX / photopic(power) * np.cos(np.radians(45))
    patches = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"].values()
    radiance = np.stack([on_fine(patch) for patch in patches]) * irradiance / np.pi
    solid_angle_sr = on_axis_sr(camera.lens.f_number, abs(camera.lens.magnification))
    scale = CHART_TIME_S * solid_angle_sr * model.pixel_pitch_m**2
    efficiency = sensor_efficiency()
    if bands is not None:
        efficiency = np.stack([band_means(curve, bands) for curve in efficiency])
    return scale * integral((radiance * FINE_NM / NM_PER_M / PHOTON_J_M)[:, None, :] * efficiency)


def band_means(curve: NDArray[np.float64], bands: WavelengthGrid) -> NDArray[np.float64]:
    """Return the curve replaced by its mean within each band, and by 0 outside the bands."""
    result = np.zeros_like(curve)
    for low, high in zip(bands.edges_nm[:-1], bands.edges_nm[1:], strict=True):
        inside = (low <= FINE_NM) & (high > FINE_NM)
        result[inside] = curve[inside].mean()
    return result


def render_chart(index: int, light: str, samples: int, step_nm: float = 10.0) -> Chart:
    overrides = {"cameras[main].lens.f_number": str(F_NUMBER)}
    if step_nm != 10.0:
        overrides |= {"spectral.step_nm": str(step_nm)}
    frame = frame_of("02_colorchecker.yaml", overrides, index)
    rig = frame.cameras[0]
    radiance, _ = render_radiance(frame.scene, rig.camera, frame.grid, samples_per_pixel=samples, max_depth=2, seed=5)
    model = rig.sensors[0].model
    tables = (expected_patches(light, rig.camera, model, bands) for bands in (None, frame.grid))
    return Chart(light, radiance, model, rig.camera, *tables)


def patch_masks(chart: Chart) -> list[tuple[NDArray[np.bool_], NDArray[np.float64]]]:
    """Return of each patch the pixels of its inner 80 % and the cos^4 of every pixel's field angle."""
    model, tangent_pitch = chart.model, chart.camera.tangent_pitch
    x = (np.arange(model.cols) + 0.5 - model.cols / 2) * tangent_pitch
    y = (np.arange(model.rows) + 0.5 - model.rows / 2)[:, None] * tangent_pitch
    cos4 = (1 + x**2 + y**2) ** -2
    masks = []
    for number in range(24):
        x_m, y_m = (number % 6 - 2.5) * 0.045, (number // 6 - 1.5) * 0.045
        inside = (np.abs(x * 0.599 - x_m) < 0.016) & (np.abs(y * 0.599 - y_m) < 0.016)
        masks.append((inside, cos4))
    return masks


def patch_means(chart: Chart, image: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (24, 3) means of an image over the patches' own pixels of each channel, and their standard errors."""
    mean, error = np.empty((24, 3)), np.empty((24, 3))
    for number, (inside, _) in enumerate(patch_masks(chart)):
        for k, name in enumerate(CHANNELS):
            values = image[inside & bayer_mask(chart.model, name)]
            mean[number, k], error[number, k] = values.mean(), values.std(ddof=1) / np.sqrt(values.size)
    return mean, error


def bayer_mask(model: SensorModel, channel: str) -> NDArray[np.bool_]:
    return np.tile(np.array(model.cfa.pattern) == channel, (model.rows // 2, model.cols // 2))


def falloff_means(chart: Chart) -> NDArray[np.float64]:
    """Return the (24, 3) means of cos^4 over the same pixels: the chart's lens is a pinhole."""
    _, cos4 = patch_masks(chart)[0]
    return patch_means(chart, cos4)[0]


@dataclass(frozen=True)
class ChartLevels:
    """(24, 3) electrons: from the tables, without noise and diffraction, without noise, and in one raw frame."""

    expected: NDArray[np.float64]
    banded: NDArray[np.float64]
    sharp: NDArray[np.float64]
    noise_free: NDArray[np.float64]
    raw: NDArray[np.float64]
    raw_error: NDArray[np.float64]


def measure_chart(chart: Chart) -> ChartLevels:
    falloff = falloff_means(chart)
    sharp, blurred = (
        patch_means(chart, expected_electrons(chart.optical(terms), chart.model, CHART_TIME_S))[0]
        for terms in (NO_BLUR, ALL_TERMS)
    )
    frame = capture(chart.optical(), chart.model, CHART_TIME_S, **streams(chart.model, "chart", chart.light))
    raw, error = patch_means(chart, (frame.dn - frame.black_level_dn) * frame.electrons_per_dn)
    return ChartLevels(chart.expected_e * falloff, chart.banded_e * falloff, sharp, blurred, raw, error)


def chart_numbers(levels: ChartLevels) -> Numbers:
    z = (levels.raw - levels.noise_free) / levels.raw_error
    halo = levels.noise_free / levels.sharp - 1
    worst = np.unravel_index(np.argmax(np.abs(halo)), halo.shape)
    return {
        "against_integral": relative(levels.sharp / levels.expected - 1),
        "against_sum_over_bands": relative(levels.sharp / levels.banded - 1),
        "diffraction_changes": relative(halo),
        "diffraction_changes_most": f"{COLORCHECKER_PATCHES[worst[0]]}, {CHANNELS[worst[1]]}",
        "raw_rms_z": rms(z),
        "raw_largest_z": float(np.max(np.abs(z))),
        "raw_largest_difference_e": float(np.max(np.abs(levels.raw - levels.expected))),
        "brightest_e": float(levels.expected.max()),
    }


def patches(effort: Effort) -> tuple[plt.Figure, Numbers]:
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    numbers: Numbers = {}
    for index, (light, marker) in enumerate(zip(LIGHTS, "o^s", strict=True)):
        levels = measure_chart(render_chart(index, light, effort.chart_samples))
        numbers[light] = chart_numbers(levels)
        for k, name in enumerate(CHANNELS):
            style = {"color": COLOURS[name], "ms": 4, "mfc": "none", "mew": 0.9}
            left.plot(levels.expected[:, k], levels.raw[:, k], marker, **style)
            right.plot(levels.expected[:, k], 100 * (levels.sharp / levels.expected - 1)[:, k], marker, **style)
        left.plot([], [], f"k{marker}", ms=4, mfc="none", label=light)
    fine = measure_chart(render_chart(LIGHTS.index("FL11"), "FL11", effort.chart_samples, step_nm=5.0))
    numbers["FL11 in bands of 5 nm"] = {"against_integral": relative(fine.sharp / fine.expected - 1)}
    low, high = 20, 5000
    left.plot([low, high], [low, high], "k-", lw=0.6)
    for name, colour_name in COLOURS.items():
        left.plot([], [], "s", color=colour_name, ms=5, label=name)
    left.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high), xlabel="integral over the tables [e-]")
    left.set(ylabel="mean of the patch [e-]", title="one raw frame")
    left.legend(fontsize=8, ncols=2)
    right.axhline(0, color="black", lw=0.6)
    right.set(xscale="log", xlabel="integral over the tables [e-]", ylabel="signal over it - 1 [%]")
    right.set(title="without noise and diffraction, bands of 10 nm")
    return figure, numbers


# 5. Noise -------------------------------------------------------------------------------------------------------------


NOISE_FRAMES = 8
PATCH_ROWS, PATCH_COLS = 8, 12
PATCH_COUNT = PATCH_ROWS * PATCH_COLS


def uniform_patches(size_px: int, model: SensorModel) -> OpticalImage:
    """Return patches of uniform light of equal photons at all wavelengths, 0 to 4800 electrons in green, shuffled.

    Not rendered: Monte-Carlo error would count as variance.
    """
    current = integral(sensor_efficiency()[1]) * model.pixel_pitch_m**2 * CHART_TIME_S
    levels = np.linspace(0.0, 4800.0, PATCH_COUNT) / current
    order = stream(0, "cornell validation", "patch order").permutation(PATCH_COUNT)
    image = np.kron(levels[order].reshape(PATCH_ROWS, PATCH_COLS), np.ones((size_px, size_px)))
    return OpticalImage(np.repeat(image[:, :, None], DEFAULT_GRID.count, axis=2).astype(np.float32), DEFAULT_GRID, PITCH_M)


@dataclass(frozen=True)
class Levels:
    """Of many patches: mean above black [DN], temporal and total variance [DN^2], and the degrees of freedom of each."""

    mean: NDArray[np.float64]
    temporal: NDArray[np.float64]
    total: NDArray[np.float64]
    temporal_freedom: NDArray[np.float64]
    total_freedom: NDArray[np.float64]


def patch_variances(frames: list[RawImage], masks: list[NDArray[np.bool_]]) -> Levels:
    """Return mean and variances of each patch's pixels of each channel, channel by channel."""
    stack = np.stack([frame.dn for frame in frames]).astype(float) - frames[0].black_level_dn
    rows = []
    for name in CHANNELS:
        own = channel_mask(frames[0], name)
        for mask in masks:
            values = stack[:, mask & own]
            temporal, total = np.var(values, axis=0, ddof=1).mean(), np.var(values[0], ddof=1)
            count, pixels = values.shape
            rows.append((values.mean(), temporal, total, pixels * (count - 1), pixels - 1))
    return Levels(*np.array(rows).T)


@dataclass(frozen=True)
class NoiseLaw:
    """Variances [DN^2] at a mean above black [DN], from the sensor's published figures (lyu2022)."""

    dn_per_e: float = 1023 / 0.4591 * 7.65e-5
    read_dn2: float = (1023 / 0.4591 * 5e-3) ** 2
    offsets_dn2: float = (1023 / 0.4591 * 0.64e-3) ** 2
    prnu: float = 0.019

    def temporal(self, mean: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.dn_per_e * mean + self.read_dn2 + 1 / 12

    def total(self, mean: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.temporal(mean) + self.offsets_dn2 + (self.prnu * mean) ** 2


LAW = NoiseLaw()


def fit(
    terms: list[NDArray[np.float64]], values: NDArray[np.float64], sigma: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the terms' coefficients by weighted least squares, and their standard errors."""
    design = np.stack(terms, axis=1) / sigma[:, None]
    covariance = np.linalg.inv(design.T @ design)
    return covariance @ design.T @ (values / sigma), np.sqrt(np.diag(covariance))


def scores(found: NDArray[np.float64], expected: NDArray[np.float64], freedom: NDArray[np.float64], name: str) -> Numbers:
    """Return how far variances lie from expected ones in standard errors; that of a variance is sqrt(2 / freedom) of it."""
    z = (found / expected - 1) * np.sqrt(freedom / 2)
    return {f"{name}_rms_z": rms(z), f"{name}_largest_z": float(np.max(np.abs(z)))}


def recovered(levels: Levels) -> Numbers:
    """Return gain, read noise and PRNU fitted to the points: straight line in the mean, then a square for the rest."""
    one = np.ones_like(levels.mean)
    expected = LAW.temporal(levels.mean), LAW.total(levels.mean)
    sigma, total_sigma = (
        law * np.sqrt(2 / freedom)
        for law, freedom in zip(expected, (levels.temporal_freedom, levels.total_freedom), strict=True)
    )
    (gain, dark), (gain_error, dark_error) = fit([levels.mean, one], levels.temporal, sigma)
    (square, _), (square_error, _) = fit([levels.mean**2, one], levels.total - levels.temporal, np.hypot(sigma, total_sigma))
    read_dn = np.sqrt(dark - 1 / 12)
    return {
        "gain_e_per_dn": {"put_in": 1 / LAW.dn_per_e, "found": 1 / gain, "standard_error": gain_error / gain**2},
        "read_noise_dn": {"put_in": LAW.read_dn2**0.5, "found": read_dn, "standard_error": 0.5 * dark_error / read_dn},
        "prnu_percent": {
            "put_in": 100 * LAW.prnu,
            "found": 100 * np.sqrt(square),
            "standard_error": 50 * square_error / np.sqrt(square),
        },
    }


def noise(effort: Effort) -> tuple[plt.Figure, Numbers]:
    size = effort.noise_patch_px
    model = replace(sensor("imx363"), rows=PATCH_ROWS * size, cols=PATCH_COLS * size)
    currents = channel_currents(uniform_patches(size, model), model.cfa)
    frames = [capture(currents, model, CHART_TIME_S, **streams(model, "noise", k)) for k in range(NOISE_FRAMES)]
    number = np.kron(np.arange(PATCH_COUNT).reshape(PATCH_ROWS, PATCH_COLS), np.ones((size, size), dtype=int))
    levels = patch_variances(frames, [number == k for k in range(PATCH_COUNT)])
    charts = [chart_noise(index, light, effort) for index, light in enumerate(LIGHTS)]
    chart = Levels(*(np.concatenate([getattr(c, field) for c in charts]) for field in Levels.__dataclass_fields__))
    numbers = {
        "patches": int(levels.mean.size),
        "frames": NOISE_FRAMES,
        **recovered(levels),
        **scores(levels.temporal, LAW.temporal(levels.mean), levels.temporal_freedom, "temporal"),
        **scores(levels.total, LAW.total(levels.mean), levels.total_freedom, "total"),
        "chart_patches": int(chart.mean.size),
        **scores(chart.temporal, LAW.temporal(chart.mean), chart.temporal_freedom, "chart_temporal"),
    }
    return plot_noise(levels, chart), numbers


def chart_noise(index: int, light: str, effort: Effort) -> Levels:
    """Return the variances between frames of the rendered chart: its Monte-Carlo error cancels in their difference."""
    chart = render_chart(index, light, min(effort.chart_samples, 64))
    optical = chart.optical()
    frames = [
        capture(optical, chart.model, CHART_TIME_S, **streams(chart.model, "pair", light, k)) for k in range(NOISE_FRAMES)
    ]
    return patch_variances(frames, [mask for mask, _ in patch_masks(chart)])


def plot_noise(levels: Levels, chart: Levels) -> plt.Figure:
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    x = np.linspace(0, 850, 300)
    left.plot(chart.mean, chart.temporal, "+", color="0.55", ms=5, mew=0.7, label="rendered chart, 24 patches × 3 lights")
    for k, name in enumerate(CHANNELS):
        own = slice(PATCH_COUNT * k, PATCH_COUNT * (k + 1))
        for axes, values in ((left, levels.temporal), (right, levels.total)):
            axes.plot(
                levels.mean[own], values[own], ".", color=COLOURS[name], ms=4, label=f"{name}, {PATCH_COUNT} uniform patches"
            )
    left.plot(x, LAW.temporal(x), "k-", lw=1, label="gain · mean + read² + 1/12")
    left.set(xlabel="mean above black [DN]", ylabel="variance [DN²]", title=f"between {NOISE_FRAMES} frames", ylim=(0, None))
    right.plot(x, LAW.total(x), "k-", lw=1, label="… + DSNU² + (PRNU · mean)²")
    right.plot(x, LAW.temporal(x), "k--", lw=0.8, label="between frames")
    right.set(xlabel="mean above black [DN]", ylabel="variance [DN²]", title="over the pixels of one frame", ylim=(0, None))
    for axes in (left, right):
        axes.legend(fontsize=8)
    return figure


# Running ---------------------------------------------------------------------------------------------------------------

SECTIONS: dict[str, Callable[[Effort], tuple[plt.Figure, Numbers]]] = {
    "bleeding": bleeding,
    "focus": focus,
    "falloff": falloff,
    "patches": patches,
    "noise": noise,
}


def save(figure: plt.Figure, target: Path) -> None:
    """Write a figure as a small palette PNG."""
    figure.tight_layout()
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, dpi=100, metadata={"Software": None})
    plt.close(figure)
    picture = Image.open(drawn).convert("RGB").quantize(128, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    picture.save(packed, "PNG", optimize=True)
    atomic_write(target, packed.getvalue())


def rounded(value: Any) -> Any:
    """Return numbers to four digits: what they are good for, and what does not differ between machines."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


def main(arguments: list[str]) -> None:
    effort = QUICK if "--quick" in arguments else Effort()
    words = [word for word in arguments if not word.startswith("--")]
    only = [word for word in words if word in SECTIONS]
    folder = next((Path(word) for word in words if word not in SECTIONS), HERE / "figures")
    numbers_file = folder / "cornell_box.json"
    numbers = json.loads(numbers_file.read_text()) if only and numbers_file.exists() else {}
    for name in only or SECTIONS:
        started = time.perf_counter()
        figure, numbers[name] = SECTIONS[name](effort)
        save(figure, folder / f"cornell_{name}.png")
        print(f"{name}: {time.perf_counter() - started:.0f} s")
        print(json.dumps(rounded(numbers[name]), indent=1))
        ordered = {key: rounded(numbers[key]) for key in SECTIONS if key in numbers}
        atomic_write(numbers_file, (json.dumps(ordered, indent=1) + "\n").encode())


if __name__ == "__main__":
    main(sys.argv[1:])
