"""Light from infinitely far away: a constant dome, maps of the whole sphere, and the sun's disk. See docs/physics/lights.md."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.upsample import reflectance_from_linear_srgb
from fullwell.render.transport.upload import upload
from fullwell.render.transport.wavelengths import PACKET, SpectraOnDevice, SpectraTable, cell_means
from fullwell.scene import ImageEnvironment, SunSky

__all__ = ["DomeMap", "MapOnDevice", "SunDisk", "SunOnDevice", "image_map", "sun_and_sky"]

Array = NDArray[np.float64]

_SAMPLING_ROWS, _SAMPLING_COLS = 256, 512
"""Every map is sampled by cells of this grid, whatever its own size, so that one kernel serves all maps."""

_SKY_ROWS, _SKY_COLS = 128, 256
_LOWEST_SUN_SINE = 1e-5
"""A sun exactly on the horizon is 2 arc seconds above."""


@dataclass(frozen=True, slots=True, eq=False)
class DomeMap:
    """Radiance from all directions: coefficients times spectra.

    Attributes
    ----------
    coefficients
        (rows, cols, components), row 0 about the zenith, columns counter-clockwise about +z; bilinear between the middles of
        its pixels.
    packet
        Of the scene's table of spectra: the first of those that hold the components' spectra.
    azimuth_rad
        Where column 0 begins, counter-clockwise from +x.
    split
        Whether nothing is mixed across the horizon.
    """

    coefficients: NDArray[np.float32]
    packet: int
    azimuth_rad: float = 0.0
    split: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class SunDisk:
    """A disk of equal radiance: unit vector towards it, angular radius, row of the scene's table."""

    direction: Array
    radius_rad: float
    row: int


def image_map(light: ImageEnvironment, spectra: SpectraTable) -> DomeMap:
    """Return an image times its light: a pixel (1, 1, 1) has the light's radiance, exactly.

    A colour is that of a reflectance of that colour under the light: three curves that add up to 1, times the light.
    """
    curves = [reflectance_from_linear_srgb(primary) for primary in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    cells = np.stack([cell_means(curve) for curve in curves]).astype(np.float64)
    cells /= cells.sum(axis=0)
    power = cell_means(light.radiance).astype(np.float64)
    packet = spectra.add_packets([(curve * power).astype(np.float32) for curve in cells])
    # The middle of an image lies towards its azimuth, its right side clockwise of it: seen from inside.
    pixels = np.maximum(np.asarray(light.pixels, dtype=np.float32)[:, ::-1], 0.0)
    return DomeMap(pixels, packet, np.radians(light.azimuth_deg) - np.pi)


def sun_and_sky(light: SunSky, spectra: SpectraTable) -> tuple[DomeMap | None, SunDisk | None]:
    """Return the clear sky's map and the sun's disk, each None where its weight is 0. Black below the horizon."""
    x, y, z = (float(v) for v in np.asarray(light.sun_direction, dtype=np.float64) / np.linalg.norm(light.sun_direction))
    sky = _clear_sky((x, y, max(_LOWEST_SUN_SINE, z)), float(light.turbidity), float(light.ground_albedo))

    def cells_of(values: Array, weight: float) -> NDArray[np.float32]:
        return cell_means(Spectrum(sky.wavelength_nm, values * weight, outside="zero"))

    dome = sun = None
    if light.sky_weight > 0:
        packet = spectra.add_packets([cells_of(component, light.sky_weight) for component in sky.basis])
        dome = DomeMap(sky.coefficients, packet, split=True)
    if light.sun_weight > 0:
        direction = np.asarray(sky.sun_direction, dtype=np.float64)
        row = spectra.add_cells(cells_of(sky.sun_radiance, light.sun_weight))
        sun = SunDisk(direction / np.linalg.norm(direction), float(sky.sun_radius_rad), row)
    return dome, sun


@functools.lru_cache(maxsize=4)
def _clear_sky(towards: tuple[float, float, float], turbidity: float, ground_albedo: float) -> Any:
    """Return the sky, remembered: the frames of one recipe share it, and it takes up to a second."""
    from fullwell.radiometry.sky import clear_sky  # noqa: PLC0415 - only skies need it

    return clear_sky(towards, turbidity=turbidity, ground_albedo=ground_albedo, rows=_SKY_ROWS, cols=_SKY_COLS)


# Where to sample -----------------------------------------------------------------------------------------------------


def cell_weights(dome: DomeMap, powers: Array) -> Array:
    """Return (_SAMPLING_ROWS, _SAMPLING_COLS) mean brightness of the map over the sampling grid's cells.

    `powers` (components,) weigh the spectra. Positive wherever the mixed pixels are.
    """
    brightness = np.maximum(np.asarray(dome.coefficients, dtype=np.float64) @ powers, 0.0)
    rows, cols = brightness.shape
    # The mean of a bilinear map over one pixel: 6/8 of itself, 1/8 of each neighbour, in both axes.
    mixed = 0.75 * brightness + 0.125 * (np.roll(brightness, 1, axis=1) + np.roll(brightness, -1, axis=1))
    halves = np.split(mixed, [rows // 2]) if dome.split else [mixed]
    padded = [np.pad(half, ((1, 1), (0, 0)), mode="edge") for half in halves if len(half)]
    smooth = np.concatenate([0.75 * p[1:-1] + 0.125 * (p[:-2] + p[2:]) for p in padded])
    weights = _overlaps(_SAMPLING_ROWS, rows) @ smooth @ _overlaps(_SAMPLING_COLS, cols).T
    return np.asarray(weights)


def _overlaps(cells: int, pixels: int) -> Array:
    """Return (cells, pixels): which share of each of `cells` equal parts of an interval lies in each of `pixels`."""
    cell_edges, pixel_edges = np.linspace(0, 1, cells + 1), np.linspace(0, 1, pixels + 1)
    high = np.minimum(cell_edges[1:, None], pixel_edges[None, 1:])
    low = np.maximum(cell_edges[:-1, None], pixel_edges[None, :-1])
    return np.asarray(np.maximum(high - low, 0.0) * cells)


# On the device -------------------------------------------------------------------------------------------------------


class MapOnDevice:
    """A `DomeMap` on the device: its radiance in a direction, and directions chosen by it."""

    def __init__(self, mi: Any, dome: DomeMap, powers: Array) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr, self._four = mi, dr, dr.llvm.ad.Array4f
        rows, cols, components = dome.coefficients.shape
        packets = -(-components // PACKET)
        padded = np.zeros((rows, cols, packets * PACKET), dtype=np.float32)
        padded[..., :components] = dome.coefficients
        self._coefficients = upload(mi.Float, padded)
        self._first = dr.opaque(mi.UInt32, dome.packet)
        self._packets = dr.opaque(mi.UInt32, packets)
        self._rows, self._cols = dr.opaque(mi.Int32, rows), dr.opaque(mi.Int32, cols)
        # Rows of the upper part end, and those of the lower part begin, at the horizon of a split map.
        self._upper_last = dr.opaque(mi.Int32, max(0, rows // 2 - 1) if dome.split else rows - 1)
        self._lower_first = dr.opaque(mi.Int32, rows // 2 if dome.split else 0)
        self._azimuth = dr.opaque(mi.Float, dome.azimuth_rad)
        weights = cell_weights(dome, powers)
        edges = np.cos(np.linspace(0.0, np.pi, _SAMPLING_ROWS + 1))
        solid_angle = (edges[:-1] - edges[1:]) * 2.0 * np.pi / _SAMPLING_COLS
        flux = weights * solid_angle[:, None]
        self.total = float(flux.sum())
        """Brightness integrated over the sphere."""
        scale = 1.0 / self.total if self.total > 0 else 0.0
        self._density = upload(mi.Float, (weights * scale).astype(np.float32))
        self._row_sums = upload(mi.Float, _running(flux.sum(axis=1)[None]))
        self._col_sums = upload(mi.Float, _running(flux))
        self._row_edges = upload(mi.Float, edges.astype(np.float32))

    def sample(self, u: Any, active: Any) -> tuple[Any, Any]:
        """Return (direction, density [sr^-1])."""
        dr, mi = self._dr, self._mi
        zero = dr.zeros(mi.UInt32, dr.width(u.x))
        row, across = self._invert(self._row_sums, zero, _SAMPLING_ROWS, u.y, active)
        col, along = self._invert(self._col_sums, row * (_SAMPLING_COLS + 1), _SAMPLING_COLS, u.x, active)
        top = dr.gather(mi.Float, self._row_edges, row, active)
        z = dr.lerp(top, dr.gather(mi.Float, self._row_edges, row + 1, active), across)
        sine, cosine = dr.sincos(self._azimuth + (mi.Float(col) + along) * (2.0 * np.pi / _SAMPLING_COLS))
        flat = dr.safe_sqrt((1.0 - z) * (1.0 + z))
        density = dr.gather(mi.Float, self._density, row * _SAMPLING_COLS + col, active)
        return mi.Vector3f(flat * cosine, flat * sine, z), density

    def _invert(self, sums: Any, base: Any, count: int, u: Any, active: Any) -> tuple[Any, Any]:
        """Return the cell of a running sum that holds `u`, and where in it; `count` is a power of two."""
        dr, mi = self._dr, self._mi
        cell = base
        step = count // 2
        while step:
            further = dr.gather(mi.Float, sums, cell + step, active) <= u
            cell = dr.select(further, cell + step, cell)
            step //= 2
        low, high = dr.gather(mi.Float, sums, cell, active), dr.gather(mi.Float, sums, cell + 1, active)
        within = dr.clip((u - low) / dr.maximum(high - low, 1e-30), 0.0, 1.0 - 2.0**-24)
        return cell - base, within

    def density(self, direction: Any, active: Any) -> Any:
        """Return the density [sr^-1] with which `sample` chooses a direction."""
        dr, mi = self._dr, self._mi
        down, around = self._place(direction)
        row = dr.minimum(mi.UInt32(down * _SAMPLING_ROWS), _SAMPLING_ROWS - 1)
        col = dr.minimum(mi.UInt32(around * _SAMPLING_COLS), _SAMPLING_COLS - 1)
        return dr.gather(mi.Float, self._density, row * _SAMPLING_COLS + col, active)

    def _place(self, direction: Any) -> tuple[Any, Any]:
        """Return where a direction lies in the map, from the top and from the left, in [0, 1]."""
        dr = self._dr
        flat = dr.sqrt(direction.x * direction.x + direction.y * direction.y)
        down = dr.atan2(flat, direction.z) * (1.0 / np.pi)
        around = (dr.atan2(direction.y, direction.x) - self._azimuth) * (0.5 / np.pi)
        return dr.clip(down, 0.0, 1.0), around - dr.floor(around)

    def radiance(self, spectra: SpectraOnDevice, direction: Any, cells: list[Any], active: Any) -> Any:
        """Return the radiance from a direction at a path's wavelengths."""
        dr, mi = self._dr, self._mi
        corners = self._corners(direction)
        width = dr.width(direction.x)

        def step(packet: Any, sums: list[Any], going: Any) -> tuple[Any, list[Any], Any]:
            mixed = dr.zeros(self._four, width)
            for pixel, weight in corners:
                mixed += dr.gather(self._four, self._coefficients, pixel * self._packets + packet, going) * weight
            sums = [
                total + dr.dot(mixed, spectra.packet(self._first + packet, cell, going))
                for total, cell in zip(sums, cells, strict=True)
            ]
            packet = packet + 1
            return packet, sums, going & (packet < self._packets)

        _, sums, _ = dr.while_loop(
            state=(
                dr.zeros(mi.UInt32, width),
                [dr.zeros(mi.Float, width) for _ in cells],
                dr.full(mi.Bool, True, width) & active,
            ),
            cond=lambda packet, sums, going: going,
            body=step,
            labels=("packet", "sums", "going"),
        )
        # Spectra after a sky's first have negative parts, and single precision leaves some of them at its dark end.
        return dr.llvm.ad.ArrayXf([dr.maximum(value, 0.0) for value in sums])

    def _corners(self, direction: Any) -> list[tuple[Any, Any]]:
        """Return the four pixels about a direction and their weights."""
        dr, mi = self._dr, self._mi
        down, around = self._place(direction)
        row, col = down * mi.Float(self._rows) - 0.5, around * mi.Float(self._cols) - 0.5
        row_floor, col_floor = dr.floor(row), dr.floor(col)
        below, beside = row - row_floor, col - col_floor
        upper = direction.z > 0
        first, last = dr.select(upper, 0, self._lower_first), dr.select(upper, self._upper_last, self._rows - 1)
        top = mi.Int32(row_floor)
        left = mi.Int32(col_floor)
        left = dr.select(left < 0, left + self._cols, left)
        right = dr.select(left + 1 >= self._cols, 0, left + 1)
        rows = [(dr.clip(top, first, last), 1.0 - below), (dr.clip(top + 1, first, last), below)]
        columns = [(left, 1.0 - beside), (right, beside)]
        return [(mi.UInt32(r * self._cols + c), weight_r * weight_c) for r, weight_r in rows for c, weight_c in columns]


def _running(flux: Array) -> NDArray[np.float32]:
    """Return (n, cells + 1) running sums from 0 to 1 of (n, cells); even steps where a row is dark."""
    sums = np.concatenate([np.zeros((len(flux), 1)), np.cumsum(flux, axis=1)], axis=1)
    total = sums[:, -1:]
    even = np.broadcast_to(np.linspace(0.0, 1.0, sums.shape[1]), sums.shape)
    return np.where(total > 0, sums / np.where(total > 0, total, 1.0), even).astype(np.float32)


class SunOnDevice:
    """A `SunDisk` on the device."""

    def __init__(self, mi: Any, sun: SunDisk) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._direction = mi.Vector3f(*(dr.opaque(mi.Float, float(x)) for x in sun.direction))
        # 1 - cos and squared chord, which keep their digits at a quarter of a degree.
        opening = 2.0 * np.sin(0.5 * sun.radius_rad) ** 2
        self.solid_angle_sr = float(2.0 * np.pi * opening)
        self._opening, self._chord2 = dr.opaque(mi.Float, opening), dr.opaque(mi.Float, 2.0 * opening)
        self._inverse_sr = dr.opaque(mi.Float, 1.0 / self.solid_angle_sr)
        self.row = dr.opaque(mi.UInt32, sun.row)

    def sample(self, u: Any) -> Any:
        """Return a direction uniform over the disk."""
        dr, mi = self._dr, self._mi
        drop = u.x * self._opening
        sine, cosine = dr.sincos(2.0 * np.pi * u.y)
        flat = dr.sqrt(drop * (2.0 - drop))
        side, up = mi.coordinate_system(self._direction)
        return mi.Vector3f(self._direction * (1.0 - drop) + side * (flat * cosine) + up * (flat * sine))

    def holds(self, direction: Any) -> Any:
        """Return whether a direction meets the disk."""
        off = direction - self._direction
        return self._dr.dot(off, off) < self._chord2

    def density(self, direction: Any) -> Any:
        """Return the density [sr^-1] with which `sample` chooses a direction."""
        return self._dr.select(self.holds(direction), self._inverse_sr, 0.0)
