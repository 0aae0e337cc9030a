"""All lights of a scene: choosing one and a direction to it, and how likely that was. See docs/physics/lights.md.

Leaves number what can be hit or stands somewhere: emissive triangle f is leaf f, emissive curved shape i is leaf
``emissive_faces + i``, and point, spot and goniometric lights follow in the order of the scene. Lamps shine on the side of
their normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.environment import (
    DomeMap,
    MapOnDevice,
    SunDisk,
    SunOnDevice,
    image_map,
    sun_and_sky,
)
from fullwell.render.transport.light_shapes import CYLINDER, DISK, LEAF_FLOATS, SPHERE, LeafTable
from fullwell.render.transport.light_tree import LeafBounds, TreeWalk, build_light_tree
from fullwell.render.transport.patterns import PatternTable, pattern_bounds
from fullwell.render.transport.surfaces import CurvedShape, PlacedPattern, SceneSurfaces
from fullwell.render.transport.upload import upload
from fullwell.render.transport.wavelengths import PACKET, SpectraOnDevice, SpectraTable, look_up
from fullwell.scene import (
    ConstantEnvironment,
    DirectionalLight,
    GoniometricLight,
    ImageEnvironment,
    Light,
    PointLight,
    SpotLight,
    SunSky,
)
from fullwell.scene.groups import sun_group

__all__ = ["LightSample", "LightSet"]

Array = NDArray[np.float64]

_EVEN_SHARE = 0.4
"""Share of the choices that goes evenly to lamps, environment and distant lights, whatever their estimated light: which
of them is hidden from a point is not known."""

_EVEN_SHARE_DISTANT = 0.1
_FLAT_WEIGHT = 1e-3
"""Added to the spectral weights, of their mean, so that a light outside all channels is still found."""

_LEAST_GROUP_WEIGHT = 1e-3
"""Of the largest: a group that nobody asked for is still found, so that its light has no bias."""

_NORMAL_SET = 0.5
"""Squared length above which a receiver's normal is one, and not the zero vector that stands for none."""


@dataclass
class LightSample:
    """A direction chosen towards a light.

    Attributes
    ----------
    direction
        Unit vector from the point to the light.
    distance
        [m], infinite for environments, sun and directional lights.
    clearance
        Vector [m] from there to just off the lamp's own surface; zero for lights without one.
    pdf
        Density over solid angle [sr^-1] that the direction is chosen, the choice of the light included; for a `delta` light the
        probability of its choice. 0 where nothing was found.
    delta
        Whether the light is a point, a spot or directional.
    group
        Light group.
    dome
        Whether the direction is one to the environment, whose radiance is `LightSet.environment_radiance`.
    """

    direction: Any
    distance: Any
    clearance: Any
    pdf: Any
    delta: Any
    group: Any
    dome: Any
    _row: Any
    _scale: Any
    _mi: Any
    _dr: Any

    def radiance(self, spectra: SpectraOnDevice, cells: list[Any]) -> Any:
        """Return what is to be divided by `pdf`: radiance, intensity / distance^2 of a point, irradiance of a distant light.

        0 where the direction is one to the environment.
        """
        return self._dr.select(self.pdf > 0, look_up(self._mi, spectra, self._row, cells) * self._scale, 0.0)


class LightSet:
    """The lights of a scene on the device.

    Attributes
    ----------
    features
        Kinds of light there are; code for others is not traced. "dome", beside "environment", stands for a constant one.
    count
        Number of lights that `sample` chooses from: all but the sun, which has `sample_sun`.
    """

    features: frozenset[str]
    count: int

    def __init__(
        self,
        mi: Any,
        spectra: SpectraTable,
        surfaces: SceneSurfaces,
        lights: Sequence[Light],
        *,
        centre_m: NDArray[np.float64],
        weights: NDArray[np.floating[Any]],
        group_weights: NDArray[np.floating[Any]],
        scene_radius_m: float,
    ) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        collected = _Collected(spectra, surfaces, lights, centre_m, weights=weights, group_weights=group_weights)
        features: set[str] = set()
        finite = np.flatnonzero(collected.intensity > 0)
        irradiance: dict[str, float] = {}
        self._leaves = LeafTable(mi, collected.records, triangles=collected.triangles, curved=collected.curved)
        self._emission = upload(mi.UInt32, collected.records.view(np.uint32)[:, [3, 7]])
        if len(finite):
            features |= {"tree"} | collected.kinds(finite)
            if "pattern" in features:
                self._patterns = PatternTable(mi, collected.patterns)
            tree = build_light_tree(collected.bounds(finite), finite)
            self._walk = TreeWalk(mi, tree, finite, len(collected.records))
            irradiance["tree"] = _typical_irradiance(collected, finite, surfaces, scene_radius_m)
        self.count = len(finite)
        self._set_environment(collected, features, irradiance)
        if collected.distant:
            features.add("distant")
            self.count += len(collected.distant)
            irradiance["distant"] = self._set_distant(collected.distant)
        self.features = frozenset(features)
        self._start, self._share = _shares(mi, dr, irradiance)

    def _set_environment(self, collected: _Collected, features: set[str], irradiance: dict[str, float]) -> None:
        mi, dr = self._mi, self._dr
        self._environment_group = dr.opaque(mi.UInt32, collected.environment_group)
        importance = collected.environment_weight
        if collected.dome_row is not None:
            total = 4.0 * np.pi * collected.power(collected.dome_row) * importance
            if total > 0:
                features |= {"environment", "dome"}
                self._dome_row = dr.opaque(mi.UInt32, collected.dome_row)
                irradiance["environment"] = total / 4.0
        if collected.map is not None:
            first, components = collected.map.packet * PACKET, collected.map.coefficients.shape[-1]
            powers = np.array([collected.power(first + component) for component in range(components)])
            environment = MapOnDevice(mi, collected.map, powers)
            if environment.total > 0:
                features.add("environment")
                self._map = environment
                irradiance["environment"] = environment.total * importance / 4.0
        if collected.sun is not None and collected.power(collected.sun.row) > 0:
            features.add("sun")
            self._sun = SunOnDevice(mi, collected.sun)
            self._sun_group = dr.opaque(mi.UInt32, collected.sun_group)
        self.count += len(features & {"environment"})

    def _set_distant(self, distant: list[_Distant]) -> float:
        mi, dr = self._mi, self._dr
        irradiance = np.array([light.importance for light in distant])
        share = (1.0 - _EVEN_SHARE_DISTANT) * irradiance / irradiance.sum() + _EVEN_SHARE_DISTANT / len(distant)
        running = np.concatenate([[0.0], np.cumsum(share)])
        records = np.zeros((len(distant), 8), dtype=np.float32)
        names = records.view(np.uint32)
        for k, light in enumerate(distant):
            records[k, 0:3] = -light.direction
            names[k, 3], names[k, 5] = light.row, light.group
        records[:, 4] = share
        self._distant = upload(mi.Float, records)
        self._distant_sums = upload(mi.Float, (running / running[-1]).astype(np.float32))
        self._distant_count = dr.opaque(mi.UInt32, len(distant))
        return float(irradiance.sum()) / 4.0

    # Sampling --------------------------------------------------------------------------------------------------------

    def sample(self, point: Any, normal: Any, u_select: Any, u: Any, active: Any) -> LightSample:
        """Choose a light, other than the sun, for a point and a direction to it.

        `normal` (unit) bounds the directions to the half space on its side; a zero vector sets no bound (fog, or a surface
        that lets light through). `u_select` and `u` are uniform in [0, 1).
        """
        mi, dr = self._mi, self._dr
        width = dr.width(u_select)
        none = dr.zeros(mi.UInt32, width)
        found = LightSample(
            direction=dr.zeros(mi.Vector3f, width),
            distance=dr.zeros(mi.Float, width),
            clearance=dr.zeros(mi.Vector3f, width),
            pdf=dr.zeros(mi.Float, width),
            delta=dr.zeros(mi.Bool, width),
            group=none,
            dome=dr.zeros(mi.Bool, width),
            _row=none,
            _scale=dr.full(mi.Float, 1.0, width),
            _mi=mi,
            _dr=dr,
        )
        for kind, choose in (
            ("tree", self._sample_tree),
            ("environment", self._sample_environment),
            ("distant", self._sample_distant),
        ):
            if kind in self.features:
                chosen, renewed = self._chosen(kind, u_select, active)
                _take(dr, found, choose(point, normal, renewed, u, chosen), chosen)
        return found

    def _chosen(self, kind: str, u_select: Any, active: Any) -> tuple[Any, Any]:
        """Return whether a lane's number chooses this kind of light, and the number made uniform again."""
        dr = self._dr
        if len(self._start) == 1:
            return active, u_select
        within = (u_select - self._start[kind]) / self._share[kind]
        last = list(self._start)[-1] == kind
        chosen = active & (within >= 0.0) & ((within < 1.0) | last)
        return chosen, dr.clip(within, 0.0, 1.0 - 2.0**-24)

    def _sample_tree(self, point: Any, normal: Any, u_select: Any, u: Any, active: Any) -> LightSample:
        mi, dr = self._mi, self._dr
        leaf, probability = self._walk.choose(point, normal, u_select, active)
        active = active & (probability > 0)
        record = self._leaves.record(leaf, active)
        row, group = self._leaves.row_and_group(record[0], record[1])
        shape = self._leaves.sample_triangle(record, point, u)
        direction, distance, pdf, clearance = shape.direction, shape.distance, shape.pdf, shape.clearance
        scale = dr.full(mi.Float, 1.0, dr.width(u_select))
        delta = dr.zeros(mi.Bool, dr.width(u_select))
        if "curved" in self.features:
            curved, is_curved = self._leaves.sample_curved(record, point, u), self._leaves.is_curved(leaf)
            direction = dr.select(is_curved, curved.direction, direction)
            distance = dr.select(is_curved, curved.distance, distance)
            pdf = dr.select(is_curved, curved.pdf, pdf)
            clearance = dr.select(is_curved, curved.clearance, clearance)
        if "point" in self.features:
            (single, falloff), delta = self._leaves.sample_point(record, point), self._leaves.is_point(leaf)
            direction = dr.select(delta, single.direction, direction)
            distance = dr.select(delta, single.distance, distance)
            pdf = dr.select(delta, single.pdf, pdf)
            clearance = dr.select(delta, single.clearance, clearance)
            scale = dr.select(delta, falloff, scale)
        if "pattern" in self.features:
            scale = scale * self._share_towards(self._leaves.pattern(record), -direction, active)
            pdf = dr.select(scale > 0, pdf, 0.0)
        pdf = dr.select(active, pdf * probability * self._share["tree"], 0.0)
        no_dome = dr.zeros(mi.Bool, dr.width(pdf))
        return LightSample(direction, distance, clearance, pdf, delta, group, no_dome, row, scale, mi, dr)

    def _share_towards(self, number: Any, towards: Any, active: Any) -> Any:
        """Return the share of a lamp's light that goes in a direction; 1 for lamps without a pattern, whose number is 0."""
        patterned = active & (number > 0)
        share = self._patterns.share(number - 1, towards, patterned)
        return self._dr.select(patterned, share, 1.0)

    def _sample_environment(self, point: Any, normal: Any, u_select: Any, u: Any, active: Any) -> LightSample:
        mi, dr = self._mi, self._dr
        if "dome" in self.features:
            local = mi.warp.square_to_cosine_hemisphere(u)
            set_ = dr.dot(normal, normal) > _NORMAL_SET
            about = mi.Frame3f(dr.select(set_, normal, mi.Vector3f(0, 0, 1))).to_world(local)
            direction = dr.select(set_, about, mi.warp.square_to_uniform_sphere(u))
        else:
            direction, _ = self._map.sample(u, active)
            height = dr.dot(normal, direction)
            direction = dr.select(height < 0, direction - 2.0 * height * normal, direction)
        density = self.environment_density(normal, direction, active)
        width = dr.width(direction.x)
        none, far, ones = dr.zeros(mi.UInt32, width), dr.full(mi.Float, dr.inf, width), dr.full(mi.Float, 1.0, width)
        no, nothing, of_dome = dr.zeros(mi.Bool, width), dr.zeros(mi.Vector3f, width), dr.full(mi.Bool, True, width)
        return LightSample(direction, far, nothing, density, no, none + self._environment_group, of_dome, none, ones, mi, dr)

    def _sample_distant(self, point: Any, normal: Any, u_select: Any, u: Any, active: Any) -> LightSample:
        mi, dr = self._mi, self._dr
        width = dr.width(u_select)

        def step(low: Any, high: Any) -> tuple[Any, Any]:
            middle = (low + high) >> 1
            further = dr.gather(mi.Float, self._distant_sums, middle, active) <= u_select
            return dr.select(further, middle, low), dr.select(further, high, middle)

        low = dr.zeros(mi.UInt32, width)
        index, _ = dr.while_loop(
            state=(low, low + self._distant_count),
            cond=lambda low, high: high - low > 1,
            body=step,
            labels=("low", "high"),
        )
        four = dr.llvm.ad.Array4f
        first, second = (dr.gather(four, self._distant, index * 2 + k, active) for k in range(2))
        direction = mi.Vector3f(first.x, first.y, first.z)
        row, group = dr.reinterpret_array(mi.UInt32, first.w), dr.reinterpret_array(mi.UInt32, second.y)
        pdf = dr.select(active, second.x * self._share["distant"], 0.0)
        far, ones = dr.full(mi.Float, dr.inf, width), dr.full(mi.Float, 1.0, width)
        no, yes, nothing = dr.zeros(mi.Bool, width), dr.full(mi.Bool, True, width), dr.zeros(mi.Vector3f, width)
        return LightSample(direction, far, nothing, pdf, yes, group, no, row, ones, mi, dr)

    def sample_sun(self, u: Any) -> tuple[Any, Any]:
        """Return a direction to the sun and its density [sr^-1]: each point that is lit looks at it, none has to choose it."""
        direction = self._sun.sample(u)
        return direction, self._sun.density(direction)

    # What rays meet --------------------------------------------------------------------------------------------------

    def hit_emission(self, leaf: Any, active: Any) -> tuple[Any, Any]:
        """Return (spectrum row, group) of the radiance on the front of an emissive surface."""
        mi, dr = self._mi, self._dr
        row = dr.gather(mi.UInt32, self._emission, leaf * 2, active)
        return row, dr.gather(mi.UInt32, self._emission, leaf * 2 + 1, active)

    def hit_share(self, leaf: Any, direction: Any, active: Any) -> Any:
        """Return the share of that radiance which a ray of this direction meets; only where "pattern" is among the features."""
        return self._share_towards(self._leaves.pattern_of(leaf, active), -direction, active)

    def hit_density(  # noqa: PLR0917 - a ray, its two ends and a mask
        self, leaf: Any, origin: Any, origin_normal: Any, direction: Any, distance: Any, light_normal: Any, active: Any
    ) -> Any:
        """Return the density [sr^-1] with which `sample` at `origin` would have chosen a direction that met a lamp.

        `light_normal` is the geometric one where the ray met it.
        """
        mi, dr = self._mi, self._dr
        if "tree" not in self.features:
            return dr.zeros(mi.Float, dr.width(distance))
        probability = self._walk.probability(leaf, origin, origin_normal, active)
        record = self._leaves.record(leaf, active)
        density = self._leaves.triangle_density(record, origin, direction, distance)
        if "curved" in self.features:
            curved = self._leaves.curved_density(record, origin, direction, distance, light_normal)
            density = dr.select(self._leaves.is_curved(leaf), curved, density)
        return dr.select(active & (probability > 0), density * probability * self._share["tree"], 0.0)

    # Far away --------------------------------------------------------------------------------------------------------

    @property
    def environment_group(self) -> Any:
        """Group of the environment."""
        return self._environment_group

    def environment_radiance(self, spectra: SpectraOnDevice, direction: Any, cells: list[Any], active: Any) -> Any:
        """Return the environment's radiance from a direction; only where "environment" is among the features."""
        if "dome" in self.features:
            return look_up(self._mi, spectra, self._dome_row, cells)
        return self._map.radiance(spectra, direction, cells, active)

    def environment_density(self, normal: Any, direction: Any, active: Any) -> Any:
        """Return the density [sr^-1] with which `sample` at a point of that normal chooses a direction for the environment."""
        dr = self._dr
        if "dome" in self.features:
            bound = dr.dot(normal, normal) > _NORMAL_SET
            cosine = dr.maximum(dr.dot(normal, direction), 0.0)
            density = dr.select(bound, cosine / np.pi, 0.25 / np.pi)
        else:
            # What was drawn below a surface's horizon is mirrored above it: a wall sees half of the sky.
            height = dr.dot(normal, direction)
            above = self._map.density(direction, active & (height >= 0))
            below = self._map.density(direction - 2.0 * height * normal, active & (height > 0))
            density = dr.select(height >= 0, above + dr.select(height > 0, below, 0.0), 0.0)
        return dr.select(active, self._share["environment"] * density, 0.0)

    @property
    def sun_group(self) -> Any:
        """Group of the sun."""
        return self._sun_group

    def sun_radiance(self, spectra: SpectraOnDevice, cells: list[Any]) -> Any:
        """Return the radiance of the sun's disk; only where "sun" is among the features."""
        return look_up(self._mi, spectra, self._sun.row, cells)

    def sun_density(self, direction: Any) -> Any:
        """Return the density [sr^-1] with which `sample_sun` chooses a direction: 0 beside the disk."""
        return self._sun.density(direction)


def _take(dr: Any, found: LightSample, other: LightSample, chosen: Any) -> None:
    """Put `other` into `found` where `chosen`."""
    for name in ("direction", "distance", "clearance", "pdf", "delta", "group", "dome", "_row", "_scale"):
        setattr(found, name, dr.select(chosen, getattr(other, name), getattr(found, name)))


def _shares(mi: Any, dr: Any, irradiance: dict[str, float]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return where each kind's part of [0, 1) starts and how large it is, on the device."""
    total = sum(irradiance.values())
    start: dict[str, Any] = {}
    share: dict[str, Any] = {}
    begun = 0.0
    for kind in ("tree", "environment", "distant"):
        if kind in irradiance:
            estimated = irradiance[kind] / total if 0 < total < np.inf else 1.0 / len(irradiance)
            part = _EVEN_SHARE / len(irradiance) + (1.0 - _EVEN_SHARE) * estimated
            start[kind], share[kind] = dr.opaque(mi.Float, begun), dr.opaque(mi.Float, part)
            begun += part
    return start, share


# On the host ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Distant:
    direction: Array
    row: int
    group: int
    importance: float


class _Collected:
    """The lights of a scene as arrays, and what bounds those that stand somewhere."""

    def __init__(
        self,
        spectra: SpectraTable,
        surfaces: SceneSurfaces,
        lights: Sequence[Light],
        centre_m: NDArray[np.float64],
        *,
        weights: NDArray[np.floating[Any]],
        group_weights: NDArray[np.floating[Any]],
    ) -> None:
        weights = np.maximum(np.asarray(weights, dtype=np.float64), 0.0)
        self._weights = weights + (_FLAT_WEIGHT * weights.mean() if np.any(weights) else 1.0)
        groups = np.maximum(np.asarray(group_weights, dtype=np.float64), 0.0)
        self._group_weights = np.maximum(groups, _LEAST_GROUP_WEIGHT * groups.max()) if np.any(groups) else groups + 1.0
        self._spectra = spectra
        self._groups = {name: number for number, name in enumerate(surfaces.groups)}
        self._powers: dict[int, float] = {}
        placed = [light for light in lights if isinstance(light, PointLight | SpotLight | GoniometricLight)]
        self.patterns: list[PlacedPattern] = []
        self.triangles, self.curved = surfaces.emissive_faces, surfaces.emissive_curved
        total = self.triangles + self.curved + len(placed)
        self.records = np.zeros((max(1, total), LEAF_FLOATS), dtype=np.float32)
        self._names = self.records.view(np.uint32)
        self.low_m, self.high_m, self.axis = np.zeros((total, 3)), np.zeros((total, 3)), np.zeros((total, 3))
        self.radius_m, self.intensity = np.zeros(total), np.zeros(total)
        self.spread_rad, self.emission_rad = np.zeros(total), np.full(total, 0.5 * np.pi)
        self._add_triangles(surfaces)
        for number, shape in enumerate(surfaces.curved[: self.curved]):
            self._add_curved(self.triangles + number, shape, surfaces)
        for number, lamp in enumerate(placed):
            self._add_placed(self.triangles + self.curved + number, lamp, np.asarray(centre_m, dtype=np.float64))
        self.distant: list[_Distant] = []
        self.map: DomeMap | None = None
        self.sun: SunDisk | None = None
        self.dome_row: int | None = None
        self.environment_group = self.sun_group = 0
        self.environment_weight = self.sun_weight = 1.0
        for light in lights:
            self._add_far(light)

    def power(self, row: int) -> float:
        """Return a spectrum's weighted sum."""
        if row not in self._powers:
            self._powers[row] = float(self._spectra.row(row).astype(np.float64) @ self._weights)
        return self._powers[row]

    def _group(self, name: str) -> int:
        return self._groups[name]

    def _pattern(self, placed: PlacedPattern | None) -> int:
        """Return the number of a pattern among those of the scene, from 1; 0 for none."""
        if placed is None:
            return 0
        self.patterns.append(placed)
        return len(self.patterns)

    def _add_triangles(self, surfaces: SceneSurfaces) -> None:
        count = self.triangles
        if count == 0:
            return
        corners = surfaces.vertices_m[surfaces.faces[:count]].astype(np.float64)
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        crossed = np.cross(first, second)
        doubled = np.linalg.norm(crossed, axis=1)
        part_of = surfaces.face_part[:count]
        rows, groups, patterns = np.zeros((3, len(surfaces.parts)), dtype=np.uint32)
        powers = np.zeros(len(surfaces.parts))
        for number in np.unique(part_of):
            part = surfaces.parts[number]
            rows[number] = SpectraTable.BLACK if part.radiance is None else self._spectra.add(part.radiance)
            groups[number] = part.group
            patterns[number] = self._pattern(part.pattern)
            powers[number] = self.power(int(rows[number])) * self._group_weights[part.group]
        record, names = self.records[:count], self._names[:count]
        record[:, 0:3], record[:, 4:7], record[:, 8:11] = corners[:, 0], first, second
        names[:, 3], names[:, 7], names[:, 11] = rows[part_of], groups[part_of], patterns[part_of]
        self.low_m[:count], self.high_m[:count] = corners.min(axis=1), corners.max(axis=1)
        middle = 0.5 * (self.low_m[:count] + self.high_m[:count])
        self.radius_m[:count] = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        self.axis[:count] = crossed / np.where(doubled > 0, doubled, 1.0)[:, None]
        self.intensity[:count] = powers[part_of] * 0.5 * doubled

    def _add_curved(self, leaf: int, shape: CurvedShape, surfaces: SceneSurfaces) -> None:
        part = surfaces.parts[shape.part]
        row = SpectraTable.BLACK if part.radiance is None else self._spectra.add(part.radiance)
        radius = float(np.cbrt(abs(np.linalg.det(shape.to_world[:3, :3]))))
        centre, axis = shape.to_world[:3, 3], shape.to_world[:3, 2] / max(radius, np.finfo(np.float64).tiny)
        half_height = radius * shape.half_height if shape.kind == "cylinder" else 0.0
        across = radius * np.sqrt(np.maximum(1.0 - axis**2, 0.0))
        kind, reach, area = {
            "sphere": (SPHERE, np.full(3, radius), np.pi * radius**2),
            "disk": (DISK, across, np.pi * radius**2),
            "cylinder": (CYLINDER, np.abs(axis) * half_height + across, 4.0 * radius * half_height),
        }[shape.kind]
        self.records[leaf, 0:3], self.records[leaf, 4:7] = centre, axis
        self.records[leaf, 8:11] = radius, half_height, kind
        self._names[leaf, 3], self._names[leaf, 7], self._names[leaf, 11] = row, part.group, self._pattern(part.pattern)
        self.low_m[leaf], self.high_m[leaf] = centre - reach, centre + reach
        self.radius_m[leaf] = np.hypot(radius, half_height)
        if shape.kind == "disk":
            self.axis[leaf] = axis
        else:
            self.spread_rad[leaf] = np.pi
        self.intensity[leaf] = self.power(row) * area * self._group_weights[part.group]

    def _add_placed(self, leaf: int, light: PointLight | SpotLight | GoniometricLight, centre_m: Array) -> None:
        row, group = self._spectra.add(light.intensity), self._group(light.group)
        place = np.asarray(light.position_m, dtype=np.float64) - centre_m
        self.records[leaf, 0:3] = place
        self.spread_rad[leaf] = np.pi
        if isinstance(light, SpotLight):
            axis = np.asarray(light.direction, dtype=np.float64) / np.linalg.norm(light.direction)
            beam, cutoff = np.radians(light.beam_deg), np.radians(light.cutoff_deg)
            self.records[leaf, 4:7] = self.axis[leaf] = axis
            self.records[leaf, 8:10] = cutoff, 1.0 / (cutoff - beam)
            self.spread_rad[leaf], self.emission_rad[leaf] = beam, cutoff - beam
        largest = 1.0
        if isinstance(light, GoniometricLight):
            frame, bounds = light.frame(), pattern_bounds(light.pattern)
            self.axis[leaf] = frame @ bounds.axis
            self._names[leaf, 11] = self._pattern(PlacedPattern(light.pattern, frame))
            self.spread_rad[leaf], self.emission_rad[leaf] = bounds.bright_rad, bounds.end_rad
            largest = float(light.pattern.shares.max())
        self._names[leaf, 3], self._names[leaf, 7] = row, group
        self.low_m[leaf] = self.high_m[leaf] = place
        self.intensity[leaf] = self.power(row) * self._group_weights[group] * largest

    def _add_far(self, light: Light) -> None:
        match light:
            case DirectionalLight():
                row, group = self._spectra.add(light.irradiance), self._group(light.group)
                importance = self.power(row) * float(self._group_weights[group])
                direction = np.asarray(light.direction, dtype=np.float64) / np.linalg.norm(light.direction)
                if importance > 0:
                    self.distant.append(_Distant(direction, row, group, importance))
                return
            case ConstantEnvironment():
                self.dome_row = self._spectra.add(light.radiance)
            case ImageEnvironment():
                self.map = image_map(light, self._spectra)
            case SunSky():
                self.map, self.sun = sun_and_sky(light, self._spectra)
                self.sun_group = self._group(sun_group(light))
                self.sun_weight = float(self._group_weights[self.sun_group])
            case _:
                return
        self.environment_group = self._group(light.group)
        self.environment_weight = float(self._group_weights[self.environment_group])

    def kinds(self, leaves: NDArray[np.int64]) -> set[str]:
        """Return which of "curved", "point" and "pattern" there are among the leaves."""
        kinds = set()
        if np.any((leaves >= self.triangles) & (leaves < self.triangles + self.curved)):
            kinds.add("curved")
        if np.any(leaves >= self.triangles + self.curved):
            kinds.add("point")
        if self.patterns:
            kinds.add("pattern")
        return kinds

    def bounds(self, leaves: NDArray[np.int64]) -> LeafBounds:
        """Return what bounds these leaves, their intensities scaled to a sum of 1."""
        return LeafBounds(
            low_m=self.low_m[leaves],
            high_m=self.high_m[leaves],
            radius_m=self.radius_m[leaves],
            axis=self.axis[leaves],
            spread_rad=self.spread_rad[leaves],
            emission_rad=self.emission_rad[leaves],
            intensity=self.intensity[leaves] / self.intensity[leaves].sum(),
        )


_PROBES = 256


def _typical_irradiance(
    collected: _Collected, leaves: NDArray[np.int64], surfaces: SceneSurfaces, scene_radius_m: float
) -> float:
    """Estimate the weighted irradiance by lamps on what the camera sees large, mean over directions of the normal.

    The median over triangles, each counted by its solid angle from the camera; without any, at the scene's radius.
    """
    some = leaves[:: -(-len(leaves) // _PROBES)]
    scale = collected.intensity[leaves].sum() / max(collected.intensity[some].sum(), np.finfo(np.float64).tiny)
    place = 0.5 * (collected.low_m[some] + collected.high_m[some])
    at, weight = np.array([[0.0, 0.0, 0.0]]), np.ones(1)
    if len(surfaces.faces):
        corners = surfaces.vertices_m[surfaces.faces[:: -(-len(surfaces.faces) // _PROBES)]].astype(np.float64)
        at = corners.mean(axis=1)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        weight = area / (np.sum(at**2, axis=1) + (0.01 * scene_radius_m) ** 2 + np.finfo(np.float64).tiny)
    distance2 = np.sum((at[:, None] - place[None]) ** 2, axis=2)
    nearest2 = np.maximum(collected.radius_m[some] ** 2, (0.01 * scene_radius_m) ** 2) + np.finfo(np.float32).tiny
    irradiance = scale * (collected.intensity[some] / np.maximum(distance2, nearest2)).sum(axis=1) / 4.0
    order = np.argsort(irradiance)
    running = np.cumsum(weight[order])
    return float(irradiance[order][np.searchsorted(running, 0.5 * running[-1])])
