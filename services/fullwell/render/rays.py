"""Camera rays: the one place where a film position becomes a ray, for the image and for the labels alike."""

from __future__ import annotations

from typing import Any

from fullwell.scene import Camera

__all__ = ["lens_rays", "pinhole_direction"]


def pinhole_direction(mi: Any, dr: Any, camera: Camera, x_px: Any, y_px: Any) -> tuple[Any, Any]:
    """Return (direction in world axes, unit; cosine to the optical axis) of the chief ray at film position (x, y) [px].

    Positions run from (0, 0) at the top-left corner of the film; pixel centres are at +0.5.
    """
    x, y = _tangents(mi, dr, camera, x_px, y_px)
    cosine = dr.rsqrt(x * x + y * y + 1.0)
    return _to_world(mi, dr, camera, x * cosine, y * cosine, cosine), cosine


def lens_rays(mi: Any, dr: Any, camera: Camera, x_px: Any, y_px: Any, lens_uv: Any) -> tuple[Any, Any]:
    """Return (origin, unit direction) of rays from the entrance pupil; the origin is relative to the pupil's centre.

    A pinhole sends all rays through the centre. A thin lens spreads them over the pupil disk (`lens_uv` in [0, 1)^2) so that
    they meet again on the plane in focus.
    """
    if camera.lens.kind == "pinhole":
        direction, _ = pinhole_direction(mi, dr, camera, x_px, y_px)
        return dr.zeros(mi.Point3f, dr.width(direction)), direction
    x, y = _tangents(mi, dr, camera, x_px, y_px)
    disk = mi.warp.square_to_uniform_disk_concentric(lens_uv) * _opaque(mi, dr, 0.5 * camera.lens.pupil_diameter_m)
    # The point in focus is d * (x, y, 1); dividing the difference by d keeps a focus at infinity finite.
    nearness = _opaque(mi, dr, 1.0 / camera.lens.focus_distance_m)
    dx, dy = x - disk.x * nearness, y - disk.y * nearness
    scale = dr.rsqrt(dx * dx + dy * dy + 1.0)
    origin = _to_world(mi, dr, camera, disk.x, disk.y, mi.Float(0.0))
    return mi.Point3f(origin), _to_world(mi, dr, camera, dx * scale, dy * scale, scale)


def _opaque(mi: Any, dr: Any, value: float) -> Any:
    """Pass a number to the kernel as data: written into its code, another camera would compile another kernel."""
    return dr.opaque(mi.Float, float(value))


def _tangents(mi: Any, dr: Any, camera: Camera, x_px: Any, y_px: Any) -> tuple[Any, Any]:
    pitch = _opaque(mi, dr, camera.tangent_pitch)
    x = (x_px - _opaque(mi, dr, camera.film.cols / 2)) * pitch
    y = (y_px - _opaque(mi, dr, camera.film.rows / 2)) * pitch
    return x, y


def _to_world(mi: Any, dr: Any, camera: Camera, x: Any, y: Any, z: Any) -> Any:
    r = [[_opaque(mi, dr, v) for v in row] for row in camera.camera_to_world[:3, :3]]
    return mi.Vector3f(
        r[0][0] * x + r[0][1] * y + r[0][2] * z,
        r[1][0] * x + r[1][1] * y + r[1][2] * z,
        r[2][0] * x + r[2][1] * y + r[2][2] * z,
    )
