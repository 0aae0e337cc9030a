"""Spectral radiance in absolute units: camera rays in, band means out, the same bytes for any number of threads."""

from __future__ import annotations

import math
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
from fullwell.render.rays import CameraRays
from fullwell.render.translate import TranslatedScene, translate
from fullwell.render.variant import activate
from fullwell.scene import Camera, SceneDescription
from fullwell.scene.validate import check_camera

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
    FieldError
        The camera or a part of the scene cannot be rendered; the message names it.
    RenderError
        The renderer refused the scene or produced too many invalid samples.
    CancelledError
        `should_cancel` returned true.
    """
    started, cpu_started = time.perf_counter(), time.process_time()
    check_camera(camera)
    mi = activate()
    translated = translate(mi, scene, camera.camera_to_world[:3, 3])
    task = _Task(mi, translated, camera, grid, samples_per_pixel, max_depth, seed)
    report = _Reporter(progress, should_cancel)
    try:
        film = _render_wavefront(task, report) if mi.variant().startswith("llvm") else _render_scalar(task, report)
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


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """What one call renders."""

    mi: Any
    translated: TranslatedScene
    camera: Camera
    grid: WavelengthGrid
    samples_per_pixel: int
    max_depth: int
    seed: int

    @property
    def pixels(self) -> int:
        """Number of film samples."""
        return self.camera.film.rows * self.camera.film.cols


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
    per_pass = _stratified(min(_MAX_PASS_SAMPLES, -(-samples_per_pixel // wanted_passes)))
    return -(-samples_per_pixel // per_pass), per_pass


@dataclass(frozen=True, slots=True)
class _Launch:
    """Pixels [first, last), each with `per_pass` samples numbered from `first_sample`, and the launch's seed."""

    first: int
    last: int
    per_pass: int
    first_sample: int
    seed: int

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.last - self.first

    @property
    def lanes(self) -> int:
        """Number of camera rays."""
        return self.pixels * self.per_pass


def _stratified(samples: int) -> int:
    """Return the next number of samples that fills a near-square grid of strata, as the sampler wants it."""
    columns = round(math.sqrt(samples))
    return columns * -(-samples // columns)


def _render_wavefront(task: _Task, report: _Reporter) -> _Film:
    tracer = _Tracer(task)
    passes, per_pass = tracer.passes, tracer.per_pass
    film = _Film(task.pixels, task.grid.count)
    film.passes, film.samples = passes, passes * per_pass
    chunk = max(1, _MAX_LANES // per_pass)
    chunks = -(-task.pixels // chunk)
    report(0.0)
    for number in range(passes):
        for piece in range(chunks):
            first, last = piece * chunk, min(task.pixels, (piece + 1) * chunk)
            launch = _Launch(first, last, per_pass, number * per_pass, seed32(task.seed, "render", number, piece))
            _accumulate(tracer, launch, film)
            report((number * chunks + piece + 1) / (passes * chunks))
    for rows in _slices(task.pixels, 1 << 16):
        counts = _band_counts(tracer.offsets[rows], task.grid.count, 0, film.samples)
        film.totals[rows] *= _normalisation(counts, film.samples)
    return film


def _accumulate(tracer: _Tracer, launch: _Launch, film: _Film) -> None:
    """Trace one launch and add its samples to the film.

    The samples of a pixel stand side by side and are summed in that order in double precision, so that no sum depends on
    thread order.
    """
    values, bands = tracer.trace(launch)
    good = np.isfinite(values) & (values >= 0)
    bad = int(values.size - np.count_nonzero(good))
    if bad:
        film.bad_samples += bad
        values = np.where(good, values, np.float32(0.0))
    band_count = film.totals.shape[1]
    pixel = np.repeat(np.arange(launch.pixels, dtype=np.int64) * band_count, launch.per_pass)
    sums = np.zeros(launch.pixels * band_count)
    for value, band in zip(values, bands, strict=True):
        sums += np.bincount(pixel + band, weights=value, minlength=sums.size)
    cube = sums.reshape(launch.pixels, band_count)
    film.totals[launch.first : launch.last] += cube
    counts = _band_counts(tracer.offsets[launch.first : launch.last], band_count, launch.first_sample, launch.per_pass)
    film.add_pass_means(launch.first, np.sum(cube * _normalisation(counts, launch.per_pass), axis=1))


class _Tracer:
    """Mitsuba's path integrator, fed with this module's camera rays and wavelengths."""

    def __init__(self, task: _Task) -> None:
        mi = task.mi
        self._task = task
        self._integrator = mi.load_dict({"type": "path", "max_depth": task.max_depth})
        self._sampler = mi.load_dict({"type": "multijitter", "sample_count": 1})
        self.passes, wanted = _plan_passes(task.samples_per_pixel)
        self._sampler.set_sample_count(wanted)
        self.per_pass = int(self._sampler.sample_count())
        self.offsets = _band_offsets(task.pixels, task.grid.count, task.seed)
        self._offsets = mi.UInt32(self.offsets)
        self._rays = CameraRays(mi, task.camera)

    def trace(self, launch: _Launch) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return ((4, lanes) photon radiance samples, (4, lanes) their bands)."""
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        mi, sampler = self._task.mi, self._sampler
        sampler.set_samples_per_wavefront(launch.per_pass)
        sampler.seed(launch.seed, launch.lanes)
        pixel, sample = self._indices(launch)
        cols = dr.opaque(mi.UInt32, self._task.camera.film.cols)
        row = pixel // cols
        jitter = sampler.next_2d()
        x_px, y_px = mi.Float(pixel - row * cols) + jitter.x, mi.Float(row) + jitter.y
        origin, direction = self._rays.through_lens(x_px, y_px, sampler.next_2d())
        bands, wavelengths = self._wavelengths(pixel, sample, sampler.next_1d())
        ray = mi.RayDifferential3f(o=origin, d=direction, time=0.0, wavelengths=wavelengths)
        radiance, _, _ = self._integrator.sample(self._task.translated.scene, sampler, ray)
        photons = radiance * wavelengths * _PHOTONS_PER_J_NM
        dr.eval(photons, *bands)
        values = np.stack([np.broadcast_to(photons[hero].numpy(), launch.lanes) for hero in range(_HERO_WAVELENGTHS)])
        return values, np.stack([np.asarray(band.numpy(), dtype=np.int64) for band in bands])

    def _indices(self, launch: _Launch) -> tuple[Any, Any]:
        import drjit as dr  # noqa: PLC0415

        mi = self._task.mi
        lane = dr.arange(mi.UInt32, launch.lanes)
        per_pass = dr.opaque(mi.UInt32, launch.per_pass)
        local = lane // per_pass
        sample = lane - local * per_pass + dr.opaque(mi.UInt32, launch.first_sample)
        return local + dr.opaque(mi.UInt32, launch.first), sample

    def _wavelengths(self, pixel: Any, sample: Any, within_band: Any) -> tuple[list[Any], Any]:
        import drjit as dr  # noqa: PLC0415

        mi, grid = self._task.mi, self._task.grid
        band_count = dr.opaque(mi.UInt32, grid.count)
        offset = dr.gather(mi.UInt32, self._offsets, pixel)
        first_nm, step_nm = dr.opaque(mi.Float, grid.first_nm - grid.step_nm / 2), dr.opaque(mi.Float, grid.step_nm)
        bands = []
        for shift in _hero_shifts(grid.count):
            position = sample + offset + dr.opaque(mi.UInt32, shift)
            bands.append(position - (position // band_count) * band_count)
        return bands, mi.Spectrum(*(first_nm + step_nm * (mi.Float(band) + within_band) for band in bands))


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


def _normalisation(counts: NDArray[np.int64], samples: int) -> NDArray[np.float64]:
    """Return (pixels, bands) factors from sums to band means.

    Where every band of a pixel has a sample, 1/count. Otherwise the expected count: right on average over pixels, since the
    offsets are uniform, at the price of empty bands.
    """
    if counts.min() > 0:
        return 1.0 / counts
    return np.full(counts.shape, counts.shape[1] / (samples * _HERO_WAVELENGTHS))


def _slices(total: int, size: int) -> Iterator[slice]:
    for first in range(0, total, size):
        yield slice(first, min(total, first + size))


# Scalar fallback -----------------------------------------------------------------------------------------------------


def _render_scalar(task: _Task, report: _Reporter) -> _Film:
    """Render with the renderer's own film, for machines without a usable LLVM (about a third of the speed)."""
    passes, per_pass = _plan_passes(task.samples_per_pixel)
    film = _Film(task.pixels, task.grid.count)
    film.passes = passes
    integrator = task.mi.load_dict({"type": "path", "max_depth": task.max_depth})
    sensor = task.mi.load_dict(_scalar_sensor(task.mi, task.camera, task.grid, per_pass))
    film.samples = passes * int(sensor.sampler().sample_count())
    report(0.0)
    for number in range(passes):
        seed = seed32(task.seed, "render", number)
        rendered = task.mi.render(task.translated.scene, sensor=sensor, integrator=integrator, seed=seed)
        image = np.array(rendered, dtype=np.float64).reshape(-1, task.grid.count)
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
