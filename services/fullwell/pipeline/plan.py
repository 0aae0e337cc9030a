"""What a frame needs, decided before anything runs: which stages, which are skipped, why, and at what cost in accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fullwell.optics import MAX_SKIPPED_CONTRAST_LOSS, nyquist_contrast_loss, working_f_number
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.pipeline.motion import rigs_by_exposure
from fullwell.pipeline.steps import PlanStep
from fullwell.schema.frame import CameraRig, FrameDescription

__all__ = ["FramePlan", "LitRig", "PlanStep", "plan_document", "plan_frame"]

_DISPLAY = frozenset({"image.png"})
_SENSOR = _DISPLAY | {"raw.npz", "raw.tiff", "raw.dng"}
_OPTICAL = _SENSOR | {"irradiance.exr"}
_RADIANCE = _OPTICAL | {"radiance.exr"}
_LABELS = frozenset(
    {
        "depth.exr",
        "normals.exr",
        "flow.exr",
        "instances.png",
        "semantic.png",
        "coverage.png",
        "labels.json",
        "driving.json",
    }
)


@dataclass(frozen=True, slots=True)
class LitRig:
    """What is rendered for the camera at `position`: for all sensors of it that see the same light."""

    position: int
    rig: CameraRig
    plan: LightPlan


@dataclass(frozen=True, slots=True)
class FramePlan:
    """The decisions of a frame, and the switches that the runner follows."""

    steps: tuple[PlanStep, ...]
    radiance: bool
    optics: bool
    sensor: bool
    display: bool
    labels: bool
    lights: tuple[LitRig, ...] = ()
    """What is rendered, camera by camera; empty where nothing is."""
    skips: bool = True
    """Whether the optics may leave out what they can bound."""


def plan_frame(frame: FrameDescription, *, skip: bool = True) -> FramePlan:
    """Return the plan of a frame from its description alone; nothing is rendered. With `skip` false nothing is left out."""
    wanted = frozenset(frame.outputs)
    stages = {
        "radiance": _RADIANCE,
        "optics": _OPTICAL,
        "sensor": _SENSOR,
        "display": _DISPLAY,
        "labels": _LABELS,
    }
    switches = {name: bool(wanted & products) for name, products in stages.items()}
    steps = [] if skip else [PlanStep("skips", "run", "asked for: nothing is left out that an output depends on")]
    for name, products in stages.items():
        needed = sorted(wanted & products)
        if needed:
            steps.append(PlanStep(name, "run", f"for {', '.join(needed)}"))
        else:
            steps.append(PlanStep(name, "skip", "no output asks for it"))
    lights: list[LitRig] = []
    for position, rig in enumerate(frame.cameras):
        if switches["radiance"]:
            for part in rigs_by_exposure(frame, rig, skip=skip):
                lights.append(LitRig(position, part, plan_light(frame, part, position, skip=skip)))
                steps.extend(lights[-1].plan.steps)
        steps.extend(_camera_steps(frame, rig, switches["radiance"], switches["optics"], skip=skip))
    return FramePlan(steps=tuple(steps), lights=tuple(lights), skips=skip, **switches)


def _camera_steps(frame: FrameDescription, rig: CameraRig, radiance: bool, optics: bool, *, skip: bool) -> list[PlanStep]:
    camera = rig.camera
    steps = []
    if radiance:
        if rig.depth_layers:
            what = f"{camera.name}: depth of field"
            steps.append(PlanStep(what, "run", f"layers by depth at f/{camera.lens.f_number:g}", "half a pixel of blur"))
        elif camera.lens.kind == "pinhole":
            steps.append(PlanStep(f"{camera.name}: depth of field", "skip", "the lens is a pinhole"))
        else:
            steps.append(PlanStep(f"{camera.name}: depth of field", "run", f"thin lens at f/{camera.lens.f_number:g}"))
    if rig.model == "isetcam":
        steps.append(
            PlanStep(f"{camera.name}: camera model", "run", "isetcam, as the recipe asks", "docs/validation/isetcam.md")
        )
    elif optics:
        steps.extend(_blur_steps(rig))
        steps.append(_diffraction_step(frame, rig, MAX_SKIPPED_CONTRAST_LOSS if skip else 0.0))
    return steps


def _diffraction_step(frame: FrameDescription, rig: CameraRig, max_loss: float) -> PlanStep:
    """Say in which bands diffraction takes part; it is left out where the film is too coarse to show it."""
    what, lens = f"{rig.camera.name}: diffraction", rig.camera.lens
    if not lens.diffraction:
        return PlanStep(what, "skip", "the recipe turns it off", "not bounded: asked for")
    if any(part is not None for part in (rig.optics.psf, rig.optics.wavefront, rig.optics.aperture)):
        return PlanStep(what, "run", "as part of the lens's point image")
    f_number = working_f_number(lens.f_number, lens.magnification)
    losses = [
        nyquist_contrast_loss(wavelength_nm=float(nm), f_number=f_number, pitch_m=rig.camera.film.pitch_m)
        for nm in frame.grid.centres_nm
    ]
    skipped = [loss for loss in losses if loss <= max_loss]
    bound = f"contrast at Nyquist too high by at most {max(skipped):.2g}" if skipped else "none"
    if len(skipped) == len(losses):
        return PlanStep(what, "skip", "the samples are too coarse to show it", bound)
    return PlanStep(what, "run", f"in {len(losses) - len(skipped)} of {len(losses)} bands, where the samples show it", bound)


def _blur_steps(rig: CameraRig) -> list[PlanStep]:
    """Say which effects of a real lens take part."""
    asked = {
        "aberrations": ("a wavefront", rig.optics.wavefront),
        "flare": ("an aperture", rig.optics.aperture),
        "point image": ("a psf", rig.optics.psf),
    }
    steps = []
    for what, (field_name, value) in asked.items():
        if value is None:
            steps.append(PlanStep(f"{rig.camera.name}: {what}", "skip", f"the lens has no {field_name.split()[1]}"))
        else:
            steps.append(PlanStep(f"{rig.camera.name}: {what}", "run", f"the lens has {field_name}"))
    return steps


def plan_document(plan: FramePlan) -> list[dict[str, Any]]:
    """Return the plan's decisions as plain data for manifests."""
    return [
        {"what": s.what, "decision": s.decision, "why": s.why, "error_bound": s.error_bound, "cost": s.cost} for s in plan.steps
    ]
