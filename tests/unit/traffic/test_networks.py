"""Road networks: drawn, generated, converted; the same bytes each time; map and world agree; bad files are refused."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from fullwell.traffic.networks import GENERATED_NAMES, NetworkSpec, make_network
from fullwell.traffic.roads import read_network
from fullwell.traffic.sumo import SumoLimits, TrafficError
from fullwell.traffic.templates import TEMPLATE_NAMES, CrossSection

FULL = CrossSection(lanes=2, sidewalk_width_m=2.5, parking_width_m=2.2, bike_lane_width_m=1.6, bus_lane_width_m=3.2)
MILLIMETRE = 2e-3
"""SUMO writes coordinates with three decimals."""

OSM = """<?xml version="1.0"?><osm version="0.6">
<node id="1" lat="48.1370" lon="11.5750"/><node id="2" lat="48.1370" lon="11.5790"/><node id="3" lat="48.1390" lon="11.5770"/>
<node id="4" lat="48.1370" lon="11.5770"/>
<way id="10"><nd ref="1"/><nd ref="4"/><nd ref="2"/><tag k="highway" v="residential"/><tag k="name" v="Long Lane"/></way>
<way id="11"><nd ref="4"/><nd ref="3"/><tag k="highway" v="secondary"/><tag k="lanes" v="2"/></way></osm>"""

XODR = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4" name="r" north="0" south="0" east="0" west="0"/>
<road name="main" length="150.0" id="1" junction="-1"><planView><geometry s="0" x="5000" y="200" hdg="0" length="150">
<line/></geometry></planView><elevationProfile><elevation s="0" a="3" b="0.05" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0"><left><lane id="1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</left><center><lane id="0" type="none" level="false"/></center><right><lane id="-1" type="driving" level="false">
<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane><lane id="-2" type="sidewalk" level="false">
<width sOffset="0" a="2" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.mark.slow
@pytest.mark.parametrize("layout", [*GENERATED_NAMES, *TEMPLATE_NAMES])
def test_every_layout_makes_a_network_and_the_same_bytes_again(layout: str) -> None:
    spec = NetworkSpec(layout, length_m=150.0, size=(20, 0) if layout == "random" else (3, 3))
    file = make_network(spec)
    assert make_network(spec).xml == file.xml
    network = read_network(file)
    assert network.of_kind("drive")
    low, high = network.bounds_m()
    assert (high - low)[:2].max() > 90
    assert bool(network.of_kind("sidewalk")) == (layout != "motorway")


def test_a_cross_section_has_its_lanes_in_order_and_width() -> None:
    network = read_network(make_network(NetworkSpec("straight", section=FULL)))
    lanes = sorted((lane for lane in network.lanes if lane.edge_id == "main"), key=lambda lane: lane.index)
    assert [lane.kind for lane in lanes] == ["sidewalk", "parking", "bike", "bus", "drive", "drive"]
    assert [lane.width_m for lane in lanes] == [2.5, 2.2, 1.6, 3.2, 3.2, 3.2]
    # Neighbours touch: centre lines are half their widths apart.
    middles = np.array([lane.centre_m[:, 1].mean() for lane in lanes])
    widths = np.array([lane.width_m for lane in lanes])
    np.testing.assert_allclose(np.diff(middles), (widths[:-1] + widths[1:]) / 2, atol=MILLIMETRE)


def test_signals_name_the_lanes_that_they_control() -> None:
    network = read_network(make_network(NetworkSpec("cross", length_m=150.0)))
    approaches = {link.from_lane for link in network.signals if not link.crossing}
    assert len(approaches) == 4
    assert all(network.lane(name).kind == "drive" for name in approaches)
    assert sum(link.crossing for link in network.signals) >= 4
    assert not read_network(make_network(NetworkSpec("cross", length_m=150.0, signals=False))).signals


def test_a_random_network_follows_its_seed() -> None:
    first, second = (make_network(NetworkSpec("random", size=(15, 0), seed=seed)).digest for seed in (1, 2))
    assert first != second


def test_openstreetmap_becomes_roads_whose_map_coordinates_come_back(tmp_path: Path) -> None:
    (tmp_path / "town.osm.xml").write_text(OSM)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "town.osm.xml")))
    assert {lane.street for lane in network.of_kind("drive")} >= {"Long Lane"}
    low, high = network.bounds_m()
    assert 200 < (high - low)[0] < 400  # 0.004 degrees of longitude at 48 degrees north are 298 m
    # UTM 32: the town is 691 to 692 km east, 5334 to 5335 km north of the zone's origin.
    east, north = network.to_map((low + high) / 2)
    assert 690_000 < east < 693_000
    assert 5_333_000 < north < 5_336_000


TAGGED_OSM = """<?xml version="1.0"?><osm version="0.6">
<node id="1" lat="48.1370" lon="11.5740"/><node id="2" lat="48.1370" lon="11.5800"/><node id="3" lat="48.1390" lon="11.5770"/>
<node id="4" lat="48.1370" lon="11.5770"><tag k="highway" v="traffic_signals"/></node><node id="8" lat="48.1350" lon="11.5770"/>
<node id="6" lat="48.1371" lon="11.5740"/><node id="7" lat="48.1371" lon="11.5800"/>
<way id="10"><nd ref="1"/><nd ref="4"/><nd ref="2"/><tag k="highway" v="secondary"/><tag k="lanes" v="4"/>
<tag k="cycleway" v="lane"/><tag k="bus:lanes:forward" v="yes|designated"/><tag k="vehicle:lanes:forward" v="yes|no"/>
<tag k="sidewalk" v="both"/></way>
<way id="11"><nd ref="4"/><nd ref="3"/><tag k="highway" v="residential"/><tag k="sidewalk" v="right"/></way>
<way id="13"><nd ref="8"/><nd ref="4"/><tag k="highway" v="residential"/></way>
<way id="12"><nd ref="6"/><nd ref="7"/><tag k="railway" v="tram"/></way></osm>"""


def test_tags_of_openstreetmap_become_lanes_and_only_streets_without_word_get_sidewalks(tmp_path: Path) -> None:
    (tmp_path / "town.osm").write_text(TAGGED_OSM)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "town.osm")))
    kinds: dict[str, list[str]] = {}
    for lane in sorted(network.lanes, key=lambda lane: lane.index):
        kinds.setdefault(lane.edge_id.partition("#")[0], []).append(lane.kind)
    assert set(kinds["10"]) == {"sidewalk", "bike", "bus", "drive"}
    assert set(kinds["-10"]) == {"sidewalk", "bike", "drive"}
    assert kinds["11"] == ["sidewalk", "drive"]
    assert kinds["-11"] == ["drive"], "the map says that it has none"
    assert kinds["13"] == kinds["-13"] == ["sidewalk", "drive"], "the map does not tell"
    assert kinds["12"] == ["rail"], "nobody walks along the tracks"
    assert network.of_kind("crossing")
    assert network.signals


def test_opendrive_keeps_widths_slopes_and_sidewalks(tmp_path: Path) -> None:
    (tmp_path / "hill.xodr").write_text(XODR)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "hill.xodr")))
    assert {lane.width_m for lane in network.of_kind("drive")} == {3.5}
    assert [lane.width_m for lane in network.of_kind("sidewalk")] == [2.0]
    east = next(lane for lane in network.of_kind("drive") if lane.centre_m[-1, 0] > lane.centre_m[0, 0])
    climb = (east.centre_m[-1, 2] - east.centre_m[0, 2]) / east.length_m
    assert climb == pytest.approx(0.05, abs=0.003)
    np.testing.assert_allclose(network.to_map(east.centre_m[0])[0], 5000.0, atol=1.0)


def test_lanes_of_opendrive_are_of_their_types(tmp_path: Path) -> None:
    types = ("driving", "bus", "biking", "parking", "shoulder", "sidewalk")
    lanes = "".join(
        f'<lane id="{-1 - place}" type="{kind}" level="false"><width sOffset="0" a="{2 + place / 10}" b="0" c="0" d="0"/>'
        "</lane>"
        for place, kind in enumerate(types)
    )
    start = XODR.index("<right>") + len("<right>")
    text = XODR[:start] + lanes + XODR[XODR.index("</right>") :]
    (tmp_path / "a.xodr").write_text(text)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "a.xodr")))
    right = [lane for lane in network.lanes if lane.kind != "walking_area" and lane.edge_id.startswith("-")]
    told = [(lane.kind, lane.width_m) for lane in sorted(right, key=lambda lane: -lane.index)]
    kinds = ("drive", "bus", "bike", "parking", "shoulder", "sidewalk")
    assert told == [(kind, pytest.approx(2 + place / 10)) for place, kind in enumerate(kinds)]
    assert not any(lane.has_rails for lane in right)
    (tmp_path / "uk.xodr").write_text(text.replace('junction="-1"', 'junction="-1" rule="LHT"'))
    with pytest.raises(TrafficError, match="which drives on the left"):
        make_network(NetworkSpec(file=tmp_path / "uk.xodr"))


def test_a_network_far_from_its_origin_is_moved_and_says_where_it_is(tmp_path: Path) -> None:
    spec = NetworkSpec("cross", length_m=150.0)
    near = read_network(make_network(spec))
    text = make_network(spec).xml.decode()
    # The same network in map coordinates, as files of national surveys have them.
    far = _shifted(text, 690_000.0, 5_334_000.0)
    (tmp_path / "far.net.xml").write_text(far)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "far.net.xml")))
    assert np.abs(network.bounds_m()).max() < 200
    lane = near.of_kind("drive")[0]
    moved = network.lane(lane.id)
    apart = network.to_map(moved.centre_m) - near.to_map(lane.centre_m)
    np.testing.assert_allclose(apart, np.broadcast_to([690_000.0, 5_334_000.0], apart.shape), atol=0.01)


def _shifted(text: str, east: float, north: float) -> str:
    import re

    def points(match: re.Match[str]) -> str:
        moved = []
        for point in match[2].split():
            x, y, *rest = point.split(",")
            moved.append(",".join([f"{float(x) + east:.3f}", f"{float(y) + north:.3f}", *rest]))
        return f'{match[1]}="{" ".join(moved)}"'

    text = re.sub(r'\b(shape|outlineShape|customShape)="([^"]+)"', points, text)
    text = re.sub(r'( x)="([-\d.]+)"', lambda m: f'{m[1]}="{float(m[2]) + east:.3f}"', text)
    return re.sub(r'( y)="([-\d.]+)"', lambda m: f'{m[1]}="{float(m[2]) + north:.3f}"', text)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("town.osm.xml", b"<osm", "cannot use 'town.osm.xml'"),
        ("empty.osm.xml", b'<osm version="0.6"></osm>', "no roads|cannot use"),
        ("town.net.xml", b"<net><edge id='1'/></net>", "cannot use 'town.net.xml'|no roads"),
        ("town.xodr", b"\x00\x01\x02", "cannot use 'town.xodr'"),
        ("bomb.osm.xml", b'<!DOCTYPE a [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><osm>&b;</osm>', "XML entities"),
        ("town.gz", gzip.compress(OSM.encode()), "must end in"),
        ("town.pbf", b"", "must end in"),
    ],
)
def test_bad_files_are_refused_with_one_clear_error(tmp_path: Path, name: str, content: bytes, says: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(TrafficError, match=says) as caught:
        read_network(make_network(NetworkSpec(file=tmp_path / name)))
    assert caught.value.path.startswith("scene.traffic.network")
    assert str(tmp_path) not in caught.value.message


def test_an_unknown_layout_is_answered_with_the_nearest() -> None:
    with pytest.raises(TrafficError, match="roundabout"):
        make_network(NetworkSpec("roundabuot"))


def test_a_program_that_takes_too_long_is_ended() -> None:
    with pytest.raises(TrafficError, match=r"took longer than 0\.01 s"):
        make_network(NetworkSpec("grid", size=(30, 30)), limits=SumoLimits(time_s=0.002))
