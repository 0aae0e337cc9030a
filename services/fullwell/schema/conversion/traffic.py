"""Traffic scenes of a recipe: streets made and kept, the ego chosen, mounts and targets placed, assets turned into objects."""

from __future__ import annotations

import math
import posixpath
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.classes import ASSET_CLASSES
from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.core.hashing import digest_of
from fullwell.scene import Emission, Light, Material, Mesh, Part, SceneObject, look_at
from fullwell.schema.assets import candidates_of, traffic_queries
from fullwell.schema.conversion.assets import DrawnAsset, asset_part_material, catalogue_material
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.conversion.dirt import ROAD_DIRT, by_height, dirt_of_vehicle, soiled
from fullwell.schema.conversion.street_lamps import bright_as_its_kind, headlamp_beams, lamp_material
from fullwell.schema.v1.cameras import MountDocument
from fullwell.schema.v1.traffic import DemandDocument, EgoDocument, RoadNetworkDocument, TargetDocument, TrafficDocument

if TYPE_CHECKING:
    from fullwell.traffic.networks import NetworkSpec
    from fullwell.traffic.own_runs import OwnRun
    from fullwell.traffic.placement import AssetShelf, PlacedAsset
    from fullwell.traffic.street import RecordedRun, Street, StreetMoment, StreetSpec

__all__ = ["STREET_GROUPS", "StreetView", "Viewpoint", "mount_pose", "street_objects", "street_view"]

Array = NDArray[np.float64]

STREET_GROUPS: Final = ("headlights", "other", "streetlights")
"""Light groups of a street's own lamps: a recipe may weight them whether or not one is lit at its moment."""

_KEPT_STREETS: Final = 4
_STANDARD_EYE: Final = (0.05, 0.2, 0.82)
"""Driver's eyes as shares of length, width and height, where an asset does not say."""
_LEVEL_ERROR_PX: Final = 0.7
"""A coarser level of detail is taken where it is nowhere farther from the finest than this share of a pixel."""

_CROWD_ERROR_PX: Final = 1.4
"""For plants: an edge that is off is seen, but nobody tells one leaf of a few pixels from its neighbours."""

_UNSEEN_FACTOR: Final = 4.0
"""By how much an error may be larger where no camera looks: of such things shadows, reflections and scattered light are seen.
The sun alone blurs a shadow's edge by six pixels of a camera with 640 of them across 60 degrees."""

_MARGIN_RAD: Final = math.radians(5.0)
"""Things within this angle of the picture's corners count as seen: they, or the camera, may turn during the exposure."""

_streets: OrderedDict[str, Street] = OrderedDict()


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Where a camera is (3,) [m], the angle [rad] that its finest pixel sees, its direction, and the angle to its corners."""

    origin_m: tuple[float, float, float]
    pixel_rad: float
    forward: tuple[float, float, float]
    half_angle_rad: float

    def may_see(self, centre_m: Array, radius_m: float) -> bool:
        """Return whether a ball may be in the picture."""
        towards = centre_m - np.array(self.origin_m)
        distance_m = float(np.linalg.norm(towards))
        if distance_m <= radius_m:
            return True
        angle_rad = math.acos(min(1.0, max(-1.0, float(towards @ np.array(self.forward)) / distance_m)))
        return angle_rad - math.asin(radius_m / distance_m) <= self.half_angle_rad + _MARGIN_RAD


@dataclass(frozen=True, slots=True, eq=False)
class StreetView:
    """A street at a moment, as a recipe looks at it."""

    street: Street
    moment: StreetMoment
    ego: PlacedAsset | None
    targets: tuple[PlacedAsset, ...]
    notes: tuple[str, ...]


# The street ----------------------------------------------------------------------------------------------------------


def street_view(document: TrafficDocument, context: Context) -> StreetView:
    """Return the street of a recipe with its ego and targets; streets are kept, so that a clip makes one for all frames.

    Raises RecipeError for roads that cannot be read, traffic without assets, an ego that is nowhere, targets off the road.
    """
    from fullwell.traffic.street import Street  # noqa: PLC0415 - SUMO is an extra

    path = "scene.traffic"
    shelf, digests = _shelf(document, context)
    spec = _spec(document, context)
    key = digest_of([_spec_key(spec, context), digests])
    with located(path):
        if key not in _streets:
            while len(_streets) >= _KEPT_STREETS:
                _streets.popitem(last=False)
            _streets[key] = Street(spec, shelf, path=path)
        _streets.move_to_end(key)
        street = _streets[key]
        moment = street.moment(spec.times_s.index(document.time_s))
        ego = None if document.ego is None else _ego(document, moment, street)
        wanted = enumerate(document.targets)
        targets = tuple(_target(target, f"{path}.targets[{number}]", ego, street, shelf) for number, target in wanted)
    moment, notes = _without(moment, targets)
    return StreetView(street, moment, ego, targets, notes)


def _shelf(document: TrafficDocument, context: Context) -> tuple[AssetShelf, list[str]]:
    """Return the assets to draw from, and their digests: those that the recipe is pinned to, or that the store has now."""
    from fullwell.traffic.placement import AssetShelf  # noqa: PLC0415

    path = "scene.traffic"
    if context.assets is None:
        fail(path, "needs assets, but no asset store is at hand here. Run it where one is.")
    by_class: dict[str, list[Any]] = {}
    digests: list[str] = []
    for query in traffic_queries(document):
        pins = candidates_of(context.document, context.assets, query, path)
        with located(path):
            by_class[query.asset_class] = [context.assets.manifest(digest) for _, digest in pins]
        digests += [digest for _, digest in pins]
    return AssetShelf(by_class), digests


def _spec(document: TrafficDocument, context: Context) -> StreetSpec:
    from fullwell.traffic.demand import JUNCTION_SHARES, preset  # noqa: PLC0415
    from fullwell.traffic.networks import NetworkSpec  # noqa: PLC0415
    from fullwell.traffic.simulation import TrafficDemand  # noqa: PLC0415
    from fullwell.traffic.street import StreetSpec  # noqa: PLC0415

    run, own_network = _run(document, context)
    network = NetworkSpec(file=own_network)
    if document.network is not None:
        network = _network(document.network, context)
    demand = document.demand or DemandDocument()
    kinds = sorted(demand.by_kind().items())
    times = set(context.moments_s) if document.time_s in context.moments_s else {document.time_s}
    if document.ego is not None and document.ego.id is None and document.ego.chosen_at_s is not None:
        times.add(document.ego.chosen_at_s)
    return StreetSpec(
        network=network,
        demand=TrafficDemand(
            {kind: entry.rate_per_s for kind, entry in kinds if entry.rate_per_s > 0},
            {kind: entry.density_per_km for kind, entry in kinds if entry.density_per_km > 0},
            preset(demand.preset, demand.level, without=[kind for kind, _ in kinds]) if demand.preset else {},
            JUNCTION_SHARES.get(demand.preset or "", 1.0),
        ),
        style=document.style,
        run=run,
        times_s=tuple(sorted(times)),
        lamps=document.lamps,
        dressed=document.dressed,
        wet=document.wet,
        season=document.season,
        seed=context.seed,
    )


def _network(roads: RoadNetworkDocument, context: Context) -> NetworkSpec:
    from fullwell.traffic.networks import NetworkSpec  # noqa: PLC0415
    from fullwell.traffic.templates import CrossSection  # noqa: PLC0415

    section = CrossSection(
        lanes=roads.lanes,
        lane_width_m=roads.lane_width_m,
        sidewalk_width_m=roads.sidewalk_width_m,
        parking_width_m=roads.parking_width_m,
        bike_lane_width_m=roads.bike_lane_width_m,
        bus_lane_width_m=roads.bus_lane_width_m,
        tram_lane_width_m=roads.tram_lane_width_m,
        speed_m_s=roads.speed_limit_m_s,
    )
    return NetworkSpec(
        layout=roads.layout or "",
        file=None if roads.file is None else _file(roads.file, "scene.traffic.network.file", context),
        section=section,
        length_m=roads.length_m,
        size=roads.size,
        signals=roads.signals,
        seed=roads.seed,
    )


def _run(document: TrafficDocument, context: Context) -> tuple[RecordedRun | OwnRun | None, Path | None]:
    """Return the user's own run, and its network where it brings one."""
    from fullwell.traffic.own_runs import read_configuration  # noqa: PLC0415
    from fullwell.traffic.street import RecordedRun  # noqa: PLC0415

    if document.run is None:
        return None, None
    path, reference = "scene.traffic.run.file", document.run.file
    file = _file(reference, path, context)
    if not document.run.is_configuration:
        signals = document.run.signals
        states = None if signals is None else _file(signals.file, "scene.traffic.run.signals.file", context)
        return RecordedRun(file, states), None

    def find(named: str) -> Path:
        """Return a file that the configuration names: relative to its folder, within the recipe's as all files are."""
        where = posixpath.normpath(posixpath.join(posixpath.dirname(reference), named))
        return _file(where, f"{path} names a file that", context)

    with located(path):
        own = read_configuration(file, find, path=path)
    if own.left_out:
        context.warn(f"{path}: options of the configuration that were not taken over: {', '.join(own.left_out)}.")
    return own, own.network


def _file(reference: str, path: str, context: Context) -> Path:
    file, context.used_files[reference] = context.files.find(reference, path)
    return file


def _spec_key(spec: StreetSpec, context: Context) -> list[Any]:
    """Return what decides a street: files by their content."""
    named = spec.network.file is not None or spec.run is not None
    used = sorted(context.used_files.items()) if named else []
    plain = replace(spec, network=replace(spec.network, file=None), run=None)
    return [repr(plain), [list(entry) for entry in used], spec.network.file is not None, type(spec.run).__name__]


# Ego, mounts, targets ------------------------------------------------------------------------------------------------


def _ego(document: TrafficDocument, moment: StreetMoment, street: Street) -> PlacedAsset:
    """Return the vehicle that carries the cameras, where it is at the moment. Raises RecipeError where there is none."""
    path, wanted = "scene.traffic.ego", document.ego
    assert wanted is not None
    if wanted.id is not None:
        return _mover(wanted.id, f"{path}.id", moment, street)
    if wanted.chosen_at_s is None or wanted.chosen_at_s == moment.time_s:
        return _chosen(wanted, moment, street)
    start = street.moment(street.spec.times_s.index(wanted.chosen_at_s))
    return _mover(_chosen(wanted, start, street).id, path, moment, street)


def _mover(name: str, path: str, moment: StreetMoment, street: Street) -> PlacedAsset:
    movers = [item for item in moment.assets if item.mover is not None]
    found = next((item for item in movers if item.id == name), None)
    if found is not None:
        return found
    if name in moment.overlapping:
        fail(path, f"is {name!r}, which overlaps another at {moment.time_s:g} s and was left out. Choose another.", name)
    if name in street.ids_seen(before_s=moment.time_s):
        fail(path, f"is {name!r}, which has left the network at {moment.time_s:g} s. Choose an earlier time, or another.", name)
    known = unknown_name_message("vehicle", name, [item.id for item in movers])
    return fail(path, f"is not in the network at {moment.time_s:g} s: {known}", name)


def _chosen(wanted: EgoDocument, moment: StreetMoment, street: Street) -> PlacedAsset:
    movers = [item for item in moment.assets if item.mover is not None]
    kinds = [item for item in movers if item.mover is not None and item.mover.kind == wanted.kind]
    fitting = [item for item in kinds if _fits(item, wanted, movers, street)]
    if not fitting:
        fail(
            "scene.traffic.ego",
            f"fits none of the {len(kinds)} vehicles of kind {wanted.kind!r} in the network at {moment.time_s:g} s. Relax "
            "its conditions, raise the demand, or choose another time.",
        )
    return min(fitting, key=lambda item: item.id)


def _fits(item: PlacedAsset, wanted: EgoDocument, movers: Sequence[PlacedAsset], street: Street) -> bool:
    assert item.mover is not None
    speed = item.mover.speed_m_s
    if speed < wanted.min_speed_m_s or (wanted.max_speed_m_s is not None and speed > wanted.max_speed_m_s):
        return False
    if wanted.lane is not None and not fnmatchcase(item.mover.lane, wanted.lane):
        return False
    lane = street.lane(item.mover.lane)
    if wanted.min_road_ahead_m > 0 and (lane is None or lane.length_m - item.mover.position_m < wanted.min_road_ahead_m):
        return False
    return wanted.vehicle_ahead_m is None or street.gap_ahead_m(item, movers, wanted.vehicle_ahead_m) is not None


def mount_pose(document: MountDocument, view: StreetView | None, path: str) -> Array:
    """Return the (4, 4) camera-to-world pose of a camera on the ego. Raises RecipeError where the scene has none."""
    if view is None or view.ego is None:
        fail(path, "needs scene.traffic with an ego; add them, or give origin_m and target_m.")
    ego = view.ego
    place = _place_m(document, ego)
    backwards = 180.0 if document.at == "rear" else 0.0
    yaw, pitch, roll = (math.radians(angle) for angle in (document.yaw_deg + backwards, document.pitch_deg, document.roll_deg))
    forward = np.array([math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch)])
    left = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
    up = np.cross(forward, left)
    up = math.cos(roll) * up - math.sin(roll) * left
    to_world = ego.to_world()
    origin = (to_world @ np.append(place, 1.0))[:3]
    try:
        return look_at(origin, origin + to_world[:3, :3] @ forward, to_world[:3, :3] @ up)
    except FieldError as error:
        fail(path, f"points nowhere: {error.message}")


def _place_m(document: MountDocument, ego: PlacedAsset) -> Array:
    length, width, height = ego.asset.size_m
    if not isinstance(document.at, str):
        return np.array(document.at, dtype=np.float64)
    said = ego.asset.attributes
    eye = [
        float(said[f"driver_eye_{axis}_m"]) if f"driver_eye_{axis}_m" in said else share * side
        for axis, share, side in zip("xyz", _STANDARD_EYE, (length, width, height), strict=True)
    ]
    return np.array(
        {
            "windscreen": [eye[0] + 0.55, 0.0, min(eye[2] + 0.12, 0.93 * height)],
            "driver": eye,
            "bumper": [length / 2 + 0.03, 0.0, min(0.6, 0.4 * height)],
            "roof": [0.0, 0.0, height + 0.12],
            "mirror_left": [0.17 * length, width / 2 + 0.05, 0.7 * height],
            "mirror_right": [0.17 * length, -width / 2 - 0.05, 0.7 * height],
            "rear": [-length / 2 - 0.03, 0.0, 0.72 * height],
        }[document.at]
    )


def _target(document: TargetDocument, path: str, ego: PlacedAsset | None, street: Street, shelf: AssetShelf) -> PlacedAsset:
    from fullwell.core.rng import stream  # noqa: PLC0415
    from fullwell.traffic.placement import PlacedAsset  # noqa: PLC0415

    assert ego is not None
    choices = [
        asset
        for asset in shelf.all(document.asset_class)
        if set(document.tags) <= set(asset.tags) and document.asset in (None, asset.id)
    ]
    if not choices:
        fail(path, f"finds no asset of class {document.asset_class!r} with its tags among those that the scene may draw.")
    asset = choices[int(stream(street.spec.seed, "target", document.id).integers(len(choices)))]
    place = street.ahead_of(ego, document.distance_m, lane=document.lane)
    if place is None:
        fail(
            f"{path}.distance_m",
            f"is {document.distance_m:g} m; the road ahead of the ego ends before, or has no lane {document.lane:+d} there. "
            "Choose another ego (min_road_ahead_m) or a longer road.",
            document.distance_m,
        )
    point, direction = place
    left = np.array([-direction[1], direction[0], 0.0])
    yaw = math.atan2(direction[1], direction[0]) + math.radians(document.facing_deg)
    # The nearest point of the target is at the distance, whichever way it faces.
    turn = math.radians(document.facing_deg)
    half = abs(asset.size_m[0] / 2 * math.cos(turn)) + abs(asset.size_m[1] / 2 * math.sin(turn))
    centre = point + half * direction + document.lateral_m * left
    return PlacedAsset(document.id, asset, "mover", centre, yaw)


def _without(moment: StreetMoment, targets: Sequence[PlacedAsset]) -> tuple[StreetMoment, tuple[str, ...]]:
    if not targets:
        return moment, moment.notes
    outlines = [target.outline(0.3) for target in targets]
    kept = tuple(
        item
        for item in moment.assets
        if item.role in ("building", "light", "signal") or not any(outline.intersects(item.outline()) for outline in outlines)
    )
    dropped = len(moment.assets) - len(kept)
    notes = (*moment.notes, f"{dropped} objects were left out where targets stand.") if dropped else moment.notes
    return replace(moment, assets=kept), notes


# Objects -------------------------------------------------------------------------------------------------------------


def street_objects(
    document: TrafficDocument, view: StreetView, viewpoints: Sequence[Viewpoint], context: Context
) -> tuple[list[SceneObject], list[Light]]:
    """Return the ground, everything within range of a camera at the coarsest level that looks the same, and beams of lamps."""
    objects: list[SceneObject] = []
    lights: list[Light] = []
    for surface in view.street.surfaces:
        material, _ = catalogue_material(surface.material, "scene.traffic", context)
        share = document.dirt.roads * ROAD_DIRT.get(surface.name, 0.0)
        material = soiled(surface.material, material, share, context.materials, road=True)
        mesh = Mesh(surface.vertices_m, surface.faces.astype(np.uint32))
        name = f"street/{surface.name}/{surface.material.replace('/', '-')}"
        objects.append(SceneObject(name, surface.name, (Part(mesh, material),), np.eye(4)))
    shown = [item for item in (*view.moment.assets, *view.targets) if item is not view.ego or document.ego_is_shown]
    far = 0
    parts: dict[Any, tuple[Part, ...]] = {}
    drawn: dict[tuple[str, int], DrawnAsset] = {}
    for item in shown:
        radius_m = float(np.linalg.norm(item.asset.size_m)) / 2
        distances = [max(float(np.linalg.norm(item.position_m - np.array(v.origin_m))) - radius_m, 0.05) for v in viewpoints]
        if min(distances) > document.range_m:
            far += 1
            continue
        level = _level(item, distances, viewpoints)
        if (item.asset.digest, level) not in drawn:
            drawn[item.asset.digest, level] = _drawn(item, level, context)
        asset = drawn[item.asset.digest, level]
        hidden = tuple(document.ego.hide) if document.ego is not None and item is view.ego else ()
        lamps = tuple(lamp_material(part.material.name, item, document, context.seed) for part in item.asset.parts)
        dirt = dirt_of_vehicle(document.dirt.vehicles, context.seed, item.id) if _is_vehicle(item) else 0.0
        key = (item.asset.digest, level, item.lit, item.paint, hidden, lamps, dirt)
        if key not in parts:
            made = _parts(asset, item, document, context, dirt=dirt)
            parts[key] = tuple(part for part in made if not _matches(part.name, hidden))
        if not parts[key]:
            fail("scene.traffic.ego.hide", "leaves nothing of the ego; leave out a pattern, or set show: false.")
        objects.append(SceneObject(item.id, item.asset.asset_class, parts[key], item.to_world(), (asset.licence,)))
        lights += headlamp_beams(document, item, asset, context.seed)
    if view.ego is not None and not document.ego_is_shown:
        level = len(view.ego.asset.levels) - 1  # it is not seen; only where its lamps are
        lights += headlamp_beams(document, view.ego, _drawn(view.ego, level, context), context.seed)
    for note in view.notes:
        context.warn(f"scene.traffic: {note}")
    if far:
        context.warn(f"scene.traffic: {far} objects beyond range_m = {document.range_m:g} m from every camera are left out.")
    return objects, lights


def _matches(name: str, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _level(item: PlacedAsset, distances_m: Sequence[float], viewpoints: Sequence[Viewpoint]) -> int:
    """Return the coarsest level whose error is too small to be seen from any camera."""
    is_crowd = ASSET_CLASSES[item.asset.asset_class].group == "vegetation"
    most_px = _CROWD_ERROR_PX if is_crowd else _LEVEL_ERROR_PX
    centre_m = item.position_m + np.array([0.0, 0.0, item.asset.size_m[2] / 2])
    radius_m = float(np.linalg.norm(item.asset.size_m)) / 2
    allowed_m = math.inf
    for distance_m, view in zip(distances_m, viewpoints, strict=True):
        factor = 1.0 if view.may_see(centre_m, radius_m) else _UNSEEN_FACTOR
        allowed_m = min(allowed_m, factor * most_px * view.pixel_rad * distance_m)
    fitting = [number for number, level in enumerate(item.asset.levels) if level.error_m <= allowed_m]
    return max(fitting, default=0)


def _drawn(item: PlacedAsset, level: int, context: Context) -> DrawnAsset:
    assert context.assets is not None
    with located("scene.traffic"):
        file = context.assets.level_file(item.asset, level)
        return DrawnAsset(item.asset, context.files.level(file, item.asset.levels[level].sha256, path="scene.traffic"))


def _is_vehicle(item: PlacedAsset) -> bool:
    return ASSET_CLASSES[item.asset.asset_class].group == "vehicle"


def _parts(asset: DrawnAsset, item: PlacedAsset, document: TrafficDocument, context: Context, *, dirt: float) -> Iterator[Part]:
    paintable = {part.name for part in asset.manifest.parts if part.paintable}
    for loaded in asset.model.parts:
        material: Material
        emission: Emission | None
        name = asset.record(loaded, "scene.traffic").material.name
        lamp = lamp_material(name, item, document, context.seed) if name.startswith("lamp/") else ""
        if item.paint and loaded.name in paintable:
            name = item.paint
            material, emission = catalogue_material(item.paint, "scene.traffic", context)
        elif lamp:
            material, emission = catalogue_material(lamp, "scene.traffic", context, lit=_matches(loaded.name, item.lit))
            emission = None if emission is None else bright_as_its_kind(emission, lamp, loaded, item)
        else:
            material, emission = asset_part_material(asset, loaded, item.lit, f"scene.traffic ({item.asset.id})", context)
        mesh = Mesh(loaded.vertices_m, loaded.faces, loaded.normals, loaded.uv)
        if dirt <= 0 or emission is not None or not name:
            yield Part(mesh, material, np.eye(4), emission, loaded.name)
            continue
        for band, share in by_height(mesh, dirt):
            yield Part(band, soiled(name, material, share, context.materials), np.eye(4), None, loaded.name)
