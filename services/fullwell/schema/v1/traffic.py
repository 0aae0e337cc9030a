"""Traffic scenes: roads, who drives on them, how the street is dressed, whose camera looks."""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from fullwell.schema.v1.common import (
    Count,
    Document,
    Flag,
    Fraction,
    Id,
    NonNegative,
    Number,
    Range,
    Text,
    exactly_one,
    refuse,
)

__all__ = ["DemandDocument", "EgoDocument", "KindDemandDocument", "TargetDocument", "TrafficDocument", "TrafficKindName"]

TrafficKindName = Literal["car", "van", "bus", "lorry", "motorcycle", "cyclist", "tram", "pedestrian"]
_Width = Annotated[float, Range(ge=0, le=20)]
_Layout = Literal["grid", "spider", "random", "straight", "curve", "cross", "tee", "blocks", "roundabout", "motorway"]


class RoadNetworkDocument(Document):
    """Roads: a `layout`, or a `file` (.net.xml of SUMO, .osm or .osm.xml of OpenStreetMap, .xodr of OpenDRIVE; packed: .gz).

    Of a layout, `length_m` is that of a block (grid, random), between circles (spider), or from end to end; `size` is junctions
    along x and y (grid), arms and circles (spider), or iterations (random). Widths are those of one direction, 0 for none.
    """

    layout: _Layout | None = None
    file: Text | None = None
    length_m: Annotated[float, Range(ge=20, le=5000)] = 240.0
    size: tuple[Count, Count] = (3, 3)
    lanes: Annotated[int, Range(ge=1, le=6, whole=True)] = 1
    lane_width_m: Annotated[float, Range(ge=2, le=6)] = 3.2
    sidewalk_width_m: _Width = 3.0
    parking_width_m: _Width = 0.0
    bike_lane_width_m: _Width = 0.0
    bus_lane_width_m: _Width = 0.0
    tram_lane_width_m: _Width = 0.0
    speed_limit_m_s: Annotated[float, Range(gt=0, le=60)] = 13.9
    signals: Flag = True
    seed: Annotated[int, Range(ge=0, le=2**31 - 1, whole=True)] = 0

    @model_validator(mode="after")
    def _one_source(self) -> RoadNetworkDocument:
        exactly_one(self, "layout", "file")
        if self.size[0] > 40 or self.size[1] > 40:
            refuse(f"is {list(self.size)}; each must be <= 40.", "size", value=list(self.size))
        return self


class KindDemandDocument(Document):
    """How much of one kind: new ones per second in the whole network, and how many per kilometre of lane at the start."""

    rate_per_s: Annotated[float, Range(ge=0, le=20)] = 0.0
    density_per_km: Annotated[float, Range(ge=0, le=300)] = 0.0


class DemandDocument(Document):
    """How much traffic: a `preset` at a `level`, and kinds by themselves, which replace those of the preset."""

    preset: Literal["city", "suburb", "rural", "motorway"] | None = None
    level: Literal["low", "medium", "high"] = "medium"
    car: KindDemandDocument | None = None
    van: KindDemandDocument | None = None
    bus: KindDemandDocument | None = None
    lorry: KindDemandDocument | None = None
    motorcycle: KindDemandDocument | None = None
    cyclist: KindDemandDocument | None = None
    tram: KindDemandDocument | None = None
    pedestrian: KindDemandDocument | None = None

    def by_kind(self) -> dict[TrafficKindName, KindDemandDocument]:
        """Return the kinds that are given by themselves."""
        given = {kind: getattr(self, kind) for kind in get_args(TrafficKindName)}
        return {kind: entry for kind, entry in given.items() if entry is not None}


class SignalStatesDocument(Document):
    """States of traffic lights, as SUMO's timedEvent SaveTLSStates or SaveTLSSwitchStates writes them."""

    file: Text


class TrafficRunDocument(Document):
    """The user's own SUMO run: its fcd-output on the network, with `signals` where they are known; or a .sumocfg to run.

    A configuration brings its network, unless the recipe has one.
    """

    file: Text
    signals: SignalStatesDocument | None = None

    @property
    def is_configuration(self) -> bool:
        """Whether SUMO is still to be run."""
        return self.file.casefold().endswith((".sumocfg", ".sumo.cfg"))

    @model_validator(mode="after")
    def _signals_of_a_record(self) -> TrafficRunDocument:
        if self.signals is not None and self.is_configuration:
            refuse("is given for a configuration, which tells them itself; remove it.", "signals")
        return self


class EgoDocument(Document):
    """Which vehicle carries the cameras: `id`, or the first (by id) that meets all conditions. It is not drawn unless `show`.

    `lane` is a pattern of SUMO's ids of lanes, such as "main_*"; `vehicle_ahead_m` asks for a vehicle on its way within that
    distance, straight on through junctions. Conditions hold at `chosen_at_s`, time_s unless given: the same vehicle then has
    the cameras at any time. Of a shown ego, parts whose names match a pattern of `hide` are left out ("glass*").
    """

    id: Text | None = None
    kind: TrafficKindName = "car"
    min_speed_m_s: NonNegative = 0.0
    max_speed_m_s: NonNegative | None = None
    lane: Text | None = None
    vehicle_ahead_m: Annotated[float, Range(gt=0, le=500)] | None = None
    min_road_ahead_m: NonNegative = 0.0
    chosen_at_s: Annotated[float, Range(ge=0, le=604_800)] | None = None
    show: Flag = False
    hide: list[Text] = Field(default_factory=list, max_length=100)


class TargetDocument(Document):
    """A thing at an exact distance, for range studies: `distance_m` from the ego's front bumper along its lane, or `lane`.

    `lane` counts from the ego's, positive to the left; `lateral_m` shifts to the left of the lane's middle. `facing_deg` is
    relative to the lane's direction. Traffic and furniture that would overlap it are left out.
    """

    id: Id
    asset_class: Text = Field(alias="class")
    tags: list[Text] = Field(default_factory=list, max_length=32)
    asset: Text | None = None
    distance_m: Annotated[float, Range(gt=0, le=2000)]
    lane: Annotated[int, Range(ge=-6, le=6, whole=True)] = 0
    lateral_m: Annotated[float, Range(ge=-20, le=20)] = 0.0
    facing_deg: Number = 0.0


class DirtDocument(Document):
    """How dirty a street is, 0 (clean) to 1: mud and dust on `vehicles`, for each by the seed; grime on `roads` and
    pavements."""

    vehicles: Fraction = 0.0
    roads: Fraction = 0.0


class TrafficDocument(Document):
    """A street with traffic by SUMO. `demand`, or a `run`; taken at `time_s` after the start.

    `style` says how the street is dressed, `season` with which plants; `lamps` what is lit; `street_lamps` what is in street
    lights, each asset's own lamps unless it says otherwise. Assets are the approved ones of the store unless `state` says
    otherwise, with one of `licence` where it is given.
    """

    network: RoadNetworkDocument | None = None
    demand: DemandDocument | None = None
    run: TrafficRunDocument | None = None
    time_s: Annotated[float, Range(ge=0, le=604_800)] = 60.0
    style: Text = "city"
    dressed: Flag = True
    lamps: Literal["day", "night"] = "day"
    headlamps: Literal["low", "high"] = "low"
    street_lamps: Literal["asset", "led", "sodium", "mercury", "metal_halide"] = "asset"
    drives_on: Literal["right", "left"] = "right"
    """For which side of the road headlamps are made: their cut-off rises on it."""

    wet: Flag = False
    season: Literal["summer", "autumn", "winter"] = "summer"
    dirt: DirtDocument = Field(default_factory=DirtDocument)
    ego: EgoDocument | None = None
    targets: list[TargetDocument] = Field(default_factory=list, max_length=100)
    state: list[Literal["pending", "approved", "rejected"]] = Field(default=["approved"], min_length=1)
    licence: list[Text] = Field(default_factory=list, max_length=32)
    range_m: Annotated[float, Range(ge=10, le=5000)] = 400.0
    """Objects farther than this from every camera are left out, and the manifest counts them."""

    @property
    def ego_is_shown(self) -> bool:
        """Whether the vehicle that carries the cameras is in the picture; without one, all vehicles are."""
        return self.ego is None or self.ego.show

    @model_validator(mode="after")
    def _one_traffic(self) -> TrafficDocument:
        if self.network is None and (self.run is None or not self.run.is_configuration):
            refuse("is missing; give a layout or a file, or a run of a .sumocfg, which brings its own.", "network")
        if self.run is not None and self.demand is not None:
            refuse("is given together with run; remove one of them.", "demand")
        if self.targets and self.ego is None:
            refuse("are placed by the ego; give ego.", "targets")
        return self
