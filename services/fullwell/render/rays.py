"""Camera rays: the one place where a film position becomes a ray, for the image and for the labels alike."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.scene import Camera

__all__ = ["CameraRays"]


class CameraRays:
    """Rays of one camera in the active renderer's arrays, in world axes about the point `centre_m`.

    That point is the centre of the entrance pupil, unless it is given: a camera that moves shares it at all times.
    Film positions run from (0, 0) at the top-left corner [px]; pixel centres are at +0.5. All numbers of the camera go to
    the kernels as data: written into their code, another camera would compile another kernel.
    """

    def __init__(self, mi: Any, camera: Camera, centre_m: NDArray[np.float64] | None = None) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self.kind = camera.lens.kind
        """What the code of the rays depends on."""
        self._pinhole = camera.lens.kind == "pinhole"
        self._pitch = self._data(camera.tangent_pitch)
        self._centre_x, self._centre_y = self._data(camera.film.cols / 2), self._data(camera.film.rows / 2)
        self._pupil_radius_m = self._data(0.5 * camera.lens.pupil_diameter_m)
        self._nearness = self._data(1.0 / camera.lens.focus_distance_m)
        self._rotation = [[self._data(v) for v in row] for row in camera.camera_to_world[:3, :3]]
        place = np.zeros(3) if centre_m is None else camera.camera_to_world[:3, 3] - centre_m
        self._place = mi.Point3f(*(self._data(v) for v in place))

    def _data(self, value: float) -> Any:
        return self._dr.opaque(self._mi.Float, float(value))

    def _tangents(self, x_px: Any, y_px: Any) -> tuple[Any, Any]:
        return (x_px - self._centre_x) * self._pitch, (y_px - self._centre_y) * self._pitch

    def _to_world(self, x: Any, y: Any, z: Any) -> Any:
        return self._mi.Vector3f(*(row[0] * x + row[1] * y + row[2] * z for row in self._rotation))

    def chief(self, x_px: Any, y_px: Any) -> Any:
        """Return the unit directions, in world axes, of the rays through the centre of the pupil."""
        x, y = self._tangents(x_px, y_px)
        scale = self._dr.rsqrt(x * x + y * y + 1.0)
        return self._to_world(x * scale, y * scale, scale)

    def through_lens(self, x_px: Any, y_px: Any, lens_uv: Any) -> tuple[Any, Any]:
        """Return (origins, unit directions) of rays through the points `lens_uv` in [0, 1)^2 of the entrance pupil.

        A pinhole sends all rays through the centre. A thin lens spreads them evenly over the pupil's disk, so that they
        meet again on the plane in focus.
        """
        if self._pinhole:
            direction = self.chief(x_px, y_px)
            return self._dr.zeros(self._mi.Point3f, self._dr.width(direction)) + self._place, direction
        x, y = self._tangents(x_px, y_px)
        mi = self._mi
        disk = mi.warp.square_to_uniform_disk_concentric(lens_uv) * self._pupil_radius_m
        # The point in focus is d * (x, y, 1); dividing the difference by d keeps a focus at infinity finite.
        dx, dy = x - disk.x * self._nearness, y - disk.y * self._nearness
        scale = self._dr.rsqrt(dx * dx + dy * dy + 1.0)
        origin = self._to_world(disk.x, disk.y, mi.Float(0.0))
        return mi.Point3f(self._place + origin), self._to_world(dx * scale, dy * scale, scale)
