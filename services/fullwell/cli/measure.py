"""`fullwell measure`: what can be measured on the products of one frame."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fullwell.core.errors import FieldError, FullwellError, NotFoundError, unknown_name_message

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fullwell.metrics import PixelRegion
    from fullwell.radiometry import Spectrum
    from fullwell.scene.images import RawImage
    from fullwell.schema.frame import SensorRig

__all__ = ["register"]

MM_PER_M = 1e3
_CHART_ROWS, _CHART_COLS = 4, 6
_NEUTRALS = slice(18, 24)


def register(app: typer.Typer) -> None:
    """Add the command of this module to `app`."""
    app.command()(measure)


def measure(
    frame_dir: Annotated[Path, typer.Argument(help="Folder of one frame (with manifest.json).", metavar="FRAME_DIR")],
    camera: Annotated[str | None, typer.Option(help="Camera to measure; default: the first.")] = None,
    sensor: Annotated[str | None, typer.Option(help="Sensor to measure; default: the first.")] = None,
    region: Annotated[str | None, typer.Option(help="Levels of this region only: x0,y0,x1,y1 [px].", metavar="RECT")] = None,
    edge: Annotated[
        str | None, typer.Option(help="e-SFR of the slanted edge in this region: x0,y0,x1,y1 [px].", metavar="RECT")
    ] = None,
    channel: Annotated[str | None, typer.Option(help="Channel for --edge; default: the one with most pixels.")] = None,
    window: Annotated[str, typer.Option(help="Window for --edge: tukey, hamming or none.")] = "tukey",
    flat: Annotated[
        bool, typer.Option("--flat", help="The picture is of a uniform scene: report the relative illumination.")
    ] = False,
    patches: Annotated[str | None, typer.Option(help="Chart for the colour difference: colorchecker.")] = None,
    corners: Annotated[
        str | None,
        typer.Option(
            help="The chart's outer corners, top left, top right, bottom right, bottom left: x,y,x,y,x,y,x,y [px].",
            metavar="CORNERS",
        ),
    ] = None,
    illuminant: Annotated[
        str | None, typer.Option(help="Light for --patches; default: the one the picture is made for.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Report as JSON.")] = False,
) -> None:
    """Measure a frame: levels, noise, exposure, and on request edge response, falloff and colour difference."""
    frame = _open(frame_dir, camera, sensor)
    report: dict[str, Any] = {"camera": frame.camera["name"], "sensor": frame.sensor["name"], "notes": frame.notes}
    raw = frame.raw()
    report |= _exposure_report(frame, raw)
    if raw is not None:
        report["levels"] = _levels_report(raw, None if region is None else _rectangle(region, "--region"))
        report["sensor_figures"] = _figures_report(frame, raw)
    if edge is not None:
        report["edge"] = _edge_report(frame, raw, _rectangle(edge, "--edge"), channel, window)
    if flat:
        report["relative_illumination"] = _falloff_report(_needed(raw, "--flat"))
    if patches is not None:
        report["patches"] = _patches_report(frame, patches, corners, illuminant)
    report |= _scene_report(frame)
    if as_json:
        print(json.dumps(report, indent=2))
    else:
        _print(report)


# The frame -----------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Frame:
    """One sensor's products in a frame's folder."""

    folder: Path
    manifest: dict[str, Any]
    camera: dict[str, Any]
    sensor: dict[str, Any]
    rig: SensorRig | None
    notes: list[str]

    def product(self, name: str) -> bytes | None:
        """Return a product of this sensor, or None where the recipe did not ask for it."""
        file = self.folder / name
        return file.read_bytes() if file.is_file() else None

    def raw(self) -> RawImage | None:
        """Return the raw image, or None."""
        from fullwell.dataset.encode import decode_raw_npz

        content = self.product("raw.npz")
        if content is None:
            self.notes.append("no raw.npz: levels, noise and edges need it; add it to the recipe's outputs")
            return None
        return decode_raw_npz(content)


def _open(frame_dir: Path, camera: str | None, sensor: str | None) -> _Frame:
    from fullwell.cli.local import _frame_folder

    folder = _frame_folder(frame_dir)
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    camera_number, camera_entry = _chosen(manifest["cameras"], camera, "--camera")
    sensor_number, sensor_entry = _chosen(camera_entry["sensors"], sensor, "--sensor")
    if len(manifest["cameras"]) > 1:
        folder = folder / camera_entry["name"]
    if len(camera_entry["sensors"]) > 1:
        folder = folder / sensor_entry["name"]
    notes: list[str] = []
    try:
        rig = _rig(manifest, camera_number, sensor_number)
    except FullwellError as error:
        rig = None
        notes.append(f"the sensor's parameters could not be read from the recipe in the manifest: {error}")
    return _Frame(folder, manifest, camera_entry, sensor_entry, rig, notes)


def _chosen(entries: list[dict[str, Any]], name: str | None, option: str) -> tuple[int, dict[str, Any]]:
    if name is None:
        return 0, entries[0]
    for number, entry in enumerate(entries):
        if entry["name"] == name:
            return number, entry
    message = unknown_name_message(option.strip("-"), name, [entry["name"] for entry in entries])
    raise FieldError(message, path=option, value=name)


def _rig(manifest: dict[str, Any], camera_number: int, sensor_number: int) -> SensorRig:
    """Return the sensor as the recipe in the manifest describes it."""
    from fullwell.radiometry import WavelengthGrid
    from fullwell.schema import load_recipe
    from fullwell.schema.conversion.cameras import camera_rig
    from fullwell.schema.conversion.context import Context, RecipeFiles

    bands = manifest["wavelengths_nm"]
    document = load_recipe(manifest["recipe"])
    context = Context(WavelengthGrid(bands["first"], bands["last"], bands["step"]), RecipeFiles(None, {}, confined=True))
    rig = camera_rig(document.cameras[camera_number], f"cameras[{camera_number}]", 1, context)
    return rig.sensors[sensor_number]


def _needed(raw: RawImage | None, option: str) -> RawImage:
    if raw is None:
        raise NotFoundError(f"{option} needs raw.npz, which this frame does not have. Add it to the recipe's outputs.")
    return raw


def _numbers(text: str, count: int, option: str, example: str) -> list[float]:
    try:
        values = [float(word) for word in text.replace(";", ",").split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise FieldError(f"{option} is {text!r}; must be {count} numbers, such as {example}.", path=option, value=text)
    return values


def _rectangle(text: str, option: str) -> PixelRegion:
    from fullwell.metrics import PixelRegion

    values = _numbers(text, 4, option, "100,80,180,160")
    if any(value != int(value) for value in values):
        raise FieldError(f"{option} is {text!r}; must be whole pixels, such as 100,80,180,160.", path=option, value=text)
    return PixelRegion(*(int(value) for value in values))


# The measurements ----------------------------------------------------------------------------------------------------


def _exposure_report(frame: _Frame, raw: RawImage | None) -> dict[str, Any]:
    from fullwell.metrics import exposure_value, photometric_exposure_lux_s

    time_s = raw.exposure_time_s if raw is not None else frame.sensor.get("exposure_time_s")
    if time_s is None:
        return {}
    f_number = float(frame.sensor["lens"]["f_number"])
    report: dict[str, Any] = {"f_number": f_number, "exposure_time_s": time_s}
    report["exposure_value"] = exposure_value(f_number=f_number, exposure_time_s=time_s)
    illuminance = _mean_illuminance(frame)
    if illuminance is not None:
        report["mean_illuminance_lux"] = illuminance
        report["photometric_exposure_lux_s"] = photometric_exposure_lux_s(illuminance, exposure_time_s=time_s)
    return {"exposure": report}


def _mean_illuminance(frame: _Frame) -> float | None:
    """Return the mean illuminance of the image plane [lx], from irradiance.exr where it is there."""
    import numpy as np

    from fullwell.core.constants import LUMINOUS_EFFICACY_LM_PER_W
    from fullwell.dataset.encode import decode_irradiance_exr
    from fullwell.radiometry import luminous_efficiency, photons_to_energy

    # It belongs to the camera's lens, not to one sensor: with several sensors it lies one folder up.
    content = frame.product("irradiance.exr") or frame.product("../irradiance.exr")
    if content is None:
        return None
    optical = decode_irradiance_exr(content)
    mean = np.mean(optical.photons, axis=(0, 1), dtype=np.float64)
    energy = photons_to_energy(mean, optical.grid.centres_nm)
    seen = energy @ luminous_efficiency().band_average(optical.grid)
    return float(LUMINOUS_EFFICACY_LM_PER_W * seen * optical.grid.step_nm)


def _levels_report(raw: RawImage, region: PixelRegion | None) -> dict[str, Any]:
    from fullwell.metrics import channel_levels

    return {
        "region": "whole image" if region is None else [region.x0, region.y0, region.x1, region.y1],
        "black_level_dn": raw.black_level_dn,
        "white_level_dn": raw.white_level_dn,
        "saturated_fraction": raw.saturated_fraction,
        "channels": [asdict(levels) for levels in channel_levels(raw, region)],
    }


def _figures_report(frame: _Frame, raw: RawImage) -> dict[str, Any] | None:
    """Return dynamic range and SNR of the sensor at this exposure, from the parameters in the recipe."""
    import numpy as np

    from fullwell.metrics import channel_mask, decibels, sensor_figures, snr_ratio
    from fullwell.sensor import saturation_electrons

    if frame.rig is None:
        return None
    model = frame.rig.model
    volts_per_e = model.conversion_gain_v_per_e
    noise = {
        "read_noise_e": model.read_noise_e,
        "dark_e": model.dark_current_e_per_s * raw.exposure_time_s,
        "quantisation_step_e": model.voltage_swing_v / (2**model.adc_bits - 1) / volts_per_e / model.analog_gain_ratio,
    }
    figures = sensor_figures(saturation_capacity_e=saturation_electrons(model), **noise)
    report: dict[str, Any] = {
        "model": model.name,
        "saturation_capacity_e": figures.saturation_capacity_e,
        "absolute_sensitivity_threshold_e": figures.absolute_sensitivity_threshold_e,
        "dynamic_range_db": figures.dynamic_range_db,
        "dynamic_range_stops": figures.dynamic_range_stops,
        "snr_max_db": figures.snr_max_db,
    }
    if raw.mean_electrons is not None:
        spatial = {"dsnu_e": model.dsnu_v / volts_per_e, "prnu_fraction": model.prnu_fraction}
        channels = []
        for name in dict.fromkeys(name for row in raw.pattern for name in row):
            collected = float(np.median(raw.mean_electrons[channel_mask(raw, name)])) - noise["dark_e"]
            signal_e = min(max(collected, 0.0), figures.saturation_capacity_e)
            temporal, total = float(snr_ratio(signal_e, **noise)), float(snr_ratio(signal_e, **noise, **spatial))
            channels.append(
                {
                    "channel": name,
                    "median_signal_e": signal_e,
                    "snr_db": decibels(temporal) if temporal > 0 else None,
                    "total_snr_db": decibels(total) if total > 0 else None,
                }
            )
        report["at_median_signal"] = channels
    return report


def _edge_report(frame: _Frame, raw: RawImage | None, region: PixelRegion, channel: str | None, window: str) -> dict[str, Any]:
    import numpy as np

    from fullwell.metrics import channel_levels, mosaic_edge_sfr

    image = _needed(raw, "--edge")
    part = region.within(image.rows, image.cols)
    counts = {levels.channel: levels for levels in channel_levels(image, region)}
    name = channel if channel is not None else max(counts, key=lambda known: counts[known].pixels)
    pattern = np.roll(np.array(image.pattern), (-region.y0, -region.x0), axis=(0, 1))
    response = mosaic_edge_sfr(
        image.dn[part].astype(np.float64) - image.black_level_dn,
        pattern=tuple(tuple(str(cell) for cell in row) for row in pattern),
        channel=name,
        window=window,  # type: ignore[arg-type]  # checked there, with the known names in the answer
    )
    if counts[name].saturated_fraction > 0:
        frame.notes.append(
            f"{counts[name].saturated_fraction:.1%} of the edge's pixels are saturated: the response is too good; expose less"
        )
    per_mm = 1.0 / (float(frame.sensor["pixel_pitch_m"]) * MM_PER_M)
    mtf50, mtf10 = response.mtf50_cycles_per_px, response.mtf10_cycles_per_px
    return {
        "region": [region.x0, region.y0, region.x1, region.y1],
        "channel": name,
        "window": window,
        "orientation": response.orientation,
        "edge_angle_deg": response.edge_angle_deg,
        "edge_step_dn": response.edge_step,
        "residual_dn": response.residual,
        "mtf50_cycles_per_px": mtf50,
        "mtf50_cycles_per_mm": None if mtf50 is None else mtf50 * per_mm,
        "mtf10_cycles_per_px": mtf10,
        "mtf10_cycles_per_mm": None if mtf10 is None else mtf10 * per_mm,
        "mtf_at_half_cycle_per_px": _finite(float(response.mtf_at(0.5))),
        "frequency_cycles_per_px": response.frequency_cycles_per_px[::8].tolist(),
        "mtf": response.mtf[::8].tolist(),
    }


def _finite(value: float) -> float | None:
    return value if value == value else None  # a NaN is not equal to itself  # noqa: PLR0124


def _falloff_report(raw: RawImage) -> list[dict[str, Any]]:
    import numpy as np

    from fullwell.metrics import channel_mask, relative_illumination

    report = []
    for name in dict.fromkeys(name for row in raw.pattern for name in row):
        used = channel_mask(raw, name) & (raw.dn < np.floor(raw.white_level_dn))
        field = np.where(used, raw.dn.astype(np.float64) - raw.black_level_dn, np.nan)
        falloff = relative_illumination(field, ring_count=10)
        report.append(
            {
                "channel": name,
                "corner_ratio": falloff.corner_ratio,
                "corner_radius_px": falloff.corner_radius_px,
                "radius_px": falloff.radius_px.tolist(),
                "ratio": falloff.ratio.tolist(),
                "standard_error": falloff.standard_error.tolist(),
            }
        )
    return report


def _patches_report(frame: _Frame, chart: str, corners: str | None, illuminant_name: str | None) -> dict[str, Any]:
    """Return the colour difference of each patch of the picture against the chart's reflectances under the light."""
    import numpy as np

    from fullwell.dataset.encode import decode_rgb_png
    from fullwell.isp.colour_matrix import xyz_to_linear_srgb_matrix
    from fullwell.metrics import delta_e_1976, delta_e_2000, patch_means, xyz_to_lab
    from fullwell.radiometry import COLORCHECKER_PATCHES, srgb_to_linear

    if chart != "colorchecker":
        raise FieldError(unknown_name_message("chart", chart, ["colorchecker"]), path="--patches", value=chart)
    if corners is None:
        raise FieldError("--patches needs --corners x,y,x,y,x,y,x,y: the chart's outer corners in the picture.", "--corners")
    content = frame.product("image.png")
    if content is None:
        raise NotFoundError("--patches needs image.png, which this frame does not have. Add it to the recipe's outputs.")
    points = np.array(_numbers(corners, 8, "--corners", "10,10,630,10,630,420,10,420")).reshape(4, 2)
    linear = srgb_to_linear(decode_rgb_png(content) / 255.0)
    found = patch_means(linear, points, rows=_CHART_ROWS, cols=_CHART_COLS)
    light, targets = _chart_targets(frame, illuminant_name)
    to_xyz = np.linalg.inv(xyz_to_linear_srgb_matrix())
    white = to_xyz @ np.ones(3)
    found_xyz, wanted_xyz = found @ to_xyz.T, targets @ to_xyz.T
    # The exposure is the photographer's choice: one factor, from the neutral patches' luminance, makes the two comparable.
    scale = float(np.sum(wanted_xyz[_NEUTRALS, 1] * found_xyz[_NEUTRALS, 1]) / np.sum(found_xyz[_NEUTRALS, 1] ** 2))
    labs = xyz_to_lab(found_xyz * scale, white), xyz_to_lab(wanted_xyz, white)
    new, old = delta_e_2000(*labs), delta_e_1976(*labs)
    return {
        "chart": chart,
        "illuminant": light,
        "exposure_factor": scale,
        "mean_delta_e_2000": float(new.mean()),
        "max_delta_e_2000": float(new.max()),
        "mean_delta_e_1976": float(old.mean()),
        "patches": [
            {"name": name, "lab": labs[0][k].tolist(), "reference_lab": labs[1][k].tolist(), "delta_e_2000": float(new[k])}
            for k, name in enumerate(COLORCHECKER_PATCHES)
        ],
    }


def _chart_targets(frame: _Frame, illuminant_name: str | None) -> tuple[str, NDArray[np.float64]]:
    """Return the light's name and the patches' linear sRGB under it, (24, 3), as the picture's white balance shows them."""
    from fullwell.isp.colour_matrix import adapted_srgb_targets
    from fullwell.radiometry import illuminant

    balanced = frame.rig is None or frame.rig.isp.white_balance != "none"
    light: Spectrum | None = None if frame.rig is None else frame.rig.isp.illuminant
    if illuminant_name is not None:
        light = illuminant(illuminant_name, path="--illuminant")
    elif light is None:
        light = _scene_light(frame)
    if light is None:
        raise FieldError("the picture's light is not known; name it with --illuminant, for example d65.", path="--illuminant")
    return light.source or "of the recipe", adapted_srgb_targets(light, adapt_white=balanced)[1:]


def _scene_light(frame: _Frame) -> Spectrum | None:
    """Return the light of the scene's own lamps, or None where the recipe's scene cannot be built from the manifest alone."""
    from fullwell.isp import scene_illuminant
    from fullwell.schema import build_frame, load_recipe

    try:
        described = build_frame(load_recipe(frame.manifest["recipe"]))
    except FullwellError as error:
        frame.notes.append(f"the scene could not be built from the recipe in the manifest: {error}")
        return None
    (rig,) = [rig for rig in described.cameras if rig.camera.name == frame.camera["name"]]
    return scene_illuminant(described.scene, rig.camera, dict(described.group_weights))


def _scene_report(frame: _Frame) -> dict[str, Any]:
    """Return the depths and objects in view, from depth.exr and labels.json where they are there."""
    import numpy as np

    from fullwell.dataset.encode import decode_depth_exr, decode_json

    report: dict[str, Any] = {}
    depth, labels = frame.product("depth.exr"), frame.product("labels.json")
    if depth is not None:
        ranges = decode_depth_exr(depth).depth_range_m
        hit = ranges[np.isfinite(ranges)]
        report["depth"] = {"hit_fraction": float(np.mean(np.isfinite(ranges)))}
        if hit.size:
            report["depth"] |= {
                "nearest_m": float(hit.min()),
                "median_m": float(np.median(hit)),
                "farthest_m": float(hit.max()),
            }
    if labels is not None:
        objects = decode_json(labels)["objects"]
        report["objects"] = {"all": len(objects), "visible": sum(item["visible_px"] > 0 for item in objects)}
    return report


# The tables ----------------------------------------------------------------------------------------------------------


def _print(report: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table("what", "value", title=f"{report['camera']}, {report['sensor']}")
    for what, value in _rows(report):
        table.add_row(what, value)
    console.print(table)
    if "levels" in report:
        levels = Table("channel", "pixels", "mean", "std. dev.", "min", "max", "saturated", "SNR", title="Levels [DN]")
        for row in report["levels"]["channels"]:
            numbers = (f"{row['mean_dn']:.2f}", f"{row['standard_deviation_dn']:.2f}", str(row["min_dn"]), str(row["max_dn"]))
            ends = (f"{row['saturated_fraction']:.2%}", f"{row['snr_ratio']:.1f}")
            levels.add_row(row["channel"], str(row["pixels"]), *numbers, *ends)
        console.print(levels)
    if "patches" in report:
        chart = Table("patch", "ΔE00", "L* a* b*", "reference", title=f"{report['patches']['chart']}, ΔE of CIEDE2000")
        for row in report["patches"]["patches"]:
            shown = [" ".join(f"{value:6.1f}" for value in row[key]) for key in ("lab", "reference_lab")]
            chart.add_row(row["name"], f"{row['delta_e_2000']:.2f}", *shown)
        console.print(chart)
    for note in report["notes"]:
        print(f"note: {note}")


def _rows(report: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the single figures of a report as (what, value with unit)."""
    known = {
        ("exposure", "exposure_value"): ("exposure value", "{:.2f} EV"),
        ("exposure", "exposure_time_s"): ("exposure time", "{:.6g} s"),
        ("exposure", "f_number"): ("f-number", "f/{:g}"),
        ("exposure", "photometric_exposure_lux_s"): ("photometric exposure", "{:.4g} lx s"),
        ("levels", "saturated_fraction"): ("saturated pixels", "{:.2%}"),
        ("sensor_figures", "dynamic_range_db"): ("dynamic range", "{:.1f} dB"),
        ("sensor_figures", "dynamic_range_stops"): ("", "{:.2f} stops"),
        ("sensor_figures", "snr_max_db"): ("largest SNR", "{:.1f} dB"),
        ("sensor_figures", "absolute_sensitivity_threshold_e"): ("absolute sensitivity threshold", "{:.2f} e-"),
        ("sensor_figures", "saturation_capacity_e"): ("saturation capacity", "{:.0f} e-"),
        ("edge", "edge_angle_deg"): ("edge angle", "{:.2f} deg"),
        ("edge", "mtf50_cycles_per_px"): ("MTF50", "{:.4f} cycles/px"),
        ("edge", "mtf50_cycles_per_mm"): ("", "{:.1f} cycles/mm"),
        ("edge", "mtf10_cycles_per_mm"): ("MTF10", "{:.1f} cycles/mm"),
        ("patches", "mean_delta_e_2000"): ("mean colour difference", "{:.2f} ΔE00"),
        ("patches", "max_delta_e_2000"): ("largest colour difference", "{:.2f} ΔE00"),
        ("depth", "nearest_m"): ("nearest surface", "{:.4g} m"),
        ("depth", "farthest_m"): ("farthest surface", "{:.4g} m"),
        ("objects", "visible"): ("objects in view", "{}"),
    }
    rows = []
    for (part, key), (what, shape) in known.items():
        value = (report.get(part) or {}).get(key)
        if value is not None:
            rows.append((what, shape.format(value)))
    figures = report.get("sensor_figures") or {}
    rows += [
        (f"SNR at the median signal, {row['channel']}", f"{row['snr_db']:.1f} dB at {row['median_signal_e']:.0f} e-")
        for row in figures.get("at_median_signal", [])
        if row["snr_db"] is not None
    ]
    falloff = report.get("relative_illumination", [])
    rows += [(f"corner over axis, {row['channel']}", f"{row['corner_ratio']:.3f}") for row in falloff]
    return rows
