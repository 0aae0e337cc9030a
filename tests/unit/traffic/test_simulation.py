"""Traffic by SUMO: repeatable, prefix-stable, in true sizes and places; the user's own runs; bad demands."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fullwell.traffic.networks import NetworkSpec, make_network
from fullwell.traffic.roads import RoadNetwork, read_network
from fullwell.traffic.simulation import TrafficDemand, VehicleModel, simulate
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.trajectories import Mover, Signals, read_fcd

MODELS = [
    VehicleModel("sedan", "car", 4.76, 1.9),
    VehicleModel("truck", "lorry", 9.0, 2.6),
    VehicleModel("rider", "cyclist", 1.8, 0.6),
    VehicleModel("walker", "pedestrian", 0.5, 0.5),
]
DEMAND = TrafficDemand({"car": 0.4, "lorry": 0.05, "cyclist": 0.05, "pedestrian": 0.2}, {"car": 6.0})
SUMO_DIGITS = 1e-3


@pytest.fixture(scope="module")
def network() -> RoadNetwork:
    return read_network(make_network(NetworkSpec("blocks", length_m=240.0)))


def places(movers: tuple[Mover, ...]) -> dict[str, list[float]]:
    return {mover.id: [*mover.front_m.tolist(), mover.yaw_rad, mover.speed_m_s] for mover in movers}


def test_the_same_seed_drives_the_same_and_another_does_not(network: RoadNetwork) -> None:
    first, again, other = (simulate(network, DEMAND, MODELS, seed=seed, times_s=[40.0]).frames[0] for seed in (5, 5, 6))
    assert places(first.movers) == places(again.movers)
    assert places(first.movers) != places(other.movers)
    assert {mover.kind for mover in first.movers} >= {"car", "pedestrian"}
    assert set(first.signals) == {link.signal for link in network.signals}


def test_a_moment_does_not_depend_on_how_long_the_run_goes_on(network: RoadNetwork) -> None:
    short = simulate(network, DEMAND, MODELS, seed=5, times_s=[30.0]).frames[0]
    whole = simulate(network, DEMAND, MODELS, seed=5, times_s=[30.0, 30.1, 45.0]).frames
    assert places(whole[0].movers) == places(short.movers)
    # A tenth of a second later everything has moved as fast as it says it drives.
    before = {mover.id: mover for mover in whole[0].movers}
    moved = [(before[mover.id], mover) for mover in whole[1].movers if mover.id in before and mover.kind == "car"]
    for old, new in moved:
        assert np.linalg.norm(new.front_m - old.front_m) == pytest.approx(0.1 * new.speed_m_s, abs=0.15)


def test_cars_stand_on_their_lanes_and_look_along_them(network: RoadNetwork) -> None:
    frame = simulate(network, DEMAND, MODELS, seed=5, times_s=[40.0]).frames[0]
    checked = 0
    for mover in frame.movers:
        lane = next((lane for lane in network.lanes if lane.id == mover.lane), None)
        if lane is None or mover.kind != "car" or lane.kind != "drive" or mover.position_m < 6:
            continue
        point, direction = lane.at(mover.position_m)
        aside = (mover.front_m - point)[:2] @ np.array([-direction[1], direction[0]])
        assert abs(aside) < lane.width_m / 2
        assert (mover.front_m - point)[:2] @ direction[:2] == pytest.approx(0.0, abs=0.05)
        assert math.cos(mover.yaw_rad - math.atan2(direction[1], direction[0])) > 0.95
        # The middle is half a length behind the bumper.
        assert (mover.front_m - mover.centre_m(4.76)) @ direction == pytest.approx(2.38, abs=0.1)
        checked += 1
    assert checked > 10


def test_rates_are_those_of_a_poisson_process() -> None:
    network = read_network(make_network(NetworkSpec("straight", length_m=400.0)))
    demand = TrafficDemand({"car": 0.1})
    counts = []
    for seed in range(12):
        run = simulate(network, demand, MODELS, seed=seed, times_s=[20.0])
        counts.append(len(run.frames[0].movers))
    # 20 s x 0.1 /s = 2 on average, all still on the 400 m: 12 runs make 24 +- 5.
    assert 24 - 4 * 24**0.5 < sum(counts) < 24 + 4 * 24**0.5


def test_signal_bits_are_lamps() -> None:
    assert Signals.from_bits(8) == Signals(brake=True)
    assert Signals.from_bits(1 | 128) == Signals(right=True, reverse=True)
    assert Signals.from_bits(4) == Signals(left=True, right=True)
    assert Signals.from_bits(0) == Signals()


FCD = """<fcd-export>
<timestep time="0.00"/>
<timestep time="1.00">
<vehicle id="b" x="10.5" y="-2" z="0.5" angle="0" type="my_truck" speed="7" pos="3" lane="e_0" slope="2"
signals="8" acceleration="-1"/>
<vehicle id="a" x="1" y="2" angle="90" type="DEFAULT_VEHTYPE" speed="3" pos="3" lane="e_0" slope="0"/>
<person id="p" x="4" y="4" angle="180" speed="1.2" pos="1" edge="e" slope="0"/>
</timestep></fcd-export>"""


def test_a_users_run_is_read_with_headings_slopes_and_signals(network: RoadNetwork, tmp_path: Path) -> None:
    (tmp_path / "fcd.xml").write_text(FCD)
    (frame,) = read_fcd(tmp_path / "fcd.xml", network, times_s=[1.0], types={})
    first, truck, walker = frame.movers
    assert [first.kind, truck.kind, walker.kind] == ["car", "lorry", "pedestrian"]
    assert (truck.yaw_rad, first.yaw_rad, walker.yaw_rad) == pytest.approx((math.pi / 2, 0.0, -math.pi / 2))
    assert truck.slope_rad == pytest.approx(math.radians(2))
    assert truck.signals.brake
    assert truck.acceleration_m_s2 == -1
    np.testing.assert_allclose(truck.front_m, [10.5, -2, 0.5])


@pytest.mark.parametrize(("content", "says"), [("<fcd", "no readable"), (FCD, "holds no step at 9 s; it holds 0 to 1 s")])
def test_a_damaged_run_or_a_time_that_it_lacks_is_refused(
    network: RoadNetwork, tmp_path: Path, content: str, says: str
) -> None:
    (tmp_path / "fcd.xml").write_text(content)
    with pytest.raises(TrafficError, match=says):
        read_fcd(tmp_path / "fcd.xml", network, times_s=[9.0], types={})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("demand", "says"),
    [
        (TrafficDemand({"tram": 0.1}), "no model of a tram"),
        (TrafficDemand({"car": math.nan}), "must be >= 0"),
        (TrafficDemand({"car": -1.0}), "must be >= 0"),
        (TrafficDemand({"car": 500.0}), "at most 20000"),
    ],
)
def test_impossible_demands_are_refused(network: RoadNetwork, demand: TrafficDemand, says: str) -> None:
    with pytest.raises(TrafficError, match=says):
        simulate(network, demand, MODELS, seed=1, times_s=[60.0])


def test_walkers_need_pavements() -> None:
    network = read_network(make_network(NetworkSpec("motorway", length_m=300.0)))
    with pytest.raises(TrafficError, match=r"demand\.pedestrian: the network has no lane for a pedestrian"):
        simulate(network, TrafficDemand({"pedestrian": 0.1}), MODELS, seed=1, times_s=[10.0])
