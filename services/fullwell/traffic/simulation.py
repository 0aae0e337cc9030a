"""Traffic by SUMO: demand becomes trips, SUMO drives them, and chosen moments come back as positions in the world."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fullwell.core.rng import stream
from fullwell.traffic.own_runs import OwnRun
from fullwell.traffic.roads import Lane, RoadNetwork
from fullwell.traffic.stops import BusStop, stop_elements
from fullwell.traffic.sumo import SumoLimits, TrafficError, run_sumo_program
from fullwell.traffic.trajectories import MoverType, TrafficFrame, TrafficKind, read_fcd, read_signal_states

__all__ = [
    "TRAFFIC_KINDS",
    "TrafficDemand",
    "TrafficRun",
    "VehicleModel",
    "drive",
    "idle_signals",
    "simulate",
]

Array = NDArray[np.float64]

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

_STEP_S: Final = 0.1
"""SUMO's step; at 1 s lane changes and stops are jerky."""
_AROUND_S: Final = 1.1
"""Steps this long before and after the wanted moments are written too: they tell how things turn and what lies between."""
_HALT_S: Final = (10.0, 25.0)
"""Least and most that a bus stands at a stop."""
_MOST_TRIPS: Final = 20_000
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

    `entry_rates_per_s` are new ones per second at each way into the network, with as many there at the start as such a stream
    has on its way; kinds that the network has no lane for, or that have no model, are left out of these. A network without an
    end has a tenth of its edges as ways in. A kind that is in none of the three does not appear.
    `junction_share` is the share of the vehicles among these where roads meet.
    """

    rates_per_s: Mapping[TrafficKind, float] = field(default_factory=dict)
    densities_per_km: Mapping[TrafficKind, float] = field(default_factory=dict)
    entry_rates_per_s: Mapping[TrafficKind, float] = field(default_factory=dict)
    junction_share: float = 1.0


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
    stops: Sequence[BusStop] = (),
    path: str = "scene.traffic",
    limits: SumoLimits | None = None,
) -> TrafficRun:
    """Return the traffic at `times_s` [s] after an empty (or, with densities, filled) start.

    The same network, demand, models, stops, seed and version of SUMO give the same run. Each bus calls at one of the stops.

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
        trips = sorted(_trips(network, demand, models, stops, seed=seed, end_s=end_s, path=path))
        if len(trips) > _MOST_TRIPS:
            raise TrafficError(
                f"{path}: the demand makes {len(trips)} trips; at most {_MOST_TRIPS} are run. Lower the rates, or the warm-up.",
                path,
            )
        types = "".join(_type_element(model) for model in models)
        (folder / "demand.rou.xml").write_text(f"<routes>{types}{''.join(text for *_, text in trips)}</routes>")
        (folder / "signals.add.xml").write_text(_SIGNAL_OUTPUT)
        (folder / "stops.add.xml").write_text(f"<additional>{stop_elements(stops)}</additional>")
        arguments = ["--net-file", "roads.net.xml", "--route-files", "demand.rou.xml"]
        arguments += ["--additional-files", "stops.add.xml,signals.add.xml"]
        arguments += _flat({**_DRIVING, **_OUTPUTS, **_QUIET})
        arguments += ["--seed", f"{seed % 2**31}", "--end", f"{end_s:g}"]
        arguments += ["--device.fcd.begin", f"{max(0.0, min(times_s) - 2 * _STEP_S):g}"]
        warnings = run_sumo_program("sumo", arguments, folder=folder, path=path, what="the traffic", limits=limits)
        known = {model.name: MoverType(model.kind, model.length_m) for model in models}
        return _run_of(folder, network, known, times_s=times_s, path=path, warnings=warnings)


def _run_of(
    folder: Path,
    network: RoadNetwork,
    types: Mapping[str, MoverType],
    *,
    times_s: Sequence[float],
    path: str,
    warnings: Sequence[str],
) -> TrafficRun:
    """Return what SUMO wrote into its folder."""
    frames = read_fcd(folder / "fcd.xml", network, times_s=times_s, types=types, path=path)
    states = read_signal_states(folder / "signals.xml", times_s, path=path)
    placed = tuple(TrafficFrame(frame.time_s, frame.movers, states[frame.time_s]) for frame in frames)
    return TrafficRun(placed, tuple(dict.fromkeys(warnings)))


def drive(
    network: RoadNetwork,
    own: OwnRun,
    *,
    times_s: Sequence[float],
    path: str = "scene.traffic.run",
    limits: SumoLimits | None = None,
) -> TrafficRun:
    """Return the traffic of the user's own SUMO configuration at `times_s` [s], times as its own clock shows them.

    It runs in a folder of its own, with its own options and step, and is cut off after the last moment.

    Raises
    ------
    TrafficError
        SUMO cannot run it, it takes too long, or it begins later than a moment.
    """
    begin_s = _seconds(own.options.get("begin", "0"), path)
    if min(times_s) < begin_s:
        where = f"{path}: the run begins at {begin_s:g} s, after time_s = {min(times_s):g}. Choose a later time_s."
        raise TrafficError(where, path, min(times_s))
    with tempfile.TemporaryDirectory(prefix="fullwell-traffic-") as name:
        folder = Path(name)
        (folder / "roads.net.xml").write_bytes(network.file.xml)
        (folder / "signals.add.xml").write_text(_SIGNAL_OUTPUT)
        for text_name, text in own.files.items():
            (folder / text_name).write_bytes(text)
        additional = ",".join(filter(None, (own.options.get("additional-files"), "signals.add.xml")))
        options = {**own.options, "net-file": "roads.net.xml", "additional-files": additional, **_OUTPUTS, **_QUIET}
        options |= {"end": f"{max(times_s) + 2 * _AROUND_S:g}", "device.fcd.begin": f"{max(0, min(times_s) - _AROUND_S):g}"}
        (folder / "run.sumocfg").write_bytes(_configuration(options))
        arguments = ["--configuration-file", "run.sumocfg"]
        warnings = run_sumo_program("sumo", arguments, folder=folder, path=path, what="the run", limits=limits or _OWN_LIMITS)
        return _run_of(folder, network, own.types, times_s=times_s, path=path, warnings=warnings)


def idle_signals(
    network: RoadNetwork, times_s: Sequence[float], *, path: str = "scene.traffic.network"
) -> dict[float, dict[str, str]]:
    """Return {time: {traffic light: state}} by the network's own programs, as they run where nobody drives."""
    if not network.signals:
        return {time: {} for time in times_s}
    with tempfile.TemporaryDirectory(prefix="fullwell-signals-") as name:
        folder = Path(name)
        (folder / "roads.net.xml").write_bytes(network.file.xml)
        (folder / "signals.add.xml").write_text(_SIGNAL_OUTPUT)
        arguments = ["--net-file", "roads.net.xml", "--additional-files", "signals.add.xml", "--end", f"{max(times_s) + 1:g}"]
        arguments += _flat(_QUIET)
        run_sumo_program("sumo", arguments, folder=folder, path=path, what="its traffic lights")
        return read_signal_states(folder / "signals.xml", times_s, path=path)


_OWN_LIMITS: Final = SumoLimits(time_s=300.0)
_SIGNAL_OUTPUT: Final = '<additional><timedEvent type="SaveTLSSwitchStates" dest="signals.xml"/></additional>'
_OUTPUTS: Final[Mapping[str, str]] = MappingProxyType(
    {"fcd-output": "fcd.xml", "fcd-output.signals": "true", "fcd-output.acceleration": "true", "precision": "4"}
)
_QUIET: Final[Mapping[str, str]] = MappingProxyType(
    {"no-step-log": "true", "xml-validation": "never", "xml-validation.net": "never", "duration-log.disable": "true"}
)
_DRIVING: Final[Mapping[str, str]] = MappingProxyType(
    {
        "step-length": f"{_STEP_S:g}",
        "ignore-route-errors": "true",
        "collision.action": "warn",
        "collision.check-junctions": "true",
        "time-to-teleport": "-1",
        "pedestrian.model": "striping",
        "lateral-resolution": "0.8",
        "default.speeddev": "0.1",
        "random-depart-offset": "0",
    }
)


def _flat(options: Mapping[str, str]) -> list[str]:
    return [word for name, value in options.items() for word in (f"--{name}", value)]


def _configuration(options: Mapping[str, str]) -> bytes:
    root = ElementTree.Element("configuration")
    for name, value in options.items():
        ElementTree.SubElement(root, name, value=value)
    return ElementTree.tostring(root)


def _seconds(text: str, path: str) -> float:
    """Return a time of SUMO's [s]: seconds, or [days:]hours:minutes:seconds."""
    try:
        return sum(float(part) * unit for part, unit in zip(reversed(text.split(":")), (1, 60, 3600, 86_400), strict=False))
    except ValueError:
        raise TrafficError(
            f"{path} begins at {text!r}, which is no time. Give seconds or hours:minutes:seconds.", path
        ) from None


def _check_demand(demand: TrafficDemand, models: Sequence[VehicleModel], path: str) -> None:
    for kind, amount in (*demand.rates_per_s.items(), *demand.densities_per_km.items()):
        if not (amount >= 0 and math.isfinite(amount)):
            raise TrafficError(f"{path}.demand.{kind} is {amount:g}; must be >= 0.", f"{path}.demand.{kind}", amount)
        if amount > 0 and not any(model.kind == kind and model.weight > 0 for model in models):
            raise TrafficError(
                f"{path}.demand.{kind} asks for traffic, but there is no model of a {kind}.", f"{path}.demand.{kind}"
            )


def _checked_times(times_s: Sequence[float], path: str) -> float:
    if not times_s or min(times_s) < 0 or not all(math.isfinite(time) for time in times_s):
        raise TrafficError(f"{path}: the moments to take must be at least one time >= 0 s.", path)
    return max(times_s) + 2 * _STEP_S


def _type_element(model: VehicleModel) -> str:
    vclass = _VCLASSES[model.kind]
    size = f'length="{model.length_m:.3f}" width="{model.width_m:.3f}" height="{model.height_m:.3f}"'
    gap = ' minGap="0.25"' if model.kind == "pedestrian" else ' minGap="2.0"'
    beside = ' latAlignment="right"' if model.kind == "cyclist" else ""
    return f'<vType id={quoteattr(model.name)} vClass="{vclass}" {size}{gap}{beside}/>'


# Demand --------------------------------------------------------------------------------------------------------------


def _trips(
    network: RoadNetwork,
    demand: TrafficDemand,
    models: Sequence[VehicleModel],
    stops: Sequence[BusStop],
    *,
    seed: int,
    end_s: float,
    path: str,
) -> Iterator[tuple[float, str, str]]:
    """Yield (departure [s], id, element); a stream of its own for each kind, so that one kind's demand moves no other."""
    for kind in TRAFFIC_KINDS:
        rate, density = demand.rates_per_s.get(kind, 0.0), demand.densities_per_km.get(kind, 0.0)
        entry_rate = demand.entry_rates_per_s.get(kind, 0.0)
        entry_rate *= demand.junction_share if kind != "pedestrian" and network.has_junctions else 1.0
        if rate <= 0 and density <= 0 and entry_rate <= 0:
            continue
        edges = _usable_edges(network, kind)
        has_model = any(model.kind == kind and model.weight > 0 for model in models)
        if rate <= 0 and density <= 0 and not (edges and has_model):
            continue
        if not edges:
            raise TrafficError(
                f"{path}.demand.{kind}: the network has no lane for a {kind}. Leave it out.", f"{path}.demand.{kind}"
            )
        chosen = [model for model in models if model.kind == kind and model.weight > 0]
        weights = np.array([model.weight for model in chosen]) / sum(model.weight for model in chosen)
        choice = _EndChoice(network, edges, kind, stops if kind == "bus" else ())
        lanes_km = sum(lane.length_m for lane in edges.values()) / 1000.0
        rate += entry_rate * choice.ways_in
        density += 1000.0 * entry_rate / _usual_speed_m_s(kind, list(edges.values()))
        there = int(stream(seed, "traffic", kind, "there").poisson(density * lanes_km)) if density > 0 else 0
        arrivals = _arrivals(stream(seed, "traffic", kind, "arrivals"), rate, end_s)
        departures = [(f"{kind}{number}", 0.0, True) for number in range(there)]
        departures += [(f"{kind}n{number}", depart_s, False) for number, depart_s in enumerate(arrivals)]
        for name, depart_s, spread in departures:
            # Of its own: one more trip, or a longer run, changes none of the others.
            rng = stream(seed, "trip", name)
            model = chosen[int(rng.choice(len(chosen), p=weights))]
            yield depart_s, name, _trip(rng, name, model, choice, depart_s=depart_s, spread=spread)


def _usual_speed_m_s(kind: TrafficKind, lanes: Sequence[Lane]) -> float:
    """Return how fast a kind goes: the lanes' limit, or what legs can do."""
    limits = np.array([lane.speed_m_s for lane in lanes])
    lengths = np.array([lane.length_m for lane in lanes])
    return min(float(limits @ lengths / lengths.sum()), _BY_LEG_M_S.get(kind, math.inf))


_BY_LEG_M_S: Final[Mapping[TrafficKind, float]] = MappingProxyType({"pedestrian": 1.3, "cyclist": 4.5})


def _arrivals(rng: np.random.Generator, rate_per_s: float, end_s: float) -> list[float]:
    """Return the times of a Poisson process, one after the other: those of a longer run begin with those of a shorter."""
    times: list[float] = []
    time_s = float(rng.exponential(1.0 / rate_per_s)) if rate_per_s > 0 else math.inf
    while time_s < end_s and len(times) < 2 * _MOST_TRIPS:
        times.append(time_s)
        time_s += float(rng.exponential(1.0 / rate_per_s))
    return times


def _usable_edges(network: RoadNetwork, kind: TrafficKind) -> dict[str, Lane]:
    """Return for each edge that the kind may start on its first such lane."""
    allowed: dict[str, tuple[str, ...]] = {
        "pedestrian": ("sidewalk",),
        "cyclist": ("bike", "drive"),
        "bus": ("drive", "bus"),
        "tram": ("rail",),
    }
    edges: dict[str, Lane] = {}
    for lane in network.lanes:
        on_rails = kind == "tram" and lane.has_rails and lane.kind in ("drive", "bus")
        if (lane.kind in allowed.get(kind, ("drive",)) or on_rails) and lane.length_m >= 8.0:
            edges.setdefault(lane.edge_id, lane)
    return dict(sorted(edges.items()))


class _EndChoice:
    """Where trips of a kind begin and end: from the network's border to its border, where there is one."""

    def __init__(self, network: RoadNetwork, edges: Mapping[str, Lane], kind: TrafficKind, stops: Sequence[BusStop]) -> None:
        self.edges = edges
        self._network, self._walks = network, kind == "pedestrian"
        self._vclass, self._stops = _VCLASSES[kind], stops
        self._names = list(edges)
        places = network.ends_m

        def near(point: Array) -> bool:
            return len(places) > 0 and bool(np.linalg.norm(places - point[:2], axis=1).min() < _BORDER_M)

        border_starts = [name for name, lane in edges.items() if near(lane.centre_m[0])]
        self._starts = border_starts or self._names
        self.ways_in = len(border_starts) or -(-len(self._names) // 10)
        self._ends = frozenset(name for name, lane in edges.items() if near(lane.centre_m[-1]))
        self._goals: dict[str, list[str]] = {}
        self._beyond: dict[str, frozenset[str]] = {}

    def pair(self, rng: np.random.Generator, *, spread: bool) -> tuple[str, str]:
        """Return the first and last edge of a trip; one that is `spread` begins anywhere."""
        starts = self._names if spread else self._starts
        start = starts[int(rng.integers(len(starts)))]
        if start not in self._goals:
            there = frozenset(self._names) if self._walks else self._reachable(start) & frozenset(self._names)
            beyond = there - {start}
            leaves = start in self._ends and not self._walks  # who is on his way out goes on: no turning at the border
            self._goals[start] = [start] if leaves else sorted(beyond & self._ends) or sorted(beyond) or [start]
        goals = self._goals[start]
        return start, goals[int(rng.integers(len(goals)))]

    def stop(self, rng: np.random.Generator, start: str, goal: str, *, spread: bool) -> BusStop | None:
        """Return a stop on the way from edge to edge; one that begins anywhere may have passed those of its first edge."""
        there = self._reachable(start) - ({start} if spread else set())
        fitting = [stop for stop in self._stops if stop.edge_id in there and goal in self._reachable(stop.edge_id)]
        return fitting[int(rng.integers(len(fitting)))] if fitting else None

    def _reachable(self, edge: str) -> frozenset[str]:
        if edge not in self._beyond:
            self._beyond[edge] = self._network.reachable(edge, vclass=self._vclass)
        return self._beyond[edge]


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
    stop = choice.stop(rng, start, goal, spread=spread)
    halt = "" if stop is None else f'<stop busStop={quoteattr(stop.id)} duration="{rng.uniform(*_HALT_S):.1f}"/>'
    ends = f"from={quoteattr(start)} to={quoteattr(goal)}"
    return f'<trip id={quoted} type={kind} depart="{depart_s:.2f}" {ends} {how}>{halt}</trip>'
