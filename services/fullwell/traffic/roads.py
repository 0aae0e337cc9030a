"""A road network as geometry: lanes, junctions, crossings and signals, in the world's coordinates."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.traffic.networks import DRIVES_ON_THE_LEFT, NetworkFile
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.templates import PARKING

__all__ = ["Junction", "Lane", "LaneKind", "RoadNetwork", "SignalLink", "read_network"]

Array = NDArray[np.float64]
LaneKind = Literal["drive", "bus", "bike", "parking", "sidewalk", "shoulder", "rail", "crossing", "walking_area", "internal"]

_FAR_M: Final = 10_000.0
"""Networks that lie farther from their origin are moved: float32 is 1 mm coarse at 10 km."""

_BACK_M: Final = 25.0
"""A way back ends this near to where the way there began: on the other side of the road."""

_DEFAULT_WIDTHS_M: Final[Mapping[str, float]] = {"sidewalk": 2.0, "crossing": 4.0, "bike": 1.5}


@dataclass(frozen=True, slots=True, eq=False)
class Lane:
    """One lane.

    Attributes
    ----------
    id, edge_id, index
        SUMO's; index 0 is the rightmost of its edge.
    kind
        By who may use it.
    centre_m
        (n, 3) centre line in driving direction; the outline of a walking area.
    width_m, speed_m_s
        Width, and speed limit.
    street
        Name of the street, empty where unknown.
    has_rails
        Whether trams or trains may use it, alone or with others.
    """

    id: str
    edge_id: str
    index: int
    kind: LaneKind
    centre_m: Array
    width_m: float
    speed_m_s: float
    street: str = ""
    has_rails: bool = False

    @property
    def length_m(self) -> float:
        """Length of the centre line."""
        return float(np.linalg.norm(np.diff(self.centre_m, axis=0), axis=1).sum())

    def at(self, distance_m: float) -> tuple[Array, Array]:
        """Return the point (3,) at a distance along the lane, and the unit direction (3,) there; ends are held."""
        steps = np.diff(self.centre_m, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        ends = np.cumsum(lengths)
        place = int(np.clip(np.searchsorted(ends, distance_m), 0, len(steps) - 1))
        before = ends[place] - lengths[place]
        share = np.clip((distance_m - before) / max(lengths[place], 1e-9), 0.0, 1.0)
        return self.centre_m[place] + share * steps[place], steps[place] / max(lengths[place], 1e-9)


@dataclass(frozen=True, slots=True, eq=False)
class Junction:
    """A junction: `kind` is SUMO's type (traffic_light, priority, dead_end, ...), `outline_m` (n, 3) its polygon."""

    id: str
    kind: str
    centre_m: Array
    outline_m: Array


@dataclass(frozen=True, slots=True)
class SignalLink:
    """One controlled movement: `index` into the state text of signal `signal`, from lane to lane; `crossing` for walkers."""

    signal: str
    index: int
    from_lane: str
    to_lane: str
    crossing: bool


@dataclass(frozen=True, slots=True, eq=False)
class RoadNetwork:
    """A network in metres, x east, y north, z up.

    Attributes
    ----------
    origin_m
        (3,) what was subtracted from SUMO's coordinates: world = SUMO - origin. Zero but for networks far from their origin.
    location
        The network's own words on projection and offset (netOffset, projParameter, ...): with them a position on the map
        follows, see `to_map`.
    successors
        {edge: the edges that connections lead to}.
    classes
        {(edge, edge that follows): SUMO's classes of vehicles that may go on so}.
    ends_m
        (n, 2) places where the network ends: roads lead from there to one other place at most.
    """

    file: NetworkFile
    lanes: tuple[Lane, ...]
    junctions: tuple[Junction, ...]
    signals: tuple[SignalLink, ...]
    origin_m: Array
    location: Mapping[str, str]
    successors: Mapping[str, tuple[str, ...]]
    classes: Mapping[tuple[str, str], frozenset[str]] = field(default_factory=dict)
    ends_m: Array = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def has_junctions(self) -> bool:
        """Whether roads meet: from some edge several lead on, ways back not counted."""
        starts, ends = ({lane.edge_id: lane.centre_m[place] for lane in self.lanes} for place in (0, -1))

        def leads_back(edge: str, following: str) -> bool:
            return float(np.linalg.norm(ends[following][:2] - starts[edge][:2])) < _BACK_M

        return any(
            sum(not leads_back(edge, other) for other in following if other in ends) > 1
            for edge, following in self.successors.items()
            if edge in starts
        )

    def reachable(self, edge: str, *, vclass: str = "") -> frozenset[str]:
        """Return the edges that a vehicle (of a class of SUMO's, where given) can come to from an edge, itself among them."""
        seen, ahead = {edge}, [edge]
        while ahead:
            here = ahead.pop()
            for following in self.successors.get(here, ()):
                if following not in seen and (not vclass or vclass in self.classes.get((here, following), ())):
                    seen.add(following)
                    ahead.append(following)
        return frozenset(seen)

    def lane(self, name: str) -> Lane:
        """Return a lane by its id; KeyError where there is none."""
        return self._by_id()[name]

    def _by_id(self) -> dict[str, Lane]:
        return {lane.id: lane for lane in self.lanes}

    def of_kind(self, *kinds: LaneKind) -> tuple[Lane, ...]:
        """Return the lanes of some kinds."""
        return tuple(lane for lane in self.lanes if lane.kind in kinds)

    def bounds_m(self) -> Array:
        """(2, 3) lower and upper corner of all lanes and junctions."""
        points = np.concatenate([lane.centre_m for lane in self.lanes] + [junction.outline_m for junction in self.junctions])
        return np.array([points.min(axis=0), points.max(axis=0)])

    def to_map(self, world_m: Array) -> Array:
        """Return map coordinates (..., 2) of world points (..., 2 or 3): those of the file that the network was made of.

        In metres of the file's projection; for a network without one, the coordinates as the file gives them.
        """
        offset = np.array([float(value) for value in self.location.get("netOffset", "0,0").split(",")][:2])
        return np.asarray(np.asarray(world_m, dtype=np.float64)[..., :2] + self.origin_m[:2] - offset)


def read_network(file: NetworkFile, *, path: str = "scene.traffic.network") -> RoadNetwork:
    """Return the geometry of a network. Raises TrafficError where it cannot be read or holds no lane for vehicles."""
    if re.search(rb"<net\s[^>]*\blefthand=[\"'](?:true|1|yes|on|x)", file.xml):
        raise TrafficError(f"{path} is a network {DRIVES_ON_THE_LEFT}", path)
    net = _sumo_net(file, path)
    lanes = list(_lanes(net))
    if not any(lane.kind in ("drive", "bus", "bike", "rail") for lane in lanes):
        raise TrafficError(f"{path} holds no lane for vehicles. Choose a file or an area with streets.", path)
    junctions = list(_junctions(net))
    origin = _origin(lanes)
    if origin.any():
        lanes = [_moved_lane(lane, origin) for lane in lanes]
        junctions = [replace(at, centre_m=at.centre_m - origin, outline_m=at.outline_m - origin) for at in junctions]
    location = {str(key): str(value) for key, value in net._location.items()}
    return RoadNetwork(
        file,
        tuple(lanes),
        tuple(junctions),
        tuple(_signals(net)),
        origin,
        location,
        successors=_successors(net),
        classes=_classes(net),
        ends_m=_ends(net) - origin[:2],
    )


def _sumo_net(file: NetworkFile, path: str) -> Any:
    from sumolib import net  # noqa: PLC0415 - an extra

    with tempfile.NamedTemporaryFile(suffix=".net.xml") as copy:
        copy.write(file.xml)
        copy.flush()
        try:
            return net.readNet(copy.name, withInternal=True, withPrograms=True, withPedestrianConnections=True)
        except Exception as error:  # sumolib raises whatever its parser meets
            raise TrafficError(f"{path} is damaged: {error}. Make it again with netconvert.", path) from error


def _lanes(net: Any) -> Iterator[Lane]:
    for edge in net.getEdges(withInternal=True):
        for lane in edge.getLanes():
            permissions = set(lane.getPermissions())
            kind = _kind(edge.getFunction(), permissions)
            shape = _points(lane.getShape3D())
            if len(shape) < 2:
                continue
            width = float(lane.getWidth()) or _DEFAULT_WIDTHS_M.get(kind, 3.2)
            name = str(edge.getName() or "")
            yield Lane(
                lane.getID(),
                edge.getID(),
                lane.getIndex(),
                kind,
                shape,
                width,
                speed_m_s=float(lane.getSpeed()),
                street=name,
                # A lane that is open to all without a word is none with rails.
                has_rails=bool(permissions & (_RAIL_CLASSES - {"subway"})) and not _is_open_to_all(permissions),
            )


_RAIL_CLASSES: Final = frozenset({"tram", "rail", "rail_urban", "rail_electric", "rail_fast", "subway"})


def _is_open_to_all(permissions: set[str]) -> bool:
    return {"tram", "rail", "ship", "passenger"} <= permissions


def _kind(function: str, permissions: set[str]) -> LaneKind:
    if function in ("crossing", "walkingarea"):
        return "crossing" if function == "crossing" else "walking_area"
    if function == "internal":
        return "internal"
    if permissions == {PARKING}:
        return "parking"
    if "passenger" in permissions:
        return "drive"
    if permissions & {"bus", "coach", "delivery", "truck"}:
        return "bus"
    if permissions & _RAIL_CLASSES:
        return "rail"
    if "bicycle" in permissions:
        return "bike"
    if "pedestrian" in permissions:
        return "sidewalk"
    return "shoulder"


def _junctions(net: Any) -> Iterator[Junction]:
    for node in net.getNodes():
        outline = _points(node.getShape3D())
        if len(outline) >= 3:
            x, y, *rest = node.getCoord3D()
            yield Junction(node.getID(), node.getType(), np.array([x, y, rest[0] if rest else 0.0]), outline)


def _ends(net: Any) -> Array:
    neighbours = ((node, {other.getID() for other in node.getNeighboringNodes()}) for node in net.getNodes())
    return np.array([node.getCoord()[:2] for node, others in neighbours if len(others) < 2], dtype=np.float64).reshape(-1, 2)


def _signals(net: Any) -> Iterator[SignalLink]:
    for signal in net.getTrafficLights():
        for start, end, index in signal.getConnections():
            crossing = start.getEdge().getFunction() in ("crossing", "walkingarea") or end.getEdge().getFunction() == "crossing"
            yield SignalLink(signal.getID(), int(index), start.getID(), end.getID(), crossing)


def _successors(net: Any) -> dict[str, tuple[str, ...]]:
    return {edge.getID(): tuple(sorted(other.getID() for other in edge.getOutgoing())) for edge in net.getEdges()}


def _classes(net: Any) -> dict[tuple[str, str], frozenset[str]]:
    allowed: dict[tuple[str, str], frozenset[str]] = {}
    for edge in net.getEdges():
        for other, connections in edge.getOutgoing().items():
            lanes = ((item.getFromLane().getPermissions(), item.getToLane().getPermissions()) for item in connections)
            allowed[edge.getID(), other.getID()] = frozenset().union(*(set(start) & set(end) for start, end in lanes))
    return allowed


def _points(shape: Any) -> Array:
    points = np.array([[*point, 0.0][:3] for point in shape], dtype=np.float64).reshape(-1, 3)
    if len(points) > 1:  # coincident points have no direction
        apart = np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6])
        points = points[apart]
    return points


def _origin(lanes: list[Lane]) -> Array:
    points = np.concatenate([lane.centre_m for lane in lanes])
    if float(np.abs(points[:, :2]).max()) <= _FAR_M:
        return np.zeros(3)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.array([math.floor(middle[0]), math.floor(middle[1]), 0.0])


def _moved_lane(lane: Lane, origin: Array) -> Lane:
    return replace(lane, centre_m=lane.centre_m - origin)
