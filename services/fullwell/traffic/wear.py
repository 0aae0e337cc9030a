"""What use and weather leave on the ground: repairs, sealed cracks, manholes, gullies; dry patches, fields, the horizon.

All seeded, a stream for each rule and lane. Sizes: manhole covers of 0.6 m (EN 124), gullies of 0.5 m by 0.3 m; repairs are
trenches of 0.9 m or whole lanes. Repairs lie 2 mm above the road and under its markings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray

from fullwell.core.rng import stream
from fullwell.traffic.ribbons import along, cut, length_m, offset, ribbon
from fullwell.traffic.roads import Lane, RoadNetwork
from fullwell.traffic.surfaces import TERRAIN_MARGIN_M, GroundPlan, RoadStyle, RoadSurface, terrain_m

__all__ = ["far_ground", "ground_cover", "road_wear"]

Array = NDArray[np.float64]

_REPAIR_M: Final = 0.002
_SEAL_M: Final = 0.0025
_COVER_M: Final = 0.003
"""Heights above the road; markings lie at 4 mm."""
_REPAIRS_PER_M: Final = 1 / 60.0
_SEALS_PER_M: Final = 1 / 45.0
_COVERS_PER_M: Final = 1 / 40.0
_GULLY_EVERY_M: Final = 25.0
_COVER_RADIUS_M: Final = 0.3
_KEEP_OFF_M: Final = 4.0
"""Of the ends of lanes: stop lines and crossings."""
_MEADOW_M: Final = 0.002
_FIELD_M: Final = 0.004
_PATCH_M: Final = 0.006
"""Heights above the ground."""
_MEADOW_OFF_M: Final = 0.3
_HORIZON_M: Final = 9000.0
"""The flat ground goes on so far: from 1.5 m above it the horizon is then 0.6' low, a tenth of a pixel."""


def road_wear(network: RoadNetwork, style: RoadStyle, *, seed: int) -> list[RoadSurface]:
    """Return repairs and sealed cracks of asphalt, and covers of cast iron, as surfaces of class "road"."""
    found: dict[str, list[tuple[Array, NDArray[np.int64]]]] = {}
    if style.road == "asphalt/worn":  # a film of water makes all asphalt one, and what is new has no repairs
        for lane in network.of_kind("drive", "bus"):
            rng = stream(seed, "street", "wear", lane.id)
            found.setdefault("asphalt/new", []).extend([*_repairs(lane, rng), *_seals(lane, rng)])
    for lane in network.of_kind("drive"):
        if style.covers:
            found.setdefault("metal/cast_iron", []).extend(_covers(lane, stream(seed, "street", "covers", lane.id)))
    if style.covers:
        for lane in _beside_pavements(network):
            found.setdefault("metal/cast_iron", []).extend(_gullies(lane, stream(seed, "street", "gullies", lane.id)))
    return [_surface("road", material, pieces) for material, pieces in found.items() if pieces]


def ground_cover(plan: GroundPlan, style: RoadStyle, *, seed: int) -> list[RoadSurface]:
    """Return what varies grassy ground: meadow that is drier than the rest, patches of dry grass and bare soil near roads, and
    fields farther off where the style has any."""
    if not style.ground.startswith("grass"):
        return []
    roads = shapely.union_all([plan.carriageway, plan.walk])
    shapely.prepare(roads)
    found: dict[str, list[tuple[Array, NDArray[np.int64]]]] = {}
    level_m = terrain_m(plan)
    taken: list[shapely.Polygon] = []
    rules = [("field", style.fields, _field, 14.0, 260.0)] if plan.heights.flat else []
    rules.append(("patch", style.bare_patches, _patch, 0.6, 70.0))
    for name, wanted, make, nearest_m, farthest_m in rules:
        rng = stream(seed, "street", "ground", name)
        west, south, east, north = roads.buffer(farthest_m, quad_segs=2).bounds
        for _ in range(wanted):
            centre = rng.uniform([west, south], [east, north])
            outline, material = make(rng, centre)
            polygon = shapely.Polygon(outline)
            if shapely.distance(roads, polygon) < nearest_m or any(polygon.intersects(other) for other in taken):
                continue
            taken.append(polygon)
            raised_m = level_m + (_PATCH_M if name == "patch" else _FIELD_M)
            found.setdefault(material, []).append(_fan(outline, centre, plan, raised_m))
    blots = stream(seed, "street", "ground", "meadow")
    meadow = list(_meadow(roads, plan, style.bare_patches, level_m + _MEADOW_M, blots))
    if meadow:
        found["grass/meadow"] = meadow
    return [_surface("terrain", material, pieces) for material, pieces in found.items()]


def far_ground(plan: GroundPlan, style: RoadStyle) -> RoadSurface:
    """Return the ground beyond the terrain of `road_surfaces`, out to the horizon: without it sky would show below it."""
    box = shapely.box(*plan.carriageway.union(plan.walk).bounds).buffer(TERRAIN_MARGIN_M, join_style="mitre")
    ring = box.exterior if plan.heights.flat else shapely.segmentize(box, 60.0).exterior
    inner = np.asarray(shapely.orient_polygons(shapely.Polygon(ring)).exterior.coords)[:, :2]
    centre = inner[:-1].mean(axis=0)
    outer = centre + (inner - centre) * (_HORIZON_M / np.abs(inner - centre).max(axis=0).min())
    level = plan.heights.at(inner) + terrain_m(plan)
    vertices = np.concatenate([np.column_stack([inner, level]), np.column_stack([outer, np.full(len(outer), level.mean())])])
    here, count = np.arange(len(inner) - 1), len(inner)
    faces = [np.stack([here, here + count, here + 1 + count], axis=1), np.stack([here, here + 1 + count, here + 1], axis=1)]
    return RoadSurface("terrain", style.ground, vertices, np.concatenate(faces).astype(np.int64))


# Roads ---------------------------------------------------------------------------------------------------------------


def _free_m(lane: Lane) -> float:
    return length_m(lane.centre_m) - 2 * _KEEP_OFF_M


def _repairs(lane: Lane, rng: np.random.Generator) -> Iterator[tuple[Array, NDArray[np.int64]]]:
    free = _free_m(lane)
    place_m = _KEEP_OFF_M
    for _ in range(int(rng.poisson(max(free, 0.0) * _REPAIRS_PER_M))):
        long_m, whole, aside, gap_m = rng.uniform(1.2, 9.0), rng.random() < 0.3, rng.uniform(-1, 1), rng.exponential(30.0)
        place_m += gap_m
        if place_m + long_m > _KEEP_OFF_M + free:
            return
        wide_m = lane.width_m - 0.5 if whole else min(0.9, lane.width_m - 0.5)
        line = cut(lane.centre_m, place_m, place_m + long_m)
        yield ribbon(offset(line, aside * (lane.width_m - 0.5 - wide_m) / 2), wide_m, raised_m=_REPAIR_M)
        place_m += long_m


def _seals(lane: Lane, rng: np.random.Generator) -> Iterator[tuple[Array, NDArray[np.int64]]]:
    """Bands of bitumen, 6 cm wide, that follow cracks along or across the lane."""
    free = _free_m(lane)
    for _ in range(int(rng.poisson(max(free, 0.0) * _SEALS_PER_M))):
        lengthwise = rng.random() < 0.6
        long_m = min(rng.uniform(4.0, 16.0) if lengthwise else lane.width_m - 0.4, free)
        start_m, aside_m = rng.uniform(0.0, max(free - long_m, 0.1)), rng.uniform(-0.35, 0.35) * lane.width_m
        steps = np.linspace(0.0, long_m, max(int(long_m / 0.5), 4))
        wander = np.cumsum(rng.normal(0.0, 0.06, len(steps)))
        if lengthwise:
            reach = lane.width_m / 2 - 0.25
            middle, sideways = along(lane.centre_m, _KEEP_OFF_M + start_m + steps), np.clip(aside_m + wander, -reach, reach)
        else:
            middle = along(lane.centre_m, _KEEP_OFF_M + start_m + wander - wander.min())
            sideways = steps - long_m / 2
        here, ahead = along(lane.centre_m, np.array([_KEEP_OFF_M + start_m, _KEEP_OFF_M + start_m + 1.0]))
        direction = (ahead - here)[:2] / max(float(np.linalg.norm((ahead - here)[:2])), 1e-9)
        line = middle.copy()
        line[:, :2] += sideways[:, None] * np.array([-direction[1], direction[0]])
        yield ribbon(line, 0.06, raised_m=_SEAL_M)


def _covers(lane: Lane, rng: np.random.Generator) -> Iterator[tuple[Array, NDArray[np.int64]]]:
    free = _free_m(lane)
    for _ in range(int(rng.poisson(max(free, 0.0) * _COVERS_PER_M))):
        centre = along(lane.centre_m, np.array([_KEEP_OFF_M + rng.uniform(0.0, free)]))[0]
        angle = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))]) * _COVER_RADIUS_M
        vertices = np.concatenate([[centre], centre + around])
        vertices[:, 2] += _COVER_M
        here = np.arange(len(angle))
        yield vertices, np.column_stack([np.zeros(len(angle)), 1 + here, 1 + (here + 1) % len(angle)]).astype(np.int64)


def _beside_pavements(network: RoadNetwork) -> list[Lane]:
    """Return the lane next to each sidewalk, whose right edge is a kerb."""
    walks = {lane.edge_id: lane.index for lane in network.of_kind("sidewalk")}
    lanes = network.of_kind("drive", "bus", "parking", "bike")
    return [lane for lane in lanes if walks.get(lane.edge_id, -2) == lane.index - 1]


def _gullies(lane: Lane, rng: np.random.Generator) -> Iterator[tuple[Array, NDArray[np.int64]]]:
    line = offset(lane.centre_m, -(lane.width_m / 2 - 0.2))
    place_m = _KEEP_OFF_M + rng.uniform(0.0, _GULLY_EVERY_M)
    while place_m < length_m(line) - _KEEP_OFF_M:
        yield ribbon(cut(line, place_m, place_m + 0.5), 0.3, raised_m=_COVER_M)
        place_m += _GULLY_EVERY_M * rng.uniform(0.85, 1.15)


# Ground --------------------------------------------------------------------------------------------------------------


def _meadow(
    roads: shapely.Geometry, plan: GroundPlan, wanted: int, raised_m: float, rng: np.random.Generator
) -> Iterator[tuple[Array, NDArray[np.int64]]]:
    """Blots of 3 to 20 m without straight sides, under patches and fields."""
    west, south, east, north = roads.buffer(90.0, quad_segs=2).bounds
    angle = np.linspace(0.0, 2 * np.pi, 28, endpoint=False)
    taken: list[shapely.Polygon] = []
    for _ in range(wanted):
        centre, radius_m = rng.uniform([west, south], [east, north]), rng.uniform(3.0, 20.0)
        waves = sum(rng.uniform(0.05, 0.25) * np.sin(count * angle + rng.uniform(0, 2 * np.pi)) for count in (2, 3, 5, 9))
        reach = radius_m * (1.0 + waves)
        outline = centre + np.column_stack([np.cos(angle) * reach, np.sin(angle) * reach * rng.uniform(0.5, 1.0)])
        polygon = shapely.Polygon(outline)
        free = polygon.is_valid and shapely.distance(roads, polygon) > _MEADOW_OFF_M
        if free and not any(polygon.intersects(other) for other in taken):
            taken.append(polygon)
            yield _fan(outline, centre, plan, raised_m)


def _patch(rng: np.random.Generator, centre: Array) -> tuple[Array, str]:
    """An uneven round patch, and what grows there."""
    radius_m = rng.uniform(0.5, 3.5)
    angle = np.linspace(0.0, 2 * np.pi, 14, endpoint=False)
    uneven = radius_m * (1 + 0.3 * np.sin(2 * angle + rng.uniform(0, 6)) + 0.18 * rng.normal(size=len(angle)).clip(-1.5, 1.5))
    outline = centre + np.column_stack([np.cos(angle) * uneven, np.sin(angle) * 0.7 * uneven])
    return outline, "grass/dry" if rng.random() < 0.8 else "soil/earth"


def _field(rng: np.random.Generator, centre: Array) -> tuple[Array, str]:
    """A field with straight sides, ploughed, mown or green."""
    half = rng.uniform([30.0, 18.0], [80.0, 50.0])
    turn = rng.uniform(0.0, math.pi)
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half * rng.uniform(0.85, 1.0, (4, 2))
    cosine, sine = math.cos(turn), math.sin(turn)
    material = ("grass/dry", "soil/earth", "foliage/hedge", "grass/dry")[int(rng.integers(4))]
    return centre + corners @ np.array([[cosine, sine], [-sine, cosine]]), material


def _fan(outline: Array, centre: Array, plan: GroundPlan, raised_m: float) -> tuple[Array, NDArray[np.int64]]:
    places = np.concatenate([[centre], outline])
    vertices = np.column_stack([places, plan.heights.at(places) + raised_m])
    here, count = np.arange(len(outline)), len(outline)
    return vertices, np.column_stack([np.zeros(count), 1 + here, 1 + (here + 1) % count]).astype(np.int64)


def _surface(name: str, material: str, pieces: Sequence[tuple[Array, NDArray[np.int64]]]) -> RoadSurface:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    faces = np.concatenate([triangles + start for (_, triangles), start in zip(pieces, starts[:-1], strict=True)])
    return RoadSurface(name, material, np.concatenate([vertices for vertices, _ in pieces]), faces)
