"""Choosing a direction towards one lamp, and the density of that choice: triangles, curved shapes, points and spots."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.collect import CURVED_OFFSET, RAY_OFFSET
from fullwell.render.transport.upload import upload

__all__ = ["CYLINDER", "DISK", "LEAF_FLOATS", "SPHERE", "LeafTable", "ShapeSample"]

LEAF_FLOATS = 12
"""A triangle: corner and spectrum row, first edge and group, second edge. A curved shape: centre and row, axis and group,
radius [m], half height [m] and kind. A point: place and row, axis and group, angle where a spot ends, 1 / (width of its edge),
both 0 where the light is no spot, and 0. All: the number of a pattern from 1, 0 for none."""

SPHERE, DISK, CYLINDER = 0.0, 1.0, 2.0

_SMALLEST_SR = 2e-3
_LARGEST_SR = 6.22
"""Triangles of a solid angle between these are sampled uniformly over it; outside them, where single precision would suffer,
uniformly over their area. Below, the two differ by less than the light varies over a lamp of 3 degrees."""

_NEAREST_M2 = 1e-20
_CLEARANCE = 1e-6
"""How far off a lamp shadow rays end, times their length, beside what rays keep off that surface anyway: the point on the lamp
comes from direction and distance, which are rounded."""


class ShapeSample:
    """Direction (unit), distance [m] and density [sr^-1] of a chosen direction; density 0 where nothing is to be had.

    `clearance` [m] is the vector from the lamp's surface to where a ray towards it ends.
    """

    def __init__(self, direction: Any, distance: Any, pdf: Any, clearance: Any) -> None:
        self.direction, self.distance, self.pdf, self.clearance = direction, distance, pdf, clearance


class LeafTable:
    """The lamps on the device, by leaf: triangles first, then curved shapes, then points and spots."""

    def __init__(self, mi: Any, records: NDArray[np.float32], *, triangles: int, curved: int) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._four = dr.llvm.ad.Array4f
        self._records = upload(mi.Float, records)
        self._first_curved = dr.opaque(mi.UInt32, triangles)
        self._first_point = dr.opaque(mi.UInt32, triangles + curved)

    def record(self, leaf: Any, active: Any) -> tuple[Any, Any, Any]:
        """Return a leaf's three groups of four numbers."""
        first, second, third = (self._dr.gather(self._four, self._records, leaf * 3 + k, active) for k in range(3))
        return first, second, third

    def row_and_group(self, first: Any, second: Any) -> tuple[Any, Any]:
        """Return spectrum row and group of a record."""
        return self._dr.reinterpret_array(self._mi.UInt32, first.w), self._dr.reinterpret_array(self._mi.UInt32, second.w)

    def is_curved(self, leaf: Any) -> Any:
        """Return whether the leaf is a sphere, disk or cylinder."""
        return (leaf >= self._first_curved) & (leaf < self._first_point)

    def is_point(self, leaf: Any) -> Any:
        """Return whether the leaf is a point or spot light."""
        return leaf >= self._first_point

    # Triangles -------------------------------------------------------------------------------------------------------

    def _corners(self, record: tuple[Any, Any, Any], point: Any) -> tuple[Any, Any, Any, Any]:
        """Return the corners seen from the point, and the product of the edges: twice the area along the normal."""
        dr, mi = self._dr, self._mi
        first, second, third = (mi.Vector3f(part.x, part.y, part.z) for part in record)
        a = first - mi.Vector3f(point)
        return a, a + second, a + third, dr.cross(second, third)

    def _solid_angle(self, a: Any, b: Any, c: Any, crossed: Any) -> tuple[Any, Any, Any, tuple[Any, Any, Any]]:
        """Return the solid angle [sr], the volume of the corners' unit vectors, their cosines ab, ac, bc, and their distances.

        Van Oosterom and Strackee 1983, eq. 8. The volume comes from the edges, so that small triangles keep their digits.
        """
        dr = self._dr
        distances = dr.norm(a), dr.norm(b), dr.norm(c)
        inverse_a, inverse_b, inverse_c = (1.0 / dr.maximum(distance, 1e-15) for distance in distances)
        volume = dr.abs(dr.dot(a, crossed)) * inverse_a * inverse_b * inverse_c
        cosines = (
            dr.dot(a, b) * inverse_a * inverse_b,
            dr.dot(a, c) * inverse_a * inverse_c,
            dr.dot(b, c) * inverse_b * inverse_c,
        )
        return 2.0 * dr.atan2(volume, 1.0 + cosines[0] + cosines[1] + cosines[2]), volume, cosines, distances

    def sample_triangle(self, record: tuple[Any, Any, Any], point: Any, u: Any) -> ShapeSample:
        """Choose a point of a triangle uniformly over its solid angle, or over its area where that is very small or large."""
        dr, mi = self._dr, self._mi
        a, b, c, crossed = self._corners(record, point)
        solid_angle, volume, cosines, distances = self._solid_angle(a, b, c, crossed)
        by_angle = (solid_angle > _SMALLEST_SR) & (solid_angle < _LARGEST_SR)
        towards = self._within_spherical_triangle((a, b, c), distances, cosines, (solid_angle, volume), u)
        root = dr.sqrt(u.x)
        weight_b, weight_c = root * (1.0 - u.y), root * u.y
        place = a * (1.0 - root) + b * weight_b + c * weight_c
        direction = dr.normalize(dr.select(by_angle, towards, place))
        facing = -dr.dot(crossed, direction)
        height = -dr.dot(crossed, a)
        # In the lamp's own plane rounding may turn a direction past its edge.
        farthest = dr.maximum(dr.maximum(distances[0], distances[1]), distances[2])
        distance = dr.select(by_angle, dr.minimum(height / facing, farthest), dr.norm(place))
        density = self._triangle_density(solid_angle, crossed, facing, distance)
        good = (height > 0) & (facing > 0) & (distance > 0)
        clearance = self._clearance(record, crossed, distance)
        return ShapeSample(mi.Vector3f(direction), distance, dr.select(good, density, 0.0), clearance)

    def _clearance(self, record: tuple[Any, Any, Any], crossed: Any, distance: Any) -> Any:
        """Return the vector [m] off a triangle that rays keep, as in `Geometry`."""
        dr, mi = self._dr, self._mi
        first, second, third = (mi.Vector3f(part.x, part.y, part.z) for part in record)
        reach = dr.maximum(dr.maximum(dr.abs(first), dr.abs(first + second)), dr.abs(first + third))
        normal = dr.normalize(crossed * dr.rcp(dr.maximum(dr.max(dr.abs(crossed)), 1e-37)))
        return normal * (RAY_OFFSET * dr.dot(dr.abs(normal), reach) + _CLEARANCE * distance)

    def _triangle_density(self, solid_angle: Any, crossed: Any, facing: Any, distance: Any) -> Any:
        """`facing` is twice the area times the cosine at the lamp."""
        dr = self._dr
        by_angle = (solid_angle > _SMALLEST_SR) & (solid_angle < _LARGEST_SR)
        return dr.select(by_angle, 1.0 / solid_angle, 2.0 * distance * distance / facing)

    def _within_spherical_triangle(self, corners: Any, distances: Any, cosines: Any, size: tuple[Any, Any], u: Any) -> Any:
        """Return a direction uniform over a triangle's solid angle; `size` is that and the volume of the unit vectors.

        Arvo 1995 without inverse trigonometry: a new third corner on the arc between the first and third cuts off the share
        u.x of the solid angle; then a point between it and the second corner. Peters 2021, section 4. The longest side is
        taken as that arc: near an edge of the lamp its ends are opposite, and any other order would lose all digits.
        """
        dr, mi = self._dr, self._mi
        solid_angle, volume = size
        a, b, c = (corner / dr.maximum(distance, 1e-15) for corner, distance in zip(corners, distances, strict=True))
        cos_ab, cos_ac, cos_bc = cosines
        longest_ab, longest_bc = (cos_ab < cos_ac) & (cos_ab < cos_bc), (cos_bc < cos_ac) & (cos_bc <= cos_ab)
        a, b, c = (
            dr.select(longest_bc, b, a),
            dr.select(longest_ab, c, dr.select(longest_bc, a, b)),
            dr.select(longest_ab, b, c),
        )
        sum_b = 1.0 + dr.select(longest_ab, cos_ac, cos_ab)
        sum_c = cos_ab + cos_ac + cos_bc + 1.0 - sum_b
        sin_part, cos_part = dr.sincos(0.5 * u.x * solid_angle)
        offset = a * (volume * cos_part - sum_c * sin_part) + c * (sum_b * sin_part)
        new = offset * (2.0 * dr.dot(a, offset) / dr.maximum(dr.dot(offset, offset), 1e-30)) - a
        between = b - new
        gap = 0.5 * dr.dot(between, between)
        share = dr.sqrt(u.y * (2.0 - u.y * gap) / dr.maximum(2.0 - gap, 1e-6))
        return mi.Vector3f(b * (1.0 - u.y * gap - share * (1.0 - gap)) + new * share)

    def triangle_density(self, record: tuple[Any, Any, Any], point: Any, direction: Any, distance: Any) -> Any:
        """Return the density with which `sample_triangle` chooses a direction that meets the triangle at a distance."""
        dr = self._dr
        a, b, c, crossed = self._corners(record, point)
        solid_angle = self._solid_angle(a, b, c, crossed)[0]
        facing = -dr.dot(crossed, direction)
        good = (dr.dot(crossed, a) < 0) & (facing > 0)
        return dr.select(good, self._triangle_density(solid_angle, crossed, facing, distance), 0.0)

    # Curved shapes ---------------------------------------------------------------------------------------------------

    def sample_curved(self, record: tuple[Any, Any, Any], point: Any, u: Any) -> ShapeSample:
        """Choose a direction to a sphere (over its cone), a disk (over its area) or the near side of a cylinder."""
        dr, mi = self._dr, self._mi
        way, axis, radius, half_height, kind = self._placed(record, point)
        of_sphere = self._sample_sphere(way, radius, u)
        side, up = self._side_of(axis)
        turn_sin, turn_cos = dr.sincos(2.0 * np.pi * u.y)
        root = dr.sqrt(u.x) * radius
        on_disk = way + side * (root * turn_cos) + up * (root * turn_sin)
        radial, range_rad, outside = self._near_side(way, axis, radius)
        angle_sin, angle_cos = dr.sincos((2.0 * u.x - 1.0) * range_rad)
        outwards = radial * angle_cos + dr.cross(axis, radial) * angle_sin
        on_cylinder = way + outwards * radius + axis * ((2.0 * u.y - 1.0) * half_height)
        is_disk = kind == DISK
        place = dr.select(is_disk, on_disk, on_cylinder)
        normal = dr.select(is_disk, axis, outwards)
        distance2 = dr.dot(place, place)
        direction = place * dr.rsqrt(dr.maximum(distance2, _NEAREST_M2))
        area = dr.select(is_disk, np.pi * radius * radius, 4.0 * range_rad * radius * half_height)
        cosine = -dr.dot(normal, direction)
        good = (cosine > 0) & (distance2 > _NEAREST_M2) & (is_disk | outside)
        density = dr.select(good, distance2 / (cosine * area), 0.0)
        is_sphere = kind == SPHERE
        direction = mi.Vector3f(dr.select(is_sphere, of_sphere[0], direction))
        distance = dr.select(is_sphere, of_sphere[1], dr.sqrt(distance2))
        normal = dr.select(is_sphere, dr.normalize(direction * distance - way), normal)
        first = record[0]
        extent = dr.abs(first.x) + dr.abs(first.y) + dr.abs(first.z) + 2.0 * radius
        clearance = normal * (CURVED_OFFSET * extent + _CLEARANCE * distance)
        return ShapeSample(direction, distance, dr.select(is_sphere, of_sphere[2], density), mi.Vector3f(clearance))

    def _placed(self, record: tuple[Any, Any, Any], point: Any) -> tuple[Any, Any, Any, Any, Any]:
        mi = self._mi
        first, second, third = record
        way = mi.Vector3f(first.x, first.y, first.z) - mi.Vector3f(point)
        return way, mi.Vector3f(second.x, second.y, second.z), third.x, third.y, third.z

    def _side_of(self, axis: Any) -> tuple[Any, Any]:
        side, up = self._mi.coordinate_system(axis)
        return side, up

    def _near_side(self, way: Any, axis: Any, radius: Any) -> tuple[Any, Any, Any]:
        """Return the unit vector from a cylinder's axis to the point, half the angle of what is seen, and whether any is."""
        dr = self._dr
        back = axis * dr.dot(way, axis) - way
        reach2 = dr.dot(back, back)
        outside = reach2 > radius * radius
        inverse = dr.rsqrt(dr.maximum(reach2, _NEAREST_M2))
        return back * inverse, dr.safe_acos(radius * inverse), outside

    def _cone(self, way: Any, radius: Any) -> tuple[Any, Any, Any]:
        """Return a sphere's squared distance, 1 - cos of the cone under which it is seen, and whether it is, from outside."""
        dr = self._dr
        distance2 = dr.dot(way, way)
        outside = distance2 > radius * radius
        sin2 = dr.minimum(radius * radius / dr.maximum(distance2, _NEAREST_M2), 1.0)
        return distance2, sin2 / (1.0 + dr.safe_sqrt(1.0 - sin2)), outside

    def _sample_sphere(self, way: Any, radius: Any, u: Any) -> tuple[Any, Any, Any]:
        """Return direction, distance and density."""
        dr, mi = self._dr, self._mi
        distance2, opening, outside = self._cone(way, radius)
        middle = way * dr.rsqrt(dr.maximum(distance2, _NEAREST_M2))
        side, up = self._side_of(middle)
        drop = u.x * opening
        sin2 = drop * (2.0 - drop)
        turn_sin, turn_cos = dr.sincos(2.0 * np.pi * u.y)
        sine = dr.safe_sqrt(sin2)
        direction = middle * (1.0 - drop) + side * (sine * turn_cos) + up * (sine * turn_sin)
        reach = dr.sqrt(distance2)
        distance = reach * (1.0 - drop) - dr.safe_sqrt(radius * radius - distance2 * sin2)
        good = outside & (opening > 0)
        density = dr.select(good, 1.0 / (2.0 * np.pi * dr.select(good, opening, 1.0)), 0.0)
        return mi.Vector3f(direction), dr.maximum(distance, 0.0), density

    def curved_density(self, record: tuple[Any, Any, Any], point: Any, direction: Any, distance: Any, normal: Any) -> Any:
        """Return the density with which `sample_curved` chooses a direction that meets the shape at `distance` and `normal`."""
        dr = self._dr
        way, axis, radius, half_height, kind = self._placed(record, point)
        _, opening, outside_sphere = self._cone(way, radius)
        of_sphere = dr.select(outside_sphere, 1.0 / (2.0 * np.pi * dr.maximum(opening, 1e-30)), 0.0)
        _, range_rad, outside = self._near_side(way, axis, radius)
        is_disk = kind == DISK
        area = dr.select(is_disk, np.pi * radius * radius, 4.0 * range_rad * radius * half_height)
        cosine = -dr.dot(normal, direction)
        good = (cosine > 0) & (is_disk | outside)
        return dr.select(kind == SPHERE, of_sphere, dr.select(good, distance * distance / (cosine * area), 0.0))

    # Points ----------------------------------------------------------------------------------------------------------

    def sample_point(self, record: tuple[Any, Any, Any], point: Any) -> tuple[ShapeSample, Any]:
        """Return the only direction to a point or spot light, with density 1, and the share of its intensity / distance^2."""
        dr = self._dr
        way, axis, cutoff_rad, inverse_edge, _ = self._placed(record, point)
        distance2 = dr.dot(way, way)
        direction = way * dr.rsqrt(dr.maximum(distance2, _NEAREST_M2))
        # The angle from its cosine would lose all digits near the axis.
        angle = 2.0 * dr.safe_asin(0.5 * dr.norm(direction + axis))
        share = dr.select(inverse_edge > 0, dr.clip((cutoff_rad - angle) * inverse_edge, 0.0, 1.0), 1.0)
        good = (distance2 > _NEAREST_M2) & (share > 0)
        scale = dr.select(good, share / dr.maximum(distance2, _NEAREST_M2), 0.0)
        nothing = dr.zeros(self._mi.Vector3f, dr.width(distance2))
        return ShapeSample(direction, dr.sqrt(distance2), dr.select(good, 1.0, 0.0), nothing), scale

    def pattern(self, record: tuple[Any, Any, Any]) -> Any:
        """Return the number of a lamp's pattern, from 1; 0 for none."""
        return self._dr.reinterpret_array(self._mi.UInt32, record[2].w)

    def pattern_of(self, leaf: Any, active: Any) -> Any:
        """Return the number of a leaf's pattern, from 1; 0 for none."""
        place = leaf * LEAF_FLOATS + (LEAF_FLOATS - 1)
        return self._dr.reinterpret_array(self._mi.UInt32, self._dr.gather(self._mi.Float, self._records, place, active))
