"""An image that gets better with every pass: launches of the path loop over lists of pixels, and what they found so far."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.errors import CancelledError, RenderError
from fullwell.core.rng import seed32
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render.rays import CameraRays
from fullwell.render.transport.collect import collect_surfaces
from fullwell.render.transport.fog import FogLayer
from fullwell.render.transport.geometry import Geometry
from fullwell.render.transport.lights import LightSet
from fullwell.render.transport.loading import forget_geometry, load_geometry
from fullwell.render.transport.loop import SLOTS, Launch, PathLoop, PathSums
from fullwell.render.transport.materials import MaterialTable
from fullwell.render.transport.moments import Moments, Turns
from fullwell.render.transport.replay import device_arrays, replayed
from fullwell.render.transport.split import SplitGeometry
from fullwell.render.transport.surfaces import SceneSurfaces
from fullwell.render.transport.upload import upload
from fullwell.render.transport.wavelengths import CELL_COUNT, CELL_NM, SpectraTable, cell_centres_nm, cell_means
from fullwell.scene import Camera, SceneDescription
from fullwell.scene.groups import group_names

__all__ = ["REPLICAS", "ProgressiveImage", "Reporter", "Stage", "Work", "check_samples"]

REPLICAS = 4
"""Independent sequences per pixel. The spread of their means is the error of the image: each is stratified over all its
samples, which makes the spread of samples within one no measure of anything."""

_PHOTONS_PER_J_NM = 1.0 / (PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M)
_LANES = 1 << 20
_FILM_FLOATS = 1 << 23
_SAMPLES_PER_LAUNCH = 1 << 22
"""Bounds memory and the time between two looks at whether to go on. The result does not depend on either."""

_PIXELS_AT_A_TIME = 1 << 16
"""Of an image that moves: bounds the memory of the lists of what is to be traced when."""

_UNIFORM_SHARE = 0.2
"""Share of the wavelengths that is spread evenly, so that no colour is left to a few samples of great weight."""

_MAX_BAD_FRACTION = 1e-3


class Reporter:
    """Progress out, cancellation in."""

    def __init__(
        self, progress: Callable[[float], None] | None = None, should_cancel: Callable[[], bool] | None = None
    ) -> None:
        self._progress = progress
        self._should_cancel = should_cancel

    def __call__(self, fraction: float) -> None:
        """Tell how far the work is; raise CancelledError where it is no longer wanted."""
        if self._should_cancel is not None and self._should_cancel():
            raise CancelledError("rendering was cancelled between two passes; nothing was written")
        if self._progress is not None:
            self._progress(min(1.0, fraction))


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """What is rendered.

    Attributes
    ----------
    responses
        Electrons per photon of each channel: filters, quantum efficiency and the lens's transmittance. May be empty.
    grid
        The bands; also the range outside which no light counts.
    keep_bands
        Whether the spectral bands are kept beside the channels.
    keep_groups
        Whether each light group has an image of its own.
    max_depth
        Segments of the longest path: 1 shows lamps only, 2 adds direct light.
    wavelengths
        Number that a path carries.
    group_importance
        Factor by which the lamps of a group are sampled more often, by the group's name; 1 for those left out.
    moments
        What `scene` and `camera` are while the film is exposed, where they move; None: they stand still.
    """

    scene: SceneDescription
    camera: Camera
    grid: WavelengthGrid
    responses: tuple[Spectrum, ...]
    keep_bands: bool
    keep_groups: bool
    max_depth: int
    seed: int
    wavelengths: int = 8
    group_importance: tuple[tuple[str, float], ...] = ()
    moments: Moments | None = None


class Stage:
    """What the pictures of one scene have in common: what stands still in all of them, and the materials.

    `moving` are the ids of objects that may be elsewhere in another picture.
    """

    def __init__(self, mi: Any, scene: SceneDescription, camera: Camera, moving: frozenset[str] = frozenset()) -> None:
        self._mi, self._moving = mi, moving
        self.centre_m = np.asarray(camera.camera_to_world[:3, 3])
        self._groups = group_names(scene)
        self._materials: tuple[MaterialTable, SpectraTable] | None = None
        self._still: Geometry | None = None
        if moving:
            forget_geometry()
            self._still = self._loaded(scene, moving=False)

    def _loaded(self, scene: SceneDescription, *, moving: bool) -> Geometry:
        objects = tuple(item for item in scene.objects if (item.id in self._moving) == moving)
        return Geometry(self._mi, collect_surfaces(replace(scene, objects=objects), self.centre_m, self._groups))

    def geometry(self, scene: SceneDescription) -> Geometry | SplitGeometry:
        """Return a scene on the device, which has the same objects as the first, all about the same point."""
        if self._still is None:
            return load_geometry(self._mi, scene, self.centre_m)
        return SplitGeometry(self._mi, self._still, self._loaded(scene, moving=True))

    def materials(self, surfaces: SceneSurfaces) -> tuple[MaterialTable, SpectraTable]:
        """Return the materials on the device, and a table of their spectra to add others to."""
        if self._materials is None:
            spectra = SpectraTable()
            self._materials = (MaterialTable(self._mi, spectra, surfaces.materials), spectra)
        table, spectra = self._materials
        return table, spectra.copy()


class _Tracer:
    """One scene on the device: what the path loop needs of it."""

    def __init__(self, mi: Any, work: Work, scene: SceneDescription, stage: Stage, weights: NDArray[np.float64]) -> None:
        geometry = stage.geometry(scene)
        surfaces = geometry.surfaces
        self._materials, spectra = stage.materials(surfaces)
        importance = dict(work.group_importance)
        of_materials = spectra.count
        self._lights = LightSet(
            mi,
            spectra,
            surfaces,
            scene.lights,
            centre_m=stage.centre_m,
            weights=weights,
            group_weights=np.array([importance.get(name, 1.0) for name in surfaces.groups]),
            scene_radius_m=geometry.reach_m(),
        )
        self.groups, self.scene = surfaces.groups, geometry.scene
        self.light_shape = _mean_shape(spectra, range(of_materials, spectra.count), weights)
        self.loop = PathLoop(
            mi,
            geometry,
            self._materials,
            self._lights,
            None if scene.fog is None else FogLayer(mi, scene.fog, float(stage.centre_m[2])),
            wavelengths=work.wavelengths,
            channels=len(work.responses),
            groups=len(surfaces.groups) if work.keep_groups else 1,
            bands=work.keep_bands,
        )
        self.tables = geometry.tables | {"spectra": spectra.finish(mi)}


class _Moment:
    """A scene as a camera sees it at one time."""

    def __init__(self, tracer: _Tracer, camera: CameraRays, shared: dict[str, Any], number: int) -> None:
        self.loop, self.camera, self.number = tracer.loop, camera, number
        self.scene = tracer.scene
        self._tables_of_scene = tracer.tables
        self.share(shared)

    def share(self, shared: dict[str, Any]) -> None:
        """Take over the tables that all moments have in common."""
        self.tables = self._tables_of_scene | shared
        self.inputs = device_arrays(self.loop, self.camera, self.tables)


@dataclass(frozen=True, slots=True, eq=False)
class _Lanes:
    """Lanes of work, (n,) each: a replica of a pixel, its turns [first, first + counts), and which samples these are."""

    pixels: NDArray[np.int64]
    replicas: NDArray[np.int64]
    first: NDArray[np.int64]
    counts: NDArray[np.int64]
    residues: NDArray[np.int64]
    whole: bool = False
    """Whether all replicas of each pixel stand side by side, and each pixel once."""

    def where(self, part: slice | NDArray[np.bool_]) -> _Lanes:
        """Return some of the lanes; a slice of whole pixels stays whole."""
        whole = self.whole and isinstance(part, slice)
        return _Lanes(self.pixels[part], self.replicas[part], self.first[part], self.counts[part], self.residues[part], whole)


def _still_lanes(pixels: NDArray[np.int64], first: NDArray[np.int64], counts: NDArray[np.int64]) -> _Lanes:
    """Return the lanes that take samples [first, first + counts) of each pixel."""
    replicas = np.tile(np.arange(REPLICAS), len(pixels))
    pixels, first, counts = (np.repeat(values, REPLICAS) for values in (pixels, first, counts))
    return _Lanes(pixels, replicas, first, counts, np.zeros(len(pixels), dtype=np.int64), whole=True)


def _lanes_by_moment(
    turns: Turns, count: int, pixels: NDArray[np.int64], first: NDArray[np.int64], counts: NDArray[np.int64]
) -> list[_Lanes]:
    """Return the lanes that take samples [first, first + counts) of each pixel in each of `count` moments."""
    replicas = np.tile(np.arange(REPLICAS, dtype=np.int32), len(pixels))
    of_lanes = np.repeat(pixels.astype(np.int32), REPLICAS)
    moments, columns = [], []
    for step in range(turns.steps):
        begin, more = turns.span(first, counts, step)
        busy = np.repeat(more > 0, REPLICAS)
        moments.append(turns.moment(pixels, step).astype(np.uint16).ravel()[busy])
        spans = [np.repeat(values.astype(np.int32), REPLICAS)[busy] for values in (begin, more)]
        columns.append(np.stack([of_lanes[busy], replicas[busy], *spans, np.full(len(spans[0]), step, dtype=np.int32)]))
    moment = np.concatenate(moments)
    # Step by step within a moment: equal counts stay side by side.
    order = np.argsort(moment, kind="stable")
    ends = np.concatenate([[0], np.cumsum(np.bincount(moment, minlength=count))])
    table = np.concatenate(columns, axis=1)
    return [_Lanes(*table[:, order[begin:end]].astype(np.int64)) for begin, end in itertools.pairwise(ends)]


class ProgressiveImage:
    """Sums of samples so far. `add` takes more of them, anywhere; everything else looks at what is there."""

    def __init__(self, mi: Any, work: Work, stage: Stage | None = None) -> None:
        """Load the scene, or the scenes of all moments; what several pictures share is in their `stage`."""
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._work = mi, work
        self._weights = self._spectral_weights()
        self._moments = self._moments_of(mi, stage or Stage(mi, work.scene, work.camera))
        self.groups: tuple[str, ...] = self._group_names if work.keep_groups else ("all",)
        self.rows, self.cols = work.camera.film.rows, work.camera.film.cols
        pixels, bands = self.rows * self.cols, work.grid.count
        self._seeds = _lane_seeds(work.seed, pixels)
        self._offsets = _band_offsets(work.seed, pixels, bands)
        self.counts = np.zeros(pixels, dtype=np.int64)
        """Samples of each replica of each pixel."""
        self._sums = np.zeros((REPLICAS, len(self.groups), len(work.responses), pixels))
        self._band_sums = np.zeros((pixels, len(self.groups), bands), dtype=np.float64) if work.keep_bands else None
        self.bad_samples = 0
        self.segments = 0
        self.cpu_s = 0.0
        self._clamped = 0.0
        self._turns: Turns | None = None
        if work.moments is not None and work.moments.count > 1:
            kept = bands if work.keep_bands else 1
            self._turns = Turns(work.moments, cols=self.cols, replicas=REPLICAS, seed=work.seed, bands=kept)
            self._shared["stride"] = dr.opaque(mi.UInt32, self._turns.steps)
            self._share_tables()

    def _moments_of(self, mi: Any, stage: Stage) -> list[_Moment]:
        """Load what the samples look at; a scene that several moments share is loaded once."""
        work = self._work
        scenes = (work.scene,) if work.moments is None else work.moments.scenes
        cameras = (work.camera,) if work.moments is None else work.moments.cameras
        tracers: dict[int, _Tracer] = {}
        for scene in scenes:
            if id(scene) not in tracers:
                tracers[id(scene)] = _Tracer(mi, work, scene, stage, self._weights)
        numbers = {key: number for number, key in enumerate(tracers)}
        first = tracers[id(scenes[0])]
        self._group_names = first.groups
        # The same for all moments, so that a sample has the same wavelengths in each.
        self._shared = self._device_tables(first.light_shape)
        return [
            _Moment(tracers[id(scene)], CameraRays(mi, camera, stage.centre_m), self._shared, numbers[id(scene)])
            for scene, camera in zip(scenes, cameras, strict=True)
        ]

    def _share_tables(self) -> None:
        for moment in self._moments:
            moment.share(self._shared)

    # What is there ---------------------------------------------------------------------------------------------------

    @property
    def pixels(self) -> int:
        """Number of film samples."""
        return self.rows * self.cols

    @property
    def samples(self) -> int:
        """Number of paths traced so far."""
        return REPLICAS * int(self.counts.sum())

    def replicas(self) -> NDArray[np.float32]:
        """Return the replicas' means, (replicas, groups, channels, rows, cols) [e- s^-1 m^-2 sr^-1]."""
        means = self._sums / np.maximum(self.counts, 1)
        return means.reshape(*means.shape[:3], self.rows, self.cols).astype(np.float32)

    def bands(self) -> NDArray[np.float32] | None:
        """Return the band means, (groups, rows, cols, bands) [photons s^-1 m^-2 sr^-1 nm^-1]; None where not kept."""
        if self._band_sums is None:
            return None
        cube = np.empty((len(self.groups), self.rows, self.cols, self._work.grid.count), dtype=np.float32)
        flat = cube.reshape(len(self.groups), self.pixels, -1)
        for first in range(0, self.pixels, 1 << 15):
            part = slice(first, min(self.pixels, first + (1 << 15)))
            factor = self._band_factors(part)
            for group in range(len(self.groups)):
                flat[group, part] = self._band_sums[part, group] * factor
        return cube

    def check(self) -> None:
        """Raise RenderError where too many samples were no numbers, or where the light exceeds single precision."""
        sums = (self._sums,) if self._band_sums is None else (self._sums, self._band_sums)
        check_samples(self.bad_samples, self.samples, sums, int(self.counts.max()))

    @property
    def clamped_fraction(self) -> float:
        """Share of the channels' light that the clamp took away."""
        return self._clamped / max(self._clamped + float(self._sums.sum()), 1e-300)

    def restart(self, clamp: NDArray[np.float64]) -> None:
        """Forget all samples; from now on clamp each to `clamp`, (channels,) of light."""
        self.counts[:] = 0
        self._sums[:] = 0.0
        if self._band_sums is not None:
            self._band_sums[:] = 0.0
        self.bad_samples, self.segments, self._clamped = 0, 0, 0.0
        self._shared["inverse_clamp"] = self._inverse_clamp(clamp)
        self._share_tables()

    def _inverse_clamp(self, clamp: NDArray[np.float64]) -> list[Any]:
        import drjit as dr  # noqa: PLC0415

        return [dr.opaque(self._mi.Float, float(1.0 / limit)) for limit in clamp]

    # More of it ------------------------------------------------------------------------------------------------------

    def add(self, pixels: NDArray[np.int64], counts: NDArray[np.int64], report: Callable[[float], None]) -> None:
        """Take `counts` more samples in each replica of each of the `pixels`; `report` gets the finished fraction."""
        keep = counts > 0
        pixels, counts = pixels[keep], counts[keep]
        # Equal counts side by side: lanes of a vector that have nothing left to do wait for the others.
        order = np.argsort(counts, kind="stable")
        pixels, counts = pixels[order], counts[order]
        total, done = REPLICAS * int(counts.sum()), 0
        some = len(pixels) if self._turns is None else _PIXELS_AT_A_TIME
        for begin in range(0, len(pixels), max(1, some)):
            part = slice(begin, begin + some)
            for moment, lanes in self._work_of(pixels[part], counts[part]):
                self._add_lanes(moment, lanes, lambda more, base=done: report((base + more) / total))  # type: ignore[misc]
                done += int(lanes.counts.sum())
        self.counts[pixels] += counts

    def _work_of(self, pixels: NDArray[np.int64], counts: NDArray[np.int64]) -> list[tuple[_Moment, _Lanes]]:
        """Return which lanes take the samples, and in which moment."""
        if self._turns is None:
            return [(self._moments[0], _still_lanes(pixels, self.counts[pixels], counts))]
        by_moment = _lanes_by_moment(self._turns, len(self._moments), pixels, self.counts[pixels], counts)
        return list(zip(self._moments, by_moment, strict=True))

    def _add_lanes(self, moment: _Moment, lanes: _Lanes, report: Callable[[int], None]) -> None:
        """Trace lanes of work, some at a time."""
        cpu_started = time.process_time()
        done, first = 0, 0
        floats = len(self.groups) * self._work.grid.count if self._work.keep_bands else 1
        room = min(_LANES, _FILM_FLOATS // floats)
        while first < len(lanes.pixels):
            count = int(lanes.counts[first])
            most = max(1, min(room // REPLICAS, _SAMPLES_PER_LAUNCH // (REPLICAS * count)))
            part = slice(first, min(len(lanes.pixels), first + most * REPLICAS))
            self._launch(moment, lanes.where(part))
            done += int(lanes.counts[part].sum())
            first = part.stop
            self.cpu_s += time.process_time() - cpu_started
            cpu_started = time.process_time()
            report(done)

    def _launch(self, moment: _Moment, lanes: _Lanes) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        # Numbers of lanes are rounded up to a power of two with lanes that have nothing to do: a recording fits one number.
        # Over time to a power of four, since each moment has recordings of its own.
        busy = len(lanes.pixels)
        bits = (busy - 1).bit_length()
        width = max(REPLICAS, 1 << (bits if lanes.whole else bits + bits % 2))

        def by_lane(values: NDArray[Any]) -> Any:
            padded = np.zeros(width, dtype=np.uint32)
            padded[:busy] = values
            return upload(self._mi.UInt32, padded)

        launch = Launch(
            pixel=by_lane(lanes.pixels),
            seed=by_lane(self._seeds[lanes.pixels, lanes.replicas]),
            first=by_lane(lanes.first),
            count=by_lane(lanes.counts),
            offset=by_lane(self._offsets[lanes.pixels, lanes.replicas]),
            residue=by_lane(lanes.residues),
        )
        sums = self._traced(moment, launch)
        dr.eval(sums.channels, sums.bands, sums.bad, sums.segments, sums.clamped)
        for group, channels in enumerate(sums.channels):
            for channel, values in enumerate(channels):
                found = np.asarray(values.numpy(), dtype=np.float64)[:busy]
                self._keep(found, group, channel, lanes)
        if self._band_sums is not None and sums.bands is not None:
            by_band = np.asarray(sums.bands.numpy()).reshape(width, len(self.groups), -1)[:busy]
            order = np.argsort(lanes.pixels, kind="stable")
            found_pixels, starts = np.unique(lanes.pixels[order], return_index=True)
            self._band_sums[found_pixels] += np.add.reduceat(by_band[order], starts, axis=0, dtype=np.float64)
        self.bad_samples += int(np.sum(sums.bad.numpy()))
        self._clamped += float(np.sum(sums.clamped.numpy(), dtype=np.float64))
        self.segments += int(np.sum(sums.segments.numpy(), dtype=np.int64))

    def _keep(self, found: NDArray[np.float64], group: int, channel: int, lanes: _Lanes) -> None:
        """Add what lanes found of a channel to the sums."""
        if lanes.whole:
            self._sums[:, group, channel, lanes.pixels[::REPLICAS]] += found.reshape(-1, REPLICAS).T
            return
        # One after the other: a replica of a pixel may be there more than once, with other turns.
        place = (lanes.replicas * len(self.groups) + group) * self._sums.shape[2] + channel
        np.add.at(self._sums.reshape(-1), place * self.pixels + lanes.pixels, found)

    def _traced(self, moment: _Moment, launch: Launch) -> PathSums:
        """Return the sums of a launch, replayed where one of its kind was recorded before."""

        def function(scene: Any, *lanes: Any) -> Any:
            sums = moment.loop.trace(scene, moment.camera, moment.tables, Launch(*lanes))
            return sums.channels, sums.bands, sums.bad, sums.segments, sums.clamped

        # The number of lanes is part of the kind: replayed with another one, the film of the bands would keep its old size.
        # So is that of the scene among those that are loaded together: its shapes' numbers are in the recording, though not in
        # the compiled code.
        kind = (moment.loop.kind, moment.camera.kind, self._work.grid.count, len(launch.pixel), moment.number)
        lanes = (launch.pixel, launch.seed, launch.first, launch.count, launch.offset, launch.residue)
        return PathSums(*replayed(kind, function, moment.scene, moment.inputs, *lanes))

    # Tables ----------------------------------------------------------------------------------------------------------

    def _spectral_weights(self) -> NDArray[np.float64]:
        """Return (cells,) how much light of a wavelength counts: the summed channel responses within the bands' range."""
        centres = cell_centres_nm()
        edges = self._work.grid.edges_nm
        inside = (centres > edges[0]) & (centres < edges[-1])
        if not self._work.responses or self._work.keep_bands:
            return np.where(inside, centres, 0.0)
        responses = np.stack([cell_means(response) for response in self._work.responses]).astype(np.float64)
        # Each channel counts by its own noise: a weak one as much as a strong one.
        peaks = responses.max(axis=1, keepdims=True)
        shares = np.divide(responses, peaks, out=np.zeros_like(responses), where=peaks > 0)
        return np.where(inside, shares.sum(axis=0) * centres, 0.0)

    def _device_tables(self, light_shape: NDArray[np.float64]) -> dict[str, Any]:
        import drjit as dr  # noqa: PLC0415

        mi, work = self._mi, self._work
        slots, density = self._slots(light_shape)
        width_nm = work.grid.step_nm * work.grid.count
        centres = cell_centres_nm()
        edges = work.grid.edges_nm
        inside = (centres > edges[0]) & (centres < edges[-1])
        responses = np.zeros((max(1, len(work.responses)), CELL_COUNT))
        # The integral over wavelength is the mean of value / density over the path's wavelengths.
        sparse_nm = np.divide(CELL_NM, density, out=np.zeros(CELL_COUNT), where=density > 0)
        spread_nm = np.full(CELL_COUNT, width_nm) if work.keep_bands else sparse_nm
        for number, response in enumerate(work.responses):
            per_energy = cell_means(response) * centres * _PHOTONS_PER_J_NM * inside
            responses[number] = per_energy * spread_nm / work.wavelengths
        return {
            "responses": upload(mi.Float, responses.astype(np.float32)),
            "slots": upload(mi.UInt32, slots),
            "columns": dr.opaque(mi.UInt32, work.camera.film.cols),
            "stride": dr.opaque(mi.UInt32, 1),
            "max_depth": dr.opaque(mi.UInt32, work.max_depth),
            "band_count": dr.opaque(mi.UInt32, work.grid.count),
            "band_count_host": work.grid.count,
            "band_first_nm": dr.opaque(mi.Float, float(edges[0])),
            "band_step_nm": dr.opaque(mi.Float, float(work.grid.step_nm)),
            "band_shifts": [dr.opaque(mi.UInt32, shift) for shift in self._band_shifts()],
            "inverse_clamp": self._inverse_clamp(np.full(len(work.responses), np.inf)),
            "photons_per_j_nm": dr.opaque(mi.Float, _PHOTONS_PER_J_NM),
        }

    def _slots(self, light_shape: NDArray[np.float64]) -> tuple[NDArray[np.uint32], NDArray[np.float64]]:
        """Return (SLOTS,) cells that equal shares of the wavelengths fall into, and (cells,) probabilities.

        Wavelengths are drawn where the lamps shine and the channels see, plus an even share over all that may count.
        """
        wanted = self._weights * light_shape
        possible = self._weights > 0
        if not possible.any():
            possible = np.ones(CELL_COUNT, dtype=bool)
        total = wanted.sum()
        shares = possible / possible.sum()
        if total > 0:
            shares = _UNIFORM_SHARE * shares + (1 - _UNIFORM_SHARE) * wanted / total
        counts = _whole_shares(shares, SLOTS)
        return np.repeat(np.arange(CELL_COUNT, dtype=np.uint32), counts), counts / SLOTS

    def _band_shifts(self) -> list[int]:
        count, wavelengths = self._work.grid.count, self._work.wavelengths
        return [k * count // wavelengths for k in range(wavelengths)]

    def _band_factors(self, part: slice) -> NDArray[np.float64]:
        """Return (pixels, bands) factors from sums to band means.

        Where every band of a pixel has a sample, 1/count. Otherwise the expected count: right on average over pixels, since
        the offsets are uniform, at the price of empty bands.
        """
        bands = self._work.grid.count
        samples = self.counts[part]
        band = np.arange(bands, dtype=np.int64)
        counts = np.zeros((len(samples), bands), dtype=np.int64)
        for replica in range(REPLICAS):
            for shift in self._band_shifts():
                start = (self._offsets[part, replica].astype(np.int64) + shift) % bands
                counts += (samples // bands)[:, None] + ((band - start[:, None]) % bands < (samples % bands)[:, None])
        expected = np.maximum(REPLICAS * samples * self._work.wavelengths, 1) / bands
        complete = counts.min(axis=1) > 0
        return np.where(complete[:, None], 1.0 / np.maximum(counts, 1), 1.0 / expected[:, None])


def check_samples(bad: int, samples: int, sums: tuple[NDArray[np.float64], ...], most: int) -> None:
    """Raise RenderError where too many samples were no numbers, or where sums of `most` samples exceed single precision."""
    if bad > _MAX_BAD_FRACTION * max(1, samples):
        raise RenderError(
            f"{bad} of {samples} samples are NaN, infinite or negative; check the scene for extreme radiances, sizes or "
            "material parameters."
        )
    if not all(np.all(part <= float(np.finfo(np.float32).max) * max(1, most)) for part in sums):
        raise RenderError("the radiance exceeds what single precision holds; scale the lights down.")


def _mean_shape(spectra: SpectraTable, rows: range, weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (cells,) the mean of the lamps' spectra, each of the same weighted power; 1 where there is no light."""
    shape = np.zeros(CELL_COUNT)
    for number in rows:
        values = np.abs(spectra.row(number)).astype(np.float64)
        power = float(values @ weights)
        if power > 0:
            shape += values / power
    return shape if np.any(shape * weights > 0) else np.ones(CELL_COUNT)


def _whole_shares(shares: NDArray[np.float64], total: int) -> NDArray[np.int64]:
    """Return whole numbers in proportion to `shares` that sum to `total`, at least 1 where a share is positive."""
    counts = np.where(shares > 0, np.maximum(1, np.floor(shares * total)), 0).astype(np.int64)
    excess = int(counts.sum()) - total
    while excess > 0:  # the floor of 1 gave too many: the largest give some back
        largest = np.argsort(-counts, kind="stable")[:excess]
        largest = largest[counts[largest] > 1]
        counts[largest] -= 1
        excess -= len(largest)
    if excess < 0:
        order = np.argsort(-(shares * total - np.floor(shares * total)) * (shares > 0), kind="stable")
        order = order[shares[order] > 0]
        np.add.at(counts, order[np.arange(-excess) % len(order)], 1)
    return counts


def _lane_seeds(seed: int, pixels: int) -> NDArray[np.uint32]:
    generator = np.random.Generator(np.random.Philox(key=seed32(seed, "lanes")))
    return generator.integers(0, 1 << 32, size=(pixels, REPLICAS), dtype=np.uint32)


def _band_offsets(seed: int, pixels: int, bands: int) -> NDArray[np.uint32]:
    """Return (pixels, replicas) starting bands, so that neighbours do not favour the same ones."""
    generator = np.random.Generator(np.random.Philox(key=seed32(seed, "bands")))
    first = generator.integers(0, bands, size=pixels, dtype=np.uint32)
    return np.asarray((first[:, None] + np.arange(REPLICAS) * bands // REPLICAS) % bands, dtype=np.uint32)
