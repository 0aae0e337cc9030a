"""Products as bytes, and back. The same arrays give the same bytes: no times, host names or library versions inside.

Every decoder reads what its encoder wrote; third-party tools read the files too (see each function for the layout).
"""

from __future__ import annotations

import io
import json
import math
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from fullwell.core.errors import FieldError, ShapeError
from fullwell.dataset.filter_codes import standard_codes
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.radiometry.photons import energy_to_photons, photons_to_energy
from fullwell.scene.images import CaptureRecord, OpticalImage, RawImage

__all__ = [
    "DepthImage",
    "FlowImage",
    "decode_coverage_png",
    "decode_depth_exr",
    "decode_flow_exr",
    "decode_ids_png",
    "decode_irradiance_exr",
    "decode_json",
    "decode_normals_exr",
    "decode_radiance_exr",
    "decode_raw_npz",
    "decode_raw_tiff",
    "decode_rgb_png",
    "encode_coverage_png",
    "encode_depth_exr",
    "encode_flow_exr",
    "encode_ids_png",
    "encode_irradiance_exr",
    "encode_json",
    "encode_normals_exr",
    "encode_radiance_exr",
    "encode_raw_npz",
    "encode_raw_tiff",
    "encode_rgb_png",
]

_METADATA = "fullwell"
"""Name of the EXR attribute and of the NPZ entry that hold full-precision metadata as JSON text."""

_STANDARD_ERROR = "relativeStandardError"
_FIRST_ZIP_TIME = (1980, 1, 1, 0, 0, 0)
_MAX_ID = 2**24 - 1
_WHITE = 255


# Spectral images -----------------------------------------------------------------------------------------------------


def encode_radiance_exr(radiance: RadianceImage) -> bytes:
    """Return spectral radiance as OpenEXR, float32, [W sr^-1 m^-2 nm^-1], one channel per band.

    Channels are named ``S0.<wavelength>nm`` with a decimal comma, after Fichet, Pacanowski and Wilkie 2021 (An OpenEXR
    Layout for Spectral Images, JCGT 10(3), sec. 4). Photons become energy at the band centres. Grid and pitch are in the
    attribute `fullwell` (JSON); the relative standard error, where known, is a channel of its own.

    Raises
    ------
    FieldError
        A value is NaN, Inf or negative.
    """
    extra = {} if radiance.standard_error is None else {_STANDARD_ERROR: _float32(radiance.standard_error)}
    metadata = {"quantity": "spectral radiance", "tangent_pitch": radiance.tangent_pitch, **_grid_entries(radiance.grid)}
    return _encode_spectral(radiance.photons, radiance.grid, metadata, extra, unit="W.m^-2.sr^-1.nm^-1")


def decode_radiance_exr(content: bytes) -> RadianceImage:
    """Return the radiance that `encode_radiance_exr` wrote, as photons (equal to a float32 rounding)."""
    channels, metadata = _decode_exr(content)
    photons, grid = _decode_spectral(channels, metadata)
    return RadianceImage(photons, grid, float(metadata["tangent_pitch"]), channels.get(_STANDARD_ERROR))


def encode_irradiance_exr(optical: OpticalImage) -> bytes:
    """Return spectral irradiance on the sensor as OpenEXR, float32, [W m^-2 nm^-1]; layout as `encode_radiance_exr`."""
    metadata = {
        "quantity": "spectral irradiance",
        "sample_pitch_m": optical.sample_pitch_m,
        "notes": list(optical.notes),
        **_grid_entries(optical.grid),
    }
    return _encode_spectral(optical.photons, optical.grid, metadata, {}, unit="W.m^-2.nm^-1")


def decode_irradiance_exr(content: bytes) -> OpticalImage:
    """Return the optical image that `encode_irradiance_exr` wrote, as photons (equal to a float32 rounding)."""
    channels, metadata = _decode_exr(content)
    photons, grid = _decode_spectral(channels, metadata)
    return OpticalImage(photons, grid, float(metadata["sample_pitch_m"]), tuple(metadata["notes"]))


def _grid_entries(grid: WavelengthGrid) -> dict[str, Any]:
    return {"first_nm": grid.first_nm, "last_nm": grid.last_nm, "step_nm": grid.step_nm}


def _encode_spectral(
    photons: NDArray[np.float32],
    grid: WavelengthGrid,
    metadata: dict[str, Any],
    extra: dict[str, NDArray[np.float32]],
    *,
    unit: str,
) -> bytes:
    channels: dict[str, NDArray[np.float32]] = {}
    # Band by band: the float64 copy of a whole image would be twice as large as the image.
    for k, wavelength_nm in enumerate(grid.centres_nm):
        energy = photons_to_energy(photons[..., k], wavelength_nm).astype(np.float32)
        if not (np.all(np.isfinite(energy)) and np.all(energy >= 0)):
            raise FieldError(
                f"the {metadata['quantity']} holds NaN, Inf or negative values at {wavelength_nm:g} nm; must be >= 0."
            )
        channels[_channel_name(wavelength_nm)] = energy
    attributes = {"spectralLayoutVersion": "1.0", "emissiveUnits": unit}
    return _encode_exr({**channels, **extra}, {**attributes, _METADATA: _compact_json(metadata)})


def _decode_spectral(
    channels: dict[str, NDArray[np.float32]], metadata: dict[str, Any]
) -> tuple[NDArray[np.float32], WavelengthGrid]:
    grid = WavelengthGrid(float(metadata["first_nm"]), float(metadata["last_nm"]), float(metadata["step_nm"]))
    energy = np.stack([channels[_channel_name(nm)] for nm in grid.centres_nm], axis=-1)
    return energy_to_photons(energy, grid.centres_nm).astype(np.float32), grid


def _channel_name(wavelength_nm: float) -> str:
    # A decimal comma, because a point would make a layer of the channel (Fichet et al. 2021, sec. 4.1).
    return f"S0.{wavelength_nm:.6f}nm".replace(".", ",").replace("S0,", "S0.")


# Depth and normals ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class DepthImage:
    """Depth of each pixel, (rows, cols) float32 [m], +inf where nothing is hit.

    `depth_z_m` is along the optical axis, `depth_range_m` the distance from the centre of the lens.
    """

    depth_z_m: NDArray[np.float32]
    depth_range_m: NDArray[np.float32]


def encode_depth_exr(depth_z_m: NDArray[np.float32], depth_range_m: NDArray[np.float32]) -> bytes:
    """Return depth as OpenEXR, float32 [m]: channel Z is depth_z, channel range is depth_range, +inf where nothing is hit.

    Raises
    ------
    ShapeError
        The two differ in shape.
    FieldError
        A depth is NaN or not > 0.
    """
    if depth_z_m.shape != depth_range_m.shape or depth_z_m.ndim != 2:
        raise ShapeError(
            f"depth_z_m has shape {depth_z_m.shape} and depth_range_m {depth_range_m.shape}; both must be (rows, cols)."
        )
    for name, depth in (("depth_z_m", depth_z_m), ("depth_range_m", depth_range_m)):
        if not np.all(depth > 0):
            raise FieldError(f"{name} holds NaN or values <= 0; must be > 0, +inf where nothing is hit.", path=name)
    attributes = {"units": "m", "Z": "along the optical axis, +inf: nothing", "range": "from the lens centre, +inf: nothing"}
    return _encode_exr({"Z": _float32(depth_z_m), "range": _float32(depth_range_m)}, attributes)


def decode_depth_exr(content: bytes) -> DepthImage:
    """Return the depths that `encode_depth_exr` wrote, exactly."""
    channels, _ = _decode_exr(content)
    return DepthImage(channels["Z"], channels["range"])


def encode_normals_exr(normals: NDArray[np.float32]) -> bytes:
    """Return (rows, cols, 3) unit normals as OpenEXR channels N.X, N.Y, N.Z, float32; (0, 0, 0) where nothing is hit."""
    if normals.ndim != 3 or normals.shape[2] != 3:
        raise ShapeError(f"normals has shape {normals.shape}; must be (rows, cols, 3).")
    if not np.all(np.isfinite(normals)):
        raise FieldError("normals holds NaN or Inf; must be unit vectors, or 0 where nothing is hit.", path="normals")
    return _encode_exr({f"N.{axis}": _float32(normals[..., k]) for k, axis in enumerate("XYZ")}, {"units": "1"})


def decode_normals_exr(content: bytes) -> NDArray[np.float32]:
    """Return the (rows, cols, 3) normals that `encode_normals_exr` wrote, exactly."""
    channels, _ = _decode_exr(content)
    return np.stack([channels[f"N.{axis}"] for axis in "XYZ"], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class FlowImage:
    """Optical flow (rows, cols, 2) float32 [px], to the right and down, over an interval [s]; NaN where there is none."""

    flow_px: NDArray[np.float32]
    interval_s: float


def encode_flow_exr(image: FlowImage) -> bytes:
    """Return optical flow as OpenEXR, float32 [px]: flow.x to the right, flow.y down, NaN where there is none.

    The attribute `interval_s` is the time that it spans, as text. Raises FieldError where a flow is Inf.
    """
    flow = image.flow_px
    if flow.ndim != 3 or flow.shape[2] != 2:
        raise ShapeError(f"flow_px has shape {flow.shape}; must be (rows, cols, 2).")
    if np.any(np.isinf(flow)):
        raise FieldError("flow_px holds Inf; must be finite, NaN where there is no flow.", path="flow_px")
    attributes = {
        "units": "px",
        "flow": "x to the right, y down, NaN: none",
        "interval_s": repr(float(image.interval_s)),
        _METADATA: _compact_json({"quantity": "optical flow", "interval_s": image.interval_s}),
    }
    return _encode_exr({f"flow.{axis}": _float32(flow[..., k]) for k, axis in enumerate("xy")}, attributes)


def decode_flow_exr(content: bytes) -> FlowImage:
    """Return the flow that `encode_flow_exr` wrote, exactly."""
    channels, metadata = _decode_exr(content)
    return FlowImage(np.stack([channels[f"flow.{axis}"] for axis in "xy"], axis=-1), float(metadata["interval_s"]))


# OpenEXR -------------------------------------------------------------------------------------------------------------


def _float32(values: NDArray[Any]) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32)


def _encode_exr(channels: dict[str, NDArray[np.float32]], attributes: dict[str, str]) -> bytes:
    import OpenEXR  # noqa: PLC0415  (native code, slow to load where no product is written)

    header: dict[str, Any] = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    stream = io.BytesIO()
    OpenEXR.File(header, channels).write(stream)
    return stream.getvalue()


def _decode_exr(content: bytes) -> tuple[dict[str, NDArray[np.float32]], dict[str, Any]]:
    import OpenEXR  # noqa: PLC0415

    try:
        with OpenEXR.File(io.BytesIO(content), separate_channels=True) as file:
            channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
            metadata = json.loads(file.header().get(_METADATA, "{}"))
    except (RuntimeError, ValueError, OSError) as error:
        raise FieldError(f"the EXR file is damaged ({error}); fetch or render it again.") from error
    return channels, metadata


# Images --------------------------------------------------------------------------------------------------------------


def encode_rgb_png(rgb: NDArray[np.uint8]) -> bytes:
    """Return a (rows, cols, 3) uint8 sRGB image as PNG, marked as sRGB."""
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
        raise ShapeError(f"rgb has shape {rgb.shape} and type {rgb.dtype}; must be (rows, cols, 3) uint8.")
    info = PngInfo()
    info.add(b"sRGB", b"\x00")
    return _png(Image.fromarray(np.ascontiguousarray(rgb)), info)


def decode_rgb_png(content: bytes) -> NDArray[np.uint8]:
    """Return the (rows, cols, 3) uint8 image of a PNG."""
    return np.asarray(_opened_png(content).convert("RGB"), dtype=np.uint8).copy()


def encode_ids_png(ids: NDArray[np.uint32]) -> bytes:
    """Return (rows, cols) ids as PNG: 16-bit grey where all are < 65536, else 8-bit RGB with id = R + 256 G + 65536 B.

    The text chunk `ids` says which. 0 is nothing. Raises FieldError above 16777215.
    """
    if ids.ndim != 2 or not np.issubdtype(ids.dtype, np.integer):
        raise ShapeError(f"ids has shape {ids.shape} and type {ids.dtype}; must be (rows, cols) of unsigned integers.")
    highest = int(ids.max(initial=0))
    if highest > _MAX_ID or int(ids.min(initial=0)) < 0:
        raise FieldError(f"the highest id is {highest}; must be 0 to {_MAX_ID}. Use fewer objects.", path="ids", value=highest)
    info = PngInfo()
    if highest < 1 << 16:
        info.add_text("ids", "id = grey")
        return _png(Image.fromarray(np.ascontiguousarray(ids.astype(np.uint16))), info)
    info.add_text("ids", "id = R + 256 G + 65536 B")
    bytes_of = np.stack([(ids >> shift) & 255 for shift in (0, 8, 16)], axis=-1).astype(np.uint8)
    return _png(Image.fromarray(bytes_of), info)


def decode_ids_png(content: bytes) -> NDArray[np.uint32]:
    """Return the (rows, cols) uint32 ids that `encode_ids_png` wrote."""
    values = np.asarray(_opened_png(content), dtype=np.uint32)
    if values.ndim == 2:
        return values
    return values @ np.array([1, 256, 65536], dtype=np.uint32)


def encode_coverage_png(coverage: NDArray[np.float32]) -> bytes:
    """Return (rows, cols) shares in [0, 1] as 8-bit grey PNG, 255 for 1: exact for the default of 17 rays per edge pixel.

    Raises FieldError where a share is NaN or outside [0, 1].
    """
    if coverage.ndim != 2:
        raise ShapeError(f"coverage has shape {coverage.shape}; must be (rows, cols).")
    if not np.all((coverage >= 0) & (coverage <= 1)):
        raise FieldError("coverage holds values that are NaN or outside [0, 1]; must be shares of pixels.", path="coverage")
    info = PngInfo()
    info.add_text("coverage", "share = grey / 255")
    return _png(Image.fromarray(np.rint(coverage * _WHITE).astype(np.uint8)), info)


def decode_coverage_png(content: bytes) -> NDArray[np.float32]:
    """Return the (rows, cols) shares of `encode_coverage_png`, to the nearest 1/255."""
    return np.asarray(_opened_png(content).convert("L"), dtype=np.float32) / np.float32(_WHITE)


def _opened_png(content: bytes) -> Image.Image:
    try:
        image = Image.open(io.BytesIO(content), formats=("PNG",))
        image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise FieldError(f"the PNG file is damaged ({error}); fetch or render it again.") from error
    return image


def _png(image: Image.Image, info: PngInfo) -> bytes:
    stream = io.BytesIO()
    image.save(stream, format="PNG", pnginfo=info, compress_level=4)
    return stream.getvalue()


# Raw -----------------------------------------------------------------------------------------------------------------


def encode_raw_npz(raw: RawImage) -> bytes:
    """Return a raw image as NPZ: `dn` (rows, cols), `mean_electrons` where known, and `fullwell` (JSON text).

    `fullwell` holds the filter pattern, the channels' quantum efficiencies, black and white level, bits, times and captures.
    """
    metadata = {**_raw_entries(raw), "channels": [_channel_entry(name, curve) for name, curve in raw.channels]}
    metadata["grid"] = _grid_entries(raw.grid)
    arrays: dict[str, NDArray[Any]] = {"dn": raw.dn, _METADATA: np.array(_compact_json(metadata))}
    if raw.mean_electrons is not None:
        arrays["mean_electrons"] = raw.mean_electrons
    return _npz(arrays)


def decode_raw_npz(content: bytes) -> RawImage:
    """Return the raw image that `encode_raw_npz` wrote, exactly."""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        metadata = json.loads(str(arrays[_METADATA]))
    except (OSError, ValueError, EOFError, KeyError, AttributeError, zipfile.BadZipFile, zlib.error) as error:
        raise FieldError(f"the NPZ file is damaged ({error}); fetch or render it again.") from error
    return RawImage(
        dn=arrays["dn"],
        pattern=tuple(tuple(row) for row in metadata["pattern"]),
        channels=tuple((entry["name"], _spectrum_of(entry)) for entry in metadata["channels"]),
        grid=WavelengthGrid(**metadata["grid"]),
        black_level_dn=metadata["black_level_dn"],
        white_level_dn=metadata["white_level_dn"],
        exposure_time_s=metadata["exposure_time_s"],
        sensor_name=metadata["sensor_name"],
        adc_bits=metadata["adc_bits"],
        saturated_fraction=metadata["saturated_fraction"],
        mean_electrons=arrays.get("mean_electrons"),
        # Archives from before there were captures lack these.
        line_time_s=metadata.get("line_time_s", 0.0),
        electrons_per_dn=metadata.get("electrons_per_dn", 0.0),
        channel_exposure_time_s=tuple((name, time_s) for name, time_s in metadata.get("channel_exposure_time_s", ())),
        captures=tuple(CaptureRecord(**entry) for entry in metadata.get("captures", ())),
    )


def encode_raw_tiff(raw: RawImage) -> bytes:
    """Return a raw image as uncompressed 16-bit grey TIFF; the image description holds the metadata as JSON.

    Where the channels have names of TIFF/EP colours (R, G, B, Cy, M, Y, W; C is clear, or cyan beside M or Y) the tags
    CFARepeatPatternDim and CFAPattern state the mosaic; BlackLevel and WhiteLevel are DNG's. Quantum efficiencies are only in
    raw.npz. Images combined to more than 16 bits have 32.
    """
    import tifffile  # noqa: PLC0415  (slow to import where no TIFF is written)

    rows, cols = len(raw.pattern), len(raw.pattern[0])
    tags: list[tuple[int, str, int, Any, bool]] = [
        (50714, "d", 1, raw.black_level_dn, True),
        (50717, "I", 1, round(raw.white_level_dn), True),
    ]
    planes = standard_codes([name for row in raw.pattern for name in row])
    if None not in planes:
        tags += [
            (33421, "H", 2, (rows, cols), True),
            (33422, "B", rows * cols, bytes(p for p in planes if p is not None), True),
        ]
    stream = io.BytesIO()
    tifffile.imwrite(
        stream,
        raw.dn,
        photometric="minisblack",
        byteorder="<",
        metadata=None,
        software=False,
        datetime=False,
        description=_compact_json(_raw_entries(raw)),
        extratags=sorted(tags, key=lambda tag: tag[0]),
    )
    return stream.getvalue()


def decode_raw_tiff(content: bytes) -> tuple[NDArray[np.uint16], dict[str, Any]]:
    """Return the DN and the metadata of the image description that `encode_raw_tiff` wrote."""
    import tifffile  # noqa: PLC0415

    try:
        with tifffile.TiffFile(io.BytesIO(content)) as file:
            page = file.pages[0]
            return np.asarray(page.asarray()), json.loads(page.description)
    except (tifffile.TiffFileError, OSError, ValueError, IndexError, struct.error) as error:
        raise FieldError(f"the TIFF file is damaged ({error}); fetch or render it again.") from error


def _raw_entries(raw: RawImage) -> dict[str, Any]:
    return {
        "pattern": [list(row) for row in raw.pattern],
        "black_level_dn": float(raw.black_level_dn),
        "white_level_dn": float(raw.white_level_dn),
        "exposure_time_s": float(raw.exposure_time_s),
        "sensor_name": raw.sensor_name,
        "adc_bits": int(raw.adc_bits),
        "saturated_fraction": float(raw.saturated_fraction),
        "line_time_s": float(raw.line_time_s),
        "electrons_per_dn": float(raw.electrons_per_dn),
        "channel_exposure_time_s": [[name, float(time_s)] for name, time_s in raw.channel_exposure_time_s],
        "captures": [asdict(capture) for capture in raw.captures],
    }


def _channel_entry(name: str, curve: Spectrum) -> dict[str, Any]:
    return {
        "name": name,
        "wavelength_nm": curve.wavelength_nm.tolist(),
        "quantum_efficiency": curve.values.tolist(),
        "outside": curve.outside,
        "unit": curve.unit,
        "source": curve.source,
    }


def _spectrum_of(entry: Mapping[str, Any]) -> Spectrum:
    return Spectrum(
        np.array(entry["wavelength_nm"]),
        np.array(entry["quantum_efficiency"]),
        outside=entry["outside"],
        unit=entry["unit"],
        source=entry["source"],
    )


def _npz(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """A NumPy archive whose bytes depend on the arrays only: numpy.savez writes the time of day."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=4) as archive:
        for name, array in sorted(arrays.items()):
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=_FIRST_ZIP_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            body = io.BytesIO()
            np.lib.format.write_array(body, np.asarray(array, order="C"), allow_pickle=False)
            archive.writestr(entry, body.getvalue(), compresslevel=4)
    return stream.getvalue()


# JSON ----------------------------------------------------------------------------------------------------------------


def encode_json(document: Mapping[str, Any]) -> bytes:
    """Return a document as indented JSON with sorted keys, UTF-8, ended by a newline.

    NumPy numbers and arrays become numbers and lists. Raises FieldError with the path of a NaN, Inf or foreign object.
    """
    plain = _plain(document, "")
    return (json.dumps(plain, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def decode_json(content: bytes) -> Any:
    """Return the document of JSON bytes; raises FieldError where they are damaged."""
    try:
        return json.loads(content)
    except ValueError as error:
        raise FieldError(f"the JSON file is damaged ({error}); fetch or render it again.") from error


def _plain(value: Any, path: str) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        raise FieldError(
            f"{path} is {value}; JSON holds finite numbers only. Leave the entry out or write null.", path, str(value)
        )
    if isinstance(value, Mapping):
        return {str(key): _plain(item, f"{path}.{key}" if path else str(key)) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, f"{path}[{index}]") for index, item in enumerate(value)]
    if value is None or isinstance(value, str | int | float):
        return value
    raise FieldError(f"{path} is of type {type(value).__name__}, which JSON cannot hold.", path, value)


def _compact_json(document: Mapping[str, Any]) -> str:
    return json.dumps(_plain(document, ""), sort_keys=True, separators=(",", ":"), allow_nan=False)
