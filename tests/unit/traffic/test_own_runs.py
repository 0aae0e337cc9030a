"""The user's own SUMO configurations: run as they are, with nothing written anywhere, and refused where they cannot be run."""

from __future__ import annotations

import gzip
import shutil
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from fullwell.core.errors import FieldError
from fullwell.traffic.networks import NetworkSpec, make_network
from fullwell.traffic.own_runs import OwnRun, read_configuration
from fullwell.traffic.roads import RoadNetwork, read_network
from fullwell.traffic.simulation import drive, idle_signals
from fullwell.traffic.street import RecordedRun, Street, StreetSpec
from fullwell.traffic.sumo import TrafficError, sumo_home
from fullwell.traffic.trajectories import TrafficFrame
from street_assets import make_shelf

pytestmark = pytest.mark.skipif(find_spec("sumo") is None, reason="SUMO is an extra")

ROUTES = """<routes>
<vType id="lift" vClass="truck" length="8.0"/><vType id="plain" vClass="passenger" imgFile="{out}/car.png"/>
<route id="along" edges="arm_1 -arm_0"/>
<flow id="stream" type="plain" from="arm_0" to="-arm_1" begin="0" end="100" period="4"/>
<person id="walker" depart="0"><walk from="arm_0" to="-arm_2"/></person>
<vehicle id="first" type="lift" route="along" depart="1" departSpeed="5"/></routes>"""
ADDITIONAL = """<additional><inductionLoop id="loop" lane="arm_1_1" pos="-20" period="10" file="{out}/loop.xml"/>
<edgeData id="dump" file="{out}/edges.xml"/><timedEvent type="SaveTLSStates" dest="{out}/tls.xml"/>
<tlLogic id="centre" type="static" programID="mine" offset="0"><phase duration="1000" state="{state}"/>
<param key="file" value="{out}/program.xml"/></tlLogic><include href="{include}"/></additional>"""
CONFIGURATION = """<sumoConfiguration><input><net-file value="net/cross.net.xml"/><r value="routes.rou.xml"/>
<additional-files value="more/all.add.xml"/></input><time><begin value="0"/><end value="5"/><step-length value="0.5"/></time>
<output><tripinfo-output value="{out}/trips.xml"/><fcd-output value="{out}/fcd.xml"/></output>
<report><log value="{out}/log.txt"/></report><gui_only><gui-settings-file value="absent.xml"/></gui_only>
<random_number><seed value="7"/></random_number>{more}</sumoConfiguration>"""


@pytest.fixture(scope="module")
def cross() -> bytes:
    return make_network(NetworkSpec("cross", length_m=200.0)).xml


@pytest.fixture
def folder(tmp_path: Path, cross: bytes) -> Path:
    """A configuration with all that people put into them, and a folder that it would write to."""
    for name in ("net", "more", "out"):
        (tmp_path / name).mkdir()
    out = tmp_path / "out"
    (tmp_path / "net" / "cross.net.xml").write_bytes(cross)
    (tmp_path / "routes.rou.xml").write_text(ROUTES.format(out=out))
    links = 1 + max(link.index for link in network_of(tmp_path).signals)
    text = ADDITIONAL.format(out=out, state="r" * links, include="poles.add.xml")
    (tmp_path / "more" / "all.add.xml").write_text(text)
    (tmp_path / "more" / "poles.add.xml").write_text('<additional><poi id="p" x="1" y="1" imgFile="a.png"/></additional>')
    (tmp_path / "run.sumocfg").write_text(CONFIGURATION.format(out=out, more=""))
    return tmp_path


def network_of(folder: Path) -> RoadNetwork:
    return read_network(make_network(NetworkSpec(file=folder / "net" / "cross.net.xml")))


def own_of(folder: Path) -> OwnRun:
    def find(reference: str) -> Path:
        file = folder / reference
        if not file.is_file():
            raise FieldError(f"scene.traffic.run.file is {reference!r}, which does not exist.", "scene.traffic.run.file")
        return file

    return read_configuration(folder / "run.sumocfg", find)


def ids(frame: TrafficFrame) -> Counter[str]:
    return Counter(mover.kind for mover in frame.movers)


def test_a_configuration_drives_as_it_says_and_writes_nothing(folder: Path) -> None:
    before = sorted(folder.rglob("*"))
    own, network = own_of(folder), network_of(folder)
    run = drive(network, own, times_s=[12.0, 12.26])
    assert ids(run.frames[0]) == {"car": 4, "lorry": 1, "pedestrian": 1}
    lorry = next(mover for mover in run.frames[0].movers if mover.id == "first")
    assert (lorry.kind, lorry.length_m, lorry.model) == ("lorry", 8.0, "lift")
    assert set(run.frames[0].signals["centre"]) == {"r"}, "the program of its additional file"
    assert sorted(folder.rglob("*")) == before
    # Between its steps of half a second everybody goes on.
    later = {mover.id: mover for mover in run.frames[1].movers}
    driving = [mover for mover in run.frames[0].movers if mover.speed_m_s > 3]
    assert driving
    for mover in driving:
        moved_m = float(np.linalg.norm(later[mover.id].front_m - mover.front_m))
        assert moved_m == pytest.approx(0.26 * mover.speed_m_s, rel=0.4)
    again = drive(network, own, times_s=[12.0])
    assert [mover.front_m.tolist() for mover in again.frames[0].movers] == [
        mover.front_m.tolist() for mover in run.frames[0].movers
    ]


def test_what_goes_into_a_run_names_no_file_but_its_own(folder: Path) -> None:
    own = own_of(folder)
    assert str(folder).encode() not in b"".join(own.files.values())
    assert not any(b"timedEvent" in text or b"edgeData" in text or b"imgFile" in text for text in own.files.values())
    assert set(own.options) == {"route-files", "additional-files", "begin", "step-length", "seed"}
    assert own.left_out == ()
    assert set(own.types) == {"lift", "plain"}


def test_a_street_of_a_configuration_has_its_traffic_in_assets_that_fit(folder: Path) -> None:
    own = own_of(folder)
    spec = StreetSpec(NetworkSpec(file=own.network), run=own, times_s=(12.0,), style="suburb", dressed=False)
    movers = [item for item in Street(spec, make_shelf()).moment(0).assets if item.mover is not None]
    assert Counter(item.asset.asset_class for item in movers) == {"car": 4, "lorry": 1, "pedestrian": 1}
    assert all(item.asset.size_m[0] <= 6.0 for item in movers if item.asset.asset_class == "car")


def test_packed_files_are_read(folder: Path) -> None:
    file = folder / "routes.rou.xml"
    packed = gzip.compress(file.read_bytes())
    file.unlink()
    (folder / "routes.rou.xml").write_bytes(packed)
    assert own_of(folder).types


def test_a_run_begins_when_it_says(folder: Path) -> None:
    file = folder / "run.sumocfg"
    file.write_text(file.read_text().replace('<begin value="0"/>', '<begin value="1:00:00"/>'))
    with pytest.raises(TrafficError, match=r"begins at 3600 s, after time_s = 10"):
        drive(network_of(folder), own_of(folder), times_s=[10.0])


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ('<x><remote-port value="8813"/></x>', "driven by a program over a port"),
        ('<x><load-state value="s.xml"/></x>', "starts from a saved state"),
        ('<x><mesosim value="true"/></x>', "mesoscopic"),
        ('<x><a value="none.add.xml"/></x>', "'none.add.xml', which does not exist"),
        ("<input><net-file value=''/></input>", "names no net-file"),
        ("<broken", "no readable file of SUMO"),
    ],
)
def test_configurations_that_need_what_is_not_here_are_refused(folder: Path, more: str, says: str) -> None:
    (folder / "run.sumocfg").write_text(CONFIGURATION.format(out="out", more=more))
    with pytest.raises(FieldError, match=says) as caught:
        own_of(folder)
    assert caught.value.path == "scene.traffic.run.file"
    assert str(folder) not in caught.value.message


def test_other_files_are_no_configurations(folder: Path) -> None:
    shutil.copyfile(folder / "routes.rou.xml", folder / "run.sumocfg")
    with pytest.raises(TrafficError, match=r"no configuration of SUMO: it begins with <routes>"):
        own_of(folder)


def test_entities_are_refused(folder: Path) -> None:
    (folder / "routes.rou.xml").write_text('<!DOCTYPE a [<!ENTITY a "b">]><routes>&a;</routes>')
    with pytest.raises(TrafficError, match="XML entities"):
        own_of(folder)


def test_what_sumo_says_of_a_wrong_run_is_told(folder: Path) -> None:
    file = folder / "routes.rou.xml"
    file.write_text(file.read_text().replace("arm_1 -arm_0", "arm_1 nowhere"))
    with pytest.raises(TrafficError, match=r"sumo cannot use the run\. .*nowhere"):
        drive(network_of(folder), own_of(folder), times_s=[2.0])


def test_options_that_are_not_taken_over_are_told(folder: Path) -> None:
    more = '<x><random value="true"/><scale value="2"/><astar.landmark-distances value="a.csv"/></x>'
    (folder / "run.sumocfg").write_text(CONFIGURATION.format(out="out", more=more))
    own = own_of(folder)
    assert own.options["scale"] == "2"
    assert own.left_out == ("random", "astar.landmark-distances")


def test_overlapping_vehicles_are_left_out_by_name(folder: Path) -> None:
    """SUMO may be told to put cars into each other; a picture cannot show that."""
    cars = "".join(
        f'<vehicle id="{name}" depart="0" departPos="30" departSpeed="0" insertionChecks="none"><route edges="arm_1 -arm_0"/>'
        "</vehicle>"
        for name in ("one", "two")
    )
    (folder / "routes.rou.xml").write_text(f"<routes>{cars}</routes>")
    more = '<x><collision.action value="warn"/></x>'
    (folder / "run.sumocfg").write_text(CONFIGURATION.format(out="out", more=more))
    own = own_of(folder)
    spec = StreetSpec(NetworkSpec(file=own.network), run=own, times_s=(0.5,), style="suburb", dressed=False)
    moment = Street(spec, make_shelf()).moment(0)
    assert [item.id for item in moment.assets if item.mover is not None] == ["one"]
    assert moment.overlapping == ("two",)
    assert any("1 movers overlapped others in SUMO's own positions and were left out: two." in note for note in moment.notes)


def test_lights_of_a_recorded_run_are_those_of_its_file_or_of_the_networks_programs(folder: Path) -> None:
    fcd = '<fcd-export><timestep time="30.00"><vehicle id="a" x="100" y="50" angle="0" type="t" speed="1"/></timestep>'
    (folder / "fcd.xml").write_text(f"{fcd}</fcd-export>")
    states = '<tlsStates><tlsState time="0.00" id="centre" state="GGGGGGGG"/></tlsStates>'
    (folder / "tls.xml").write_text(states)
    network = NetworkSpec(file=folder / "net" / "cross.net.xml")
    shown = {}
    for name in ("", "tls.xml"):
        run = RecordedRun(folder / "fcd.xml", folder / name if name else None)
        spec = StreetSpec(network, run=run, times_s=(30.0,), dressed=False)
        shown[name] = Street(spec, make_shelf()).moment(0).signals["centre"]
    assert shown["tls.xml"] == "GGGGGGGG"
    assert shown[""] == idle_signals(network_of(folder), [30.0])[30.0]["centre"]
    assert set(shown[""]) & set("Gg")


def test_networks_write_no_files_of_their_lights(tmp_path: Path, cross: bytes) -> None:
    with_output = cross.replace(b"</tlLogic>", b'<param key="file" value="/nowhere/x.xml"/></tlLogic>')
    (tmp_path / "a.net.xml").write_bytes(with_output)
    assert b"/nowhere" in with_output
    assert b"/nowhere" not in make_network(NetworkSpec(file=tmp_path / "a.net.xml")).xml


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "least"),
    [("cross", {"car": 15}), ("square", {"car": 20}), ("ramp", {"car": 30, "lorry": 10}), ("A10KW", {"car": 90})],
)
def test_configurations_that_come_with_sumo_run(name: str, least: dict[str, int]) -> None:
    folder = sumo_home() / "tools" / "game"
    own = read_configuration(folder / f"{name}.sumocfg", lambda reference: folder / reference)
    network = read_network(make_network(NetworkSpec(file=own.network)))
    (frame,) = drive(network, own, times_s=[60.1]).frames
    kinds = ids(frame)
    assert all(kinds[kind] >= number for kind, number in least.items())  # type: ignore[index]
    assert frame.signals
