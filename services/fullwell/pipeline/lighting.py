"""What of the light a camera's frame needs: channels or spectra, which groups, how exact, how deep; and why."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.core.hashing import digest_of
from fullwell.isp import scene_illuminant
from fullwell.optics import IDEAL_LENS, channels_suffice, diffraction_otf, form_channel_image, working_f_number
from fullwell.pipeline.culling import leave_out
from fullwell.pipeline.motion import MotionPlan, Timing, plan_motion
from fullwell.pipeline.noise import SensorNoise, longest_capture
from fullwell.pipeline.path_depth import choose_depth
from fullwell.pipeline.steps import PlanStep
from fullwell.radiometry import ChannelRadiance, Spectrum, WavelengthGrid
from fullwell.render import REPLICAS, LightRequest, NoiseTarget, SamplingGoal
from fullwell.scene import Film, SceneDescription
from fullwell.scene.groups import group_names, only_groups
from fullwell.schema.frame import CameraRig, FrameDescription, SensorRig, View
from fullwell.sensor import exposure_time
from fullwell.sensor.quantum_efficiency import ChannelCurrents

__all__ = ["LightPlan", "plan_light"]

_MOST_RESPONSES = 12
"""Channels, or parts of them, that are counted directly; with more, the spectrum is cheaper than a column for each."""

_MOST_PARTS = 4
"""Ranges of wavelength that a channel is cut into, so that diffraction is nearly the same within each."""

_CONTRAST_BOUND = 0.02
"""Change of contrast up to the Nyquist frequency that one wavelength a channel may cause, for any colour of an object."""

_FREQUENCIES = 65
"""At which contrasts are compared, from zero to Nyquist; they are smooth."""

_PATHS_PER_CPU_S = 1.5e6
"""In a Cornell box; many triangles and long paths take longer: a plan's cost is an order of magnitude."""

_LEAST_SAMPLES = 4 * REPLICAS
"""Rays for each film sample before the noise is looked at."""

_NO_LEVELS = "all triangles are traced: coarser meshes would gain next to nothing"
"""Measured: docs/physics/skips.md."""

_SPECTRAL_PRODUCTS = frozenset({"radiance.exr", "irradiance.exr"})
_SLOPES_PER_NM = (-0.01, 0.01)
"""Relative slopes of reflectance: a factor of e within 100 nm is a strong colour. Lamps with lines are in the light itself."""

Places = tuple[tuple[int, ...], ...]
"""For each channel of a sensor, the responses whose sum it counts."""


@dataclass(frozen=True, slots=True, eq=False)
class LightPlan:
    """What is rendered for a camera.

    Attributes
    ----------
    scene
        The scene without what cannot matter.
    request
        To be completed with a seed.
    channels
        By the sensor's name, for each of its channels the responses of the request that it is the sum of; empty where the
        spectrum serves.
    wavelength_nm
        (responses,) mean wavelengths [nm].
    steps
        The decisions, for people.
    identity
        Digest of all that decides the light beside scene, pose, film and seed.
    """

    scene: SceneDescription
    request: LightRequest
    channels: dict[str, Places]
    wavelength_nm: NDArray[np.float64]
    steps: tuple[PlanStep, ...]
    identity: str

    def light_of(self, sensor: SensorRig, light: NDArray[np.float64], tangent_pitch: float) -> ChannelRadiance:
        """Return what a sensor's channels count, part by part, from (responses, rows, cols) of light."""
        places = self.channels[sensor.name]
        parts = [part for of_channel in places for part in of_channel]
        channel = np.repeat(np.arange(len(places)), [len(of_channel) for of_channel in places])
        return ChannelRadiance(light[parts], self.wavelength_nm[parts], channel, tangent_pitch)

    def shapes(self, film: Film) -> tuple[tuple[int, ...], tuple[int, ...] | None]:
        """Return the shapes of the replicas and of the bands, None where they are not kept."""
        request = self.request
        groups = len(group_names(self.scene)) if request.keep_groups else 1
        replicas = (REPLICAS, groups, len(request.responses), film.rows, film.cols)
        return replicas, (groups, film.rows, film.cols, request.grid.count) if request.keep_bands else None


def plan_light(frame: FrameDescription, rig: CameraRig, position: int, *, skip: bool = True) -> LightPlan:
    """Return what is to be rendered for the camera at `position`; with `skip` false nothing is left out."""
    own = View(rig.sensors, frame.group_weights)
    motion = plan_motion(frame, rig, position, skip=skip)
    views = _views_of_one_exposure(frame.views[position] if frame.views else (own,), own, motion)
    steps: list[PlanStep] = []
    sensors = (*(sensor for view in views for sensor in view.sensors), *rig.sensors)
    light = scene_illuminant(frame.scene, rig.camera) or Spectrum.constant(1.0)
    responses, places, bands, direct = _choose_form(frame, rig, sensors, light, skip=skip, steps=steps)
    means = _mean_wavelengths(frame.grid, responses, light)
    scene, keep_groups = _choose_groups(frame, rig, views, skip=skip, steps=steps)
    scene, max_depth = _reduce(frame, rig, scene, keep_groups, motion, skip=skip, steps=steps)
    quality = frame.quality
    goal = SamplingGoal(
        noise_ratio=quality.noise_ratio,
        samples_per_pixel=quality.samples_per_pixel or 1,
        max_samples_per_pixel=quality.max_samples_per_pixel,
        time_limit_s=quality.time_limit_s,
        clamp_saturation=quality.max_sample_saturation,
    )
    targets = _targets(frame.grid, rig, views, places)
    steps.append(_sampling_step(frame, rig, views))
    request = LightRequest(
        grid=frame.grid,
        responses=responses,
        keep_bands=bands,
        keep_groups=keep_groups,
        max_depth=max_depth,
        goal=goal,
        targets=targets,
        group_importance=_importance(views) if keep_groups else (),
        motion=motion.request(rig.camera, _metering(frame.grid, rig, places, position), dict(frame.group_weights)),
    )
    channels = {s.name: places[_channel_digest(s)] for s in rig.sensors} if direct else {}
    adaptive = goal.noise_ratio is not None or quality.max_sample_saturation is not None
    identity = digest_of(
        {
            "responses": list(responses),
            "bands": bands,
            "groups": keep_groups,
            "importance": list(request.group_importance),
            "goal": goal,
            "depth": max_depth,
            "lens": [rig.camera.lens.f_number, rig.camera.lens.magnification] if adaptive else None,
            "views": [[[[s.model, s.exposure] for s in v.sensors], list(v.group_weights)] for v in views] if adaptive else None,
        }
        | motion.identity(dict(frame.group_weights))
    )
    return LightPlan(scene, request, channels, means, tuple(steps), identity)


def _views_of_one_exposure(views: tuple[View, ...], own: View, motion: MotionPlan) -> tuple[View, ...]:
    """Return the views that see the same light as the frame's own where something moves: those of the same exposure."""
    if motion.timing is None:
        return views
    if motion.timing.automatic:  # found from this frame's own light
        return (own,)
    same = tuple(view for view in views if all(Timing.of(sensor) == motion.timing for sensor in view.sensors))
    return same or (own,)


# Channels or bands ---------------------------------------------------------------------------------------------------


def _responses(
    grid: WavelengthGrid, rig: CameraRig, sensors: tuple[SensorRig, ...], parts: int
) -> tuple[tuple[Spectrum, ...], dict[str, Places]]:
    """Return the distinct responses behind the lens, each channel in `parts`, and by sensor's digest those of its channels."""
    known: dict[str, tuple[int, ...]] = {}
    found: list[Spectrum] = []
    places: dict[str, Places] = {}
    for sensor in sensors:
        key = _channel_digest(sensor)
        if key in places:
            continue
        of_sensor = []
        for _, efficiency in sensor.model.cfa.channels:
            digest = digest_of([efficiency.wavelength_nm, efficiency.values, efficiency.outside])
            if digest not in known:
                pieces = _parts(grid, efficiency.times(rig.camera.lens.transmittance), parts)
                known[digest] = tuple(range(len(found), len(found) + len(pieces)))
                found.extend(pieces)
            of_sensor.append(known[digest])
        places[key] = tuple(of_sensor)
    return tuple(found), places


def _parts(grid: WavelengthGrid, response: Spectrum, count: int) -> list[Spectrum]:
    """Return a response cut into equally wide ranges of wavelength; the parts add up to the whole within the bands."""
    if count == 1:
        return [response]
    pieces = []
    for low, high in itertools.pairwise(np.linspace(grid.edges_nm[0], grid.edges_nm[-1], count + 1)):
        inside = response.wavelength_nm[(response.wavelength_nm > low) & (response.wavelength_nm < high)]
        knots = np.concatenate([[low], inside, [high]])
        pieces.append(Spectrum(knots, response.at(knots), outside="zero", source=response.source))
    return pieces


def _channel_digest(sensor: SensorRig) -> str:
    return digest_of([[e.wavelength_nm, e.values, e.outside] for _, e in sensor.model.cfa.channels])


def _mean_wavelengths(
    grid: WavelengthGrid, responses: tuple[Spectrum, ...], light: Spectrum, slope_per_nm: float = 0.0
) -> NDArray[np.float64]:
    """Return (responses,) mean wavelengths of the photons counted from a surface whose reflectance has a relative slope."""
    wavelengths = _fine_nm(grid)
    reflectance = np.exp(slope_per_nm * (wavelengths - wavelengths.mean()))
    energy = light.at(wavelengths) * wavelengths * reflectance
    weights = np.stack([response.at(wavelengths) * energy for response in responses])
    plain = np.stack([response.at(wavelengths) for response in responses])
    weights = np.where(weights.sum(axis=1, keepdims=True) > 0, weights, plain)
    total = weights.sum(axis=1)
    means = np.divide(weights @ wavelengths, total, out=np.full(len(responses), 550.0), where=total > 0)
    return np.asarray(means, dtype=np.float64)


def _choose_form(
    frame: FrameDescription,
    rig: CameraRig,
    sensors: tuple[SensorRig, ...],
    light: Spectrum,
    *,
    skip: bool,
    steps: list[PlanStep],
) -> tuple[tuple[Spectrum, ...], dict[str, Places], bool, bool]:
    """Return (responses, places of the sensors' channels, whether bands are kept, whether channels serve), and say why."""
    what = f"{rig.camera.name}: spectra"
    edges = frame.grid.edges_nm
    bands = f"{frame.grid.count} bands, {edges[0]:g}-{edges[-1]:g} nm"
    asked = sorted(_SPECTRAL_PRODUCTS & set(frame.outputs))
    reason, bound = "", 0.0
    whole = _responses(frame.grid, rig, sensors, 1)
    responses, places = whole
    needs_spectra = not channels_suffice(rig.optics) or rig.depth_layers
    if rig.model == "isetcam":
        reason = "ISETCam's camera works on bands"
    elif needs_spectra and not asked:
        reason = "the lens's point image depends on the wavelength"
    else:
        for parts in range(1, _MOST_PARTS + 1):
            responses, places = _responses(frame.grid, rig, sensors, parts)
            bound = _contrast_bound(frame.grid, rig, responses, light)
            if bound <= _CONTRAST_BOUND:
                break
        if bound > _CONTRAST_BOUND:
            reason = f"diffraction differs within a channel: contrast by up to {bound:.2g}"
        elif len(responses) > _MOST_RESPONSES:
            reason = f"the sensors have {len(responses)} different responses; up to {_MOST_RESPONSES} are counted directly"
    direct = not (reason or needs_spectra) and skip
    if reason or not skip:
        responses, places = whole[0][:_MOST_RESPONSES], whole[1]
    elif needs_spectra:  # the same light as for a lens without: it is not rendered again for another one
        reason = "the lens's point image depends on the wavelength"
    if direct and not asked:
        low, high = _support(frame, responses)
        why = f"{len(responses)} responses are counted directly; only {low:g}-{high:g} nm reach one"
        steps.append(PlanStep(what, "skip", why, f"contrast within {bound:.2g} for strong colours"))
        return responses, places, False, True
    why = reason or (f"for {', '.join(asked)}" if asked else "asked for: nothing is skipped")
    also = "; the sensors' channels are counted directly" if direct else ""
    accuracy = f"contrast within {bound:.2g}" if direct else "the width of a band"
    steps.append(PlanStep(what, "run", f"{bands}: {why}{also}", accuracy))
    return responses, places, True, direct


def _fine_nm(grid: WavelengthGrid) -> NDArray[np.float64]:
    edges = grid.edges_nm
    return np.asarray(np.arange(edges[0], edges[-1] + 0.25, 0.5), dtype=np.float64)


def _support(frame: FrameDescription, responses: tuple[Spectrum, ...]) -> tuple[float, float]:
    """Return the range of wavelengths in which some channel counts anything [nm]."""
    edges = frame.grid.edges_nm
    wavelengths = _fine_nm(frame.grid)
    counted = np.max([response.at(wavelengths) for response in responses], axis=0) > 0
    inside = wavelengths[counted]
    return (float(inside[0]), float(inside[-1])) if inside.size else (float(edges[0]), float(edges[-1]))


def _contrast_bound(grid: WavelengthGrid, rig: CameraRig, responses: tuple[Spectrum, ...], light: Spectrum) -> float:
    """Return by how much the contrast up to Nyquist may be off because a channel is diffracted at one wavelength."""
    lens = rig.camera.lens
    if not lens.diffraction:
        return 0.0
    f_number = working_f_number(lens.f_number, lens.magnification)
    # Not at Nyquist alone: with small pixels no wavelength passes there, and colours differ below it.
    frequencies = np.linspace(0.0, 0.5 / rig.camera.film.pitch_m, _FREQUENCIES)

    def contrasts(slope_per_nm: float) -> NDArray[np.float64]:
        means = _mean_wavelengths(grid, responses, light, slope_per_nm)
        return np.stack([diffraction_otf(frequencies, wavelength_nm=float(nm), f_number=f_number) for nm in means])

    plain = contrasts(0.0)
    return max(float(np.max(np.abs(contrasts(slope) - plain))) for slope in _SLOPES_PER_NM)


# Groups --------------------------------------------------------------------------------------------------------------


def _choose_groups(
    frame: FrameDescription, rig: CameraRig, views: tuple[View, ...], *, skip: bool, steps: list[PlanStep]
) -> tuple[SceneDescription, bool]:
    """Return the scene without lamps that no view shows, and whether groups are kept apart."""
    what = f"{rig.camera.name}: light groups"
    groups = group_names(frame.scene)
    weights = [dict(view.group_weights) for view in views]
    if all(weight == 1.0 for view in weights for weight in view.values()):
        steps.append(PlanStep(what, "skip", f"{len(groups)} in one image: no view weights them"))
        return frame.scene, False
    dark = {name for name in groups if skip and all(view.get(name, 1.0) == 0.0 for view in weights)}
    scene = only_groups(frame.scene, frozenset(groups) - dark) if dark else frame.scene
    if dark:
        steps.append(PlanStep(what, "skip", f"{', '.join(sorted(dark))}: weight 0 in every view"))
    kept = [name for name in groups if name not in dark]
    steps.append(PlanStep(what, "run", f"{', '.join(kept)} kept apart: other weights cost no rendering"))
    return scene, True


def _importance(views: tuple[View, ...]) -> tuple[tuple[str, float], ...]:
    """Return by how much the lamps of a group are sampled more: as the strongest view weights them."""
    names = {name for view in views for name, _ in view.group_weights}
    strongest = {name: max(dict(view.group_weights).get(name, 1.0) for view in views) for name in names}
    return tuple(sorted((name, weight) for name, weight in strongest.items() if weight > 0))


# Scene ---------------------------------------------------------------------------------------------------------------


def _reduce(
    frame: FrameDescription,
    rig: CameraRig,
    scene: SceneDescription,
    keep_groups: bool,
    motion: MotionPlan,
    *,
    skip: bool,
    steps: list[PlanStep],
) -> tuple[SceneDescription, int]:
    """Return the scene without objects that cannot matter, and how many segments its paths have."""
    name = rig.camera.name
    if motion.runs:
        what = f"{name}: objects out of view"
        steps.append(PlanStep(what, "run", f"all {len(scene.objects)} objects are kept: what moves may bring them into view"))
    elif skip:
        scene, step = leave_out(scene, rig.camera, frame.grid, weighted=keep_groups)
        steps.append(step)
    depth, step = choose_depth(scene, frame.grid, frame.quality.max_depth, camera_name=name, skip=skip)
    steps.append(step)
    steps.append(PlanStep(f"{name}: level of detail", "skip", _NO_LEVELS))
    steps.append(motion.step)
    return scene, depth


# Samples -------------------------------------------------------------------------------------------------------------


def _targets(
    grid: WavelengthGrid, rig: CameraRig, views: tuple[View, ...], places: dict[str, Places]
) -> tuple[tuple[tuple[tuple[str, float], ...], NoiseTarget], ...]:
    """Return (group weights, noise of the sensors) of each view."""
    time_of = _exposure_finder(grid, rig)
    targets = []
    for view in views:
        sensors = []
        for sensor in view.sensors:
            of_sensor = places[_channel_digest(sensor)]
            if max(map(max, of_sensor)) < _MOST_RESPONSES:
                sensors.append((sensor, of_sensor))
        if sensors:
            targets.append((view.group_weights, SensorNoise(rig, tuple(sensors), time_of)))
    return tuple(targets)


def _exposure_finder(grid: WavelengthGrid, rig: CameraRig) -> Callable[[SensorRig, NDArray[np.float64]], float]:
    """Return what finds a sensor's base exposure time [s] from (channels, rows, cols) of light of its channels."""

    def time_of(sensor: SensorRig, light: NDArray[np.float64]) -> float:
        anywhere_nm = np.full(len(light), 550.0)
        radiance = ChannelRadiance(light, anywhere_nm, np.arange(len(light)), rig.camera.tangent_pitch)
        image = form_channel_image(radiance, replace(rig.camera.lens, diffraction=False), IDEAL_LENS)
        currents = ChannelCurrents(image.electrons, sensor.model.cfa, grid, image.sample_pitch_m)
        return exposure_time(currents, sensor.model, sensor.exposure)

    return time_of


def _metering(
    grid: WavelengthGrid, rig: CameraRig, places: dict[str, Places], position: int
) -> Callable[[NDArray[np.float64]], float]:
    """Return what finds the exposure time [s] of the first sensor's longest capture from (responses, rows, cols) of light."""
    sensor, time_of = rig.sensors[0], _exposure_finder(grid, rig)
    of_sensor = places[_channel_digest(sensor)]

    def metered(light: NDArray[np.float64]) -> float:
        if max(map(max, of_sensor)) >= len(light):
            path = f"cameras[{position}].sensors[0].exposure"
            sentence = f"{path} is automatic, and the sensor has more channels than it can be found from while something moves."
            raise FieldError(f"{sentence} Give exposure.time_s.", path=path)
        channels = SensorNoise(rig, ((sensor, of_sensor),), time_of).channels(light)
        return time_of(sensor, channels) * longest_capture(sensor)[0]

    return metered


def _sampling_step(frame: FrameDescription, rig: CameraRig, views: tuple[View, ...]) -> PlanStep:
    quality, film = frame.quality, rig.camera.film
    size = f"{film.cols} x {film.rows} samples"
    what = f"{rig.camera.name}: render"
    if quality.noise_ratio is None:
        count = quality.samples_per_pixel or 1
        cost = f"about {_cpu_s(rig, count)} CPU-s"
        return PlanStep(what, "run", f"{size}, {count} rays each", "Monte-Carlo error, in the manifest", cost)
    shared = f" in each of {len(views)} views" if len(views) > 1 else ""
    cap = f"at most {quality.max_samples_per_pixel} rays each"
    if quality.time_limit_s is not None:
        cap += f" and {quality.time_limit_s:g} s"
    most = quality.max_samples_per_pixel
    least, highest = _cpu_s(rig, min(_LEAST_SAMPLES, most)), _cpu_s(rig, most)
    cost = f"about {least} CPU-s" if least == highest else f"about {least} to {highest} CPU-s"
    bound = f"{quality.noise_ratio:g} of the sensor's noise, unless a cap is reached"
    return PlanStep(what, "run", f"{size}, {cap}, until the noise allows{shared}", bound, cost)


def _cpu_s(rig: CameraRig, samples_per_pixel: int) -> str:
    """Return the CPU time that so many rays need, roughly, in two digits."""
    seconds = rig.camera.film.rows * rig.camera.film.cols * samples_per_pixel / _PATHS_PER_CPU_S
    return f"{float(f'{seconds:.1e}'):g}"
