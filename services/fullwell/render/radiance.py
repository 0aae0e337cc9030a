"""Spectral radiance in absolute units: camera rays in, band means out, the same bytes for any number of threads."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.errors import CancelledError, FullwellError, RenderError
from fullwell.core.rng import seed32
from fullwell.radiometry import RadianceImage, WavelengthGrid
from fullwell.render.rays import lens_rays
from fullwell.render.translate import TranslatedScene, translate
from fullwell.render.variant import activate
from fullwell.scene import Camera, SceneDescription

__all__ = ["RenderStatistics", "render_radiance"]

_PHOTONS_PER_J_NM = 1.0 / (PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M)
"""Photons per joule and nanometre of wavelength: n = E * lambda_nm * this."""

_MAX_LANES = 1 << 21
"""Camera rays per kernel launch. It bounds memory, and it is a constant because it takes part in the seeds."""

_MAX_PASS_SAMPLES = 64
_HERO_WAVELENGTHS = 4
_MAX_BAD_FRACTION = 1e-3
"""Share of samples that may be NaN, infinite or negative (and count as black) before the image is refused."""

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class RenderStatistics:
    """What the rendering did: camera rays per pixel, passes, refused samples, wall and CPU seconds, renderer variant."""

    samples_per_pixel: int
    passes: int
    bad_samples: int
    wall_s: float
    cpu_s: float
    variant: str


def render_radiance(
    scene: SceneDescription,
    camera: Camera,
    grid: WavelengthGrid,
    *,
    samples_per_pixel: int,
    max_depth: int,
    seed: int,
    progress: Progress | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> tuple[RadianceImage, RenderStatistics]:
    """Return the spectral photon radiance that reaches the camera's film samples, and what it took.

    Parameters
    ----------
    samples_per_pixel
        Camera rays per film sample; rounded up so that passes of stratified samples divide it.
    max_depth
        Segments of the longest path: 1 shows emitters only, 2 adds direct light, and so on.
    seed
        The same seed gives the same bytes, for any number of threads.
    progress, should_cancel
        Called between passes, with the finished fraction in [0, 1].

    Returns
    -------
    The image in photons s^-1 m^-2 sr^-1 nm^-1 (lens effects other than depth of field left out) and its statistics.

    Raises
    ------
    RenderError
        The renderer refused the scene or produced too many invalid samples.
    CancelledError
        `should_cancel` returned true.
    """
    started, cpu_started = time.perf_counter(), time.process_time()
    mi = activate()
    translated = translate(mi, scene, camera.camera_to_world[:3, 3])
    report = _Reporter(progress, should_cancel)
    try:
        if mi.variant().startswith("llvm"):
            film = _render_wavefront(mi, translated, camera, grid, samples_per_pixel, max_depth, seed, report)
        else:
            film = _render_scalar(mi, translated, camera, grid, samples_per_pixel, max_depth, seed, report)
    except FullwellError:
        raise
    except Exception as error:
        raise RenderError(f"the renderer failed: {error.__cause__ or error}") from error
    statistics = RenderStatistics(
        samples_per_pixel=film.samples,
        passes=film.passes,
        bad_samples=film.bad_samples,
        wall_s=time.perf_counter() - started,
        cpu_s=time.process_time() - cpu_started,
        variant=str(mi.variant()),
    )
    return film.image(camera, grid), statistics


class _Reporter:
    """Progress out, cancellation in."""

    def __init__(self, progress: Progress | None, should_cancel: Callable[[], bool] | None) -> None:
        self._progress = progress
        self._should_cancel = should_cancel

    def __call__(self, fraction: float) -> None:
        if self._should_cancel is not None and self._should_cancel():
            raise CancelledError("rendering was cancelled between two passes; nothing was written")
        if self._progress is not None:
            self._progress(fraction)


class _Film:
    """Sums of band means over passes, and the spread of the passes' band sums."""

    def __init__(self, pixels: int, bands: int) -> None:
        self.totals = np.zeros((pixels, bands), dtype=np.float64)
        self.pass_sum = np.zeros(pixels, dtype=np.float64)
        self.pass_square_sum = np.zeros(pixels, dtype=np.float64)
        self.passes = 0
        self.samples = 0
        self.bad_samples = 0

    def add_pass_means(self, first: int, band_sums: NDArray[np.float64]) -> None:
        """Note the (pixels,) band sums of one pass for the pixels from `first` on."""
        part = slice(first, first + len(band_sums))
        self.pass_sum[part] += band_sums
        self.pass_square_sum[part] += band_sums**2

    def standard_error(self) -> NDArray[np.float32] | None:
        """Return the (pixels,) relative standard error of the band sum; None for a single pass."""
        if self.passes < 2:
            return None
        mean = self.pass_sum / self.passes
        variance = np.maximum(self.pass_square_sum / self.passes - mean**2, 0.0) * self.passes / (self.passes - 1)
        error = np.sqrt(variance / self.passes)
        return np.divide(error, mean, out=np.zeros_like(error), where=mean > 0).astype(np.float32)

    def image(self, camera: Camera, grid: WavelengthGrid) -> RadianceImage:
        """Return the finished image; refuse one with too many invalid samples or with values float32 cannot hold."""
        rows, cols = camera.film.rows, camera.film.cols
        tried = max(1, self.samples * rows * cols * _HERO_WAVELENGTHS)
        if self.bad_samples > _MAX_BAD_FRACTION * tried:
            raise RenderError(
                f"{self.bad_samples} of {tried} samples are NaN, infinite or negative; check the scene for extreme radiances, "
                "sizes or material parameters."
            )
        if not np.all(self.totals <= np.finfo(np.float32).max):
            raise RenderError("the radiance exceeds what single precision holds; scale the lights down.")
        error = self.standard_error()
        return RadianceImage(
            photons=self.totals.astype(np.float32).reshape(rows, cols, grid.count),
            grid=grid,
            tangent_pitch=camera.tangent_pitch,
            standard_error=None if error is None else error.reshape(rows, cols),
        )


# Compiled wavefronts -------------------------------------------------------------------------------------------------


def _plan_passes(samples_per_pixel: int) -> tuple[int, int]:
    """Return (passes, samples per pass): at least two passes for an error estimate, at most 64 stratified samples each."""
    if samples_per_pixel == 1:
        return 1, 1
    wanted_passes = 4 if samples_per_pixel >= 32 else 2
    per_pass = min(_MAX_PASS_SAMPLES, -(-samples_per_pixel // wanted_passes))
    return -(-samples_per_pixel // per_pass), per_pass


def _render_wavefront(
    mi: Any,
    translated: TranslatedScene,
    camera: Camera,
    grid: WavelengthGrid,
    samples_per_pixel: int,
    max_depth: int,
    seed: int,
    report: _Reporter,
) -> _Film:
    pixels = camera.film.rows * camera.film.cols
    integrator = mi.load_dict({"type": "path", "max_depth": max_depth})
    sampler = mi.load_dict({"type": "multijitter", "sample_count": 1})
    passes, per_pass = _plan_passes(samples_per_pixel)
    sampler.set_sample_count(per_pass)
    per_pass = int(sampler.sample_count())
    film = _Film(pixels, grid.count)
    film.passes, film.samples = passes, passes * per_pass
    chunk = max(1, _MAX_LANES // per_pass)
    chunks = -(-pixels // chunk)
    offsets = _band_offsets(pixels, grid.count, seed)
    report(0.0)
    for number in range(passes):
        for piece in range(chunks):
            first, last = piece * chunk, min(pixels, (piece + 1) * chunk)
            lanes = _Lanes(first, last, per_pass, number * per_pass, seed32(seed, "render", number, piece))
            _accumulate(mi, translated, integrator, sampler, camera, grid, lanes, offsets, film)
            report((number * chunks + piece + 1) / (passes * chunks))
    for rows in _slices(pixels, 1 << 16):
        counts = _band_counts(offsets[rows], grid.count, 0, film.samples)
        film.totals[rows] *= _normalisation(counts, grid.count, film.samples)
    return film


@dataclass(frozen=True, slots=True)
class _Lanes:
    """Pixels [first, last), each with `per_pass` samples numbered from `first_sample`, and the launch's seed."""

    first: int
    last: int
    per_pass: int
    first_sample: int
    seed: int


def _accumulate(
    mi: Any,
    translated: TranslatedScene,
    integrator: Any,
    sampler: Any,
    camera: Camera,
    grid: WavelengthGrid,
    lanes: _Lanes,
    offsets: NDArray[np.uint32],
    film: _Film,
) -> None:
    """Trace one launch and add its samples to the film.

    The samples of a pixel stand side by side and are summed in that order in double precision, so that no sum depends on
    thread order.
    """
    pixel_count = lanes.last - lanes.first
    values, bands = _trace(mi, translated, integrator, sampler, camera, grid, lanes, offsets)
    good = np.isfinite(values) & (values >= 0)
    bad = int(values.size - np.count_nonzero(good))
    if bad:
        film.bad_samples += bad
        values = np.where(good, values, 0.0)
    pixel = np.repeat(np.arange(pixel_count, dtype=np.int64) * grid.count, lanes.per_pass)
    sums = np.zeros(pixel_count * grid.count)
    for hero in range(_HERO_WAVELENGTHS):
        sums += np.bincount(pixel + bands[hero], weights=values[hero], minlength=sums.size)
    cube = sums.reshape(pixel_count, grid.count)
    film.totals[lanes.first : lanes.last] += cube
    part_offsets = offsets[lanes.first : lanes.last]
    counts = _band_counts(part_offsets, grid.count, lanes.first_sample, lanes.per_pass)
    film.add_pass_means(lanes.first, np.sum(cube * _normalisation(counts, grid.count, lanes.per_pass), axis=1))


def _trace(
    mi: Any,
    translated: TranslatedScene,
    integrator: Any,
    sampler: Any,
    camera: Camera,
    grid: WavelengthGrid,
    lanes: _Lanes,
    offsets: NDArray[np.uint32],
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return ((4, lanes) photon radiance samples, (4, lanes) their bands)."""
    import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

    pixel_count = lanes.last - lanes.first
    sampler.set_samples_per_wavefront(lanes.per_pass)
    sampler.seed(lanes.seed, pixel_count * lanes.per_pass)
    lane = dr.arange(mi.UInt32, pixel_count * lanes.per_pass)
    per_pass = dr.opaque(mi.UInt32, lanes.per_pass)
    local = lane // per_pass
    sample = lane - local * per_pass + dr.opaque(mi.UInt32, lanes.first_sample)
    pixel = local + dr.opaque(mi.UInt32, lanes.first)
    cols = dr.opaque(mi.UInt32, camera.film.cols)
    row = pixel // cols
    jitter = sampler.next_2d()
    x_px, y_px = mi.Float(pixel - row * cols) + jitter.x, mi.Float(row) + jitter.y
    origin, direction = lens_rays(mi, dr, camera, x_px, y_px, sampler.next_2d())
    within_band = sampler.next_1d()
    band_count = dr.opaque(mi.UInt32, grid.count)
    offset = dr.gather(mi.UInt32, mi.UInt32(offsets), pixel)
    first_nm, step_nm = dr.opaque(mi.Float, grid.first_nm - grid.step_nm / 2), dr.opaque(mi.Float, grid.step_nm)
    bands, wavelengths = [], []
    for shift in _hero_shifts(grid.count):
        position = sample + offset + dr.opaque(mi.UInt32, shift)
        band = position - (position // band_count) * band_count
        bands.append(band)
        wavelengths.append(first_nm + step_nm * (mi.Float(band) + within_band))
    ray = mi.RayDifferential3f(o=origin, d=direction, time=0.0, wavelengths=mi.Spectrum(*wavelengths))
    radiance, _, _ = integrator.sample(translated.scene, sampler, ray)
    photons = radiance * ray.wavelengths * _PHOTONS_PER_J_NM
    dr.eval(photons, *bands)
    lane_count = pixel_count * lanes.per_pass
    values = np.stack([np.broadcast_to(np.asarray(photons[h].numpy()), lane_count) for h in range(_HERO_WAVELENGTHS)])
    return values, np.stack([np.asarray(band.numpy(), dtype=np.int64) for band in bands])


# Every camera ray carries four wavelengths. Which bands they fall into is decided by counting, not by chance: sample s of a
# pixel visits the bands s + offset + (0, B/4, B/2, 3B/4) modulo B. So each band of a pixel gets the same number of samples to
# within a few, known beforehand, and the mean over a band's samples is unbiased without the noise of a random count.


def _hero_shifts(bands: int) -> list[int]:
    return [hero * bands // _HERO_WAVELENGTHS for hero in range(_HERO_WAVELENGTHS)]


def _band_offsets(pixels: int, bands: int, seed: int) -> NDArray[np.uint32]:
    """Return (pixels,) starting bands, so that neighbouring pixels do not favour the same ones."""
    generator = np.random.Generator(np.random.Philox(key=seed32(seed, "bands")))
    return generator.integers(0, bands, size=pixels, dtype=np.uint32)


def _band_counts(offsets: NDArray[np.uint32], bands: int, first_sample: int, samples: int) -> NDArray[np.int64]:
    """Return (pixels, bands) numbers of samples that fell into each band of samples [first, first + count)."""
    counts = np.zeros((len(offsets), bands), dtype=np.int64)
    whole, rest = divmod(samples, bands)
    band = np.arange(bands, dtype=np.int64)
    for shift in _hero_shifts(bands):
        start = (offsets.astype(np.int64) + shift + first_sample) % bands
        counts += whole + ((band[None, :] - start[:, None]) % bands < rest)
    return counts


def _normalisation(counts: NDArray[np.int64], bands: int, samples: int) -> NDArray[np.float64]:
    """Return (pixels, bands) factors from sums to band means.

    Where every band of a pixel has a sample, 1/count. Otherwise the expected count: right on average over pixels, since the
    offsets are uniform, at the price of empty bands.
    """
    expected = samples * _HERO_WAVELENGTHS / bands
    if counts.min() > 0:
        return 1.0 / counts
    return np.full(counts.shape, 1.0 / expected)


def _slices(total: int, size: int) -> Iterator[slice]:
    for first in range(0, total, size):
        yield slice(first, min(total, first + size))


# Scalar fallback -----------------------------------------------------------------------------------------------------


def _render_scalar(
    mi: Any,
    translated: TranslatedScene,
    camera: Camera,
    grid: WavelengthGrid,
    samples_per_pixel: int,
    max_depth: int,
    seed: int,
    report: _Reporter,
) -> _Film:
    """Render with the renderer's own film, for machines without a usable LLVM (about a third of the speed)."""
    passes, per_pass = _plan_passes(samples_per_pixel)
    film = _Film(camera.film.rows * camera.film.cols, grid.count)
    film.passes = passes
    integrator = mi.load_dict({"type": "path", "max_depth": max_depth})
    sensor = mi.load_dict(_scalar_sensor(mi, camera, grid, per_pass))
    film.samples = passes * int(sensor.sampler().sample_count())
    report(0.0)
    for number in range(passes):
        image = np.array(
            mi.render(translated.scene, sensor=sensor, integrator=integrator, seed=seed32(seed, "render", number)),
            dtype=np.float64,
        ).reshape(-1, grid.count)
        good = np.isfinite(image) & (image >= 0)
        film.bad_samples += int(image.size - np.count_nonzero(good))
        image = np.where(good, image, 0.0)
        film.totals += image / passes
        film.add_pass_means(0, image.sum(axis=1))
        report((number + 1) / passes)
    return film


def _scalar_sensor(mi: Any, camera: Camera, grid: WavelengthGrid, samples: int) -> dict[str, Any]:
    """Return the camera as the renderer's own; each band's response is lambda/(h c) over its width: photons, not energy."""
    film: dict[str, Any] = {
        "type": "specfilm",
        "width": camera.film.cols,
        "height": camera.film.rows,
        "rfilter": {"type": "box"},
    }
    edges = grid.edges_nm
    for band in range(grid.count):
        low, high = float(edges[band]), float(edges[band + 1])
        factors = [low * _PHOTONS_PER_J_NM / grid.step_nm, high * _PHOTONS_PER_J_NM / grid.step_nm]
        film[f"band{band:04d}"] = {
            "type": "regular",
            "wavelength_min": low,
            "wavelength_max": high,
            "values": ", ".join(repr(f) for f in factors),
        }
    pose = camera.camera_to_world.copy()
    pose[:3, 3] = 0.0
    pose[:3, :2] *= -1.0  # the renderer's camera looks along +z with x to the left and y up
    aspect_width = camera.film.cols * camera.tangent_pitch
    sensor: dict[str, Any] = {
        "type": "perspective" if camera.lens.kind == "pinhole" else "thinlens",
        "fov": float(np.degrees(2 * np.arctan(aspect_width / 2))),
        "fov_axis": "x",
        "near_clip": 1e-4,
        "far_clip": 1e6,
        "to_world": mi.ScalarTransform4f(pose),
        "film": film,
        "sampler": {"type": "multijitter", "sample_count": samples},
    }
    if camera.lens.kind == "thin_lens":
        sensor["aperture_radius"] = 0.5 * camera.lens.pupil_diameter_m
        sensor["focus_distance"] = float(min(camera.lens.focus_distance_m, 1e6))
    return sensor
