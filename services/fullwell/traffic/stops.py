"""Bus stops: where buses stop in a network, and the shelters there. They do not depend on how the street is dressed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final
from xml.sax.saxutils import quoteattr

import numpy as np

from fullwell.core.rng import stream
from fullwell.traffic.dressing import with_lights
from fullwell.traffic.placement import AssetShelf, Footprints, PlacedAsset
from fullwell.traffic.ribbons import offset
from fullwell.traffic.roads import Lane, RoadNetwork
from fullwell.traffic.surfaces import KERB_HEIGHT_M

__all__ = ["BusStop", "bus_stops", "stop_elements", "with_shelters"]

_SHORTEST_ROAD_M: Final = 60.0
_SHARE: Final = 0.4
"""Of roads that are long enough, on each side."""
_STOP_M: Final = 15.0
"""Length of a stop: a bus of 12 m and room to pull up."""
_FROM_FRONT_M: Final = 3.5
"""How far a shelter stands behind the place of the bus's front, about at its first door."""
_KERB_GAP_M: Final = 0.45


@dataclass(frozen=True, slots=True)
class BusStop:
    """A stretch of a lane [m from its start] where buses stop, the front at `end_m`."""

    id: str
    edge_id: str
    lane_id: str
    start_m: float
    end_m: float


def bus_stops(network: RoadNetwork, *, seed: int) -> tuple[BusStop, ...]:
    """Return the stops of a network: on a share of the roads that have a sidewalk and room, each with a stream of its own."""
    stops = []
    for edge, lanes in sorted(_lanes_by_edge(network).items()):
        buses = [lane for lane in lanes if lane.kind in ("bus", "drive")]
        rng = stream(seed, "bus stop", edge)
        if not buses or not any(lane.kind == "sidewalk" for lane in lanes) or rng.random() >= _SHARE:
            continue
        lane = min(buses, key=lambda lane: lane.index)
        if lane.length_m >= _SHORTEST_ROAD_M:
            end_m = lane.length_m * rng.uniform(0.5, 0.75)
            stops.append(BusStop(f"stop/{edge}", edge, lane.id, end_m - _STOP_M, end_m))
    return tuple(stops)


def _lanes_by_edge(network: RoadNetwork) -> dict[str, list[Lane]]:
    found: dict[str, list[Lane]] = {}
    for lane in network.of_kind("bus", "drive", "sidewalk"):
        found.setdefault(lane.edge_id, []).append(lane)
    return found


def stop_elements(stops: Sequence[BusStop]) -> str:
    """Return the stops as elements of an additional file of SUMO."""
    return "".join(
        f'<busStop id={quoteattr(stop.id)} lane={quoteattr(stop.lane_id)} startPos="{stop.start_m:.2f}" '
        f'endPos="{stop.end_m:.2f}" friendlyPos="true"/>'
        for stop in stops
    )


def with_shelters(
    standing: Sequence[PlacedAsset],
    stops: Sequence[BusStop],
    network: RoadNetwork,
    shelf: AssetShelf,
    *,
    seed: int,
    lights_on: bool,
) -> tuple[PlacedAsset, ...]:
    """Return what stands along the roads with shelters at the stops, and none elsewhere; furniture and trees make way."""
    shelters = [with_lights(item) if lights_on else item for item in _shelters(stops, network, shelf, seed)]
    if not shelters:
        return tuple(standing)
    taken = Footprints()
    fixed = [item for item in standing if item.role not in ("furniture", "vegetation")]
    for item in fixed:
        taken.take(item.outline())
    placed = [item for item in shelters if taken.claim(item.outline())]
    way = Footprints()
    for item in placed:
        way.take(item.outline(0.3))
    kept = [
        item
        for item in standing
        if item.asset.asset_class != "bus_stop"
        and (item.role not in ("furniture", "vegetation") or way.is_free(item.outline()))
    ]
    return (*kept, *placed)


def _shelters(stops: Sequence[BusStop], network: RoadNetwork, shelf: AssetShelf, seed: int) -> Iterator[PlacedAsset]:
    """Yield a shelter at each stop that faces the road from its pavement, at the kerb."""
    walks = {lane.edge_id: lane for lane in network.of_kind("sidewalk")}
    lanes = {lane.id: lane for lane in network.lanes}
    for stop in stops:
        walk, rng = walks[stop.edge_id], stream(seed, "shelter", stop.id)
        asset = shelf.draw(rng, "bus_stop", largest_m=(walk.width_m - 1.0, _STOP_M))
        if asset is None:
            continue
        share = (stop.end_m - _FROM_FRONT_M) / lanes[stop.lane_id].length_m
        line = offset(walk.centre_m, walk.width_m / 2 - _KERB_GAP_M - asset.size_m[0] / 2)
        beside = Lane(walk.id, walk.edge_id, walk.index, walk.kind, line, walk.width_m, walk.speed_m_s)
        point, direction = beside.at(share * beside.length_m)
        yaw = math.atan2(direction[1], direction[0]) + math.pi / 2
        yield PlacedAsset(f"bus_stop/{stop.edge_id}", asset, "furniture", point + np.array([0.0, 0.0, KERB_HEIGHT_M]), yaw)
