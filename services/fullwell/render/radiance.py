"""Spectral radiance in absolute units: equal samples for every pixel, the same bytes for any number of threads."""

from __future__ import annotations

from collections.abc import Callable

from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.render.adaptive import SamplingGoal
from fullwell.render.light import LightRequest, RenderStatistics, render_light
from fullwell.scene import Camera, SceneDescription

__all__ = ["render_radiance"]


def render_radiance(
    scene: SceneDescription,
    camera: Camera,
    grid: WavelengthGrid,
    *,
    samples_per_pixel: int,
    max_depth: int,
    seed: int,
    progress: Callable[[float], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> tuple[RadianceImage, RenderStatistics]:
    """Return the spectral photon radiance that reaches the camera's film samples, and what it took.

    Parameters
    ----------
    samples_per_pixel
        Camera rays per film sample; rounded up to a multiple of the number of replicas.
    max_depth
        Segments of the longest path: 1 shows emitters only, 2 adds direct light, and so on.
    seed
        The same seed gives the same bytes, for any number of threads.
    progress, should_cancel
        Called between launches, with the finished fraction in [0, 1].

    Returns
    -------
    The image in photons s^-1 m^-2 sr^-1 nm^-1 (lens effects other than depth of field left out) and its statistics. Its
    standard error is that of all photons together.

    Raises
    ------
    FieldError
        The camera or a part of the scene cannot be rendered; the message names it.
    RenderError
        The renderer refused the scene or produced too many invalid samples.
    CancelledError
        `should_cancel` returned true.
    """
    request = LightRequest(
        grid=grid,
        responses=(Spectrum.constant(1.0),),
        max_depth=max_depth,
        goal=SamplingGoal(noise_ratio=None, samples_per_pixel=samples_per_pixel),
        seed=seed,
    )
    light = render_light(scene, camera, request, progress=progress, should_cancel=should_cancel)
    return light.radiance({}), light.statistics
