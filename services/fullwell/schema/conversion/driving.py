"""What labels may tell of a street: road users, lanes, regions and signals as plain facts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.scene.motion import (
    DrivingFacts,
    EgoFacts,
    GroundRegion,
    LaneFacts,
    MapFacts,
    RoadUser,
    SignalFacts,
    SignalLinkFacts,
)

if TYPE_CHECKING:
    from fullwell.schema.conversion.traffic import StreetView
    from fullwell.traffic.placement import PlacedAsset
    from fullwell.traffic.roads import Lane
    from fullwell.traffic.street import Street

__all__ = ["driving_facts"]

Array = NDArray[np.float64]

_FINE_M: Final = 4.0
"""Outlines are cut to this length where the network has slopes, as the surfaces are."""
_SMALLEST_M2: Final = 0.02
_LETTERS: Final = "GgyurRsoO"
"""In the order in which a light that controls several movements shows them."""
_LIGHTS: Final = ("red", "amber", "green")


def driving_facts(view: StreetView, *, places_m: Sequence[Any], range_m: float, mounted: Sequence[str]) -> DrivingFacts:
    """Return the facts of a street within `range_m` [m] of one of `places_m` (3,), the cameras'.

    `mounted` names the cameras that the ego carries.
    """
    moment, street = view.moment, view.street
    parked = [item for item in moment.assets if item.role == "parked"]
    users = [_user(item) for item in moment.assets if item.mover is not None]
    users += [_user(item) for item in (*view.targets, *parked)]
    origins = np.array([np.asarray(place, dtype=np.float64)[:2] for place in places_m]).reshape(-1, 2)
    ego = None if view.ego is None else EgoFacts(_user(view.ego), tuple(mounted))
    return DrivingFacts(
        time_s=moment.time_s,
        users=tuple(users),
        ego=ego,
        lanes=tuple(_lanes(street, origins, range_m)),
        drivable=tuple(_regions(street, street.plan.carriageway, origins, range_m)),
        crossings=tuple(_regions(street, street.plan.crossings, origins, range_m)),
        signals=tuple(_signal(item, street, moment.signals) for item in moment.assets if item.role == "signal"),
        map=_map(street),
    )


def _map(street: Street) -> MapFacts:
    east, north = street.network.to_map(np.zeros(2)).tolist()
    projection = street.network.location.get("projParameter", "!")
    return MapFacts((east, north), "" if projection in ("!", "-", ".") else projection)


def _user(item: PlacedAsset) -> RoadUser:
    mover, size = item.mover, item.asset.size_m
    length, width, height = float(size[0]), float(size[1]), float(size[2])
    common: dict[str, Any] = {
        "object_id": item.id,
        "position_m": item.position_m,
        "yaw_rad": item.yaw_rad,
        "size_m": (length, width, height),
        "velocity_m_s": item.velocity_m_s,
    }
    if mover is None:
        role: Literal["parked", "target"] = "parked" if item.role == "parked" else "target"
        return RoadUser(role=role, kind=item.asset.asset_class, sumo_id="", lane="", yaw_rate_rad_s=0.0, **common)
    signals = mover.signals
    return RoadUser(
        role="mover",
        kind=mover.kind,
        sumo_id=mover.id,
        lane=mover.lane,
        speed_m_s=mover.speed_m_s,
        acceleration_m_s2=mover.acceleration_m_s2,
        yaw_rate_rad_s=mover.yaw_rate_rad_s,
        brake=signals.brake,
        left=signals.left,
        right=signals.right,
        reverse=signals.reverse,
        **common,
    )


# Roads ---------------------------------------------------------------------------------------------------------------


def _lanes(street: Street, origins_m: Array, range_m: float) -> Iterator[LaneFacts]:
    from fullwell.traffic.ribbons import offset  # noqa: PLC0415 - SUMO is an extra
    from fullwell.traffic.surfaces import KERB_HEIGHT_M  # noqa: PLC0415

    for lane in street.network.lanes:
        # The shape of a walking area is its outline, which is no line to walk along.
        if lane.kind == "walking_area" or not _is_near(lane, origins_m, range_m):
            continue
        centre = lane.centre_m + np.array([0.0, 0.0, KERB_HEIGHT_M if lane.kind == "sidewalk" else 0.0])
        left, right = offset(centre, lane.width_m / 2), offset(centre, -lane.width_m / 2)
        yield LaneFacts(lane.id, lane.kind, lane.street, lane.width_m, lane.speed_m_s, centre, left, right)


def _is_near(lane: Lane, origins_m: Array, range_m: float) -> bool:
    """Return whether the box around a lane comes within range of a camera."""
    low, high = lane.centre_m[:, :2].min(axis=0), lane.centre_m[:, :2].max(axis=0)
    apart = np.maximum(np.maximum(low - origins_m, origins_m - high), 0.0)
    return bool(len(origins_m)) and float(np.hypot(apart[:, 0], apart[:, 1]).min()) <= range_m


def _regions(street: Street, region: Any, origins_m: Array, range_m: float) -> Iterator[GroundRegion]:
    """Yield the polygons of a region, cut to squares around the cameras, at the height of the road."""
    import shapely  # noqa: PLC0415 - an extra

    boxes = [shapely.box(x - range_m, y - range_m, x + range_m, y + range_m) for x, y in origins_m.tolist()]
    near = region.intersection(shapely.union_all(boxes))
    if not street.plan.heights.flat:
        near = shapely.segmentize(near, _FINE_M)
    for part in getattr(near, "geoms", [near]):
        if part.geom_type == "Polygon" and part.area > _SMALLEST_M2:
            rings = [_ring(street, ring) for ring in (part.exterior, *part.interiors)]
            yield GroundRegion(rings[0], tuple(rings[1:]))


def _ring(street: Street, ring: Any) -> Array:
    points = np.asarray(ring.coords, dtype=np.float64)[:-1, :2]
    return np.column_stack([points, street.plan.heights.at(points)])


def _signal(item: PlacedAsset, street: Street, states: Mapping[str, str]) -> SignalFacts:
    edge = item.id.removeprefix("signal/")
    approach = {lane.id for lane in street.network.lanes if lane.edge_id == edge}
    links = [link for link in street.network.signals if link.from_lane in approach and not link.crossing]
    movements = tuple(
        SignalLinkFacts(link.from_lane, link.to_lane, states.get(link.signal, "")[link.index : link.index + 1])
        for link in links
    )
    present = {movement.state for movement in movements} - {""}
    state = next((letter for letter in _LETTERS if letter in present), min(present, default=""))
    shown = tuple(name for name in _LIGHTS if any(pattern.startswith(f"light_{name}") for pattern in item.lit))
    return SignalFacts(item.id, min((link.signal for link in links), default=""), state, shown, movements)
