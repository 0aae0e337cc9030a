"""Traffic scenes: roads, who drives on them, how the street is dressed, whose camera looks."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fullwell.schema.v1.common import Count, Document, Flag, Id, NonNegative, Number, Range, Text, exactly_one, refuse

__all__ = ["EgoDocument", "TargetDocument", "TrafficDocument", "TrafficKindName"]

TrafficKindName = Literal["car", "van", "bus", "lorry", "motorcycle", "cyclist", "tram", "pedestrian"]
_Width = Annotated[float, Range(ge=0, le=20)]
_Layout = Literal["grid", "spider", "random", "straight", "curve", "cross", "tee", "blocks", "roundabout", "motorway"]


class RoadNetworkDocument(Document):
    """Roads: a `layout`, or a `file` (.net.xml of SUMO, .osm or .osm.xml of OpenStreetMap, .xodr of OpenDRIVE).

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
    speed_limit_m_s: Annotated[float, Range(gt=0, le=60)] = 13.9
    signals: Flag = True
    seed: Annotated[int, Range(ge=0, le=2**31 - 1, whole=True)] = 0

    @model_validator(mode="after")
    def _one_source(self) -> RoadNetworkDocument:
        exactly_one(self, "layout", "file")
        if self.size[0] > 40 or self.size[1] > 40:
            refuse(f"is {list(self.size)}; each must be <= 40.", "size", value=list(self.size))
        return self


class DemandDocument(Document):
    """How much of one kind: new ones per second in the whole network, and how many per kilometre of lane at the start."""

    rate_per_s: Annotated[float, Range(ge=0, le=20)] = 0.0
    density_per_km: Annotated[float, Range(ge=0, le=300)] = 0.0


class TrafficRunDocument(Document):
    """The user's own SUMO run on the network: its fcd-output."""

    file: Text


class EgoDocument(Document):
    """Which vehicle carries the cameras: `id`, or the first (by id) that meets all conditions. It is not drawn unless `show`.

    `vehicle_ahead_m` asks for a vehicle in its lane within that distance.
    """

    id: Text | None = None
    kind: TrafficKindName = "car"
    min_speed_m_s: NonNegative = 0.0
    max_speed_m_s: NonNegative | None = None
    vehicle_ahead_m: Annotated[float, Range(gt=0, le=500)] | None = None
    min_road_ahead_m: NonNegative = 0.0
    show: Flag = False


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


class TrafficDocument(Document):
    """A street with traffic by SUMO. `demand` by kind, or `run`; taken at `time_s` after the start.

    `style` says how the street is dressed; `lamps` what is lit. Assets are the approved ones of the store unless `state` says
    otherwise, with one of `licence` where it is given.
    """

    network: RoadNetworkDocument
    demand: dict[TrafficKindName, DemandDocument] = Field(default_factory=dict)
    run: TrafficRunDocument | None = None
    time_s: Annotated[float, Range(ge=0, le=86_400)] = 60.0
    style: Text = "city"
    dressed: Flag = True
    lamps: Literal["day", "night"] = "day"
    headlamps: Literal["low", "high"] = "low"
    wet: Flag = False
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
        if self.run is not None and self.demand:
            refuse("is given together with run; remove one of them.", "demand")
        if self.targets and self.ego is None:
            refuse("are placed by the ego; give ego.", "targets")
        return self
