"""Where everybody is at chosen moments: SUMO's fcd-output read, and filled between its steps."""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any, Final, Literal, cast
from xml.etree.ElementTree import ParseError, iterparse

import numpy as np
from numpy.typing import NDArray

from fullwell.traffic.roads import RoadNetwork
from fullwell.traffic.sumo import TrafficError

__all__ = [
    "Mover",
    "MoverType",
    "Signals",
    "TrafficFrame",
    "TrafficKind",
    "mover_type",
    "read_fcd",
    "read_signal_states",
]

Array = NDArray[np.float64]
TrafficKind = Literal["car", "van", "bus", "lorry", "motorcycle", "cyclist", "tram", "pedestrian"]

_SNAP_S: Final = 1e-6
_LONGEST_STEP_S: Final = 1.0
"""SUMO's own default; between steps that are farther apart nothing is filled in."""
_NEAR_M: Final = 200.0
"""How far from a network its traffic may be: parking areas and stops lie beside it."""


@dataclass(frozen=True, slots=True)
class MoverType:
    """What a type of SUMO's is: its kind, and its length [m]."""

    kind: TrafficKind
    length_m: float


_OF_VCLASS: Final[Mapping[str, MoverType]] = MappingProxyType(
    {
        **{name: MoverType("car", 5.0) for name in ("passenger", "private", "taxi", "evehicle", "hov", "vip", "authority")},
        **{name: MoverType("car", 5.0) for name in ("army", "custom1", "custom2", "ignoring")},
        **{name: MoverType("van", 6.5) for name in ("delivery", "emergency")},
        **{name: MoverType("motorcycle", 2.2) for name in ("motorcycle", "moped")},
        **{name: MoverType("cyclist", 1.6) for name in ("bicycle", "scooter")},
        **{name: MoverType("tram", 22.0) for name in ("tram", "rail_urban", "rail", "rail_electric", "rail_fast", "subway")},
        **{name: MoverType("pedestrian", 0.215) for name in ("pedestrian", "wheelchair")},
        "bus": MoverType("bus", 12.0),
        "coach": MoverType("bus", 14.0),
        "truck": MoverType("lorry", 7.1),
        "trailer": MoverType("lorry", 16.5),
    }
)
"""Kinds of SUMO's vehicle classes, and their lengths where a type does not say; ships and aircraft are no road users."""

_NAME_WORDS: Final[tuple[tuple[str, str], ...]] = (
    ("trailer", "trailer"), ("truck", "truck"), ("lorry", "truck"), ("bus", "bus"), ("coach", "coach"),
    ("motor", "motorcycle"), ("moped", "moped"), ("bike", "bicycle"), ("bicycle", "bicycle"), ("cycl", "bicycle"),
    ("tram", "tram"), ("rail", "rail"), ("ped", "pedestrian"), ("person", "pedestrian"), ("van", "delivery"),
    ("delivery", "delivery"),
)  # fmt: skip
_NO_ROAD_USERS: Final = frozenset({"ship", "aircraft", "drone", "cable_car", "container"})


def mover_type(name: str, *, vclass: str = "", length_m: float | None = None) -> MoverType | None:
    """Return what a type is: by its class, or by the words in its name where it has none; a car if no word fits.

    None for what does not use roads.
    """
    if vclass in _NO_ROAD_USERS:
        return None
    plain = name.casefold().removeprefix("default_").removesuffix("type")
    by_name = next((known for word, known in _NAME_WORDS if word in plain), "passenger")
    found = _OF_VCLASS.get(vclass) or _OF_VCLASS.get(plain) or _OF_VCLASS[by_name]
    return found if length_m is None else MoverType(found.kind, length_m)


@dataclass(frozen=True, slots=True)
class Signals:
    """Lamps of a vehicle that are on."""

    brake: bool = False
    left: bool = False
    right: bool = False
    reverse: bool = False

    @classmethod
    def from_bits(cls, bits: int) -> Signals:
        """Return what SUMO's signal bits say (MSVehicle::Signalling): 0 right, 1 left, 2 both, 3 brake, 7 reverse."""
        both = bool(bits & 4)
        return cls(brake=bool(bits & 8), left=both or bool(bits & 2), right=both or bool(bits & 1), reverse=bool(bits & 128))


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """A vehicle, cyclist or walker at a moment.

    Attributes
    ----------
    id, model, kind
        SUMO's id, and the name of its type.
    front_m
        (3,) SUMO's reference point: the middle of the front bumper (of walkers: their front), on the road.
    yaw_rad, slope_rad
        Heading counter-clockwise from +x (east), and how steeply it points upwards.
    lane, position_m
        Where on which lane its front is; an edge for walkers.
    length_m
        By SUMO.
    yaw_rate_rad_s
        Counter-clockwise, until the next step of the run, or since the one before; None where it has neither.
    """

    id: str
    model: str
    kind: TrafficKind
    front_m: Array
    yaw_rad: float
    slope_rad: float
    speed_m_s: float
    acceleration_m_s2: float
    lane: str
    position_m: float
    length_m: float
    signals: Signals = Signals()
    yaw_rate_rad_s: float | None = None

    def forward(self) -> Array:
        """Return the unit vector (3,) of its heading."""
        level = math.cos(self.slope_rad)
        return np.array([level * math.cos(self.yaw_rad), level * math.sin(self.yaw_rad), math.sin(self.slope_rad)])

    def centre_m(self, length_m: float) -> Array:
        """Return the point (3,) on the road below its middle."""
        return self.front_m - length_m / 2 * self.forward()


@dataclass(frozen=True, slots=True, eq=False)
class TrafficFrame:
    """All movers at a time [s], sorted by id, and the state text of each traffic light."""

    time_s: float
    movers: tuple[Mover, ...]
    signals: Mapping[str, str]


# Reading -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    time_s: float
    items: Mapping[str, tuple[str, dict[str, str]]]
    """{id: (vehicle or person, its attributes)}: only those of wanted moments become movers."""


def read_fcd(
    file: Path,
    network: RoadNetwork,
    *,
    times_s: Sequence[float],
    types: Mapping[str, MoverType],
    path: str = "scene.traffic.run",
) -> tuple[TrafficFrame, ...]:
    """Return the movers of an fcd-output file at `times_s` [s], in their order, without traffic lights.

    Between two steps at most 1 s apart, places follow the cubic through both with their velocities, headings and speeds go on
    evenly; who is not there at both is not there between. Yaw rates come from the next step, else from the one before; so do
    accelerations where the file has none. People in vehicles are left out.

    `types` tells what types are; one that is not in it is judged by the words in its name, and is a car if none fits.

    Raises
    ------
    TrafficError
        The file is damaged, holds none of a wanted time (the message tells which times it holds), or nothing in it is near the
        network.
    """
    found: dict[float, tuple[Mover, ...]] = {}
    waiting = sorted(set(times_s))
    before: _Step | None = None
    here: _Step | None = None
    first_s, last_s = math.nan, math.nan
    maker = _Maker(network, types)
    try:
        for step in _steps(file):
            if here is not None and step.time_s <= here.time_s:
                raise ValueError(f"its time goes from {here.time_s:g} back to {step.time_s:g} s")
            first_s = step.time_s if here is None else first_s
            last_s = step.time_s
            while waiting and here is not None and waiting[0] < step.time_s - _SNAP_S:
                time_s = waiting.pop(0)
                if abs(time_s - here.time_s) <= _SNAP_S:
                    found[time_s] = maker.at(before, here, step)
                elif time_s > here.time_s and step.time_s - here.time_s <= _LONGEST_STEP_S + _SNAP_S:
                    found[time_s] = maker.between(here, step, time_s)
            before, here = here, step
            if not waiting:
                break
        if here is not None and waiting and abs(waiting[0] - here.time_s) <= _SNAP_S:
            found[waiting[0]] = maker.at(before, here, None)
    except (ParseError, ValueError, OSError, EOFError, KeyError) as error:
        reason = f"something in it lacks {error}" if isinstance(error, KeyError) else str(error)
        raise TrafficError(f"{path} is no readable fcd-output of SUMO: {reason}.", path) from error
    missing = [time for time in times_s if time not in found]
    if missing:
        span = f"it holds {first_s:g} to {last_s:g} s" if last_s >= first_s else "it holds no time step"
        raise TrafficError(f"{path} holds no step at {missing[0]:g} s; {span}. Choose another time.", path, missing[0])
    frames = tuple(TrafficFrame(time, found[time], {}) for time in times_s)
    _check_places(frames, network, path)
    return frames


def _steps(file: Path) -> Iterator[_Step]:
    root: Any = None
    with _opened(file) as stream:
        for event, element in iterparse(stream, events=("start", "end")):
            if root is None:
                root = element
            if event == "end" and element.tag == "timestep":
                items = {
                    item.attrib["id"]: (item.tag, dict(item.attrib))
                    for item in element
                    if item.tag in ("vehicle", "person") and not item.get("vehicle")
                }
                yield _Step(float(element.get("time", "nan")), items)
                root.clear()  # what was read would stay in memory


def _opened(file: Path) -> IO[bytes]:
    """Return a file opened to be read, unpacked where SUMO packed it."""
    with file.open("rb") as stream:
        packed = stream.read(2) == b"\x1f\x8b"
    return cast("IO[bytes]", gzip.open(file)) if packed else file.open("rb")


def _check_places(frames: Sequence[TrafficFrame], network: RoadNetwork, path: str) -> None:
    places = [mover.front_m[:2] for frame in frames for mover in frame.movers]
    low, high = network.bounds_m()[:, :2] + np.array([[-_NEAR_M], [_NEAR_M]])
    if places and not any((low <= place).all() and (place <= high).all() for place in places):
        raise TrafficError(
            f"{path} has its traffic nowhere near the network. Give the network that the run was made on, and write the run "
            "without --fcd-output.geo.",
            path,
        )


class _Maker:
    """Makes movers of what steps say."""

    def __init__(self, network: RoadNetwork, types: Mapping[str, MoverType]) -> None:
        self._origin_m, self._types = network.origin_m, types
        self._lengths = {lane.id: (lane.edge_id, lane.length_m) for lane in network.lanes}

    def at(self, before: _Step | None, step: _Step, after: _Step | None) -> tuple[Mover, ...]:
        """Return everybody at a step; turning by the step after, else by that before."""
        movers = []
        for name in sorted(step.items):
            mover = self._mover(step, name)
            if mover is None:
                continue
            later, earlier = self._mover(after, name), self._mover(before, name)
            rate = _yaw_rate(mover, later, step, after)
            rate = _yaw_rate(mover, earlier, step, before) if rate is None else rate
            gained = mover.acceleration_m_s2
            if math.isnan(gained):
                other, there = (earlier, before) if earlier is not None else (later, after)
                gained = 0.0
                if other is not None and there is not None:
                    gained = (other.speed_m_s - mover.speed_m_s) / (there.time_s - step.time_s)
            movers.append(_changed(mover, acceleration_m_s2=gained, yaw_rate_rad_s=rate))
        return tuple(movers)

    def between(self, start: _Step, end: _Step, time_s: float) -> tuple[Mover, ...]:
        """Return everybody who is there at both steps, at a time between them."""
        movers = []
        for name in sorted(start.items.keys() & end.items.keys()):
            first, last = self._mover(start, name), self._mover(end, name)
            if first is not None and last is not None:
                movers.append(self._filled(first, last, time_s - start.time_s, end.time_s - start.time_s))
        return tuple(movers)

    def _filled(self, first: Mover, last: Mover, passed_s: float, step_s: float) -> Mover:
        share = passed_s / step_s
        if _has_jumped(first, last, step_s):
            return first if share < 0.5 else last
        turn = math.remainder(last.yaw_rad - first.yaw_rad, math.tau)
        gained = last.speed_m_s - first.speed_m_s
        lane, position_m = self._on_lane(first, last, share)
        return _changed(
            first,
            front_m=_cubic(first, last, share, step_s),
            yaw_rad=first.yaw_rad + share * turn,
            slope_rad=first.slope_rad + share * (last.slope_rad - first.slope_rad),
            speed_m_s=first.speed_m_s + share * gained,
            acceleration_m_s2=gained / step_s,
            lane=lane,
            position_m=position_m,
            yaw_rate_rad_s=turn / step_s,
        )

    def _on_lane(self, first: Mover, last: Mover, share: float) -> tuple[str, float]:
        """Return lane and place on it: from lane to lane of an edge half-way, from edge to edge where the first ends."""
        (edge, length_m), (other, _) = (self._lengths.get(mover.lane, ("", math.inf)) for mover in (first, last))
        if edge == other:
            lane = first.lane if share < 0.5 else last.lane
            return lane, first.position_m + share * (last.position_m - first.position_m)
        way_m = float(np.linalg.norm(last.front_m - first.front_m))
        place_m = first.position_m + share * way_m
        if place_m <= length_m:
            return first.lane, place_m
        return last.lane, max(0.0, last.position_m - (1 - share) * way_m)

    def _mover(self, step: _Step | None, name: str) -> Mover | None:
        if step is None or name not in step.items:
            return None
        tag, item = step.items[name]
        model = item.get("type", "")
        kind = self._types.get(model) or mover_type(model, vclass="pedestrian" if tag == "person" else "")
        if kind is None:
            return None
        place = np.array([float(item["x"]), float(item["y"]), float(item.get("z", "0"))]) - self._origin_m
        return Mover(
            id=name,
            model=model,
            kind=kind.kind,
            front_m=place,
            yaw_rad=math.radians(90.0 - float(item.get("angle", "0"))),
            slope_rad=math.radians(float(item.get("slope", "0"))),
            speed_m_s=float(item.get("speed", "0")),
            acceleration_m_s2=float(item.get("acceleration", "nan")),
            lane=item.get("lane") or item.get("edge") or "",
            position_m=float(item.get("pos", "0")),
            length_m=kind.length_m,
            signals=Signals.from_bits(int(item.get("signals", "0"))),
        )


def _changed(mover: Mover, **values: Any) -> Mover:
    plain = {name: getattr(mover, name) for name in Mover.__slots__}
    return Mover(**{**plain, **values})


def _has_jumped(first: Mover, last: Mover, step_s: float) -> bool:
    """Return whether SUMO has put it elsewhere: nothing drives that fast."""
    fastest = max(first.speed_m_s, last.speed_m_s) + 5.0
    return float(np.linalg.norm(last.front_m - first.front_m)) > fastest * step_s + 4.0


def _yaw_rate(mover: Mover, other: Mover | None, step: _Step, there: _Step | None) -> float | None:
    if other is None or there is None:
        return None
    apart_s = there.time_s - step.time_s
    if abs(apart_s) > _LONGEST_STEP_S + _SNAP_S or _has_jumped(mover, other, abs(apart_s)):
        return None
    return math.remainder(other.yaw_rad - mover.yaw_rad, math.tau) / apart_s


def _cubic(first: Mover, last: Mover, share: float, step_s: float) -> Array:
    """Return the point (3,) of the Hermite cubic with the velocities at both ends.

    These are held to three times the chord, beyond which the cubic would overshoot (Fritsch and Carlson 1980): SUMO's speeds
    jump from step to step.
    """
    way = last.front_m - first.front_m
    longest = 3.0 * float(np.linalg.norm(way))
    start, end = (min(mover.speed_m_s * step_s, longest) * mover.forward() for mover in (first, last))
    square, cube = share**2, share**3
    bend = (cube - 2 * square + share) * start + (cube - square) * end
    return np.asarray(first.front_m + (3 * square - 2 * cube) * way + bend)


def read_signal_states(file: Path, times_s: Sequence[float], *, path: str = "scene.traffic.run") -> dict[float, dict[str, str]]:
    """Return {time: {traffic light: state}}: the last state at or before each time, of a file by SaveTLSStates.

    A file that does not exist holds none. Raises TrafficError for one that cannot be read.
    """
    states: dict[float, dict[str, str]] = {time: {} for time in times_s}
    if not file.is_file():
        return states
    try:
        for _, element in iterparse(file, events=("end",)):
            if element.tag == "tlsState":
                at = float(element.get("time", "0"))
                for time, known in states.items():
                    if at <= time + _SNAP_S:
                        known[element.get("id", "")] = element.get("state", "")
                element.clear()
    except (ParseError, ValueError, OSError) as error:
        raise TrafficError(f"{path} holds no readable states of traffic lights: {error}.", path) from error
    return states
