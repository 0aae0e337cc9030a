"""A street scene: a network, the traffic of a moment, and everything beside the road."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray

from fullwell.assets.records import AssetManifest
from fullwell.core.rng import stream
from fullwell.traffic.dressing import draw_paint, dress, pivot_of_pole, street_style
from fullwell.traffic.networks import NetworkSpec, make_network
from fullwell.traffic.own_runs import OwnRun
from fullwell.traffic.placement import AssetShelf, Footprints, PlacedAsset, footprint
from fullwell.traffic.ribbons import cut
from fullwell.traffic.roads import Lane, RoadNetwork, read_network
from fullwell.traffic.simulation import TrafficDemand, TrafficRun, VehicleModel, drive, idle_signals, simulate
from fullwell.traffic.stops import BusStop, bus_stops, with_shelters
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.surfaces import KERB_HEIGHT_M, GroundPlan, RoadSurface, ground_plan, merged, road_surfaces
from fullwell.traffic.trajectories import Mover, TrafficFrame, TrafficKind, read_fcd, read_signal_states
from fullwell.traffic.wear import far_ground, ground_cover, road_wear

Array = NDArray[np.float64]

__all__ = ["TRAFFIC_CLASSES", "RecordedRun", "Street", "StreetMoment", "StreetSpec"]

TRAFFIC_CLASSES: Final[Mapping[TrafficKind, tuple[str, ...]]] = MappingProxyType(
    {
        "car": ("car",),
        "van": ("van", "emergency_vehicle"),
        "bus": ("bus",),
        "lorry": ("lorry",),
        "motorcycle": ("motorcycle",),
        "cyclist": ("cyclist",),
        "tram": ("tram",),
        "pedestrian": ("pedestrian",),
    }
)
"""Asset classes that stand for each kind of traffic."""

_PAINTED: Final = frozenset({"car", "van"})


_EMERGENCY_WORDS: Final = ("emergency", "ambulance", "police", "fire", "rescue")
_NAMED: Final = 5
_SAME_LANE_M: Final = 1.5
_SAME_WAY_COSINE: Final = 0.7
_LONGER_M: Final = 1.0
"""An asset may be this much longer than SUMO's vehicle: half of the gap that it keeps."""


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """What a run of SUMO wrote: its fcd-output, and the states of its traffic lights (by SaveTLSStates) where it has them."""

    fcd: Path
    signals: Path | None = None


@dataclass(frozen=True, slots=True)
class StreetSpec:
    """What street is wanted.

    Attributes
    ----------
    network, demand, style
        Roads, traffic, and the name of a dressing.
    run
        The user's own traffic on the network instead of a demand: what his run of SUMO wrote, or a configuration to run.
    times_s
        The moments of a clip, or one.
    dressed, wet
        Whether things stand along the roads; whether the roads are wet.
    season
        "summer", "autumn" or "winter": which trees and bushes are drawn.
    lamps
        "day": running lights and what SUMO switches on; "night": headlights, tail lights, street lights and windows too.
    """

    network: NetworkSpec
    demand: TrafficDemand = field(default_factory=TrafficDemand)
    style: str = "city"
    run: RecordedRun | OwnRun | None = None
    times_s: tuple[float, ...] = (60.0,)
    lamps: str = "day"
    dressed: bool = True
    wet: bool = False
    season: str = "summer"
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class StreetMoment:
    """A street at one time: all assets, movers first; the state of each signal; what was left out, and why.

    `overlapping` are ids of movers that are left out because they stand in others.
    """

    time_s: float
    assets: tuple[PlacedAsset, ...]
    signals: Mapping[str, str]
    notes: tuple[str, ...]
    overlapping: tuple[str, ...] = ()


class Street:
    """A street with its traffic; what stands is made once for all moments. The same spec and shelf make the same street."""

    def __init__(self, spec: StreetSpec, shelf: AssetShelf, *, path: str = "scene.traffic") -> None:
        self.spec, self._shelf, self._path = spec, shelf, path
        self._last_moment: tuple[int, StreetMoment] | None = None
        self._style = replace(street_style(spec.style, path=f"{path}.style"), season=spec.season)
        self.network: RoadNetwork = read_network(make_network(spec.network, path=f"{path}.network"), path=f"{path}.network")
        self.plan: GroundPlan = ground_plan(self.network)

    @cached_property
    def surfaces(self) -> tuple[RoadSurface, ...]:
        """Road, pavements, markings, ground."""
        style = replace(self._style.surfaces, road="asphalt/wet") if self.spec.wet else self._style.surfaces
        surfaces = [*road_surfaces(self.network, self.plan, style), far_ground(self.plan, style)]
        if self.spec.dressed:
            surfaces += road_wear(self.network, style, seed=self.spec.seed)
            surfaces += ground_cover(self.plan, style, seed=self.spec.seed)
        return tuple(merged(surfaces))

    @cached_property
    def standing(self) -> tuple[PlacedAsset, ...]:
        """Everything that does not move, signals dark."""
        if not self.spec.dressed:
            return ()
        night, seed = self.spec.lamps == "night", self.spec.seed
        dressed = dress(self.network, self.plan, self._style, self._shelf, seed=seed, lights_on=night)
        if "bus_stop" not in self._style.furniture:
            return dressed
        return with_shelters(dressed, self._stops, self.network, self._shelf, seed=seed, lights_on=night)

    @cached_property
    def _stops(self) -> tuple[BusStop, ...]:
        """Where buses stop; a user's own run has its own stops, of which the fcd-output does not tell."""
        return bus_stops(self.network, seed=self.spec.seed) if self.spec.run is None else ()

    @cached_property
    def run(self) -> TrafficRun:
        """The traffic at all moments."""
        spec, path = self.spec, f"{self._path}.run"
        if isinstance(spec.run, OwnRun):
            return drive(self.network, spec.run, times_s=spec.times_s, path=path)
        if spec.run is not None:
            frames = read_fcd(spec.run.fcd, self.network, times_s=spec.times_s, types={}, path=path)
            if spec.run.signals is not None:
                states = read_signal_states(spec.run.signals, spec.times_s, path=f"{path}.signals")
            else:
                states = idle_signals(self.network, spec.times_s)
            return TrafficRun(tuple(replace(frame, signals=states[frame.time_s]) for frame in frames), ())
        models = self._models()
        return simulate(
            self.network, spec.demand, models, seed=spec.seed, times_s=spec.times_s, stops=self._stops, path=self._path
        )

    def _models(self) -> list[VehicleModel]:
        models = []
        for kind, classes in TRAFFIC_CLASSES.items():
            for asset in self._drivable(kind, classes):
                length, width, height = asset.size_m
                weight = 0.05 if asset.asset_class == "emergency_vehicle" else 1.0
                models.append(VehicleModel(asset.id, kind, length, width, height, weight))
        return models

    def _drivable(self, kind: TrafficKind, classes: Sequence[str]) -> list[AssetManifest]:
        """Return the assets that may stand for a kind; of motorcycles those with riders, where there are any."""
        found = [asset for name in classes for asset in self._shelf.all(name)]
        ridden = [asset for asset in found if "ridden" in asset.tags]
        return ridden if kind == "motorcycle" and ridden else found

    def lane(self, name: str) -> Lane | None:
        """Return a lane by its id; None where there is none, as for walkers off the lanes."""
        return self._lanes.get(name)

    @cached_property
    def _lanes(self) -> dict[str, Lane]:
        return {lane.id: lane for lane in self.network.lanes}

    def ahead_of(self, item: PlacedAsset, distance_m: float, *, lane: int = 0) -> tuple[Array, Array] | None:
        """Return the point (3,) on the road `distance_m` ahead of a mover's front bumper along its lane, and the direction.

        `lane` counts lanes to the left. Where the lane ends, the way goes straight on through the junction into the lane that
        bends least. None where the road ends, or has no such lane.
        """
        mover = item.mover
        here = None if mover is None else self.lane(mover.lane)
        if mover is None or here is None:
            return None
        left_m = distance_m
        place_m = mover.position_m
        visited: set[str] = set()
        while left_m > here.length_m - place_m:
            left_m -= here.length_m - place_m
            visited.add(here.id)
            following = self._straight_on(here, visited)
            if following is None:
                return None
            left_m -= float(np.linalg.norm(following.centre_m[0] - here.centre_m[-1]))
            here, place_m = following, 0.0
            if left_m < 0:  # within a junction
                return None
        wanted = here.index + lane
        lanes = (other for other in self._lanes.values() if other.edge_id == here.edge_id and other.index == wanted)
        beside = next(lanes, None)
        if beside is None:
            return None
        share = (place_m + left_m) / here.length_m
        return beside.at(share * beside.length_m)

    def ids_seen(self, *, before_s: float) -> frozenset[str]:
        """Return the ids of all who were in the network at earlier moments of the spec."""
        return frozenset(mover.id for frame in self.run.frames if frame.time_s < before_s for mover in frame.movers)

    def gap_ahead_m(self, item: PlacedAsset, movers: Sequence[PlacedAsset], within_m: float) -> float | None:
        """Return the distance from a mover's front bumper to the tail of the next vehicle on its way, straight on.

        None where none is within `within_m` [m]; walkers are no vehicles.
        """
        way = self._way_ahead(item, within_m)
        if way is None:
            return None
        gaps = []
        for other in movers:
            if other.mover is None or other.mover.kind == "pedestrian" or other.id == item.id:
                continue
            tail = shapely.Point((other.position_m - other.asset.size_m[0] / 2 * other.mover.forward())[:2])
            along_m = float(way.project(tail))
            if not 0 < along_m <= within_m or way.distance(tail) > _SAME_LANE_M:
                continue
            ahead = np.subtract(*(way.interpolate(place).coords[0] for place in (along_m + 0.5, along_m - 0.5)))
            if float(ahead @ other.mover.forward()[:2]) > _SAME_WAY_COSINE * float(np.linalg.norm(ahead)):
                gaps.append(along_m)
        return min(gaps, default=None)

    def _way_ahead(self, item: PlacedAsset, length_m: float) -> Any | None:
        """Return the line (shapely) of a mover's lane before its front bumper, straight on through junctions."""
        mover = item.mover
        lane = None if mover is None else self.lane(mover.lane)
        if mover is None or lane is None:
            return None
        points = [mover.front_m[None, :2], cut(lane.centre_m, min(mover.position_m, lane.length_m), lane.length_m)[1:, :2]]
        way_m, visited = lane.length_m - mover.position_m, {lane.id}
        while way_m < length_m and (following := self._straight_on(lane, visited)) is not None:
            points.append(following.centre_m[:, :2])
            visited.add(following.id)
            way_m, lane = way_m + following.length_m, following
        line = np.concatenate(points)
        return shapely.LineString(line) if len(line) > 1 else None

    def _straight_on(self, lane: Lane, visited: set[str]) -> Lane | None:
        edges = self.network.successors.get(lane.edge_id, ())
        _, ahead = lane.at(lane.length_m)
        best, most = None, math.cos(math.radians(50.0))
        for other in self._lanes.values():
            if other.edge_id in edges and other.kind == lane.kind and other.id not in visited:
                _, direction = other.at(0.0)
                aside = other.centre_m[0] - lane.centre_m[-1]
                turn = float(direction[:2] @ ahead[:2]) - 0.01 * abs(float(aside[0] * ahead[1] - aside[1] * ahead[0]))
                if turn > most:
                    best, most = other, turn
        return best

    def moment(self, number: int) -> StreetMoment:
        """Return the street at the time of that number in the spec; the last one is kept."""
        if self._last_moment is None or self._last_moment[0] != number:
            self._last_moment = number, self._moment(number)
        return self._last_moment[1]

    def _moment(self, number: int) -> StreetMoment:
        frame = self.run.frames[number]
        movers, notes, overlapping = self._movers(frame)
        standing = [self._signalled(item, frame.signals) for item in self.standing]
        kept, hidden = _without_overlaps(movers, standing)
        if hidden:
            notes.append(f"{hidden} standing objects were left out where traffic passes through their place.")
        told = tuple(notes) + self.run.warnings[:8]
        return StreetMoment(frame.time_s, (*movers, *kept), frame.signals, told, overlapping)

    def _movers(self, frame: TrafficFrame) -> tuple[list[PlacedAsset], list[str], tuple[str, ...]]:
        taken, placed, swinging = Footprints(), [], 0
        dropped: list[str] = []
        for mover in frame.movers:
            asset = self._asset_of(mover)
            if asset is None:
                raise TrafficError(
                    f"{self._path}: there is no asset for a {mover.kind} ({mover.id}). Approve or import one.", self._path
                )
            item = self._placed(mover, asset)
            if not self._houses.is_free(footprint(item.position_m, item.yaw_rad, _body(asset))):
                swinging += 1  # the tail of a long vehicle that SUMO turns about its front
                continue
            if taken.claim(footprint(item.position_m, item.yaw_rad, _body(asset))):
                placed.append(item)
            else:
                dropped.append(mover.id)
        notes = []
        if dropped:
            named = ", ".join(dropped[:_NAMED]) + (", ..." if len(dropped) > _NAMED else "")
            notes.append(f"{len(dropped)} movers overlapped others in SUMO's own positions and were left out: {named}.")
        if swinging:
            notes.append(f"{swinging} long vehicles would have swung into buildings and were left out.")
        return placed, notes, tuple(dropped)

    @cached_property
    def _houses(self) -> Footprints:
        taken = Footprints()
        for item in self.standing:
            if item.role == "building":
                taken.take(item.outline())
        return taken

    def _asset_of(self, mover: Mover) -> AssetManifest | None:
        choices = self._drivable(mover.kind, TRAFFIC_CLASSES[mover.kind])
        named = next((asset for asset in choices if asset.id == mover.model), None)
        if named is not None or not choices:
            return named
        # A type of the user's own: the same mover has the same asset at all moments, one that fits into its gap.
        if not any(word in mover.model.casefold() for word in _EMERGENCY_WORDS):
            choices = [asset for asset in choices if asset.asset_class != "emergency_vehicle"] or choices
        fitting = [asset for asset in choices if asset.size_m[0] <= mover.length_m + _LONGER_M]
        fitting = fitting or [min(choices, key=lambda asset: asset.size_m[0])]
        return fitting[int(stream(self.spec.seed, "asset of", mover.id).integers(len(fitting)))]

    def _placed(self, mover: Mover, asset: AssetManifest) -> PlacedAsset:
        position = mover.centre_m(asset.size_m[0])
        if mover.kind == "pedestrian" and self._is_on_pavement(position):
            position[2] += KERB_HEIGHT_M
        paint = draw_paint(stream(self.spec.seed, "paint", mover.id)) if asset.asset_class in _PAINTED else ""
        return PlacedAsset(
            id=mover.id,
            asset=asset,
            role="mover",
            position_m=position,
            yaw_rad=mover.yaw_rad,
            slope_rad=mover.slope_rad,
            lit=self._lit(mover, asset),
            paint=paint,
            velocity_m_s=mover.speed_m_s * mover.forward(),
            mover=mover,
        )

    def _is_on_pavement(self, position_m: NDArray[np.float64]) -> bool:
        return bool(self.plan.walk.contains(shapely.Point(position_m[:2])))

    def _lit(self, mover: Mover, asset: AssetManifest) -> tuple[str, ...]:
        signals = mover.signals
        wanted = ["headlight*", "taillight*"] if self.spec.lamps == "night" else ["drl*"]
        wanted += ["brakelight*"] if signals.brake else []
        wanted += ["indicator*left"] if signals.left else []
        wanted += ["indicator*right"] if signals.right else []
        wanted += ["reverselight*"] if signals.reverse else []
        return _present(wanted, asset)

    def _signalled(self, item: PlacedAsset, states: Mapping[str, str]) -> PlacedAsset:
        if item.role != "signal":
            return item
        edge = item.id.removeprefix("signal/")
        lanes = {lane.id for lane in self.network.lanes if lane.edge_id == edge}
        links = [link for link in self.network.signals if link.from_lane in lanes and not link.crossing]
        shown = {states.get(link.signal, "")[link.index : link.index + 1] for link in links}
        lit = _present(_ASPECTS[next((letter for letter in _ASPECTS if letter in shown), "r")], item.asset)
        return PlacedAsset(item.id, item.asset, item.role, item.position_m, item.yaw_rad, lit=lit)


_ASPECTS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "G": ("light_green*",),
        "g": ("light_green*",),
        "y": ("light_amber*",),
        "u": ("light_red*", "light_amber*"),
        "r": ("light_red*",),
        "R": ("light_red*",),
        "s": ("light_red*",),
        "o": ("light_amber*",),
        "O": (),
    }
)
"""What is lit in each of SUMO's states, the freest first; "o" blinks, and is drawn lit."""


def _present(patterns: Sequence[str], asset: AssetManifest) -> tuple[str, ...]:
    """Return the patterns that a lamp of the asset matches: recipes refuse the others."""
    lamps = [part.name for part in asset.parts if part.material.name.startswith("lamp/")]
    return tuple(pattern for pattern in patterns if any(fnmatchcase(name, pattern) for name in lamps))


def _body(asset: AssetManifest) -> tuple[float, float]:
    """Return the extents (x, y) that count against others: walkers swing their arms, cars have mirrors."""
    shrink = 0.6 if asset.asset_class == "pedestrian" else 0.9
    return asset.size_m[0] * (0.97 if asset.asset_class != "pedestrian" else shrink), asset.size_m[1] * shrink


def _without_overlaps(movers: Sequence[PlacedAsset], standing: Sequence[PlacedAsset]) -> tuple[list[PlacedAsset], int]:
    """Return what stands where nobody is, and how many were left out: furniture gives way to traffic."""
    taken = Footprints()
    for item in movers:
        taken.take(footprint(item.position_m, item.yaw_rad, _body(item.asset)))
    kept = [item for item in standing if item.role == "building" or taken.is_free(_ground(item))]
    return kept, len(standing) - len(kept)


def _ground(item: PlacedAsset) -> Any:
    """Return what touches the ground: trunks and poles, not crowns and arms."""
    if item.asset.asset_class == "tree":
        return footprint(item.position_m, item.yaw_rad, (0.5, 0.5))
    if item.role in ("light", "signal"):
        return footprint(pivot_of_pole(item.asset, item.position_m, item.yaw_rad, back=True), item.yaw_rad, (0.4, 0.4))
    return item.outline()
