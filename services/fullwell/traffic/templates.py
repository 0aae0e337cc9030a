"""Road layouts by name, as the plain node and edge files that netconvert makes a network of."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

__all__ = ["PARKING", "TEMPLATE_NAMES", "CrossSection", "PlainNetwork", "template", "with_section"]

Point = tuple[float, float]

PARKING: Final = "custom1"
"""The vehicle class of lanes that cars stand on: SUMO lets nothing drive there."""


@dataclass(frozen=True, slots=True)
class CrossSection:
    """One direction of a road, widths [m]; 0 leaves a lane out.

    From the right: sidewalk, parking, bicycles, buses, others, trams.
    """

    lanes: int = 1
    lane_width_m: float = 3.2
    sidewalk_width_m: float = 3.0
    parking_width_m: float = 0.0
    bike_lane_width_m: float = 0.0
    bus_lane_width_m: float = 0.0
    tram_lane_width_m: float = 0.0
    speed_m_s: float = 13.9

    def lane_elements(self) -> str:
        """Return the lanes as elements of an edge file, the rightmost first."""
        rows = [("pedestrian", self.sidewalk_width_m), (PARKING, self.parking_width_m)]
        rows += [("bicycle", self.bike_lane_width_m), ("bus taxi", self.bus_lane_width_m)]
        given = [f'allow="{who}" width="{width:g}"' for who, width in rows if width > 0]
        # Bicycles ride on the road where they have no lane; pedestrians only where there is no sidewalk.
        barred = ["tram rail rail_urban rail_electric rail_fast subway ship"]
        barred += ["pedestrian"] if self.sidewalk_width_m > 0 else []
        barred += ["bicycle"] if self.bike_lane_width_m > 0 else []
        given += [f'disallow="{" ".join(barred)}" width="{self.lane_width_m:g}"'] * self.lanes
        given += [f'allow="tram" width="{self.tram_lane_width_m:g}"'] if self.tram_lane_width_m > 0 else []
        return "".join(f'<lane index="{index}" {attributes}/>' for index, attributes in enumerate(given))

    @property
    def _side_widths_m(self) -> tuple[float, ...]:
        return (
            *(self.sidewalk_width_m, self.parking_width_m, self.bike_lane_width_m, self.bus_lane_width_m),
            self.tram_lane_width_m,
        )

    @property
    def lane_count(self) -> int:
        """All lanes of the direction, the sidewalk among them."""
        return self.lanes + sum(width > 0 for width in self._side_widths_m)


@dataclass(frozen=True, slots=True)
class PlainNetwork:
    """The text of a node file and of an edge file."""

    nodes: str
    edges: str


def with_section(nodes: str, edges: str, section: CrossSection) -> PlainNetwork:
    """Return a network of node and edge files with other lanes: those of a cross-section on every edge."""
    drawing = _Drawing(section)
    for edge in ElementTree.fromstring(edges).iter("edge"):
        points = [tuple(float(part) for part in point.split(",")[:2]) for point in edge.get("shape", "").split()]
        drawing.one_way(edge.attrib["id"], edge.attrib["from"], edge.attrib["to"], [(x, y) for x, y in points])
    return PlainNetwork(nodes, drawing.text().edges)


class _Drawing:
    def __init__(self, section: CrossSection) -> None:
        self._section = section
        self._nodes: list[str] = []
        self._edges: list[str] = []

    def node(self, name: str, at: Point, kind: str = "priority") -> None:
        self._nodes.append(f'<node id="{name}" x="{at[0]:.3f}" y="{at[1]:.3f}" type="{kind}"/>')

    def one_way(
        self, name: str, start: str, end: str, shape: Sequence[Point] = (), section: CrossSection | None = None
    ) -> None:
        along = "" if not shape else " shape=" + quoteattr(" ".join(f"{x:.3f},{y:.3f}" for x, y in shape))
        of = section or self._section
        self._edges.append(
            f'<edge id="{name}" from="{start}" to="{end}" numLanes="{of.lane_count}" speed="{of.speed_m_s:g}"{along}>'
            f"{of.lane_elements()}</edge>"
        )

    def road(self, name: str, start: str, end: str, shape: Sequence[Point] = ()) -> None:
        self.one_way(name, start, end, shape)
        self.one_way(f"-{name}", end, start, shape[::-1])

    def text(self) -> PlainNetwork:
        return PlainNetwork(f"<nodes>{''.join(self._nodes)}</nodes>", f"<edges>{''.join(self._edges)}</edges>")


def _straight(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    del signals
    drawing = _Drawing(section)
    drawing.node("west", (0.0, 0.0))
    drawing.node("east", (length_m, 0.0))
    drawing.road("main", "west", "east")
    return drawing.text()


def _curve(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    """A quarter of a circle of this length."""
    del signals
    drawing = _Drawing(section)
    radius_m = length_m / (math.pi / 2)
    steps = max(12, round(length_m / 4))
    arc = [
        (radius_m * math.sin(angle), radius_m * (1 - math.cos(angle)))
        for angle in (k / steps * math.pi / 2 for k in range(steps + 1))
    ]
    drawing.node("start", arc[0])
    drawing.node("end", arc[-1])
    drawing.road("main", "start", "end", arc)
    return drawing.text()


def _arms(section: CrossSection, length_m: float, signals: bool, directions_deg: Sequence[float]) -> PlainNetwork:
    drawing = _Drawing(section)
    drawing.node("centre", (0.0, 0.0), "traffic_light" if signals else "priority")
    for number, direction in enumerate(directions_deg):
        angle = math.radians(direction)
        drawing.node(f"end_{number}", (length_m / 2 * math.cos(angle), length_m / 2 * math.sin(angle)))
        drawing.road(f"arm_{number}", f"end_{number}", "centre")
    return drawing.text()


def _cross(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    return _arms(section, length_m, signals, (0, 90, 180, 270))


def _tee(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    return _arms(section, length_m, signals, (0, 180, 270))


def _roundabout(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    """Four arms into a ring of one lane, driven counter-clockwise; trams do not go round it."""
    del signals
    drawing = _Drawing(replace(section, tram_lane_width_m=0.0))
    radius_m = 14.0 + section.lane_width_m
    ring = CrossSection(lanes=1, lane_width_m=max(section.lane_width_m, 4.5), sidewalk_width_m=0.0, speed_m_s=8.3)
    count, steps = 4, 8

    def at(turn: float) -> Point:
        return radius_m * math.cos(2 * math.pi * turn), radius_m * math.sin(2 * math.pi * turn)

    for number in range(count):
        turn = number / count
        drawing.node(f"ring_{number}", at(turn))
        outside = radius_m + length_m / 2
        drawing.node(f"end_{number}", (outside * math.cos(2 * math.pi * turn), outside * math.sin(2 * math.pi * turn)))
        drawing.road(f"arm_{number}", f"end_{number}", f"ring_{number}")
        shape = [at(turn + step / steps / count) for step in range(steps + 1)]
        drawing.one_way(f"ring_{number}", f"ring_{number}", f"ring_{(number + 1) % count}", shape, ring)
    return drawing.text()


def _motorway(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    """Two carriageways with hard shoulders on either side of a reserve of 4 m."""
    del signals
    drawing = _Drawing(section)
    lanes = max(2, section.lanes)
    width_m = max(section.lane_width_m, 3.5)
    middle_m = 2.0
    attributes = 'disallow="pedestrian bicycle moped tram rail rail_urban rail_electric rail_fast subway ship"'
    elements = '<lane index="0" allow="emergency" width="2.5"/>' + "".join(
        f'<lane index="{index + 1}" {attributes} width="{width_m:g}"/>' for index in range(lanes)
    )
    for name, y_m, start, end in (("east", -middle_m, 0.0, length_m), ("west", middle_m, length_m, 0.0)):
        drawing.node(f"{name}_start", (start, y_m))
        drawing.node(f"{name}_end", (end, y_m))
        drawing._edges.append(
            f'<edge id="{name}" from="{name}_start" to="{name}_end" numLanes="{lanes + 1}" '
            f'speed="{max(section.speed_m_s, 27.8):g}">{elements}</edge>'
        )
    return drawing.text()


def _blocks(section: CrossSection, length_m: float, signals: bool) -> PlainNetwork:
    """Three by three junctions in blocks of a third of the length, with roads that lead in and out on all sides."""
    drawing = _Drawing(section)
    count, pitch_m = 3, length_m / 3
    kind = "traffic_light" if signals else "priority"
    for column in range(-1, count + 1):
        for row in range(-1, count + 1):
            outside = (column in (-1, count)) + (row in (-1, count))
            if outside == 2:
                continue
            stretch = 0.5 if outside else 1.0  # roads in and out are half a block long
            at = [
                pitch_m * (min(max(place, 0), count - 1) + stretch * (place - min(max(place, 0), count - 1)))
                for place in (column, row)
            ]
            drawing.node(f"n_{column}_{row}", (at[0], at[1]), "priority" if outside else kind)
            if column > -1 and row not in (-1, count):
                drawing.road(f"h_{column}_{row}", f"n_{column - 1}_{row}", f"n_{column}_{row}")
            if row > -1 and column not in (-1, count):
                drawing.road(f"v_{column}_{row}", f"n_{column}_{row - 1}", f"n_{column}_{row}")
    return drawing.text()


_TEMPLATES: Final = MappingProxyType[str, Callable[[CrossSection, float, bool], PlainNetwork]](
    {
        "straight": _straight,
        "curve": _curve,
        "cross": _cross,
        "tee": _tee,
        "blocks": _blocks,
        "roundabout": _roundabout,
        "motorway": _motorway,
    }
)
TEMPLATE_NAMES: Final = tuple(_TEMPLATES)


def template(name: str, section: CrossSection, *, length_m: float, signals: bool) -> PlainNetwork:
    """Return the layout of a name in `TEMPLATE_NAMES`; `length_m` from end to end, right-hand traffic."""
    return _TEMPLATES[name](section, length_m, signals)
