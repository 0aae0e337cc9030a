"""The same image from the renderer's own integrator, for machines without a usable LLVM: slower, and noisier within bands."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.errors import FieldError, RenderError
from fullwell.core.rng import seed32
from fullwell.radiometry import WavelengthGrid
from fullwell.render.translate import check_sky_range, translate
from fullwell.render.transport.progressive import REPLICAS, Work, check_samples
from fullwell.scene import Camera, SceneDescription, Translucent
from fullwell.scene.groups import group_names, only_groups

__all__ = ["ScalarImage"]

_PHOTONS_PER_J_NM = 1.0 / (PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M)


class ScalarImage:
    """Sums of samples so far, all over the image: lists of pixels are not followed, every pixel gets the most samples asked."""

    def __init__(self, mi: Any, work: Work) -> None:
        if work.scene.fog is not None:
            raise FieldError("fog needs the compiled renderer; leave it out or install libLLVM.", path="atmosphere")
        if any(isinstance(part.material, Translucent) for thing in work.scene.objects for part in thing.parts):
            raise RenderError("translucent materials need the compiled renderer; use diffuse ones or install libLLVM.")
        check_sky_range(work.scene, work.grid)
        self._mi, self._work = mi, work
        names = group_names(work.scene)
        self.groups: tuple[str, ...] = names if work.keep_groups else ("all",)
        self._scenes = [only_groups(work.scene, frozenset({name})) for name in names] if work.keep_groups else [work.scene]
        self.rows, self.cols = work.camera.film.rows, work.camera.film.cols
        self.counts = np.zeros(self.rows * self.cols, dtype=np.int64)
        self._rounds = 0
        bands = work.grid.count
        self._responses = (
            np.stack([response.band_average(work.grid) * work.grid.step_nm for response in work.responses], axis=1)
            if work.responses
            else np.zeros((bands, 0))
        )
        self._sums = np.zeros((REPLICAS, len(self.groups), len(work.responses), self.rows * self.cols))
        self._band_sums = np.zeros((len(self.groups), self.rows * self.cols, bands))
        self.bad_samples = 0
        self.segments = 0
        self.cpu_s = 0.0
        self.clamped_fraction = 0.0

    @property
    def samples(self) -> int:
        """Number of paths traced so far."""
        return REPLICAS * int(self.counts.sum())

    def add(self, pixels: NDArray[np.int64], counts: NDArray[np.int64], report: Callable[[float], None]) -> None:
        """Take more samples in each replica, everywhere."""
        del pixels
        started = time.process_time()
        count = int(counts.max(initial=0))
        taken = count
        for replica in range(REPLICAS):
            for number, scene in enumerate(self._scenes):
                image, taken = self._rendered(scene, count, seed32(self._work.seed, "scalar", self._rounds, replica, number))
                self._sums[replica, number] += (image @ self._responses).T * taken
                self._band_sums[number] += image * taken
                report((replica + (number + 1) / len(self._scenes)) / REPLICAS)
        self.counts += taken
        self._rounds += 1
        self.cpu_s += time.process_time() - started

    def _rendered(self, scene: SceneDescription, count: int, seed: int) -> tuple[NDArray[np.float64], int]:
        """Return (pixels, bands) means of `count` samples or a few more, and how many there were."""
        work = self._work
        translated = translate(self._mi, scene, work.camera.camera_to_world[:3, 3])
        sensor = self._mi.load_dict(_sensor(self._mi, work.camera, work.grid, count))
        integrator = self._mi.load_dict({"type": "path", "max_depth": work.max_depth})
        rendered = self._mi.render(translated.scene, sensor=sensor, integrator=integrator, seed=seed)
        image = np.array(rendered, dtype=np.float64).reshape(-1, work.grid.count)
        good = np.isfinite(image) & (image >= 0)
        self.bad_samples += int(image.size - np.count_nonzero(good))
        return np.where(good, image, 0.0), int(sensor.sampler().sample_count())

    def restart(self, clamp: NDArray[np.float64]) -> None:
        """Refuse: the renderer's own film has no clamp."""
        del clamp
        raise RenderError("samples cannot be clamped without LLVM; leave quality.max_sample_saturation out or install it.")

    def replicas(self) -> NDArray[np.float32]:
        """Return the replicas' means, (replicas, groups, channels, rows, cols) [e- s^-1 m^-2 sr^-1]."""
        means = self._sums / np.maximum(self.counts, 1)
        return means.reshape(*means.shape[:3], self.rows, self.cols).astype(np.float32)

    def bands(self) -> NDArray[np.float32] | None:
        """Return the band means, (groups, rows, cols, bands) [photons s^-1 m^-2 sr^-1 nm^-1]; None where not kept."""
        if not self._work.keep_bands:
            return None
        means = self._band_sums / (REPLICAS * np.maximum(self.counts, 1)[None, :, None])
        return np.asarray(means.reshape(len(self.groups), self.rows, self.cols, -1), dtype=np.float32)

    def check(self) -> None:
        """Raise RenderError where too many samples were no numbers, or where the light exceeds single precision."""
        check_samples(self.bad_samples, self.samples, (self._sums, self._band_sums), int(self.counts.max()))


def _sensor(mi: Any, camera: Camera, grid: WavelengthGrid, samples: int) -> dict[str, Any]:
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
