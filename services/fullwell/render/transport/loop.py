"""The path loop: camera rays in, sums of channel responses and of spectral bands out, in one kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fullwell.render.rays import CameraRays
from fullwell.render.transport.fog import FogLayer
from fullwell.render.transport.geometry import Geometry, Tables
from fullwell.render.transport.lights import LightSample, LightSet
from fullwell.render.transport.materials import MaterialTable
from fullwell.render.transport.sampler import PathSampler
from fullwell.render.transport.split import SplitGeometry
from fullwell.render.transport.wavelengths import CELL_COUNT, CELL_NM, FIRST_EDGE_NM, look_up

__all__ = ["SLOTS", "Launch", "PathLoop", "PathSums"]

SLOTS = 4096
"""Equal shares of probability that wavelengths are drawn from; a cell has a whole number of them."""

_NO_LEAF = 0xFFFFFFFF
_SHADOW_SHARE = 1.0 - 1e-6
"""Share of the way to just before a lamp that a shadow ray looks at: the rest is rounding."""

_FAR = 3e38
_CAMERA_PAIRS = 3
_BOUNCE_PAIRS = 6
_ROULETTE_START = 2


class Launch:
    """The work of one launch, by lane: film sample `pixel`, sequence `seed`, turns [first, first + count) of it; and for bands,
    the `offset` of each lane's first band.

    A turn is a sample of the sequence: each one, or with ``stride`` (of the tables) n every n-th, beginning with `residue`.

    Not a dataclass: Dr.Jit would take it for loop state.
    """

    def __init__(self, pixel: Any, seed: Any, first: Any, count: Any, offset: Any, residue: Any) -> None:  # noqa: PLR0917
        self.pixel, self.seed, self.first, self.count, self.offset = pixel, seed, first, count, offset
        self.residue = residue

    def sample(self, tables: Tables, turn: Any) -> Any:
        """Return the number in the sequence of a turn."""
        return turn * tables["stride"] + self.residue


class _Inputs:
    """What the loop reads and never changes, kept out of its state in the same way."""

    def __init__(self, scene: Any, camera: CameraRays, tables: Tables, launch: Launch, film: Any) -> None:
        self.scene, self.camera, self.tables, self.launch, self.film = scene, camera, tables, launch, film


@dataclass(frozen=True, slots=True, eq=False)
class PathSums:
    """Sums over each lane's samples: `channels[group][channel]` arrays, `bands` flat (lane, group, band) or None, `bad`
    samples, `segments` traced, and the light that was `clamped` away, of all channels."""

    channels: list[list[Any]]
    bands: Any | None
    bad: Any
    segments: Any
    clamped: Any


class PathLoop:
    """One kind of kernel. What differs between scenes of the same kind is data in `tables`.

    Parameters
    ----------
    wavelengths
        Number that a path carries.
    channels, groups
        Numbers of sensor channels and of light groups that are kept apart.
    bands
        Whether spectral bands are kept too. Wavelengths then visit the bands by turns; otherwise they follow `slots`.
    """

    def __init__(
        self,
        mi: Any,
        geometry: Geometry | SplitGeometry,
        materials: MaterialTable,
        lights: LightSet,
        fog: FogLayer | None = None,
        *,
        wavelengths: int,
        channels: int,
        groups: int,
        bands: bool,
    ) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._geometry, self._materials, self._lights, self._fog = geometry, materials, lights, fog
        self._wavelengths, self._channels, self._groups, self._bands = wavelengths, channels, groups, bands

    @property
    def kind(self) -> tuple[Any, ...]:
        """What the compiled code depends on."""
        parts = (self._geometry, self._materials, self._lights)
        features = tuple(tuple(sorted(part.features)) for part in parts)
        switches = self._lights.count > 0, self._fog is not None, self._bands
        return features, switches, self._wavelengths, self._channels, self._groups

    def trace(self, scene: Any, camera: CameraRays, tables: Tables, launch: Launch) -> PathSums:
        """Return the sums of a launch.

        `tables` are those of the geometry with, beside them, ``spectra``, ``responses`` (channel, cell), ``slots``,
        ``columns``, ``stride``, ``max_depth``, ``band_count``, ``band_first_nm`` and ``band_step_nm``.
        """
        import drjit as dr  # noqa: PLC0415

        mi = self._mi
        lanes = dr.width(launch.pixel)
        film = None
        if self._bands:
            film = dr.zeros(mi.Float, lanes * self._groups * tables["band_count_host"])
        channels, bad, segments, clamped = _decorated(dr)(self, _Inputs(scene, camera, tables, launch, film), lanes)
        return PathSums(channels, film, bad, segments, clamped)

    def _added(self, radiance: list[Any], value: Any, group: Any) -> list[Any]:
        """Return the groups' radiances with `value` added to that of its group."""
        if self._groups == 1:
            return [radiance[0] + value]
        return [kept + self._dr.select(group == number, value, 0.0) for number, kept in enumerate(radiance)]

    def _camera_sample(self, camera: CameraRays, tables: Tables, launch: Launch, sample: Any) -> tuple[Any, Any, Any]:
        """Return origin, direction and wavelength cells of a new path."""
        mi, dr = self._mi, self._dr
        numbers = PathSampler(mi, launch.seed, sample)
        row = launch.pixel // tables["columns"]
        jitter = numbers.pair(0)
        x_px, y_px = mi.Float(launch.pixel - row * tables["columns"]) + jitter.x, mi.Float(row) + jitter.y
        origin, direction = camera.through_lens(x_px, y_px, numbers.pair(1))
        cells = []
        if self._bands:
            # Once through all bands, W wavelengths have been in each: they are spread evenly over it, and so are the rounds.
            u = PathSampler(mi, launch.seed, sample // tables["band_count"]).pair(2).x
            for k, band in enumerate(self._bands_of(tables, launch, sample)):
                nm = tables["band_first_nm"] + tables["band_step_nm"] * (mi.Float(band) + self._shifted(u, k))
                cells.append(mi.UInt32(dr.clip((nm - FIRST_EDGE_NM) * (1.0 / CELL_NM), 0.0, CELL_COUNT - 1.0)))
        else:
            u = numbers.pair(2).x
            for k in range(self._wavelengths):
                shifted = self._shifted(u, k)
                slot = dr.minimum(mi.UInt32(shifted * SLOTS), SLOTS - 1)
                cells.append(dr.gather(mi.UInt32, tables["slots"], slot))
        return origin, direction, dr.llvm.ad.ArrayXu(cells)

    def _shifted(self, u: Any, k: int) -> Any:
        """Return the number of a path's wavelength k, in [0, 1): all of them are equally far apart on a circle."""
        shifted = u + k / self._wavelengths
        return self._dr.select(shifted >= 1.0, shifted - 1.0, shifted)

    def _bands_of(self, tables: Tables, launch: Launch, sample: Any) -> list[Any]:
        """Return the bands of a path's wavelengths.

        Decided by counting, not by chance: sample s of a lane visits the bands s + offset + k B / W modulo B, so each band
        gets the same number of samples to within a few, known beforehand.
        """
        bands = []
        for shift in tables["band_shifts"]:
            position = sample + launch.offset + shift
            bands.append(position - (position // tables["band_count"]) * tables["band_count"])
        return bands

    def _shadow_ray(self, start: Any, point: Any, light: LightSample) -> Any:
        """Return the ray from `start`, just off the surface at `point`, to just off the lamp's own surface.

        Both ends move: near a lamp but far from the origin the two offsets are a large share of the way, and a ray along the
        light's direction would end behind the lamp or short of what stands before it.
        """
        mi, dr = self._mi, self._dr
        endless = dr.isinf(light.distance)
        end = point + light.direction * dr.select(endless, 0.0, light.distance) + light.clearance
        way = mi.Vector3f(end - start)
        length = dr.norm(way)
        ahead = dr.dot(way, light.direction) > 0
        direction = dr.select(endless, light.direction, way * dr.rcp(dr.maximum(length, 1e-30)))
        reach = dr.select(endless, _FAR, dr.select(ahead, length * _SHADOW_SHARE, 0.0))
        return mi.Ray3f(mi.Ray3f(o=start, d=direction), reach)

    def _to_channels(self, tables: Tables, radiance: Any, cells: Any) -> list[Any]:
        """Return the channels' responses to a path's spectral radiance; the weights hold the density of the wavelengths."""
        mi, dr = self._mi, self._dr
        sums = []
        for channel in range(self._channels):
            total = mi.Float(0)
            for k in range(self._wavelengths):
                weight = dr.gather(mi.Float, tables["responses"], cells[k] + channel * CELL_COUNT)
                total = dr.fma(radiance[k], weight, total)
            sums.append(total)
        return sums


_compiled: list[Any] = []


def _decorated(dr: Any) -> Any:
    """Return the loop with its control flow rewritten; made once, when the renderer is there."""
    if not _compiled:
        _compiled.append(dr.syntax(_loop_body))
    return _compiled[0]


def _loop_body(self: Any, given: Any, lanes: int) -> Any:  # noqa: PLR0912, PLR0915 - one loop, in the order of a path
    import drjit as dr  # noqa: PLC0415

    mi = self._mi
    spectral = dr.llvm.ad.ArrayXf
    count = self._wavelengths

    def zeros() -> Any:
        return spectral([dr.zeros(mi.Float, lanes) for _ in range(count)])

    turn = given.launch.first + dr.zeros(mi.UInt32, lanes)
    end = turn + given.launch.count
    active = turn < end
    fresh = dr.full(mi.Mask, True, lanes)
    origin, direction = dr.zeros(mi.Point3f, lanes), dr.zeros(mi.Vector3f, lanes)
    cells = dr.llvm.ad.ArrayXu([dr.zeros(mi.UInt32, lanes) for _ in range(count)])
    throughput = zeros()
    radiance = [zeros() for _ in range(self._groups)]
    last_point = dr.zeros(mi.Point3f, lanes)
    last_normal = dr.zeros(mi.Vector3f, lanes)
    last_density = dr.zeros(mi.Float, lanes)
    single = dr.full(mi.Mask, False, lanes)
    depth = dr.zeros(mi.UInt32, lanes)
    seen = dr.zeros(mi.Float, lanes)
    eta = dr.full(mi.Float, 1, lanes)
    sums = [[dr.zeros(mi.Float, lanes) for _ in range(self._channels)] for _ in range(self._groups)]
    bad = dr.zeros(mi.UInt32, lanes)
    segments = dr.zeros(mi.UInt32, lanes)
    clamped = dr.zeros(mi.Float, lanes)

    while active:
        sample = given.launch.sample(given.tables, turn)
        if fresh:
            origin, direction, cells = self._camera_sample(given.camera, given.tables, given.launch, sample)
            throughput = spectral([mi.Float(1) for _ in range(count)])
            radiance = [spectral([mi.Float(0) for _ in range(count)]) for _ in range(self._groups)]
            last_density = mi.Float(0)  # nothing but the camera ray itself could have found what it hits
            last_normal = mi.Vector3f(0)
            last_point = mi.Point3f(0)
            single = mi.Mask(False)
            depth = mi.UInt32(0)
            seen = mi.Float(0)
            eta = mi.Float(1)
        cell_list = [cells[k] for k in range(count)]
        wavelengths_nm = [FIRST_EDGE_NM + CELL_NM * (mi.Float(cell) + 0.5) for cell in cell_list]
        numbers = PathSampler(mi, given.launch.seed, sample)
        first_pair = _CAMERA_PAIRS + _BOUNCE_PAIRS * depth
        ray = mi.Ray3f(o=origin, d=direction)
        hit = self._geometry.intersect(given.tables, given.scene, ray, active)
        segments += dr.select(active, 1, 0)
        in_fog = mi.Mask(False)
        if self._fog is not None:
            in_fog, free_m = self._fog.collision(origin, direction, hit.distance, numbers.pair(first_pair + 4).x)
            in_fog &= active
            throughput = dr.select(in_fog, throughput * self._fog.albedo, throughput)
            hit.point = dr.select(in_fog, origin + direction * dr.select(in_fog, free_m, 0.0), hit.point)
            hit.offset_m = dr.select(in_fog, 0.0, hit.offset_m)
            hit.valid &= ~in_fog

        # Emission met by the ray, weighted against the chance that light sampling had found it
        if "tree" in self._lights.features:
            shines = hit.valid & (hit.leaf != _NO_LEAF) & (dr.dot(hit.front_normal, direction) < 0)
            if shines:
                row, group = self._lights.hit_emission(hit.leaf, shines)
                # From the point itself: the ray starts off it by what may be a large share of the way.
                between = dr.norm(hit.point - last_point)
                other = self._lights.hit_density(
                    hit.leaf, last_point, last_normal, direction, between, hit.front_normal, shines & (last_density > 0)
                )
                share = dr.select(last_density > 0, last_density / (last_density + other), 1.0)
                if "pattern" in self._lights.features:
                    share *= self._lights.hit_share(hit.leaf, direction, shines)
                radiance = self._added(
                    radiance, throughput * look_up(mi, given.tables["spectra"], row, cell_list) * share, group
                )
        # What is far away: the sky is looked up once for each lane, by rays that left the scene and by light sampling alike.
        escaped = active & ~hit.valid & ~in_fog
        far_direction = direction
        far_weight = throughput
        if "environment" in self._lights.features:
            other = self._lights.environment_density(last_normal, direction, escaped)
            share = dr.select(last_density > 0, last_density / (last_density + other), 1.0)
            far_weight = dr.select(escaped, throughput * share, 0.0)
        if "sun" in self._lights.features:
            other = self._lights.sun_density(direction)
            in_sun = escaped & (other > 0)
            if in_sun:
                share = dr.select(last_density > 0, last_density / (last_density + other), 1.0)
                met = throughput * self._lights.sun_radiance(given.tables["spectra"], cell_list) * share
                radiance = self._added(radiance, met, self._lights.sun_group)

        depth += 1
        alive = active & (hit.valid | in_fog) & (depth < given.tables["max_depth"])
        finished = active & ~alive
        if alive:
            frame = mi.Frame3f(hit.shading_normal)
            wi = frame.to_local(-direction)
            choice, texture_pair = numbers.pair(first_pair + 1), numbers.pair(first_pair + 3)
            surface = self._materials.at(
                given.tables["spectra"], hit.material, hit.uv, cell_list, wavelengths_nm, texture_pair.y, alive, single
            )
            facing = dr.select(wi.z < 0, -hit.shading_normal, hit.shading_normal)
            bound = dr.select(surface.lit_behind | in_fog, mi.Vector3f(0), facing)
            lit = alive & (surface.has_smooth | in_fog)
            if self._lights.count > 0:  # noqa: SIM102 - decided while compiling; the next one on the lanes
                if lit:
                    light = self._lights.sample(hit.point, bound, choice.x, numbers.pair(first_pair), lit)
                    wo = frame.to_local(light.direction)
                    value, density = surface.evaluate(wi, wo)
                    if self._fog is not None:
                        phase = self._fog.phase(dr.dot(direction, light.direction))
                        value, density = dr.select(in_fog, phase, value), dr.select(in_fog, phase, density)
                    useful = lit & (light.pdf > 0) & dr.any(value > 0)
                    start = hit.start(light.direction, mi, dr)
                    shadow = self._shadow_ray(start, hit.point, light)
                    useful &= ~self._geometry.occluded(given.scene, shadow, useful)
                    share = dr.select(light.delta, 1.0, light.pdf / (light.pdf + density))
                    weight = throughput * value * (share / light.pdf)
                    if self._fog is not None:
                        weight = weight * self._fog.transmittance(start, light.direction, light.distance)
                    weight = dr.select(useful, weight, 0.0)
                    if "environment" in self._lights.features:
                        far_direction = dr.select(light.dome, light.direction, far_direction)
                        far_weight = dr.select(light.dome, weight, far_weight)
                    if not self._lights.features.isdisjoint(("tree", "distant")):
                        sent = weight * light.radiance(given.tables["spectra"], cell_list)
                        radiance = self._added(radiance, sent, light.group)
            if "sun" in self._lights.features:  # noqa: SIM102 - as above
                if lit:
                    sunwards, sun_density = self._lights.sample_sun(numbers.pair(first_pair + 5))
                    value, density = surface.evaluate(wi, frame.to_local(sunwards))
                    if self._fog is not None:
                        phase = self._fog.phase(dr.dot(direction, sunwards))
                        value, density = dr.select(in_fog, phase, value), dr.select(in_fog, phase, density)
                    useful = lit & (sun_density > 0) & dr.any(value > 0)
                    start = hit.start(sunwards, mi, dr)
                    useful &= ~self._geometry.occluded(given.scene, mi.Ray3f(mi.Ray3f(o=start, d=sunwards), _FAR), useful)
                    weight = throughput * value * dr.rcp(sun_density + density)
                    if self._fog is not None:
                        weight = weight * self._fog.transmittance(start, sunwards, mi.Float(dr.inf))
                    sent = dr.select(useful, weight * self._lights.sun_radiance(given.tables["spectra"], cell_list), 0.0)
                    radiance = self._added(radiance, sent, self._lights.sun_group)

            bounce = surface.sample(wi, choice.y, numbers.pair(first_pair + 2))
            onward = frame.to_world(bounce.wo)
            weight, next_density = bounce.weight, dr.select(bounce.delta, 0.0, bounce.pdf)
            if self._fog is not None:
                scattered, of_phase = self._fog.scatter(direction, numbers.pair(first_pair + 2))
                onward = dr.select(in_fog, scattered, onward)
                weight, next_density = dr.select(in_fog, 1.0, weight), dr.select(in_fog, of_phase, next_density)
            throughput = throughput * weight
            if "dispersion" in self._materials.features:
                single |= alive & ~in_fog & bounce.single_wavelength
            eta = eta * dr.select(in_fog, 1.0, bounce.eta)
            strongest = dr.max(throughput)
            finished |= alive & ~(strongest > 0)
            # Russian roulette by what is left of the path's weight; radiance in glass is denser by the index squared.
            # A path that lost nothing goes on, to `max_depth`: its end by chance is noise without bound where nothing absorbs.
            # What counts is what is left of the light of the surface that the camera sees: a black car's pixel is compared with
            # its own noise, and a path from it must not return with more weight than it had there.
            left = strongest * eta * eta
            seen = dr.select(seen > 0, seen, dr.select(bounce.delta & ~in_fog, 0.0, left))
            survival = dr.minimum(left * dr.rcp(dr.select(seen > 0, seen, 1.0)), 1.0)
            survival = dr.select(depth < _ROULETTE_START, 1.0, survival)
            finished |= alive & (texture_pair.x >= survival)
            throughput = throughput * dr.rcp(dr.maximum(survival, 1e-6))
            origin = hit.start(onward, mi, dr)
            direction = onward
            last_density = next_density
            last_normal = bound
            last_point = hit.point

        if "environment" in self._lights.features:
            looks = active & (dr.max(far_weight) > 0)
            if looks:
                sky = self._lights.environment_radiance(given.tables["spectra"], far_direction, cell_list, looks)
                radiance = self._added(radiance, far_weight * sky, self._lights.environment_group)

        if finished:
            good = dr.full(mi.Mask, True, lanes)
            for group in range(self._groups):
                total = dr.sum(radiance[group])
                good &= dr.isfinite(total) & (dr.min(radiance[group]) >= 0)
            counted = [self._to_channels(given.tables, radiance[group], cells) for group in range(self._groups)]
            excess = mi.Float(1.0)
            for channel in range(self._channels):
                together = sum(of_group[channel] for of_group in counted)
                excess = dr.maximum(excess, together * given.tables["inverse_clamp"][channel])
            kept = dr.select(good, dr.rcp(excess), 0.0)
            for group in range(self._groups):
                for channel in range(self._channels):
                    sums[group][channel] += counted[group][channel] * kept
                    clamped += dr.select(good, counted[group][channel] * (1.0 - kept), 0.0)
            if given.film is not None:
                lane = dr.arange(mi.UInt32, lanes)
                for k, band in enumerate(self._bands_of(given.tables, given.launch, sample)):
                    photons = wavelengths_nm[k] * given.tables["photons_per_j_nm"]
                    for group in range(self._groups):
                        index = (lane * self._groups + group) * given.tables["band_count"] + band
                        dr.scatter_add(
                            given.film,
                            radiance[group][k] * (photons * kept),
                            index,
                            finished & good,
                            mode=dr.ReduceMode.NoConflicts,
                        )
            bad += dr.select(good, 0, 1)
            turn += 1
        fresh = finished
        active &= turn < end
    return sums, bad, segments, clamped
