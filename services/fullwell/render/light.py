"""Light through a camera's pupil: what sensors would count and what spectra they would see, from one rendering."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, FullwellError, RenderError
from fullwell.core.hashing import Unchanging
from fullwell.core.rng import seed32
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.render.adaptive import NoiseTarget, SamplingGoal, SamplingOutcome, sample_until
from fullwell.render.exposure_moments import MotionRequest, cut_exposure
from fullwell.render.scalar import ScalarImage
from fullwell.render.transport.moments import Moments
from fullwell.render.transport.progressive import REPLICAS, ProgressiveImage, Reporter, Stage, Work
from fullwell.render.variant import activate
from fullwell.scene import Camera, SceneDescription
from fullwell.scene.validate import check_camera

__all__ = ["LightRequest", "RenderStatistics", "RenderedLight", "render_light"]


@dataclass(frozen=True, slots=True)
class RenderStatistics:
    """What the rendering did.

    Attributes
    ----------
    samples_per_pixel, samples_min, samples_max
        Camera rays per film sample: mean, fewest, most.
    passes
        Rounds of sampling.
    bad_samples, segments
        Samples that were no numbers and count as black; rays between two surfaces that were traced.
    clamped_fraction
        Share of the channels' light that a clamp of single samples took away; 0 without one.
    moments, moment_step_px, exposure_time_s
        Moments that the exposure was cut into, 1 where nothing moved; how far anything moves in one, at most [px],
        -1 where that is not known; and the exposure time of a row that the motion was rendered for [s], 0 without motion.
    wall_s, cpu_s
        Time, all threads' for `cpu_s`.
    variant
        Of the renderer.
    noise_ratio_rms, noise_ratio_max
        Predicted standard error over the sensor's noise, over tiles: root mean square, worst; 0 without a target.
    tiles, unmet_tiles, stopped_by
        Tiles of 8 x 8 film samples, those above the target, and what ended the sampling: "target", "samples" or "time".
    """

    samples_per_pixel: float
    passes: int
    bad_samples: int
    wall_s: float
    cpu_s: float
    variant: str
    samples_min: int = 0
    samples_max: int = 0
    segments: int = 0
    noise_ratio_rms: float = 0.0
    noise_ratio_max: float = 0.0
    tiles: int = 0
    unmet_tiles: int = 0
    stopped_by: str = "samples"
    clamped_fraction: float = 0.0
    moments: int = 1
    moment_step_px: float = 0.0
    exposure_time_s: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class LightRequest:
    """What is wanted of a scene and a camera.

    Attributes
    ----------
    grid
        Bands of the spectra; also the range outside which no light counts.
    responses
        Electrons per photon of each channel that is kept directly, filters and the lens's transmittance included.
    keep_bands, keep_groups
        Whether spectral bands are kept too, and whether each light group has its own image.
    group_importance
        Factor by which the lamps of a group are sampled more often, by name; 1 for those left out.
    max_depth
        Segments of the longest path: 1 shows emitters only, 2 adds direct light, and so on.
    goal, targets
        When to stop, and what noise the sensors have: (weights of light groups by name, noise) for each way in which they look
        at the light; groups left out have weight 1. Without any, every pixel gets equal samples.
    seed
        The same seed gives the same bytes, for any number of threads.
    motion
        What moves while the film is exposed; None: nothing.
    """

    grid: WavelengthGrid
    responses: tuple[Spectrum, ...] = ()
    keep_bands: bool = True
    keep_groups: bool = False
    group_importance: tuple[tuple[str, float], ...] = ()
    max_depth: int = 8
    goal: SamplingGoal = field(default_factory=SamplingGoal)
    targets: tuple[tuple[tuple[tuple[str, float], ...], NoiseTarget], ...] = ()
    seed: int = 0
    motion: MotionRequest | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RenderedLight(Unchanging):
    """Light per solid angle of the pupil, as it reaches the film samples; lens effects but depth of field left out.

    Attributes
    ----------
    replicas
        (replicas, groups, channels, rows, cols) float32 [e- s^-1 m^-2 sr^-1]: independent estimates of what the channels
        would count.
    bands
        (groups, rows, cols, bands) float32 [photons s^-1 m^-2 sr^-1 nm^-1], or None.
    groups
        Names of the light groups, or ("all",).
    grid, tangent_pitch
        As in `RadianceImage`.
    statistics
        What it took.
    """

    replicas: NDArray[np.float32]
    bands: NDArray[np.float32] | None
    groups: tuple[str, ...]
    grid: WavelengthGrid
    tangent_pitch: float
    statistics: RenderStatistics

    def weights(self, by_name: Mapping[str, float]) -> NDArray[np.float64]:
        """Return (groups,) factors; 1 for groups that are not named."""
        return _weights(self.groups, by_name)

    def channels(self, by_name: Mapping[str, float]) -> NDArray[np.float64]:
        """Return (channels, rows, cols) [e- s^-1 m^-2 sr^-1] with the groups weighted."""
        mean = self.replicas.mean(axis=0, dtype=np.float64)
        return np.asarray(np.tensordot(self.weights(by_name), mean, axes=(0, 0)))

    def channel_error(self, by_name: Mapping[str, float]) -> NDArray[np.float64]:
        """Return (channels, rows, cols) standard errors of `channels`, each from few estimates: average them before use."""
        return _standard_error(weighted_groups(self.replicas, self.weights(by_name)))

    def radiance(self, by_name: Mapping[str, float]) -> RadianceImage:
        """Return the spectral image with the groups weighted. Raises RenderError where no bands were kept."""
        if self.bands is None:
            raise RenderError("the light was rendered without spectral bands; ask for them.")
        weights = self.weights(by_name)
        photons = self.bands[0] if len(self.groups) == 1 and weights[0] == 1.0 else None
        if photons is None:
            photons = np.tensordot(weights, self.bands, axes=(0, 0)).astype(np.float32)
        return RadianceImage(
            photons=photons, grid=self.grid, tangent_pitch=self.tangent_pitch, standard_error=self._relative_error(by_name)
        )

    def _relative_error(self, by_name: Mapping[str, float]) -> NDArray[np.float32] | None:
        """Return the (rows, cols) relative standard error of the channels' sum."""
        if self.replicas.shape[2] == 0:
            return None
        light = weighted_groups(self.replicas, self.weights(by_name)).sum(axis=1, dtype=np.float64)
        error, mean = _standard_error(light), light.mean(axis=0)
        relative = np.divide(error, mean, out=np.zeros_like(error), where=mean > 0)
        return np.asarray(relative, dtype=np.float32)


def render_light(
    scene: SceneDescription,
    camera: Camera,
    request: LightRequest,
    *,
    progress: Callable[[float], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> RenderedLight:
    """Render what `request` asks for.

    `progress` and `should_cancel` are called between launches, with the finished fraction in [0, 1].

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
    work = Work(
        scene=scene,
        camera=camera,
        grid=request.grid,
        responses=request.responses,
        keep_bands=request.keep_bands,
        keep_groups=request.keep_groups,
        max_depth=request.max_depth,
        seed=request.seed,
        group_importance=request.group_importance,
    )
    report = Reporter(progress, should_cancel)
    try:
        image: ProgressiveImage | ScalarImage
        motion = _Exposure()
        if request.motion is not None:
            stage = _stage(mi, work, request.motion)
            motion = _exposed(mi, work, stage, request.motion, report)
            image = ProgressiveImage(mi, replace(work, moments=motion.moments), stage)
        else:
            image = ProgressiveImage(mi, work) if mi.variant().startswith("llvm") else ScalarImage(mi, work)
        views = [(_weights(image.groups, dict(by_name)), target) for by_name, target in request.targets]
        outcome = sample_until(image, request.goal, views, report=report, replicas=REPLICAS)
        image.check()
        light = RenderedLight(
            replicas=image.replicas(),
            bands=image.bands(),
            groups=image.groups,
            grid=request.grid,
            tangent_pitch=camera.tangent_pitch,
            statistics=replace(
                _statistics(image, outcome, started, cpu_started, str(mi.variant())),
                moments=1 if motion.moments is None else motion.moments.count,
                moment_step_px=motion.step_px,
                exposure_time_s=motion.time_s,
            ),
        )
    except FullwellError:
        raise
    except Exception as error:
        raise RenderError(f"the renderer failed: {_cause(error)}") from error
    return light


def weighted_groups(replicas: NDArray[np.floating], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (replicas, channels, rows, cols) sums over the groups of (replicas, groups, channels, rows, cols), weighted.

    Group by group: a dot product over the second axis would copy everything twice before it begins.
    """
    total = replicas[:, 0] * weights[0]
    for group in range(1, len(weights)):
        if weights[group]:
            total += replicas[:, group] * weights[group]
    return np.asarray(total, dtype=np.float64)


def _standard_error(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard error of the mean over the first axis."""
    away = light - light.mean(axis=0)
    away *= away
    return np.asarray(np.sqrt(away.sum(axis=0) / (len(light) * (len(light) - 1))))


@dataclass(frozen=True, slots=True, eq=False)
class _Exposure:
    """Moments (None: nothing moves far enough), shift in each, and exposure time."""

    moments: Moments | None = None
    step_px: float = 0.0
    time_s: float = 0.0


_METERING_SAMPLES = 4
"""Of each replica, in the picture of the scene standing still that an automatic exposure is found from."""

_METERED_PIXELS, _LARGEST_BLOCK = 16384, 8
"""Film samples that are enough for its percentiles, and how many along each side of a block one of them stands for at most."""


def _stage(mi: Any, work: Work, request: MotionRequest) -> Stage:
    """Load what stands still."""
    if not str(mi.variant()).startswith("llvm"):
        sentence = (
            "motion needs the compiled renderer; set quality.motion_blur_px to more than anything moves, or install libLLVM."
        )
        raise FieldError(sentence, path="quality.motion_blur_px")
    moving = frozenset(item.id for item in work.scene.objects if item.id in request.motions)
    return Stage(mi, work.scene, work.camera, moving)


def _exposed(mi: Any, work: Work, stage: Stage, request: MotionRequest, report: Reporter) -> _Exposure:
    """Find the exposure time where it is automatic, and cut it into moments."""
    time_s = request.exposure_time_s
    if callable(time_s):
        report(0.0)
        still = ProgressiveImage(mi, replace(work, keep_bands=False, seed=seed32(work.seed, "metering")), stage)
        mean = _metered(still, report)
        time_s = time_s(np.tensordot(_weights(still.groups, request.group_weights), mean, axes=(0, 0)))
    moments = cut_exposure(work.scene, work.camera, request, time_s)
    if moments is None:
        return _Exposure(time_s=time_s)
    step_px = request.shift_px(time_s + request.readout_s) / moments.count
    return _Exposure(moments, step_px if np.isfinite(step_px) else -1.0, time_s)


def _metered(image: ProgressiveImage, report: Reporter) -> NDArray[np.float64]:
    """Return (groups, channels, rows, cols) of few samples; of a large picture one film sample stands for a block."""
    block = max(1, min(_LARGEST_BLOCK, math.isqrt(image.pixels // _METERED_PIXELS)))
    chosen = np.arange(image.pixels).reshape(image.rows, image.cols)[block // 2 :: block, block // 2 :: block]
    image.add(chosen.ravel(), np.full(chosen.size, _METERING_SAMPLES), lambda _: report(0.0))
    means = image.replicas().mean(axis=0, dtype=np.float64)
    row, col = (
        np.minimum(np.arange(size) // block, count - 1) for size, count in zip(means.shape[2:], chosen.shape, strict=True)
    )
    return np.asarray(means.reshape(*means.shape[:2], -1)[..., chosen[np.ix_(row, col)]])


def _weights(groups: tuple[str, ...], by_name: Mapping[str, float]) -> NDArray[np.float64]:
    return np.array([float(by_name.get(name, 1.0)) for name in groups])


def _cause(error: BaseException) -> BaseException:
    """Return the innermost cause: Dr.Jit wraps what happens inside its loops."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error


def _statistics(
    image: ProgressiveImage | ScalarImage, outcome: SamplingOutcome, started: float, cpu_started: float, variant: str
) -> RenderStatistics:
    return RenderStatistics(
        samples_per_pixel=float(outcome.samples.mean()),
        passes=outcome.rounds,
        bad_samples=image.bad_samples,
        wall_s=time.perf_counter() - started,
        cpu_s=time.process_time() - cpu_started,
        variant=variant,
        samples_min=int(outcome.samples.min()),
        samples_max=int(outcome.samples.max()),
        segments=image.segments,
        noise_ratio_rms=outcome.rms_ratio,
        noise_ratio_max=float(outcome.ratio.max(initial=0.0)),
        tiles=outcome.tiles,
        unmet_tiles=outcome.unmet_tiles,
        stopped_by=outcome.stopped_by,
        clamped_fraction=image.clamped_fraction,
    )
