"""Street objects that SUMO does not know: parked cars, lights, signals, furniture, trees, buildings, by rules and a seed.

Everything stands beside the road and overlaps nothing: footprints are claimed one by one, and what finds no room is left out.
The rules of spacing are those of the driving-scene generators this project takes over from, widened to ranges.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray

from fullwell.assets.records import AssetManifest
from fullwell.core.errors import unknown_name_message
from fullwell.core.rng import stream
from fullwell.traffic.placement import AssetShelf, Footprints, PlacedAsset, Role, footprint
from fullwell.traffic.ribbons import along, length_m
from fullwell.traffic.roads import Lane, RoadNetwork
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.surfaces import KERB_HEIGHT_M, GroundPlan, RoadStyle

__all__ = ["CAR_PAINTS", "STYLES", "StreetStyle", "draw_paint", "dress", "pivot_of_pole", "street_style", "with_lights"]

Array = NDArray[np.float64]

CAR_PAINTS: Final[Mapping[str, float]] = MappingProxyType(
    {
        "paint/white": 21, "paint/black": 19, "paint/grey": 15, "paint/silver": 15, "paint/red": 10, "paint/blue": 8,
        "paint/brown": 6, "paint/green": 4, "paint/beige": 0.8, "paint/yellow": 0.7, "paint/orange": 0.5,
    }
)  # fmt: skip
"""Popularity of car colours in per cent, as in the driving data sets; "other 2" is spread over three."""

_KEEP_FREE_M: Final = 9.0
"""Nothing stands this near to the ends of a pavement: corners are for walkers and views."""


@dataclass(frozen=True, slots=True)
class StreetStyle:
    """How a street is dressed; spacings [m] along each side, 0 for none.

    Attributes
    ----------
    light_m, tree_m
        Between street lights, and least and most between trees.
    furniture
        Number of each class per pavement and 100 m.
    parking_m, parking_share
        Length of a place in a parking lane, and the share of places that are taken.
    setback_m
        Least and most between pavement and buildings.
    building_gap_m, building_share
        Least gap between buildings, and the share of sites that are built on.
    building_tag
        Only buildings with this tag, where there are any.
    layers
        Distant vegetation: (nearest, farthest) [m] from the roads and plants per hectare, in woods and clearings.
    gardens
        Bushes, hedges and grass patches per 100 m of building front.
    season
        Which trees and bushes are drawn: "summer", "autumn" or "winter". Evergreens are at all times.
    surfaces
        Materials of road, pavement and ground.
    """

    light_m: float = 24.0
    light_tag: str = ""
    tree_m: tuple[float, float] = (0.0, 0.0)
    furniture: Mapping[str, float] = field(default_factory=dict)
    parking_m: float = 5.6
    parking_share: float = 0.7
    setback_m: tuple[float, float] = (0.4, 1.0)
    building_gap_m: float = 0.2
    building_share: float = 1.0
    building_tag: str = ""
    layers: tuple[tuple[float, float, float], ...] = ()
    gardens: float = 0.0
    season: str = "summer"
    surfaces: RoadStyle = field(default_factory=RoadStyle)


STYLES: Final[Mapping[str, StreetStyle]] = MappingProxyType(
    {
        "city": StreetStyle(
            light_m=24.0,
            tree_m=(9.0, 16.0),
            furniture={
                "bin": 2.5, "bench": 1.0, "bike_rack": 0.7, "bus_stop": 0.5, "call_box": 0.3, "billboard": 0.3, "clutter": 1.0,
            },
            parking_share=0.75,
            building_tag="city",
            layers=((60.0, 300.0, 8.0),),
            surfaces=RoadStyle(ground="concrete/grey"),
        ),
        "suburb": StreetStyle(
            light_m=32.0,
            tree_m=(8.0, 22.0),
            furniture={"bin": 1.0, "bench": 0.3, "bus_stop": 0.3, "clutter": 0.3},
            parking_share=0.35,
            setback_m=(5.0, 8.0),
            building_gap_m=4.0,
            building_share=0.9,
            building_tag="suburb",
            layers=((15.0, 60.0, 10.0), (60.0, 140.0, 12.0), (140.0, 300.0, 24.0)),
            gardens=9.0,
        ),
        "rural": StreetStyle(
            light_m=0.0,
            tree_m=(10.0, 40.0),
            setback_m=(12.0, 30.0),
            building_gap_m=40.0,
            building_share=0.25,
            building_tag="suburb",
            layers=((5.0, 40.0, 10.0), (40.0, 140.0, 14.0), (140.0, 320.0, 55.0)),
            gardens=4.0,
            surfaces=RoadStyle(edge_lines=True, zebra=False, covers=False, fields=60),
        ),
        "motorway": StreetStyle(
            light_m=0.0,
            building_share=0.0,
            layers=((12.0, 40.0, 12.0), (40.0, 140.0, 14.0), (140.0, 320.0, 40.0)),
            surfaces=RoadStyle(edge_lines=True, zebra=False, road="asphalt/new", covers=False, fields=60),
        ),
    }
)  # fmt: skip


def street_style(name: str, *, path: str = "scene.traffic.style") -> StreetStyle:
    """Return a style; an unknown name raises TrafficError with the nearest."""
    if name not in STYLES:
        raise TrafficError(f"{path}: {unknown_name_message('street style', name, STYLES)}", path, name)
    return STYLES[name]


@dataclass(slots=True)
class _Site:
    """What all rules share."""

    network: RoadNetwork
    plan: GroundPlan
    style: StreetStyle
    shelf: AssetShelf
    taken: Footprints
    seed: int
    placed: list[PlacedAsset] = field(default_factory=list)

    def rng(self, *names: str | int) -> np.random.Generator:
        """Return a stream of its own for each rule and lane: one more tree moves no lamp."""
        return stream(self.seed, "street", *names)

    def put(
        self, name: str, asset: AssetManifest, role: Role, position_m: Array, yaw_rad: float, *, size_m: Any = None, **more: Any
    ) -> bool:
        """Place an asset where its footprint (or `size_m`) is free; return whether it was."""
        if not self.taken.claim(footprint(position_m, yaw_rad, size_m or asset.size_m, 0.05)):
            return False
        self.placed.append(PlacedAsset(name, asset, role, position_m, yaw_rad, **more))
        return True


def dress(
    network: RoadNetwork, plan: GroundPlan, style: StreetStyle, shelf: AssetShelf, *, seed: int, lights_on: bool = False
) -> tuple[PlacedAsset, ...]:
    """Return everything that stands along the roads, in an order that does not change from run to run.

    Parameters
    ----------
    shelf
        What there is to draw; rules for classes that it lacks do nothing.
    lights_on
        Whether street lights and windows are lit.
    """
    site = _Site(network, plan, style, shelf.without(_OUT_OF_SEASON[style.season]), Footprints(), seed)
    for rule in (_signals, _signs, _street_lights, _buildings, _furniture, _trees, _parked, _gardens, _layers):
        rule(site)
    return tuple(with_lights(item) for item in site.placed) if lights_on else tuple(site.placed)


_OUT_OF_SEASON: Final[Mapping[str, frozenset[str]]] = MappingProxyType(
    {
        "summer": frozenset({"autumn", "winter", "bare"}),
        "autumn": frozenset({"summer", "winter", "bare"}),
        "winter": frozenset({"summer", "autumn"}),
    }
)
"""Tags of plants that are not drawn."""


_LIT: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"street_light": ("lamp*",), "bus_stop": ("lamp*", "sign_panel*"), "billboard": ("lamp*", "sign_panel*")}
)


def with_lights(item: PlacedAsset) -> PlacedAsset:
    """Return a thing with the lamps lit that it has on at night."""
    patterns = _LIT.get(item.asset.asset_class, ())
    if item.role == "building":
        patterns = ("lit_windows*", "shop_windows*", "lobby_windows*", "sign_panel*")
    names = [part.name for part in item.asset.parts if part.material.name.startswith("lamp/")]
    lit = tuple(pattern for pattern in patterns if any(fnmatchcase(name, pattern) for name in names))
    return replace(item, lit=lit) if lit else item


# Along pavements -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One side of a road: the line where its pavement (or the road) ends, and how wide the pavement is."""

    name: str
    lane: Lane
    walk_m: float
    limit_m_s: float = 0.0

    @property
    def whole_m(self) -> float:
        return length_m(self.lane.centre_m)

    def place(self, along_m: float, from_kerb_m: float) -> tuple[Array, float]:
        """Return the point (3,) at a distance along the road and from the kerb (outwards), and the road's yaw there."""
        here, ahead = along(self.lane.centre_m, np.array([along_m, along_m + 0.5]))
        if along_m + 0.5 > self.whole_m:
            here, ahead = along(self.lane.centre_m, np.array([along_m - 0.5, along_m]))
            here, ahead = ahead, 2 * ahead - here
        direction = (ahead - here)[:2] / max(float(np.linalg.norm((ahead - here)[:2])), 1e-9)
        right = np.array([direction[1], -direction[0]])
        point = here.copy()
        point[:2] += right * (from_kerb_m - self._kerb_to_centre_m)
        point[2] += KERB_HEIGHT_M if self.walk_m > 0 else 0.0
        return point, math.atan2(direction[1], direction[0])

    @property
    def _kerb_to_centre_m(self) -> float:
        return self.walk_m / 2 if self.walk_m > 0 else -self.lane.width_m / 2


def _sides(network: RoadNetwork) -> list[_Side]:
    """Return both sides of each road by the rightmost lane of each edge; sidewalks where there are any."""
    rightmost: dict[str, Lane] = {}
    for lane in network.of_kind("sidewalk", "parking", "bike", "bus", "drive", "shoulder"):
        if lane.edge_id not in rightmost or lane.index < rightmost[lane.edge_id].index:
            rightmost[lane.edge_id] = lane
    limits = {lane.edge_id: lane.speed_m_s for lane in network.of_kind("drive")}
    return [
        _Side(edge, lane, lane.width_m if lane.kind == "sidewalk" else 0.0, limits.get(edge, 0.0))
        for edge, lane in sorted(rightmost.items())
    ]


def _street_lights(site: _Site) -> None:
    """Arms over the road, half a metre behind the kerb."""
    if site.style.light_m <= 0 or not site.shelf.has("street_light"):
        return
    rng = site.rng("lights")
    spacing_m = site.style.light_m
    too_low = {light.id: 0.0 for light in site.shelf.all("street_light") if light.size_m[2] * _SPACING_PER_HEIGHT < spacing_m}
    kind = site.shelf.draw(rng, "street_light", tag=site.style.light_tag, weights=too_low)
    kind = kind or site.shelf.draw(rng, "street_light")
    assert kind is not None
    for side in _sides(site.network):
        count = max(1, round((side.whole_m - 2 * _KEEP_FREE_M) / site.style.light_m)) if side.whole_m > 2 * _KEEP_FREE_M else 0
        for number in range(count):
            along_m = _KEEP_FREE_M + (number + 0.5) * (side.whole_m - 2 * _KEEP_FREE_M) / count
            base, yaw = side.place(along_m, 0.5)
            if site.taken.claim(footprint(base, yaw, _POLE_M)):
                name = f"street_light/{side.name}/{number}"
                turn = yaw + math.pi / 2
                site.placed.append(PlacedAsset(name, kind, "light", pivot_of_pole(kind, base, turn), turn))


_SPACING_PER_HEIGHT: Final = 4.2
"""Street lights farther apart than this times their height leave the road dark between them; lanterns are for paths."""

_POLE_M: Final = (0.4, 0.4)
"""What lights, signals and signs take of the ground."""


def pivot_of_pole(asset: AssetManifest, base_m: Array, yaw_rad: float, *, back: bool = False) -> Array:
    """Return where the pivot of an asset is whose pole stands at `base_m` (3,), or with `back` the pole of one at that pivot.

    Assets say where their pole is (column_offset_x_m, post_offset_x_m, post_offset_y_m): not in the middle of one with an arm.
    """
    said = asset.attributes
    ahead = float(said.get("column_offset_x_m", said.get("post_offset_x_m", 0.0)))
    left = float(said.get("post_offset_y_m", 0.0))
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    shift = np.array([cosine * ahead - sine * left, sine * ahead + cosine * left, 0.0])
    return np.asarray(base_m + shift if back else base_m - shift)


def _signals(site: _Site) -> None:
    """One traffic light for each approach that a signal controls, at the stop line, facing the drivers."""
    if not site.shelf.has("traffic_light"):
        return
    rng = site.rng("signals")
    kind = site.shelf.draw(rng, "traffic_light", tag="vehicle") or site.shelf.draw(rng, "traffic_light")
    assert kind is not None
    controlled: dict[str, str] = {}
    lanes = {lane.id: lane for lane in site.network.lanes}
    for link in site.network.signals:
        lane = lanes.get(link.from_lane)
        if lane is not None and not link.crossing and lane.kind in ("drive", "bus"):
            controlled.setdefault(lane.edge_id, link.signal)
    for side in _sides(site.network):
        if side.name in controlled and side.whole_m > 8.0:
            base, yaw = side.place(side.whole_m - 0.8, 0.6)
            if site.taken.claim(footprint(base, yaw, _POLE_M)):
                turn = yaw + math.pi
                pivot = pivot_of_pole(kind, base, turn)
                site.placed.append(PlacedAsset(f"signal/{side.name}", kind, "signal", pivot, turn))


def _signs(site: _Site) -> None:
    """Give way where no signal rules, and the speed limit here and there; both face the drivers."""
    controlled = {link.from_lane for link in site.network.signals}
    signalled = {lane.edge_id for lane in site.network.lanes if lane.id in controlled}
    crossings = [junction for junction in site.network.junctions if junction.kind not in ("dead_end", "traffic_light")]
    centres = np.array([junction.centre_m[:2] for junction in crossings]).reshape(-1, 2)
    for side in _sides(site.network):
        rng = site.rng("signs", side.name)
        limit = f"speed_limit_{5 * round(side.limit_m_s * 3.6 / 5)}"
        wanted = [("limit", limit, 0.35 * side.whole_m)] if rng.random() < 0.3 else []
        end = side.lane.centre_m[-1, :2]
        if side.name not in signalled and len(centres) and np.linalg.norm(centres - end, axis=1).min() < _AT_JUNCTION_M:
            wanted.append(("yield", "yield", side.whole_m - 1.5))
        for name, tag, along_m in wanted:
            asset = site.shelf.draw(rng, "traffic_sign", tag=tag)
            if asset is None or side.whole_m < 12.0:
                continue
            base, yaw = side.place(along_m, 0.55)
            if site.taken.claim(footprint(base, yaw, _POLE_M)):
                pivot = pivot_of_pole(asset, base, yaw + math.pi)
                site.placed.append(PlacedAsset(f"sign/{side.name}/{name}", asset, "light", pivot, yaw + math.pi))


_AT_JUNCTION_M: Final = 20.0


def _trees(site: _Site) -> None:
    """A row behind the kerb; only trunks claim ground, but crowns keep off facades."""
    least_m, most_m = site.style.tree_m
    if most_m <= 0 or not site.shelf.has("tree"):
        return
    for side in _sides(site.network):
        rng = site.rng("trees", side.name)
        along_m, number = _KEEP_FREE_M + rng.uniform(0.0, most_m), 0
        from_kerb_m = 0.9 if side.walk_m > 0 else 3.5
        room_m = 2 * (side.walk_m + site.style.setback_m[0] - from_kerb_m) if site.style.building_share > 0 else math.inf
        while along_m < side.whole_m - _KEEP_FREE_M:
            asset = site.shelf.draw(rng, "tree", largest_m=(max(room_m, 3.0) + 1.5,) * 2, weights=_ALONG_STREETS)
            if asset is not None:
                point, _ = side.place(along_m, from_kerb_m)
                turn = rng.uniform(0.0, 2 * math.pi)
                name = f"tree/{side.name}/{number}"
                site.put(name, asset, "vegetation", point, turn, size_m=(0.7, 0.7, asset.size_m[2]))
            along_m += rng.uniform(least_m, most_m)
            number += 1


_ALONG_STREETS: Final[Mapping[str, float]] = MappingProxyType({"street": 3.0, "conifer": 0.1, "columnar": 0.5})
"""Chances of trees in rows by their tags, against 1."""


def _furniture(site: _Site) -> None:
    """Seats and stops face the road; the rest turns its front to it as well, at the back of the pavement."""
    for side in _sides(site.network):
        if side.walk_m < 1.5 or side.whole_m < 2 * _KEEP_FREE_M + 4.0:
            continue
        for asset_class, per_100_m in sorted(site.style.furniture.items()):
            rng = site.rng("furniture", asset_class, side.name)
            count = int(rng.poisson(per_100_m * side.whole_m / 100.0))
            for number in range(count):
                asset = site.shelf.draw(rng, asset_class, largest_m=(side.walk_m - 1.0, 8.0))
                along_m = rng.uniform(_KEEP_FREE_M, side.whole_m - _KEEP_FREE_M)
                if asset is None:
                    continue
                at_kerb = asset_class in ("bin", "bus_stop", "bike_rack") or rng.random() < 0.3
                half_m = asset.size_m[0] / 2
                from_kerb_m = 0.45 + half_m if at_kerb else side.walk_m - 0.1 - half_m
                point, yaw = side.place(along_m, from_kerb_m)
                site.put(f"{asset_class}/{side.name}/{number}", asset, "furniture", point, yaw + math.pi / 2)


def _parked(site: _Site) -> None:
    """Cars in parking lanes, along the road."""
    for lane in site.network.of_kind("parking"):
        rng = site.rng("parked", lane.id)
        whole = length_m(lane.centre_m)
        count = int((whole - 2 * _KEEP_FREE_M) / site.style.parking_m)
        for number in range(max(count, 0)):
            taken = rng.random() < site.style.parking_share
            kind = "van" if rng.random() < 0.12 else "car"
            room_m = (site.style.parking_m - 0.4, lane.width_m + 0.1)
            asset = site.shelf.draw(rng, kind, largest_m=room_m) or site.shelf.draw(rng, "car", largest_m=room_m)
            along_m = _KEEP_FREE_M + (number + 0.5) * site.style.parking_m + rng.normal(0.0, 0.12)
            aside_m, turn = rng.normal(0.0, 0.06), rng.normal(0.0, 0.012)
            paint = draw_paint(rng)
            if not taken or asset is None:
                continue
            here, ahead = along(lane.centre_m, np.array([along_m, along_m + 0.5]))
            direction = (ahead - here)[:2] / max(float(np.linalg.norm((ahead - here)[:2])), 1e-9)
            point = here + np.array([-direction[1], direction[0], 0.0]) * aside_m
            yaw = math.atan2(direction[1], direction[0]) + turn
            site.put(f"parked/{lane.id}/{number}", asset, "parked", point, yaw, paint=paint)


def draw_paint(rng: np.random.Generator) -> str:
    """Return a car paint by popularity."""
    names, shares = list(CAR_PAINTS), np.array(list(CAR_PAINTS.values()))
    return names[int(rng.choice(len(names), p=shares / shares.sum()))]


# Beside roads --------------------------------------------------------------------------------------------------------


def _buildings(site: _Site) -> None:
    """A front row along each side, as tight as the style allows; each building faces its street and keeps off all roads."""
    style = site.style
    if style.building_share <= 0 or not site.shelf.has("building"):
        return
    tag = style.building_tag if site.shelf.has("building", tag=style.building_tag) else ""
    near = shapely.union_all([site.plan.carriageway, site.plan.walk]).buffer(0.2)
    shapely.prepare(near)
    for side in _sides(site.network):
        rng = site.rng("buildings", side.name)
        along_m, number, beside = rng.uniform(0.0, 3.0), 0, ""
        while along_m < side.whole_m:
            left_m = side.whole_m - along_m
            at_corner = number == 0 or left_m < _CORNER_M
            largest_m = (math.inf, max(left_m + 4.0, 6.0))
            weights = {**(_AT_CORNERS if at_corner else {}), beside: 0.0}
            asset = site.shelf.draw(rng, "building", tag=tag, largest_m=largest_m, weights=weights)
            if asset is None:
                break
            width_m, depth_m = asset.size_m[1], asset.size_m[0]
            setback_m = rng.uniform(*style.setback_m)
            if rng.random() < style.building_share:
                point, yaw = side.place(along_m + width_m / 2, side.walk_m + setback_m + depth_m / 2)
                point[2] -= 0.02  # the ground beside the pavement is a little lower
                outline = footprint(point, yaw + math.pi / 2, asset.size_m)
                if not near.intersects(outline) and site.put(
                    f"building/{side.name}/{number}", asset, "building", point, yaw + math.pi / 2
                ):
                    along_m += width_m + style.building_gap_m
                    number, beside = number + 1, asset.id
                    continue
            along_m += 4.0 if style.building_share >= 1 else width_m / 2 + style.building_gap_m
            number += 1


_CORNER_M: Final = 22.0
_AT_CORNERS: Final[Mapping[str, float]] = MappingProxyType({"corner": 5.0, "detached": 4.0, "terraced": 0.05})
"""Chances of buildings at the ends of rows by their tags: party walls without windows are for the middle."""


def _gardens(site: _Site) -> None:
    """Bushes, hedges in rows, and grass between pavement and buildings."""
    if site.style.gardens <= 0:
        return
    for side in _sides(site.network):
        rng = site.rng("gardens", side.name)
        for number in range(int(rng.poisson(site.style.gardens * side.whole_m / 100.0))):
            kind = "bush" if rng.random() < 0.55 else "grass"
            asset = site.shelf.draw(rng, kind)
            along_m = rng.uniform(2.0, max(side.whole_m - 2.0, 2.1))
            beyond_m = rng.uniform(0.8, max(site.style.setback_m[0], 1.0))
            blocks = int(rng.integers(4, 11))
            if asset is None:
                continue
            if "hedge" in asset.tags:
                _hedge_row(site, f"hedge/{side.name}/{number}", asset, side, along_m=along_m, blocks=blocks)
                continue
            half_m = max(asset.size_m[:2]) / 2
            point, yaw = side.place(along_m, side.walk_m + half_m + beyond_m)
            point[2] -= 0.03
            if site.plan.is_free(footprint(point, yaw, asset.size_m)):
                site.put(f"{kind}/{side.name}/{number}", asset, "vegetation", point, yaw + rng.uniform(-0.2, 0.2))


def _hedge_row(site: _Site, name: str, asset: AssetManifest, side: _Side, *, along_m: float, blocks: int) -> None:
    """Blocks of one hedge side by side behind the pavement, as far as there is room; a row of less than three is none."""
    depth_m, block_m = asset.size_m[0], asset.size_m[1] - _HEDGE_LAP_M
    places = [side.place(along_m + number * block_m, side.walk_m + depth_m / 2 + 0.35) for number in range(blocks)]
    ground = [footprint(point, yaw + math.pi / 2, (depth_m, block_m - 0.02)) for point, yaw in places]
    row = itertools.takewhile(lambda outline: site.plan.is_free(outline) and site.taken.is_free(outline), ground)
    fitting = len(list(row))
    if fitting < _LEAST_HEDGE or along_m + fitting * block_m > side.whole_m:
        return
    for number in range(fitting):
        point, yaw = places[number]
        point[2] -= 0.03
        site.taken.take(ground[number])
        site.placed.append(PlacedAsset(f"{name}/{number}", asset, "vegetation", point, yaw + math.pi / 2))


_HEDGE_LAP_M: Final = 0.12
"""Leaves of one block reach so far into the next."""
_LEAST_HEDGE: Final = 3


def _layers(site: _Site) -> None:
    """Plants by distance from the roads, in woods and clearings, none on the road."""
    if not site.style.layers or not site.shelf.has("tree"):
        return
    roads = shapely.union_all([site.plan.carriageway, site.plan.walk])
    shapely.prepare(roads)
    for layer, (nearest_m, farthest_m, per_hectare) in enumerate(site.style.layers):
        rng = site.rng("layer", layer)
        west, south, east, north = roads.buffer(farthest_m, quad_segs=2).bounds
        count = min(int(rng.poisson(per_hectare * (east - west) * (north - south) / 1e4)), _MOST_PLANTS)
        places = rng.uniform([west, south], [east, north], (count, 2))
        distances = shapely.distance(roads, shapely.points(places))
        wooded = rng.random(count) < 2.0 * _wooded(places, site.rng("woods").uniform(0.0, 1.0, (2, 6)))
        for number in np.flatnonzero((distances > nearest_m) & (distances <= farthest_m) & wooded):
            kind = "tree" if rng.random() < 0.85 or not site.shelf.has("bush") else "bush"
            asset = site.shelf.draw(rng, kind, weights=_FREE_STANDING)
            if asset is None:
                continue
            point = np.append(places[number], site.plan.heights.at(places[number : number + 1])[0] + KERB_HEIGHT_M - 0.03)
            trunk = (1.0, 1.0, asset.size_m[2]) if kind == "tree" else asset.size_m
            name = f"{kind}/layer{layer}/{int(number)}"
            site.put(name, asset, "vegetation", point, rng.uniform(0.0, 2 * math.pi), size_m=trunk)


def _wooded(places_m: Array, phases: Array) -> Array:
    """Return (n,) the chance of a plant at places (n, 2): waves of 90 to 300 m, half of the land near 0, half near 1."""
    waves = np.zeros(len(places_m))
    for number, (turn, phase) in enumerate(phases.T):
        wave_m = 90.0 + 42.0 * number
        towards = np.array([math.cos(2 * math.pi * turn), math.sin(2 * math.pi * turn)])
        waves += np.sin(2 * math.pi * (places_m @ towards / wave_m + phase))
    return np.asarray(1.0 / (1.0 + np.exp(-2.2 * waves)))


_FREE_STANDING: Final[Mapping[str, float]] = MappingProxyType({"hedge": 0.0, "street": 0.3})
"""Chances of plants in the open by their tags: a clipped block of hedge stands in rows only."""
_MOST_PLANTS: Final = 4000
