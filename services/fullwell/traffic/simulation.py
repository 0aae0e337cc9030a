"""Traffic by SUMO: demand becomes trips, SUMO drives them, and chosen moments come back as positions in the world."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal
from xml.etree.ElementTree import ParseError, iterparse
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fullwell.core.rng import stream
from fullwell.traffic.roads import Lane, RoadNetwork
from fullwell.traffic.sumo import SumoLimits, TrafficError, run_sumo_program

__all__ = [
    "TRAFFIC_KINDS",
    "Mover",
    "Signals",
    "TrafficDemand",
    "TrafficFrame",
    "TrafficKind",
    "TrafficRun",
    "VehicleModel",
    "read_fcd",
    "simulate",
]

Array = NDArray[np.float64]
TrafficKind = Literal["car", "van", "bus", "lorry", "motorcycle", "cyclist", "tram", "pedestrian"]

_VCLASSES: Final[Mapping[TrafficKind, str]] = MappingProxyType(
    {
        "car": "passenger",
        "van": "delivery",
        "bus": "bus",
        "lorry": "truck",
        "motorcycle": "motorcycle",
        "cyclist": "bicycle",
        "tram": "tram",
        "pedestrian": "pedestrian",
    }
)
TRAFFIC_KINDS: Final[tuple[TrafficKind, ...]] = tuple(_VCLASSES)

_KIND_OF_VCLASS: Final[Mapping[str, TrafficKind]] = MappingProxyType(
    {
        "passenger": "car", "private": "car", "taxi": "car", "evehicle": "car", "hov": "car", "emergency": "car",
        "delivery": "van", "bus": "bus", "coach": "bus", "truck": "lorry", "trailer": "lorry",
        "motorcycle": "motorcycle", "moped": "motorcycle", "scooter": "motorcycle", "bicycle": "cyclist",
        "tram": "tram", "rail_urban": "tram", "pedestrian": "pedestrian", "wheelchair": "pedestrian",
    }
)  # fmt: skip

_STEP_S: Final = 0.1
"""SUMO's step where clips of high frame rates are wanted too; at 1 s lane changes and stops are jerky."""
_MOST_TRIPS: Final = 20_000
_SNAP_S: Final = 1e-6
_BORDER_M: Final = 15.0
"""How near a road must end to a dead end to lead into or out of the network."""


@dataclass(frozen=True, slots=True)
class VehicleModel:
    """What may drive or walk: SUMO is told its true size, so that what stands for it in the picture fits its gaps.

    `name` is its type in SUMO and in the results, an asset's id for example; `weight` its share among its kind.
    """

    name: str
    kind: TrafficKind
    length_m: float
    width_m: float
    height_m: float = 1.5
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class TrafficDemand:
    """How much of each kind: new ones per second in the whole network, or how many there are per kilometre of lane.

    Both may be given; a kind in neither does not appear.
    """

    rates_per_s: Mapping[TrafficKind, float] = field(default_factory=dict)
    densities_per_km: Mapping[TrafficKind, float] = field(default_factory=dict)


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
    """One vehicle or walker at one moment.

    Attributes
    ----------
    id, model, kind
        SUMO's id, stable over a run; the name of its `VehicleModel`.
    front_m
        (3,) [m] middle of the front bumper (of a walker: its front), on the road, in the world's coordinates.
    yaw_rad
        Of its forward axis, counter-clockwise from +x. SUMO's angle is clockwise from north.
    slope_rad
        Up is positive.
    speed_m_s, acceleration_m_s2
        Along its forward axis.
    lane, position_m
        Lane and place along it; empty for walkers off the lanes.
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
    signals: Signals = Signals()

    def centre_m(self, length_m: float) -> Array:
        """Return the point (3,) on the road below its middle."""
        level = math.cos(self.slope_rad)
        forward = np.array([level * math.cos(self.yaw_rad), level * math.sin(self.yaw_rad), math.sin(self.slope_rad)])
        return self.front_m - length_m / 2 * forward


@dataclass(frozen=True, slots=True, eq=False)
class TrafficFrame:
    """All movers at a time [s], sorted by id, and the state text of each traffic light."""

    time_s: float
    movers: tuple[Mover, ...]
    signals: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class TrafficRun:
    """Chosen moments of a run, and what SUMO warned of."""

    frames: tuple[TrafficFrame, ...]
    warnings: tuple[str, ...]


# Running -------------------------------------------------------------------------------------------------------------


def simulate(
    network: RoadNetwork,
    demand: TrafficDemand,
    models: Sequence[VehicleModel],
    *,
    seed: int,
    times_s: Sequence[float],
    path: str = "scene.traffic",
    limits: SumoLimits | None = None,
) -> TrafficRun:
    """Return the traffic at `times_s` [s] after an empty (or, with densities, filled) start.

    The same network, demand, models, seed and version of SUMO give the same run.

    Raises
    ------
    TrafficError
        A kind without a model, a demand too large, a network none of whose lanes the kinds may use.
    """
    _check_demand(demand, models, path)
    end_s = _checked_times(times_s, path)
    with tempfile.TemporaryDirectory(prefix="fullwell-traffic-") as name:
        folder = Path(name)
        (folder / "roads.net.xml").write_bytes(network.file.xml)
        trips = sorted(_trips(network, demand, models, seed=seed, end_s=end_s, path=path))
        if len(trips) > _MOST_TRIPS:
            raise TrafficError(
                f"{path}: the demand makes {len(trips)} trips; at most {_MOST_TRIPS} are run. Lower the rates, or the warm-up.",
                path,
            )
        types = "".join(_type_element(model) for model in models)
        (folder / "demand.rou.xml").write_text(f"<routes>{types}{''.join(text for *_, text in trips)}</routes>")
        (folder / "signals.add.xml").write_text(_signal_outputs(network))
        arguments = ["--net-file", "roads.net.xml", "--route-files", "demand.rou.xml", "--additional-files", "signals.add.xml"]
        arguments += [*_RUN_OPTIONS, "--seed", f"{seed % 2**31}", "--end", f"{end_s:g}"]
        arguments += ["--device.fcd.begin", f"{min(times_s):g}"]
        warnings = run_sumo_program("sumo", arguments, folder=folder, path=path, what="the traffic", limits=limits)
        kinds = {model.name: model.kind for model in models}
        frames = read_fcd(folder / "fcd.xml", network, times_s=times_s, kinds=kinds, path=path)
        states = _signal_states(folder / "signals.xml", times_s)
    placed = tuple(TrafficFrame(frame.time_s, frame.movers, states.get(frame.time_s, {})) for frame in frames)
    return TrafficRun(placed, tuple(dict.fromkeys(warnings)))


_RUN_OPTIONS: Final = (
    *("--step-length", f"{_STEP_S:g}", "--fcd-output", "fcd.xml", "--fcd-output.signals", "true"),
    *("--fcd-output.acceleration", "true", "--precision", "4", "--no-step-log", "true"),
    *("--ignore-route-errors", "true", "--collision.action", "warn", "--collision.check-junctions", "true"),
    *("--time-to-teleport", "-1", "--pedestrian.model", "striping", "--lateral-resolution", "0.8", "--default.speeddev", "0.1"),
    *("--random-depart-offset", "0", "--xml-validation", "never", "--duration-log.disable", "true"),
)


def _check_demand(demand: TrafficDemand, models: Sequence[VehicleModel], path: str) -> None:
    wanted = {**demand.rates_per_s, **demand.densities_per_km}
    for kind, amount in wanted.items():
        if not (amount >= 0 and math.isfinite(amount)):
            raise TrafficError(f"{path}.demand.{kind} is {amount:g}; must be >= 0.", f"{path}.demand.{kind}", amount)
        if amount > 0 and not any(model.kind == kind and model.weight > 0 for model in models):
            raise TrafficError(
                f"{path}.demand.{kind} asks for traffic, but there is no model of a {kind}.", f"{path}.demand.{kind}"
            )


def _checked_times(times_s: Sequence[float], path: str) -> float:
    if not times_s or min(times_s) < 0 or not all(math.isfinite(time) for time in times_s):
        raise TrafficError(f"{path}: the moments to take must be at least one time >= 0 s.", path)
    return max(times_s) + _STEP_S


def _type_element(model: VehicleModel) -> str:
    vclass = _VCLASSES[model.kind]
    size = f'length="{model.length_m:.3f}" width="{model.width_m:.3f}" height="{model.height_m:.3f}"'
    gap = ' minGap="0.25"' if model.kind == "pedestrian" else ' minGap="2.0"'
    beside = ' latAlignment="right"' if model.kind == "cyclist" else ""
    return f'<vType id={quoteattr(model.name)} vClass="{vclass}" {size}{gap}{beside}/>'


def _signal_outputs(network: RoadNetwork) -> str:
    names = sorted({link.signal for link in network.signals})
    events = "".join(f'<timedEvent type="SaveTLSStates" source={quoteattr(name)} dest="signals.xml"/>' for name in names)
    return f"<additional>{events}</additional>"


# Demand --------------------------------------------------------------------------------------------------------------


def _trips(
    network: RoadNetwork, demand: TrafficDemand, models: Sequence[VehicleModel], *, seed: int, end_s: float, path: str
) -> Iterator[tuple[float, str, str]]:
    """Yield (departure [s], id, element); a stream of its own for each kind, so that one kind's demand moves no other."""
    for kind in TRAFFIC_KINDS:
        rate, density = demand.rates_per_s.get(kind, 0.0), demand.densities_per_km.get(kind, 0.0)
        if rate <= 0 and density <= 0:
            continue
        edges = _usable_edges(network, kind)
        if not edges:
            raise TrafficError(
                f"{path}.demand.{kind}: the network has no lane for a {kind}. Leave it out.", f"{path}.demand.{kind}"
            )
        chosen = [model for model in models if model.kind == kind and model.weight > 0]
        weights = np.array([model.weight for model in chosen]) / sum(model.weight for model in chosen)
        choice = _EndChoice(network, edges, walks=kind == "pedestrian")
        lanes_km = sum(lane.length_m for lane in edges.values()) / 1000.0
        there = int(stream(seed, "traffic", kind, "there").poisson(density * lanes_km)) if density > 0 else 0
        arrivals = _arrivals(stream(seed, "traffic", kind, "arrivals"), rate, end_s)
        departures = [(f"{kind}{number}", 0.0, True) for number in range(there)]
        departures += [(f"{kind}n{number}", depart_s, False) for number, depart_s in enumerate(arrivals)]
        for name, depart_s, spread in departures:
            # Of its own: one more trip, or a longer run, changes none of the others.
            rng = stream(seed, "trip", name)
            model = chosen[int(rng.choice(len(chosen), p=weights))]
            yield depart_s, name, _trip(rng, name, model, choice, depart_s=depart_s, spread=spread)


def _arrivals(rng: np.random.Generator, rate_per_s: float, end_s: float) -> list[float]:
    """Return the times of a Poisson process, one after the other: those of a longer run begin with those of a shorter."""
    times: list[float] = []
    time_s = float(rng.exponential(1.0 / rate_per_s)) if rate_per_s > 0 else math.inf
    while time_s < end_s and len(times) < 2 * _MOST_TRIPS:
        times.append(time_s)
        time_s += float(rng.exponential(1.0 / rate_per_s))
    return times


def _usable_edges(network: RoadNetwork, kind: TrafficKind) -> dict[str, Lane]:
    """Return for each edge that the kind may start on its longest such lane."""
    allowed: dict[str, tuple[str, ...]] = {
        "pedestrian": ("sidewalk",),
        "cyclist": ("bike", "drive"),
        "bus": ("drive", "bus"),
        "tram": ("rail",),
    }
    edges: dict[str, Lane] = {}
    for lane in network.lanes:
        if lane.kind in allowed.get(kind, ("drive",)) and lane.length_m >= 8.0:
            edges.setdefault(lane.edge_id, lane)
    return dict(sorted(edges.items()))


class _EndChoice:
    """Where trips of a kind begin and end: from the network's border to its border, where there is one."""

    def __init__(self, network: RoadNetwork, edges: Mapping[str, Lane], *, walks: bool) -> None:
        self.edges = edges
        self._network, self._walks = network, walks
        self._names = list(edges)
        border = [junction.centre_m[:2] for junction in network.junctions if junction.kind == "dead_end"]
        places = np.array(border).reshape(-1, 2)

        def near(point: Array) -> bool:
            return len(places) > 0 and bool(np.linalg.norm(places - point[:2], axis=1).min() < _BORDER_M)

        self._starts = [name for name, lane in edges.items() if near(lane.centre_m[0])] or self._names
        self._ends = frozenset(name for name, lane in edges.items() if near(lane.centre_m[-1]))
        self._goals: dict[str, list[str]] = {}

    def pair(self, rng: np.random.Generator, *, spread: bool) -> tuple[str, str]:
        """Return the first and last edge of a trip; one that is `spread` begins anywhere."""
        starts = self._names if spread else self._starts
        start = starts[int(rng.integers(len(starts)))]
        if start not in self._goals:
            there = frozenset(self._names) if self._walks else self._network.reachable(start) & frozenset(self._names)
            beyond = there - {start}
            self._goals[start] = sorted(beyond & self._ends) or sorted(beyond) or [start]
        goals = self._goals[start]
        return start, goals[int(rng.integers(len(goals)))]


def _trip(
    rng: np.random.Generator, name: str, model: VehicleModel, choice: _EndChoice, *, depart_s: float, spread: bool
) -> str:
    start, goal = choice.pair(rng, spread=spread)
    quoted, kind = quoteattr(name), quoteattr(model.name)
    if model.kind == "pedestrian":
        place = f"{rng.uniform(0.0, 1.0) * choice.edges[start].length_m:.2f}" if spread else "0"
        walk = f'<walk from={quoteattr(start)} to={quoteattr(goal)} departPosLat="random"/>'
        return f'<person id={quoted} type={kind} depart="{depart_s:.2f}" departPos="{place}">{walk}</person>'
    place = "random_free" if spread else "base"
    how = f'departPos="{place}" departSpeed="{"0" if spread else "max"}" departLane="best"'
    return f'<trip id={quoted} type={kind} depart="{depart_s:.2f}" from={quoteattr(start)} to={quoteattr(goal)} {how}/>'


# Reading -------------------------------------------------------------------------------------------------------------


def read_fcd(
    file: Path,
    network: RoadNetwork,
    *,
    times_s: Sequence[float],
    kinds: Mapping[str, TrafficKind],
    path: str = "scene.traffic.run",
) -> tuple[TrafficFrame, ...]:
    """Return the movers of an fcd-output file at `times_s`, in their order, without signals.

    `kinds` maps types to kinds; a type that is not in it is judged by the words in its name, and is a car if none fits.

    Raises
    ------
    TrafficError
        The file is damaged, or holds none of a wanted time; the message tells which times it holds.
    """
    wanted = {round(time / _SNAP_S): time for time in times_s}
    found: dict[float, tuple[Mover, ...]] = {}
    first, last = math.inf, -math.inf
    try:
        for _, element in iterparse(file, events=("end",)):
            if element.tag != "timestep":
                continue
            time = float(element.get("time", "nan"))
            first, last = min(first, time), max(last, time)
            place = round(time / _SNAP_S)
            if place in wanted:
                movers = [_mover(item, network, kinds) for item in element if item.tag in ("vehicle", "person")]
                found[wanted[place]] = tuple(sorted(movers, key=lambda mover: mover.id))
            element.clear()
    except (ParseError, ValueError, OSError) as error:
        raise TrafficError(f"{path} is no readable fcd-output of SUMO: {error}.", path) from error
    missing = [time for time in times_s if time not in found]
    if missing:
        span = f"it holds {first:g} to {last:g} s" if last >= first else "it holds no time step"
        raise TrafficError(f"{path} holds no step at {missing[0]:g} s; {span}. Choose another time.", path, missing[0])
    return tuple(TrafficFrame(time, found[time], {}) for time in times_s)


def _mover(item: Any, network: RoadNetwork, kinds: Mapping[str, TrafficKind]) -> Mover:
    model = item.get("type", "")
    kind = kinds.get(model) or ("pedestrian" if item.tag == "person" else _kind_by_name(model))
    place = np.array([float(item.get("x")), float(item.get("y")), float(item.get("z", "0"))]) - network.origin_m
    return Mover(
        id=item.get("id"),
        model=model,
        kind=kind,
        front_m=place,
        yaw_rad=math.radians(90.0 - float(item.get("angle", "0"))),
        slope_rad=math.radians(float(item.get("slope", "0"))),
        speed_m_s=float(item.get("speed", "0")),
        acceleration_m_s2=float(item.get("acceleration", "0")),
        lane=item.get("lane") or item.get("edge") or "",
        position_m=float(item.get("pos", "0")),
        signals=Signals.from_bits(int(item.get("signals", "0"))),
    )


_NAME_WORDS: Final[tuple[tuple[str, TrafficKind], ...]] = (
    ("truck", "lorry"), ("lorry", "lorry"), ("trailer", "lorry"), ("bus", "bus"), ("coach", "bus"), ("motor", "motorcycle"),
    ("moped", "motorcycle"), ("bike", "cyclist"), ("bicycle", "cyclist"), ("cycl", "cyclist"), ("tram", "tram"),
    ("rail", "tram"), ("ped", "pedestrian"), ("person", "pedestrian"), ("van", "van"), ("delivery", "van"),
)  # fmt: skip


def _kind_by_name(model: str) -> TrafficKind:
    name = model.casefold()
    exact = _KIND_OF_VCLASS.get(name.removeprefix("default_").removesuffix("type"))
    if exact is not None:
        return exact
    return next((kind for word, kind in _NAME_WORDS if word in name), "car")


def _signal_states(file: Path, times_s: Sequence[float]) -> dict[float, dict[str, str]]:
    """Return {time: {signal: state}}: the last state at or before each time."""
    states: dict[float, dict[str, str]] = {time: {} for time in times_s}
    if not file.is_file():
        return states
    for _, element in iterparse(file, events=("end",)):
        if element.tag == "tlsState":
            at = float(element.get("time", "0"))
            for time, known in states.items():
                if at <= time + _SNAP_S:
                    known[element.get("id", "")] = element.get("state", "")
            element.clear()
    return states
