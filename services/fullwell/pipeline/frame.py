"""One frame from description to published products; the manifest, written last, is the commit point."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fullwell.core.errors import CancelledError, ConflictError, NotFoundError
from fullwell.core.hashing import sha256_hex
from fullwell.core.rng import seed32, stream
from fullwell.dataset import encode
from fullwell.dataset.dng import check_dng_pattern, encode_raw_dng
from fullwell.isp import scene_illuminant
from fullwell.labels import Labels, driving_document, labels_document, make_labels, optical_flow
from fullwell.optics import OpticsOptions
from fullwell.pipeline.cache import LightCache, ObtainedLight, obtain_light
from fullwell.pipeline.camera_chain import develop_picture, form_channels, form_image, take_picture
from fullwell.pipeline.kept_labels import KeptLabels, labels_of
from fullwell.pipeline.keys import frame_digest, light_key
from fullwell.pipeline.lighting import LightPlan
from fullwell.pipeline.noise import SensorNoise
from fullwell.pipeline.plan import FramePlan, plan_document, plan_frame
from fullwell.pipeline.progress import CancelCheck, FrameProgress, ProgressCallback
from fullwell.pipeline.stage_store import StageStore
from fullwell.render import (
    RenderedLight,
    RenderStatistics,
    choose_variant,
    query_depth,
    query_surfaces,
    render_light,
    tile_errors,
)
from fullwell.scene import Camera, ConstantEnvironment, Film, ImageEnvironment, SunSky
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.scene.motion import Motion
from fullwell.schema.frame import CameraRig, FrameDescription, SensorRig
from fullwell.sensor import ChannelCurrents, SensorModel
from fullwell.sensor.exposures import FixedExposure
from fullwell.storage import ObjectStore

__all__ = ["MANIFEST_NAME", "MANIFEST_SCHEMA", "render_frame"]

MANIFEST_NAME = "manifest.json"
MANIFEST_SCHEMA = "fullwell/manifest/v1"

_VERSIONED = ("fullwell", "mitsuba", "drjit", "numpy", "scipy", "colour-science")


def render_frame(
    frame: FrameDescription,
    store: ObjectStore,
    prefix: str,
    *,
    cache: LightCache | None = None,
    stages: StageStore | None = None,
    skip: bool = True,
    progress: ProgressCallback | None = None,
    should_cancel: CancelCheck | None = None,
) -> dict[str, Any]:
    """Make the products that a frame asks for, publish them under `prefix`, and return the manifest.

    Rendered light is taken from `cache` (memory) and `stages` (shared with other workers) and kept in both.

    With `skip` false the planner leaves nothing out, to see what its skips change.

    A frame that is published already is returned at once, so running twice does nothing twice. Products are complete before
    the manifest appears; what a crash leaves behind is products without a manifest, which nobody reads and the next run
    overwrites with the same bytes.

    Raises
    ------
    ConflictError
        Another frame is published under this prefix.
    CancelledError
        `should_cancel` returned true; no manifest was written.
    FullwellError
        Any stage failed; no manifest was written.
    """
    digest = frame_digest(frame, skip=skip)
    published = _published(store, prefix, digest)
    if published is not None:
        return published
    _check_products(frame)
    run = _Run(frame, plan_frame(frame, skip=skip), cache or LightCache(), stages, progress, should_cancel)
    for position, rig in enumerate(frame.cameras):
        _camera_products(run, rig, position)
    run.report("store", 0.98)
    published = _published(store, prefix, digest)
    if published is not None:  # a late duplicate must not touch the products of a frame that is committed
        return published
    listing = []
    for name in sorted(run.products):
        content = run.products[name]
        info = store.put(f"{prefix}/{name}", content)
        listing.append({"name": name, "bytes": len(content), "sha256": sha256_hex(content), "content_type": info.content_type})
    manifest = _manifest(run, digest, listing)
    try:
        store.put(f"{prefix}/{MANIFEST_NAME}", encode.encode_json(manifest), if_absent=True)
    except ConflictError:  # another worker finished the same frame first; its products are the same bytes
        published = _published(store, prefix, digest)
        if published is None:
            raise
        return published
    run.report("done", 1.0)
    return manifest


def _check_products(frame: FrameDescription) -> None:
    """Refuse products that a sensor cannot have before anything is rendered."""
    if "raw.dng" in frame.outputs:
        for rig in frame.cameras:
            for sensor in rig.sensors:
                check_dng_pattern(sensor.model.cfa.pattern)


def _published(store: ObjectStore, prefix: str, digest: str) -> dict[str, Any] | None:
    try:
        manifest: dict[str, Any] = encode.decode_json(store.get(f"{prefix}/{MANIFEST_NAME}"))
    except NotFoundError:
        return None
    if manifest.get("frame_digest") != digest:
        raise ConflictError(
            f"another frame is published under {prefix!r} (recipe {manifest.get('recipe_name')!r}, frame "
            f"{manifest.get('index')}); choose another destination or remove that one."
        )
    return manifest


@dataclass(slots=True)
class _Run:
    """What accumulates while a frame runs."""

    frame: FrameDescription
    plan: FramePlan
    cache: LightCache
    stage_store: StageStore | None
    progress: ProgressCallback | None
    should_cancel: CancelCheck | None
    products: dict[str, bytes] = field(default_factory=dict)
    cameras: list[dict[str, Any]] = field(default_factory=list)
    stages: list[dict[str, Any]] = field(default_factory=list)
    cached: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    instance_table: tuple[tuple[str, int], ...] = ()
    started: float = field(default_factory=time.time)
    cpu_started: float = field(default_factory=time.process_time)

    def report(self, stage: str, fraction: float) -> None:
        """Tell where the frame is; stop where it was cancelled."""
        self.check()
        if self.progress is not None:
            self.progress(FrameProgress(stage, min(1.0, fraction)))

    def check(self) -> None:
        """Raise CancelledError where the frame was cancelled."""
        if self.should_cancel is not None and self.should_cancel():
            raise CancelledError("the frame was cancelled; nothing was published")

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage."""
        wall, cpu = time.perf_counter(), time.process_time()
        yield
        self.stages.append(
            {
                "stage": name,
                "wall_s": round(time.perf_counter() - wall, 4),
                "cpu_s": round(time.process_time() - cpu, 4),
            }
        )


_RENDER_SHARE = 0.85
"""Share of a camera's time that rendering is taken to need, for the progress bar only."""


def _camera_products(run: _Run, rig: CameraRig, position: int) -> None:
    frame, plan, name = run.frame, run.plan, rig.camera.name
    base, share = position / len(frame.cameras), 0.97 / len(frame.cameras)
    folder = f"{name}/" if len(frame.cameras) > 1 else ""
    document: dict[str, Any] = {
        "name": name,
        "model": rig.model,
        "camera_to_world": rig.camera.camera_to_world.tolist(),
        "sensors": [],
    }
    by_sensor: dict[str, _Images] = {}
    lights = [lit for lit in plan.lights if lit.position == position]
    for number, lit in enumerate(lights):
        part = share * _RENDER_SHARE / len(lights)
        inner = folder if len(lights) == 1 else f"{folder}{lit.rig.sensors[0].name}/"
        images = _rendered(run, lit.rig, lit.plan, inner, (base + number * part, part))
        by_sensor |= {sensor.name: images for sensor in lit.rig.sensors}
        document.setdefault("radiance", _radiance_document(images, frame))
    for number, sensor in enumerate(rig.sensors):
        part = (number + 0.5) / len(rig.sensors)
        run.report("sensor and labels", base + share * (_RENDER_SHARE + (1 - _RENDER_SHARE) * part))
        inner = f"{folder}{sensor.name}/" if len(rig.sensors) > 1 else folder
        document["sensors"].append(_sensor_products(run, rig, sensor, inner, by_sensor.get(sensor.name)))
        if len(lights) > 1:
            document["sensors"][-1]["radiance"] = _radiance_document(by_sensor[sensor.name], frame)
    run.cameras.append(document)


@dataclass(frozen=True, slots=True, eq=False)
class _Images:
    """What a camera's sensors look at: the light, and what the optics made of it, by bands or by each sensor's channels."""

    light: RenderedLight
    key: str
    plan: LightPlan
    optical: OpticalImage | None
    currents: dict[str, ChannelCurrents]

    def of(self, sensor: SensorRig) -> OpticalImage | ChannelCurrents | None:
        """Return the light on a sensor."""
        return self.currents.get(sensor.name, self.optical)


def _rendered(run: _Run, rig: CameraRig, plan: LightPlan, folder: str, span: tuple[float, float]) -> _Images:
    """Render a camera's light, form its images, and add the products made of them.

    `span` is the start and the length of the rendering in the frame's progress.
    """
    name, outputs, weights = rig.camera.name, run.frame.outputs, dict(run.frame.group_weights)
    light, key = _light(run, rig, plan, *span)
    optical, currents = None, {}
    spectral = run.plan.optics and (not plan.channels or "irradiance.exr" in outputs)
    if spectral or "radiance.exr" in outputs:
        radiance = light.radiance(weights)
        _add(run, f"{folder}radiance.exr", lambda: encode.encode_radiance_exr(radiance))
        if spectral:
            run.report("optics", sum(span))
            with run.stage(f"{name}: optics"):
                optical = form_image(rig, radiance, _optics_options(run, rig))
            run.notes.extend(f"{name}: {note}" for note in optical.notes)
            _add(run, f"{folder}irradiance.exr", lambda: encode.encode_irradiance_exr(optical))
    if run.plan.sensor and plan.channels:
        run.report("optics", sum(span))
        with run.stage(f"{name}: optics"):
            seen = light.channels(weights)
            for sensor in rig.sensors:
                part = plan.light_of(sensor, seen, light.tangent_pitch)
                currents[sensor.name], notes = form_channels(rig, sensor, part, run.frame.grid)
                run.notes.extend(f"{name}/{sensor.name}: {note}" for note in notes)
    return _Images(light, key, plan, optical, currents)


def _optics_options(run: _Run, rig: CameraRig) -> OpticsOptions:
    """Return the options of the lens, with the depth of every film sample where depth of field is made from layers."""
    options = rig.optics if run.plan.skips else replace(rig.optics, max_skipped_contrast_loss=0.0)
    if not rig.depth_layers:
        return options
    return replace(options, depth_z_m=query_depth(run.frame.scene, rig.camera, should_cancel=run.should_cancel))


def _add(run: _Run, name: str, encoder: Any) -> None:
    """Encode a product where the recipe asks for it."""
    if name.rpartition("/")[2] in run.frame.outputs:
        with run.stage(f"encode {name}"):
            run.products[name] = encoder()


def _light(run: _Run, rig: CameraRig, plan: LightPlan, base: float, share: float) -> tuple[RenderedLight, str]:
    frame, name, film = run.frame, rig.camera.name, rig.camera.film
    key = light_key(frame, rig, plan, variant=choose_variant().variant)

    def render() -> RenderedLight:
        run.report("render", base)
        with run.stage(f"{name}: render"):
            return render_light(
                plan.scene,
                rig.camera,
                replace(plan.request, seed=seed32(frame.seed, "light", key)),
                progress=lambda fraction: run.report("render", base + share * fraction),
                should_cancel=run.should_cancel,
            )

    obtained = obtain_light(
        key,
        render,
        shapes=plan.shapes(film),
        memory=run.cache,
        stages=run.stage_store,
        tick=lambda: run.report("wait for another worker", base),
    )
    run.cached.append({"camera": name, "key": key, **obtained.document()})
    if obtained.source != "render":
        run.notes.append(_reuse_note(name, key, obtained))
    statistics = obtained.light.statistics
    if statistics.unmet_tiles:
        run.notes.append(
            f"{name}: the noise target is not met in {statistics.unmet_tiles} of {statistics.tiles} tiles (stopped by "
            f"{statistics.stopped_by}); the worst has {statistics.noise_ratio_max:.3g} times the sensor's noise"
        )
    return obtained.light, key


def _reuse_note(camera: str, key: str, obtained: ObtainedLight) -> str:
    source = _source_note(obtained.source)
    return f"{camera}: light reused from {source} (key {key[:12]}); rendering it took {obtained.light.statistics.wall_s:.3g} s"


def _source_note(source: str) -> str:
    return "an earlier frame of this run" if source == "memory" else "the stage cache"


def _radiance_document(images: _Images, frame: FrameDescription) -> dict[str, Any]:
    """Return what was rendered, and how exact it is; all of it the same wherever the frame is made."""
    light = images.light
    statistics = light.statistics
    return {
        "key": images.key,
        "variant": statistics.variant,
        "groups": list(light.groups),
        "bands": light.bands is not None,
        "samples_per_pixel": round(statistics.samples_per_pixel, 3),
        "samples_min": statistics.samples_min,
        "samples_max": statistics.samples_max,
        "passes": statistics.passes,
        "segments": statistics.segments,
        "bad_samples": statistics.bad_samples,
        "motion": _motion_document(statistics),
        "clamped_fraction": statistics.clamped_fraction,
        "relative_standard_error_rms": _relative_error_rms(light, tuple(frame.group_weights)),
        "noise_target": {
            "noise_ratio": frame.quality.noise_ratio,
            "predicted_rms": statistics.noise_ratio_rms,
            "predicted_max": statistics.noise_ratio_max,
            "tiles": statistics.tiles,
            "unmet_tiles": statistics.unmet_tiles,
            "stopped_by": statistics.stopped_by,
        },
    }


_error_rms: weakref.WeakKeyDictionary[RenderedLight, dict[Any, float | None]] = weakref.WeakKeyDictionary()
"""By the weights of groups: frames that vary only the sensor have the same."""


def _relative_error_rms(light: RenderedLight, weights: tuple[Any, ...]) -> float | None:
    """Return the rms over film samples and channels of the relative standard error; None without channels."""
    known = _error_rms.setdefault(light, {})
    if weights not in known:
        error, mean = light.channel_error(dict(weights)), light.channels(dict(weights))
        relative = np.divide(error, mean, out=np.zeros_like(error), where=mean > 0)
        known[weights] = float(np.sqrt(np.mean(np.square(relative)))) if relative.size else None
    return known[weights]


def _motion_document(statistics: RenderStatistics) -> dict[str, Any] | None:
    """Return how motion was rendered; None where nothing moved far enough."""
    if statistics.moments == 1:
        return None
    step_px = statistics.moment_step_px
    return {
        "moments": statistics.moments,
        "step_px": None if step_px < 0 else step_px,
        "exposure_time_s": statistics.exposure_time_s,
    }


def _sensor_products(
    run: _Run,
    rig: CameraRig,
    sensor: SensorRig,
    folder: str,
    images: _Images | None,
) -> dict[str, Any]:
    view = _sensor_view(rig.camera, sensor.model)
    document: dict[str, Any] = {
        "name": sensor.name,
        "model": sensor.model.name,
        "size_px": [sensor.model.cols, sensor.model.rows],
        "pixel_pitch_m": sensor.model.pixel_pitch_m,
        "intrinsics_px": view.intrinsics_px.tolist(),
        "lens": _lens_document(rig.camera),
    }
    seen = images.of(sensor) if run.plan.sensor and images is not None else None
    if seen is not None and images is not None:
        raw = _expose(run, rig, sensor, seen)
        document |= _raw_document(raw, sensor.model) | _noise_document(run.frame, rig, sensor, images, raw)
        _add(run, f"{folder}raw.npz", lambda: encode.encode_raw_npz(raw))
        _add(run, f"{folder}raw.tiff", lambda: encode.encode_raw_tiff(raw))
        weights = dict(run.frame.group_weights)
        light = scene_illuminant(run.frame.scene, rig.camera, weights) if sensor.isp.illuminant is None else None
        _add(run, f"{folder}raw.dng", lambda: encode_raw_dng(raw, sensor.isp, scene_light=light))
        if run.plan.display:
            with run.stage(f"{rig.camera.name}/{sensor.name}: isp"):
                rgb, document["isp"] = develop_picture(rig, sensor, raw, scene_light=light)
            _add(run, f"{folder}image.png", lambda: encode.encode_rgb_png(rgb))
    if run.plan.labels:
        with run.stage(f"{rig.camera.name}/{sensor.name}: labels"):
            kept = _labels(run, view, f"{rig.camera.name}/{sensor.name}")
        run.instance_table = kept.labels.instance_table
        _label_products(run, kept.labels, view, rig.motion, folder, kept.files)
    return document


def _labels(run: _Run, view: Camera, name: str) -> KeptLabels:
    """Return the labels of a view."""
    scene = run.frame.scene

    def make() -> Labels:
        return make_labels(scene, view, query_surfaces(scene, view, should_cancel=run.should_cancel))

    kept = labels_of(scene, view, make, stages=run.stage_store)
    if kept.source != "made":
        run.notes.append(f"{name}: labels reused from {_source_note(kept.source)}")
    return kept


def _sensor_view(camera: Camera, model: SensorModel) -> Camera:
    """Return the camera with the sensor's own pixels as film: labels have one value per pixel."""
    return Camera(camera.name, camera.camera_to_world, camera.lens, Film(model.rows, model.cols, model.pixel_pitch_m))


def _expose(run: _Run, rig: CameraRig, sensor: SensorRig, seen: OpticalImage | ChannelCurrents) -> RawImage:
    with run.stage(f"{rig.camera.name}/{sensor.name}: sensor"):
        rng = stream(run.frame.seed, "sensor", run.frame.index, rig.camera.name, sensor.name)
        return take_picture(rig, sensor, seen, rng=rng)


def _raw_document(raw: RawImage, model: SensorModel) -> dict[str, Any]:
    """Return what the capture was."""
    document: dict[str, Any] = {
        "exposure_time_s": raw.exposure_time_s,
        "adc_bits": raw.adc_bits,
        "black_level_dn": raw.black_level_dn,
        "white_level_dn": raw.white_level_dn,
        "saturated_fraction": raw.saturated_fraction,
        "electrons_per_dn": raw.electrons_per_dn,
        "serial": model.serial,
        "temperature_k": model.temperature_k,
        "shutter": _shutter_document(raw),
    }
    if raw.channel_exposure_time_s:
        document["channel_exposure_time_s"] = dict(raw.channel_exposure_time_s)
    if raw.captures:
        document["captures"] = [dataclasses.asdict(record) for record in raw.captures]
    if raw.mean_electrons is not None:
        document["mean_electrons"] = float(raw.mean_electrons.mean(dtype=np.float64))
    return document


def _noise_document(
    frame: FrameDescription, rig: CameraRig, sensor: SensorRig, images: _Images, raw: RawImage
) -> dict[str, Any]:
    """Return the Monte-Carlo error of this very picture in units of the sensor's own noise, over tiles."""
    places = images.plan.channels.get(sensor.name)
    if places is None:
        return {}
    weights = images.light.weights(dict(frame.group_weights))
    longest = raw.exposure_time_s
    target = SensorNoise(rig, ((replace(sensor, exposure=FixedExposure(longest)), places),), lambda *_: longest)
    errors = tile_errors(images.light.replicas, [(weights, target)])
    return {"noise_ratio_rms": errors.rms, "noise_ratio_max": float(errors.ratio.max())}


def _shutter_document(raw: RawImage) -> dict[str, Any]:
    """Return when the rows were exposed: row r starts at r times the line time after the first, of each capture.

    The scene and the labels are those of `scene_time_s`, the middle of the middle row's exposure.
    """
    middle_s = raw.row_middle_s
    return {
        "kind": "rolling" if raw.line_time_s > 0 else "global",
        "line_time_s": raw.line_time_s,
        "first_row_start_s": float(raw.row_start_s[0]),
        "last_row_start_s": float(raw.row_start_s[-1]),
        "first_row_middle_s": float(middle_s[0]),
        "last_row_middle_s": float(middle_s[-1]),
        "scene_time_s": float(middle_s[0] + middle_s[-1]) / 2,
    }


def _lens_document(camera: Camera) -> dict[str, Any]:
    lens = camera.lens
    return {
        "kind": lens.kind,
        "focal_length_m": lens.focal_length_m,
        "f_number": lens.f_number,
        "focus_distance_m": lens.focus_distance_m if np.isfinite(lens.focus_distance_m) else "inf",
        "image_distance_m": lens.image_distance_m,
    }


def _label_products(  # noqa: PLR0917 - what is seen, from where, where to
    run: _Run, labels: Labels, view: Camera, motion: Motion, folder: str, encoded: dict[str, bytes]
) -> None:
    def add(name: str, encoder: Callable[[], bytes], *, of_labels_alone: bool = True) -> None:
        def once() -> bytes:
            if name not in encoded:
                encoded[name] = encoder()
            return encoded[name]

        _add(run, f"{folder}{name}", once if of_labels_alone else encoder)

    add("depth.exr", lambda: encode.encode_depth_exr(labels.depth_z_m, labels.depth_range_m))
    add("coverage.png", lambda: encode.encode_coverage_png(labels.coverage))
    add("normals.exr", lambda: encode.encode_normals_exr(labels.normals_camera))
    add("flow.exr", lambda: encode.encode_flow_exr(_flow(run.frame, labels, view, motion)), of_labels_alone=False)
    add("instances.png", lambda: encode.encode_ids_png(labels.instances))
    add("semantic.png", lambda: encode.encode_ids_png(labels.semantic.astype(np.uint32)))
    driving, motions = run.frame.driving, run.frame.motions
    told = motions if motions or driving is not None else None
    add(
        "labels.json",
        lambda: encode.encode_json(labels_document(labels, view.intrinsics_px, view.camera_to_world, told)),
        of_labels_alone=told is None,
    )
    if driving is not None:
        _add(run, f"{folder}driving.json", lambda: encode.encode_json(driving_document(labels, view, driving)))


_SKIES = (ConstantEnvironment, ImageEnvironment, SunSky)


def _flow(frame: FrameDescription, labels: Labels, view: Camera, motion: Motion) -> encode.FlowImage:
    flow = optical_flow(
        labels,
        view,
        frame.motions,
        interval_s=frame.flow_interval_s,
        camera_motion=motion,
        has_sky=any(isinstance(light, _SKIES) for light in frame.scene.lights),
    )
    return encode.FlowImage(flow, frame.flow_interval_s)


def _manifest(run: _Run, digest: str, products: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the manifest. Everything but `run` is the same whenever and wherever the frame is made."""
    frame = run.frame
    licences = sorted({licence for item in frame.scene.objects for licence in item.licences})
    return {
        "schema": MANIFEST_SCHEMA,
        "frame_digest": digest,
        "recipe_name": frame.recipe_name,
        "recipe": encode.decode_json(frame.recipe_json.encode()),
        "index": frame.index,
        "count": frame.count,
        "seed": frame.seed,
        "varied": [{"path": path, "value": value} for path, value in frame.varied],
        "wavelengths_nm": {"first": frame.grid.first_nm, "last": frame.grid.last_nm, "step": frame.grid.step_nm},
        "plan": plan_document(run.plan),
        "cameras": run.cameras,
        "instances": [{"id": name, "instance": number} for name, number in run.instance_table],
        "classes": [{"id": number + 1, "name": name} for number, name in enumerate(frame.scene.semantic_classes)],
        "licences": licences,
        "warnings": list(frame.warnings),
        "products": products,
        "versions": {name: importlib.metadata.version(name) for name in _VERSIONED},
        "run": {
            "started_unix_s": round(run.started, 3),
            "seconds": round(time.time() - run.started, 3),
            "cpu_s": round(time.process_time() - run.cpu_started, 3),
            "stages": run.stages,
            "cache": run.cached,
            "notes": run.notes,
        },
    }
