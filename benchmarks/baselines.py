"""Baselines: the renderer's own path integrator with 31 bands, and this project's engine as it stands.

Run: python -m benchmarks.baselines [--scene NAME] [--size 160x120] [--samples 16] [--repeats 3] [--json FILE]
"""

from __future__ import annotations

import argparse
import gc
import json
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.engines import Budget, Engine, Result, Stopwatch
from benchmarks.scenes import SCENES, build_frame
from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.rng import seed32
from fullwell.radiometry import WavelengthGrid
from fullwell.render import activate, render_radiance
from fullwell.render.translate import translate
from fullwell.scene import Camera
from fullwell.schema.frame import FrameDescription

__all__ = ["MitsubaPath", "PresentEngine", "band_sensor"]

_PHOTONS_PER_J_NM = 1.0 / (PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M)
_MAX_LANES = 1 << 23
"""Camera rays per call: above about 1e9 the renderer dies without a word, and memory grows with them long before."""


def band_sensor(mi: Any, camera: Camera, grid: WavelengthGrid, *, samples: int, sampler: str = "multijitter") -> Any:
    """Return the renderer's own camera with a film of one response per band, lambda / (h c) / width: photons per nanometre."""
    film: dict[str, Any] = {
        "type": "specfilm",
        "width": camera.film.cols,
        "height": camera.film.rows,
        "rfilter": {"type": "box"},
    }
    edges = grid.edges_nm
    for band in range(grid.count):
        low, high = float(edges[band]), float(edges[band + 1])
        values = ", ".join(repr(nm * _PHOTONS_PER_J_NM / grid.step_nm) for nm in (low, high))
        film[f"band{band:04d}"] = {"type": "regular", "wavelength_min": low, "wavelength_max": high, "values": values}
    pose = camera.camera_to_world.copy()
    pose[:3, 3] = 0.0  # the scene is centred on the camera
    pose[:3, :2] *= -1.0  # the renderer's camera looks along +z with x to the left and y up
    described: dict[str, Any] = {
        "type": "perspective" if camera.lens.kind == "pinhole" else "thinlens",
        "fov": float(np.degrees(2 * np.arctan(camera.film.cols * camera.tangent_pitch / 2))),
        "fov_axis": "x",
        "near_clip": 1e-4,
        "far_clip": 1e6,
        "to_world": mi.ScalarTransform4f(pose),
        "film": film,
        "sampler": {"type": sampler, "sample_count": samples},
    }
    if camera.lens.kind == "thin_lens":
        described["aperture_radius"] = 0.5 * camera.lens.pupil_diameter_m
        described["focus_distance"] = float(min(camera.lens.focus_distance_m, 1e6))
    return mi.load_dict(described)


@dataclass(eq=False)
class MitsubaPath:
    """Mitsuba's `path` through its `specfilm`, compiled by LLVM where that works."""

    sampler: str = "multijitter"
    pass_samples: int = 64
    """Most samples per pixel of one call; more are rendered in calls with new seeds, whose means are averaged."""
    _frame: FrameDescription | None = None
    _scene: Any = None
    _load_cpu_s: float = 0.0

    @property
    def name(self) -> str:
        """Name and version."""
        mi = activate()
        return f"mitsuba-{mi.__version__} {mi.variant()} path {self.sampler}"

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return the bands of the frame's first camera. Loading counts as set-up; kernels that are not cached do not."""
        import drjit as dr  # noqa: PLC0415 - loaded with the renderer

        mi = activate()
        self._load(mi, frame)
        rig, depth = frame.cameras[0], budget.max_depth or frame.quality.max_depth
        film = rig.camera.film
        most = max(1, min(self.pass_samples, _MAX_LANES // (film.rows * film.cols)))
        calls = -(-budget.samples_per_pixel // most)
        watch = Stopwatch()
        sensor = band_sensor(mi, rig.camera, frame.grid, samples=-(-budget.samples_per_pixel // calls), sampler=self.sampler)
        integrator = mi.load_dict({"type": "path", "max_depth": depth})
        total = np.zeros((film.rows, film.cols, frame.grid.count))
        for number in range(calls):
            rendered = mi.render(self._scene, sensor=sensor, integrator=integrator, seed=seed32(budget.seed, "mitsuba", number))
            total += np.nan_to_num(np.array(rendered, dtype=np.float64), nan=0.0, posinf=0.0, neginf=0.0)
        dr.sync_thread()
        cpu_s, wall_s = watch.read()
        samples = calls * int(sensor.sampler().sample_count())
        return Result("bands", (total / calls).astype(np.float32), cpu_s, wall_s, samples, self._load_cpu_s)

    def _load(self, mi: Any, frame: FrameDescription) -> None:
        if self._frame is frame:
            return
        self._frame = self._scene = None
        gc.collect()
        watch = Stopwatch()
        self._scene = translate(mi, frame.scene, frame.cameras[0].camera.camera_to_world[:3, 3]).scene
        self._frame, self._load_cpu_s = frame, watch.read()[0]


@dataclass(frozen=True)
class PresentEngine:
    """`fullwell.render.render_radiance`."""

    @property
    def name(self) -> str:
        """Name and version."""
        return f"fullwell render_radiance {activate().variant()}"

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return the bands of the first camera; loading is in the time unless the scene is that of the last call."""
        image, told = render_radiance(
            frame.scene,
            frame.cameras[0].camera,
            frame.grid,
            samples_per_pixel=budget.samples_per_pixel,
            max_depth=budget.max_depth or frame.quality.max_depth,
            seed=budget.seed,
        )
        return Result("bands", image.photons, told.cpu_s, told.wall_s, told.samples_per_pixel)


# Command -------------------------------------------------------------------------------------------------------------


def measure(engine: Engine, frame: FrameDescription, samples: int, repeats: int) -> dict[str, Any]:
    """Return the CPU-seconds of the first call (loading, kernels not cached) and the median of `repeats` later ones."""
    watch = Stopwatch()
    first = engine.render(frame, Budget(samples, seed=0))
    cold_s = watch.read()[0]
    later = [engine.render(frame, Budget(samples, seed=1 + number)) for number in range(repeats)]
    warm_s = statistics.median(result.cpu_s for result in later)
    film = frame.cameras[0].camera.film
    rays = first.samples * film.rows * film.cols
    return {
        "engine": engine.name,
        "samples": first.samples,
        "first_call_cpu_s": round(cold_s, 3),
        "load_cpu_s": round(first.setup_cpu_s, 3),
        "warm_cpu_s": round(warm_s, 3),
        "warm_wall_s": round(statistics.median(result.wall_s for result in later), 3),
        "mega_rays_per_cpu_s": round(rays / warm_s / 1e6, 3),
        "mean": float(np.mean([result.image.mean(dtype=np.float64) for result in later])),
    }


def main() -> None:
    """Measure both engines on the scenes asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=sorted(SCENES), action="append")
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    cols, rows = (int(text) for text in arguments.size.split("x"))
    rows_of: list[dict[str, Any]] = []
    for scene in arguments.scene or SCENES:
        with tempfile.TemporaryDirectory() as folder:
            frame = build_frame(scene, Path(folder), size=(cols, rows))
        for engine in (MitsubaPath(), PresentEngine()):
            told = {"scene": scene, "size": arguments.size, **measure(engine, frame, arguments.samples, arguments.repeats)}
            rows_of.append(told)
            print(json.dumps(told), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows_of, indent=2) + "\n")


if __name__ == "__main__":
    main()
