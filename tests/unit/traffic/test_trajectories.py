"""Where everybody is: fcd-output read, and filled between its steps by closed forms."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from fullwell.traffic.networks import NetworkSpec, make_network
from fullwell.traffic.roads import RoadNetwork, read_network
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.trajectories import Mover, mover_type, read_fcd, read_signal_states

RADIUS_M = 20.0
SPEED_M_S = 8.0


@pytest.fixture(scope="module")
def network() -> RoadNetwork:
    return read_network(make_network(NetworkSpec("straight", length_m=240.0)))


def fcd(folder: Path, steps: dict[float, list[str]]) -> Path:
    text = "".join(f'<timestep time="{time:.2f}">{"".join(items)}</timestep>' for time, items in steps.items())
    (folder / "fcd.xml").write_text(f"<fcd-export>{text}</fcd-export>")
    return folder / "fcd.xml"


def car(x: float, y: float, yaw_rad: float = 0.0, *, speed: float = SPEED_M_S, name: str = "a", more: str = "") -> str:
    angle = 90.0 - math.degrees(yaw_rad)
    return f'<vehicle id="{name}" type="car" x="{x:.6f}" y="{y:.6f}" angle="{angle:.6f}" speed="{speed:.6f}" pos="3" {more}/>'


def on_circle(time_s: float) -> str:
    turned = SPEED_M_S * time_s / RADIUS_M
    return car(RADIUS_M * math.sin(turned), RADIUS_M * (1 - math.cos(turned)), turned)


def only(frames: tuple[object, ...]) -> Mover:
    (frame,) = frames
    (mover,) = frame.movers  # type: ignore[attr-defined]
    assert isinstance(mover, Mover)
    return mover


def test_between_steps_a_car_on_a_circle_stays_on_it(network: RoadNetwork, tmp_path: Path) -> None:
    """A cubic of 0.4 rad leaves its circle by less than 1e-4 of the radius; the chord by 2 per cent."""
    file = fcd(tmp_path, {float(time): [on_circle(time)] for time in range(3)})
    for time_s in (1.1, 1.25, 1.5, 1.9):
        mover = only(read_fcd(file, network, times_s=[time_s], types={}))
        turned = SPEED_M_S * time_s / RADIUS_M
        place = [RADIUS_M * math.sin(turned), RADIUS_M * (1 - math.cos(turned)), 0.0]
        np.testing.assert_allclose(mover.front_m, place, atol=2e-3)
        assert mover.yaw_rad == pytest.approx(turned, abs=1e-6)
        assert mover.yaw_rate_rad_s == pytest.approx(SPEED_M_S / RADIUS_M, rel=1e-5)
        assert mover.acceleration_m_s2 == pytest.approx(0.0, abs=1e-5)


def test_yaw_rates_come_from_the_next_step_and_at_the_end_from_the_one_before(network: RoadNetwork, tmp_path: Path) -> None:
    file = fcd(tmp_path, {float(time): [on_circle(time)] for time in range(3)})
    for time_s in (0.0, 1.0, 2.0):
        mover = only(read_fcd(file, network, times_s=[time_s], types={}))
        assert mover.yaw_rate_rad_s == pytest.approx(SPEED_M_S / RADIUS_M, rel=1e-5)
    alone = fcd(tmp_path, {0.0: [on_circle(0)]})
    assert only(read_fcd(alone, network, times_s=[0.0], types={})).yaw_rate_rad_s is None


def test_accelerations_that_a_file_lacks_are_those_of_its_speeds(network: RoadNetwork, tmp_path: Path) -> None:
    file = fcd(tmp_path, {0.0: [car(0, 0, speed=4)], 1.0: [car(5, 0, speed=6)], 2.0: [car(10.5, 0, speed=5)]})
    values = {time: only(read_fcd(file, network, times_s=[time], types={})).acceleration_m_s2 for time in (0.0, 0.5, 1.0, 2.0)}
    assert values == pytest.approx({0.0: 2.0, 0.5: 2.0, 1.0: 2.0, 2.0: -1.0})
    told = fcd(tmp_path, {0.0: [car(0, 0, more='acceleration="-3"')]})
    assert only(read_fcd(told, network, times_s=[0.0], types={})).acceleration_m_s2 == -3


def test_a_car_that_brakes_to_a_halt_does_not_overshoot(network: RoadNetwork, tmp_path: Path) -> None:
    """SUMO moves by the speed at the end of a step: a car at 5 m/s may stand still from one step to the next."""
    file = fcd(tmp_path, {0.0: [car(10, 0, speed=5)], 1.0: [car(10, 0, speed=0)]})
    assert only(read_fcd(file, network, times_s=[0.4], types={})).front_m[0] == pytest.approx(10.0)
    file = fcd(tmp_path, {0.0: [car(10, 0, speed=9)], 1.0: [car(11, 0, speed=1)]})
    places = [only(read_fcd(file, network, times_s=[time], types={})).front_m[0] for time in np.arange(0.1, 1.0, 0.1).tolist()]
    assert np.all(np.diff(places) >= 0)
    assert max(places) <= 11.0


def test_who_is_put_elsewhere_does_not_fly_there(network: RoadNetwork, tmp_path: Path) -> None:
    file = fcd(tmp_path, {0.0: [car(10, 0)], 1.0: [car(150, 0, math.pi)]})
    early, late = (only(read_fcd(file, network, times_s=[time], types={})) for time in (0.4, 0.6))
    assert (early.front_m[0], late.front_m[0]) == (10, 150)
    assert only(read_fcd(file, network, times_s=[0.0], types={})).yaw_rate_rad_s is None


def test_lanes_change_half_way_and_edges_where_they_end(network: RoadNetwork, tmp_path: Path) -> None:
    there = 'lane="main_0"', 'lane="main_1"'
    file = fcd(tmp_path, {0.0: [car(10, 0, more=there[0])], 1.0: [car(18, 2, more=there[1])]})
    lanes = [only(read_fcd(file, network, times_s=[time], types={})).lane for time in (0.4, 0.6)]
    assert lanes == ["main_0", "main_1"]


def test_a_packed_run_is_read_and_a_broken_one_refused(network: RoadNetwork, tmp_path: Path) -> None:
    packed = gzip.compress(fcd(tmp_path, {0.0: [car(7, 0)]}).read_bytes())
    (tmp_path / "fcd.xml.gz").write_bytes(packed)
    assert only(read_fcd(tmp_path / "fcd.xml.gz", network, times_s=[0.0], types={})).front_m[0] == 7
    (tmp_path / "fcd.xml.gz").write_bytes(packed[:-12])
    with pytest.raises(TrafficError, match="no readable fcd-output"):
        read_fcd(tmp_path / "fcd.xml.gz", network, times_s=[5.0], types={})


def test_who_is_there_at_one_step_only_is_not_there_between(network: RoadNetwork, tmp_path: Path) -> None:
    file = fcd(tmp_path, {0.0: [car(0, 0), car(9, 0, name="b")], 1.0: [car(8, 0), car(30, 0, name="c")]})
    (frame,) = read_fcd(file, network, times_s=[0.5], types={})
    assert [mover.id for mover in frame.movers] == ["a"]


def test_people_in_vehicles_and_ships_are_left_out(network: RoadNetwork, tmp_path: Path) -> None:
    rider = '<person id="p" x="1" y="1" angle="0" speed="0" vehicle="a"/>'
    walker = '<person id="q" x="1" y="1" angle="0" speed="0"/>'
    (frame,) = read_fcd(fcd(tmp_path, {0.0: [car(0, 0), rider, walker]}), network, times_s=[0.0], types={})
    assert [(mover.id, mover.kind) for mover in frame.movers] == [("a", "car"), ("q", "pedestrian")]
    assert mover_type("ferry", vclass="ship") is None


@pytest.mark.parametrize(
    ("steps", "time_s", "says"),
    [
        ({0.0: [car(0, 0)], 5.0: [car(9, 0)]}, 2.0, "holds no step at 2 s; it holds 0 to 5 s"),
        ({3.0: [car(0, 0)], 1.0: [car(9, 0)]}, 3.5, "its time goes from 3 back to 1 s"),
        ({0.0: [car(4_000_000, 5_000_000)]}, 0.0, "nowhere near the network"),
        ({0.0: ['<vehicle id="a" angle="0"/>']}, 0.0, "no readable fcd-output"),
    ],
)
def test_runs_that_cannot_be_used_say_why(
    network: RoadNetwork, tmp_path: Path, steps: dict[float, list[str]], time_s: float, says: str
) -> None:
    with pytest.raises(TrafficError, match=says):
        read_fcd(fcd(tmp_path, steps), network, times_s=[time_s], types={})


def test_lights_show_their_last_state(tmp_path: Path) -> None:
    rows = "".join(f'<tlsState time="{time}" id="x" state="{state}"/>' for time, state in ((0, "G"), (5, "y"), (8, "r")))
    (tmp_path / "s.xml").write_text(f"<tlsStates>{rows}</tlsStates>")
    states = read_signal_states(tmp_path / "s.xml", [4.9, 5.0, 60.0])
    assert [state["x"] for state in states.values()] == ["G", "y", "r"]
    (tmp_path / "s.xml").write_text("<tlsStates>")
    with pytest.raises(TrafficError, match="no readable states"):
        read_signal_states(tmp_path / "s.xml", [1.0])


@pytest.mark.parametrize(
    ("name", "vclass", "kind"),
    [
        ("x", "passenger", "car"),
        ("x", "rail_urban", "tram"),
        ("DEFAULT_BIKETYPE", "", "cyclist"),
        ("my_truck", "", "lorry"),
        ("anything", "", "car"),
        ("veh_bus", "truck", "lorry"),
    ],
)
def test_types_are_known_by_class_or_by_name(name: str, vclass: str, kind: str) -> None:
    found = mover_type(name, vclass=vclass)
    assert found is not None
    assert found.kind == kind
