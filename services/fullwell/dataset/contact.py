"""One picture of all products of a frame, for people: what `fullwell show` writes."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fullwell.core.errors import FieldError
from fullwell.dataset.drawing import (
    BACKGROUND,
    FAINT,
    INK,
    PANEL,
    Rgb,
    Tags,
    colour_bar,
    colour_map,
    distinct_colour,
    fit,
    flow_picture,
    font,
    id_picture,
    nice_ticks,
    wavelength_colour,
)
from fullwell.dataset.encode import (
    decode_depth_exr,
    decode_flow_exr,
    decode_ids_png,
    decode_irradiance_exr,
    decode_json,
    decode_normals_exr,
    decode_radiance_exr,
    decode_raw_npz,
    decode_raw_tiff,
    decode_rgb_png,
)
from fullwell.radiometry import WavelengthGrid
from fullwell.radiometry.photons import photons_to_energy

__all__ = ["picture_of_products"]

_PANEL_PX = (520, 400)
_TITLE_PX = 30
_GAP_PX = 14
_HEADER_PX = 76
_COLUMNS = 3
_MAX_BOX_LABELS = 40
_CROWD = 12
_SCENERY_SHARE = 0.12
"""In pictures with more than _CROWD boxes, those above this share of the picture are scenery: drawn thin, without a tag."""

_TINY = 1e-30
"""Stands for the brightest value of a black picture, so that nothing is divided by 0."""

_Draw = Callable[[Image.Image, "_Frame"], None]


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """The products of one sensor of a frame, by plain product name."""

    products: Mapping[str, bytes]
    labels: Mapping[str, Any]
    manifest: Mapping[str, Any]

    def objects(self) -> list[Mapping[str, Any]]:
        """Labelled objects that can be seen, nearest first."""
        seen = [entry for entry in self.labels.get("objects", []) if entry.get("visible_px", 0) > 0]
        return sorted(seen, key=lambda entry: float(entry.get("distance_m") or 0.0))


def picture_of_products(products: Mapping[str, bytes], title: str) -> bytes:
    """Return one PNG that shows every product of a frame.

    Products are named as in the frame's folder; a camera's or sensor's name may stand before them (``left/depth.exr``); of
    several products of a kind the first is shown. Those that are not there are left out.

    Raises
    ------
    FieldError
        None of the products can be shown, or one of them is damaged.
    """
    frame = _frame_of(products)
    panels = list(_panels(frame))
    if not panels:
        raise FieldError(
            "there is no product that can be shown; ask for image.png or others in the recipe's outputs.", "outputs"
        )
    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    pitch = (_PANEL_PX[0] + _GAP_PX, _PANEL_PX[1] + _TITLE_PX + _GAP_PX)
    canvas = Image.new("RGB", (columns * pitch[0] + _GAP_PX, _HEADER_PX + rows * pitch[1]), BACKGROUND)
    _draw_header(canvas, title, frame)
    for index, (heading, note, draw) in enumerate(panels):
        corner = (_GAP_PX + index % columns * pitch[0], _HEADER_PX + index // columns * pitch[1])
        panel = Image.new("RGB", _PANEL_PX, PANEL)
        draw(panel, frame)
        canvas.paste(panel, (corner[0], corner[1] + _TITLE_PX))
        pen = ImageDraw.Draw(canvas)
        pen.text((corner[0], corner[1] + 5), heading, fill=INK, font=font(16))
        start = corner[0] + pen.textlength(heading, font=font(16)) + 12
        pen.text((start, corner[1] + 8), _shortened(pen, note, corner[0] + _PANEL_PX[0] - start, 12), fill=FAINT, font=font(12))
    stream = io.BytesIO()
    canvas.save(stream, format="PNG", compress_level=6)
    return stream.getvalue()


def _frame_of(products: Mapping[str, bytes]) -> _Frame:
    by_kind: dict[str, bytes] = {}
    kinds = sorted(
        {"image.png", "raw.npz", "raw.tiff", "radiance.exr", "irradiance.exr", "depth.exr", "normals.exr", "flow.exr"}
    )
    kinds += ["instances.png", "semantic.png", "labels.json", "manifest.json"]
    for kind in kinds:
        named = sorted(
            name for name in products if name == kind or name.endswith(("/" + kind, "." + kind, "-" + kind, "_" + kind))
        )
        if named:
            # "irradiance.exr" must not answer for "radiance.exr", hence the separators above; the plain name wins.
            by_kind[kind] = products[kind if kind in named else named[0]]
    documents = {kind: decode_json(by_kind[kind]) if kind in by_kind else {} for kind in ("labels.json", "manifest.json")}
    return _Frame(by_kind, documents["labels.json"], documents["manifest.json"])


def _panels(frame: _Frame) -> Iterator[tuple[str, str, _Draw]]:
    """(heading, note, drawing) of every panel that the products allow."""
    have = frame.products
    if "image.png" in have:
        rows, cols = decode_rgb_png(have["image.png"]).shape[:2]
        yield "image.png", f"sRGB, {cols} x {rows} pixels", _draw_image
    if "image.png" in have and frame.objects():
        yield "labels.json", f"boxes of visible pixels, {len(frame.objects())} objects in view", _draw_boxes
    if "raw.npz" in have or "raw.tiff" in have:
        dn, metadata = _raw(frame)
        note = f"{int(dn.min())} to {int(dn.max())} DN, median {np.median(dn):.0f}, black {metadata['black_level_dn']:.1f}"
        name = "raw.npz" if "raw.npz" in have else "raw.tiff"
        yield name, f"{note}, {metadata['adc_bits']} bits; right: middle, in filter colours", _draw_raw
    if "depth.exr" in have:
        yield "depth.exr", "along the optical axis [m]; black: nothing", _draw_depth
    if "instances.png" in have:
        count = len(np.unique(decode_ids_png(have["instances.png"])).nonzero()[0])
        yield "instances.png", f"{count} instances", _draw_instances
    if "semantic.png" in have:
        yield "semantic.png", "classes", _draw_semantic
    if "normals.exr" in have:
        yield "normals.exr", "right: red, up: green, towards the camera: blue", _draw_normals
    if "flow.exr" in have:
        image = decode_flow_exr(have["flow.exr"])
        note = f"direction as on the wheel, {_flow_scale_px(image.flow_px):.3g} px in {_time_text(image.interval_s)} at its rim"
        yield "flow.exr", note, _draw_flow
    for name, note in (("radiance.exr", "W / (sr m2 nm)"), ("irradiance.exr", "W / (m2 nm)")):
        if name in have:
            yield name, f"mean spectrum [{note}] and four bands", _spectral_drawing(name)
    if "manifest.json" in have and len(have) > 1:
        yield "manifest.json", "in brief", _draw_manifest


# Header --------------------------------------------------------------------------------------------------------------


def _draw_header(canvas: Image.Image, title: str, frame: _Frame) -> None:
    pen = ImageDraw.Draw(canvas)
    width = canvas.width - 2 * _GAP_PX
    pen.text((_GAP_PX, 12), _shortened(pen, title, width, 24), fill=INK, font=font(24))
    pen.text((_GAP_PX, 46), _shortened(pen, "   ".join(_key_numbers(frame)), width, 14), fill=FAINT, font=font(14))


def _key_numbers(frame: _Frame) -> Iterator[str]:
    """What a person wants to know first, as far as raw image and manifest say it."""
    if "raw.npz" in frame.products or "raw.tiff" in frame.products:
        _, raw = _raw(frame)
        yield f"sensor {raw['sensor_name']}"
        yield f"exposure {_time_text(raw['exposure_time_s'])}"
        yield f"saturated {100 * raw['saturated_fraction']:.2g} %"
    elif isinstance(exposure_s := _first(frame.manifest, "exposure_time_s"), int | float):
        yield f"exposure {_time_text(exposure_s)}"
    for key, words in (("samples_per_pixel", "{:g} samples per pixel"), ("seed", "seed {:d}"), ("seconds", "made in {:.3g} s")):
        value = _first(frame.manifest, key)
        if isinstance(value, int | float):
            yield words.format(value)
    for entry in frame.manifest.get("varied", []):
        yield f"{entry['path']} = {_value_text(entry['value'])}"


def _value_text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _first(document: Any, key: str) -> Any:
    """The value of the first entry of that name, the outermost first."""
    level = [document]
    while level:
        for entry in level:
            if isinstance(entry, Mapping) and key in entry:
                return entry[key]
        level = [
            child
            for entry in level
            for child in (entry.values() if isinstance(entry, Mapping) else entry if isinstance(entry, list) else ())
            if isinstance(child, Mapping | list)
        ]
    return None


def _time_text(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1:
            return f"{seconds * factor:.4g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def _shortened(pen: ImageDraw.ImageDraw, text: str, width_px: float, size_px: int) -> str:
    if pen.textlength(text, font=font(size_px)) <= width_px:
        return text
    while text and pen.textlength(text + "...", font=font(size_px)) > width_px:
        text = text[:-1]
    return text + "..."


def _draw_manifest(panel: Image.Image, frame: _Frame) -> None:
    """Camera, quality, time and warnings, in lines."""
    pen = ImageDraw.Draw(panel)
    y = 12
    for name, text in _manifest_lines(frame.manifest):
        words, line = text.split(), ""
        pen.text((12, y), name, fill=FAINT, font=font(13))
        for word in words:
            longer = f"{line} {word}".strip()
            if line and pen.textlength(longer, font=font(13)) > panel.width - 142:
                pen.text((130, y), line, fill=INK, font=font(13))
                y, line = y + 17, word
            else:
                line = longer
        pen.text((130, y), line, fill=INK, font=font(13))
        y += 22
        if y > panel.height - 24:
            return


def _manifest_lines(manifest: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    if "index" in manifest and "count" in manifest:
        yield "frame", f"{manifest['index']} of {manifest['count']}"
    for camera in manifest.get("cameras", [])[:2]:
        for sensor in camera.get("sensors", [])[:3]:
            yield from _sensor_lines(sensor)
        radiance = camera.get("radiance")
        if radiance:
            error = radiance.get("relative_standard_error_rms")
            noise = "" if error is None else f", error {100 * error:.2g} % rms per pixel"
            yield "rendering", f"{radiance.get('samples_per_pixel')} samples per pixel{noise}, {radiance.get('variant', '')}"
    run = manifest.get("run", {})
    stages = sorted(run.get("stages", []), key=lambda stage: -float(stage.get("wall_s", 0.0)))[:4]
    if stages:
        parts = ", ".join(f"{stage['stage'].rpartition(': ')[2]} {stage['wall_s']:.3g} s" for stage in stages)
        yield "time", f"{run.get('seconds', 0):.3g} s: {parts}"
    if manifest.get("licences"):
        yield "licences", ", ".join(manifest["licences"])
    for sentence in _grouped([str(note) for note in (*manifest.get("warnings", []), *run.get("notes", []))]):
        yield "note", sentence


def _grouped(sentences: Iterable[str]) -> Iterator[str]:
    """Sentences that differ only in the field they begin with, told once."""
    groups: dict[str, list[str]] = {}
    for sentence in sentences:
        first, _, rest = sentence.partition(" ")
        field = first if "." in first or "[" in first else ""
        groups.setdefault(rest if field else sentence, []).append(field)
    for text, fields in groups.items():
        more = f" (and {len(fields) - 1} more)" if len(fields) > 1 else ""
        yield f"{fields[0]}{more} {text}".strip()


def _sensor_lines(sensor: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    cols, rows = sensor.get("size_px", (0, 0))
    pitch_um = 1e6 * float(sensor.get("pixel_pitch_m", 0.0))
    yield "sensor", f"{sensor.get('model')}, {cols} x {rows} pixels of {pitch_um:.3g} um, {sensor.get('adc_bits', '?')} bits"
    lens = sensor.get("lens")
    if lens:
        yield (
            "lens",
            f"{lens.get('kind')}, f = {1e3 * lens['focal_length_m']:.3g} mm, f/{lens['f_number']:.3g}".replace("_", " "),
        )
    if "exposure_time_s" in sensor:
        mean = sensor.get("mean_electrons")
        level = "" if mean is None else f", mean {mean:.0f} electrons"
        yield (
            "exposure",
            f"{_time_text(sensor['exposure_time_s'])}{level}, {100 * sensor.get('saturated_fraction', 0):.2g} % saturated",
        )
    ratio = sensor.get("noise_ratio_rms")
    if ratio is not None:
        yield "noise ratio", f"{ratio:.2g} (error of rendering over noise of the sensor)"


# Images and labels ---------------------------------------------------------------------------------------------------


def _paste(panel: Image.Image, pixels: NDArray[np.uint8], *, smooth: bool = True) -> tuple[float, int, int]:
    """Put a picture into the middle of the panel; returns its scale and corner."""
    picture, factor = fit(pixels, panel.size, smooth=smooth)
    corner = ((panel.width - picture.width) // 2, (panel.height - picture.height) // 2)
    panel.paste(picture, corner)
    return factor, corner[0], corner[1]


def _draw_image(panel: Image.Image, frame: _Frame) -> None:
    _paste(panel, decode_rgb_png(frame.products["image.png"]))


def _draw_boxes(panel: Image.Image, frame: _Frame) -> None:
    pixels = decode_rgb_png(frame.products["image.png"])
    # Dimmed, so that the boxes can be told from what is in them.
    factor, left, top = _paste(panel, (pixels * 0.72).astype(np.uint8))
    pen = ImageDraw.Draw(panel)
    tags = Tags(pen, (0, 0, panel.width - 1, panel.height - 1), [])
    objects = frame.objects()
    named = [entry for entry in objects if entry.get("class") and entry.get("bbox_visible_px")] or objects
    crowd = len(named) > _CROWD
    for entry in reversed(named):
        box = entry.get("bbox_visible_px")
        if box:
            corners = [left + box[0] * factor, top + box[1] * factor, left + box[2] * factor - 1, top + box[3] * factor - 1]
            corners[2:] = max(corners[2], corners[0]), max(corners[3], corners[1])
            scenery = crowd and _area(box) > _SCENERY_SHARE * pixels.shape[0] * pixels.shape[1]
            colour = distinct_colour(int(entry.get("class_id") or entry["instance"]))
            pen.rectangle(corners, outline=colour, width=1 if scenery else 2)
    for entry in [entry for entry in named if entry.get("bbox_visible_px")][:_MAX_BOX_LABELS]:
        box = entry["bbox_visible_px"]
        text = f"{entry.get('class') or entry['id']} {entry.get('distance_m', 0):.3g} m"
        width_px = pen.textlength(text, font=font(12))
        # In a crowd, tags of the scenery and tags wider than what they name would hide the rest.
        if crowd and (
            _area(box) > _SCENERY_SHARE * pixels.shape[0] * pixels.shape[1] or width_px > 1.5 * (box[2] - box[0]) * factor + 60
        ):
            continue
        colour = distinct_colour(int(entry.get("class_id") or entry["instance"]))
        tags.put((left + box[0] * factor, top + box[1] * factor), text, colour, size_px=12)


def _area(box: Sequence[float]) -> float:
    return max(box[2] - box[0], 0) * max(box[3] - box[1], 0)


def _draw_instances(panel: Image.Image, frame: _Frame) -> None:
    ids = decode_ids_png(frame.products["instances.png"])
    factor, left, top = _paste(panel, id_picture(ids), smooth=False)
    tags = Tags(ImageDraw.Draw(panel), (0, 0, panel.width - 1, panel.height - 1), [])
    by_size = sorted(frame.objects(), key=lambda entry: -int(entry["visible_px"]))
    for entry in by_size[:_MAX_BOX_LABELS]:
        where = np.argwhere(ids == entry["instance"])
        if len(where):
            # The pixel nearest to the centroid: the centroid of a ring lies in its hole.
            centre = where[np.argmin(((where - where.mean(axis=0)) ** 2).sum(axis=1))]
            anchor = (left + (centre[1] + 0.5) * factor - 20, top + (centre[0] + 0.5) * factor + 8)
            tags.put(anchor, str(entry["id"]), distinct_colour(int(entry["instance"])), size_px=12)


def _draw_semantic(panel: Image.Image, frame: _Frame) -> None:
    ids = decode_ids_png(frame.products["semantic.png"])
    names = {int(entry["id"]): str(entry["name"]) for entry in frame.labels.get("classes", [])} | {0: "unlabelled"}
    present = [int(number) for number in np.unique(ids)]
    legend_px = 22 * (-(-min(len(present), 12) // 4)) + 6
    picture, _ = fit(id_picture(ids), (panel.width, panel.height - legend_px), smooth=False)
    panel.paste(picture, ((panel.width - picture.width) // 2, 0))
    pen = ImageDraw.Draw(panel)
    shares = {number: float((ids == number).mean()) for number in present}
    for place, number in enumerate(sorted(present, key=lambda n: -shares[n])[:12]):
        x, y = 8 + place % 4 * (panel.width - 8) // 4, panel.height - legend_px + 6 + place // 4 * 22
        pen.rectangle((x, y + 1, x + 13, y + 14), fill=distinct_colour(number), outline=FAINT)
        text = f"{names.get(number, number)} {100 * shares[number]:.2g} %"
        pen.text((x + 19, y), _shortened(pen, text, (panel.width - 8) // 4 - 24, 12), fill=INK, font=font(12))


# Arrays --------------------------------------------------------------------------------------------------------------


def _raw(frame: _Frame) -> tuple[NDArray[np.uint16] | NDArray[np.uint32], Mapping[str, Any]]:
    if "raw.tiff" in frame.products and "raw.npz" not in frame.products:
        return decode_raw_tiff(frame.products["raw.tiff"])
    raw = decode_raw_npz(frame.products["raw.npz"])
    names = ("pattern", "black_level_dn", "white_level_dn", "exposure_time_s", "sensor_name", "adc_bits", "saturated_fraction")
    return raw.dn, {name: getattr(raw, name) for name in names}


_FILTER_TINTS: dict[str, tuple[float, float, float]] = {
    "r": (1.0, 0.25, 0.2),
    "g": (0.25, 1.0, 0.3),
    "b": (0.3, 0.45, 1.0),
    "c": (0.2, 1.0, 1.0),
    "m": (1.0, 0.3, 1.0),
    "y": (1.0, 1.0, 0.2),
}


def _draw_raw(panel: Image.Image, frame: _Frame) -> None:
    dn, metadata = _raw(frame)
    black = float(metadata["black_level_dn"])
    bright = max(float(np.percentile(dn, 99.5)), black + 1.0)
    # A square root spreads the shadows, as the eye does.
    shown = np.sqrt(np.clip((dn - black) / (bright - black), 0.0, 1.0))
    grey = np.repeat((shown * 255)[..., None], 3, axis=2).astype(np.uint8)
    factor, left, top = _paste(panel, grey)
    side = min(24, *dn.shape)
    row, col = (dn.shape[0] - side) // 2, (dn.shape[1] - side) // 2
    pattern = metadata["pattern"]
    rows, cols = np.mgrid[row : row + side, col : col + side]
    tints = np.array([[_FILTER_TINTS.get(str(name)[:1].casefold(), (1.0, 1.0, 1.0)) for name in line] for line in pattern])
    tinted = shown[row : row + side, col : col + side, None] * tints[rows % len(pattern), cols % len(pattern[0])]
    zoom = Image.fromarray((tinted * 255).astype(np.uint8)).resize((6 * side, 6 * side), Image.Resampling.NEAREST)
    corner = (panel.width - zoom.width - 8, panel.height - zoom.height - 8)
    panel.paste(zoom, corner)
    pen = ImageDraw.Draw(panel)
    pen.rectangle((corner[0] - 2, corner[1] - 2, panel.width - 7, panel.height - 7), outline=INK, width=2)
    box = [left + col * factor, top + row * factor, left + (col + side) * factor, top + (row + side) * factor]
    pen.rectangle(box, outline=INK, width=1)


def _draw_depth(panel: Image.Image, frame: _Frame) -> None:
    depth_m = decode_depth_exr(frame.products["depth.exr"]).depth_z_m
    hit = np.isfinite(depth_m)
    bar_px = 70
    pixels = np.zeros((*depth_m.shape, 3), np.uint8)
    pen = ImageDraw.Draw(panel)
    if not hit.any():
        pen.text((12, 12), "nothing is hit", fill=FAINT, font=font(14))
        return
    near, far = (float(v) for v in np.percentile(depth_m[hit], [0.5, 99.5]))
    far = max(far, near * 1.001)
    logarithmic = far > 8 * near
    scale: Callable[[Any], Any] = np.log if logarithmic else np.asarray
    span = float(scale(far) - scale(near))
    fraction = (scale(np.where(hit, depth_m, far)) - scale(near)) / span
    pixels[hit] = colour_map(1.0 - fraction)[hit]
    picture, _ = fit(pixels, (panel.width - bar_px, panel.height))
    panel.paste(picture, ((panel.width - bar_px - picture.width) // 2, (panel.height - picture.height) // 2))
    top, height, x = 26, panel.height - 44, panel.width - bar_px + 12
    panel.paste(colour_bar(height, 14), (x, top))
    ticks = _log_ticks(near, far) if logarithmic else nice_ticks(near, far)
    for tick in ticks:
        y = top + float(scale(tick) - scale(near)) / span * height
        pen.line((x + 14, y, x + 18, y), fill=INK)
        pen.text((x + 21, y - 8), f"{tick:g}", fill=INK, font=font(13))
    pen.text((x, 6), "m (log)" if logarithmic else "m", fill=FAINT, font=font(12))


def _log_ticks(low: float, high: float) -> list[float]:
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    return [digit * 10.0**power for power in decades for digit in (1, 2, 5) if low <= digit * 10.0**power <= high]


def _draw_normals(panel: Image.Image, frame: _Frame) -> None:
    normals = decode_normals_exr(frame.products["normals.exr"])
    # Camera axes are x right, y down, z forward; people read up and towards the viewer as positive.
    shown = normals * np.array([1.0, -1.0, -1.0]) * 0.5 + 0.5
    shown[~normals.any(axis=2)] = 0.06
    _paste(panel, (np.clip(shown, 0.0, 1.0) * 255).astype(np.uint8))


_WHEEL_PX = 64
_LEAST_FLOW_PX = 1e-3
"""Less is not worth spreading over the colours."""


def _flow_scale_px(flow: NDArray[np.float32]) -> float:
    """Return the flow that has full colour: nearly the largest, so that a few pixels do not pale the rest."""
    lengths = np.hypot(flow[..., 0], flow[..., 1])
    moving = lengths[np.isfinite(lengths) & (lengths > _LEAST_FLOW_PX)]
    return float(np.percentile(moving, 98)) if len(moving) else _LEAST_FLOW_PX


def _draw_flow(panel: Image.Image, frame: _Frame) -> None:
    flow = decode_flow_exr(frame.products["flow.exr"]).flow_px
    _paste(panel, flow_picture(flow, _flow_scale_px(flow)))
    side = np.arange(_WHEEL_PX) - (_WHEEL_PX - 1) / 2
    across, down = np.meshgrid(side, side)
    wheel = np.stack([across, down], axis=-1) / (_WHEEL_PX / 2)
    wheel[np.hypot(across, down) > _WHEEL_PX / 2] = np.nan
    corner = (panel.width - _WHEEL_PX - 8, panel.height - _WHEEL_PX - 8)
    panel.paste(Image.fromarray(flow_picture(wheel, 1.0)), corner)


def _spectral_drawing(name: str) -> _Draw:
    def draw(panel: Image.Image, frame: _Frame) -> None:
        if name == "radiance.exr":
            radiance = decode_radiance_exr(frame.products[name])
            _draw_spectral(panel, radiance.photons, radiance.grid)
        else:
            optical = decode_irradiance_exr(frame.products[name])
            _draw_spectral(panel, optical.photons, optical.grid)

    return draw


def _draw_spectral(panel: Image.Image, photons: NDArray[np.float32], grid: WavelengthGrid) -> None:
    mean = photons_to_energy(photons.mean(axis=(0, 1), dtype=np.float64), grid.centres_nm)
    bands = sorted({round(k) for k in (np.linspace(0.12, 0.88, 4) * (grid.count - 1)).tolist()})
    pitch = panel.width // 4
    below = round(photons.shape[0] / photons.shape[1] * (pitch - 10))
    below = min(below, panel.height // 2) + 26
    _draw_curve(panel, grid, mean, height_px=panel.height - below)
    pen = ImageDraw.Draw(panel)
    bright = max(float(np.percentile(photons[..., bands], 99)), _TINY)
    for place, band in enumerate(bands):
        grey = np.sqrt(np.clip(photons[..., band] / bright, 0.0, 1.0))
        picture, _ = fit(np.repeat((grey * 255)[..., None], 3, axis=2).astype(np.uint8), (pitch - 10, below - 26))
        x = place * pitch + 5 + (pitch - 10 - picture.width) // 2
        panel.paste(picture, (x, panel.height - below))
        colour = wavelength_colour(float(grid.centres_nm[band]))
        pen.text((place * pitch + 8, panel.height - 21), f"{grid.centres_nm[band]:g} nm", fill=colour, font=font(13))


def _draw_curve(panel: Image.Image, grid: WavelengthGrid, values: NDArray[np.float64], *, height_px: int) -> None:
    pen = ImageDraw.Draw(panel)
    left, right, top, bottom = 64, panel.width - 16, 14, height_px - 30
    low_nm, high_nm = float(grid.edges_nm[0]), float(grid.edges_nm[-1])
    highest = max(float(values.max()) * 1.08, _TINY)

    def place(wavelength_nm: float, value: float) -> tuple[float, float]:
        across = (wavelength_nm - low_nm) / (high_nm - low_nm)
        return left + across * (right - left), bottom - value / highest * (bottom - top)

    for tick in nice_ticks(0.0, highest, about=4):
        y = place(low_nm, tick)[1]
        pen.line((left, y, right, y), fill=(58, 62, 70))
        pen.text((6, y - 8), f"{tick:.3g}", fill=FAINT, font=font(12))
    for tick in nice_ticks(low_nm, high_nm, about=6):
        x = place(tick, 0.0)[0]
        pen.line((x, bottom, x, bottom + 4), fill=FAINT)
        pen.text((x - 12, bottom + 6), f"{tick:g}", fill=FAINT, font=font(12))
    edges = grid.edges_nm
    for k, value in enumerate(values.tolist()):
        x0, y0 = place(float(edges[k]), value)
        x1 = place(float(edges[k + 1]), value)[0]
        tone: Rgb = wavelength_colour(float(grid.centres_nm[k]))
        pen.rectangle((x0, y0, max(x1 - 1, x0), bottom), fill=(tone[0] // 2, tone[1] // 2, tone[2] // 2))
        pen.line((x0, y0, x1, y0), fill=tone, width=2)
    pen.line((left, bottom, right, bottom), fill=FAINT)
