"""What a road network looks like: carriageway, raised pavements with kerbs, markings, and the ground around."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fullwell.traffic.ribbons import cut, dashes, length_m, offset, ribbon
from fullwell.traffic.roads import Lane, RoadNetwork

__all__ = [
    "KERB_HEIGHT_M",
    "TERRAIN_MARGIN_M",
    "GroundPlan",
    "RoadStyle",
    "RoadSurface",
    "ground_plan",
    "merged",
    "road_surfaces",
    "terrain_m",
]

Array = NDArray[np.float64]

KERB_HEIGHT_M: Final = 0.12
"""Height of a pavement above the carriageway."""
_KERB_WIDTH_M: Final = 0.15
_MARK_M: Final = 0.004
"""Markings lie this much above the road: thermoplastic is 2 to 5 mm thick."""
_LINE_M: Final = 0.12
_DASH_M: Final = (3.0, 6.0)
_FAST_DASH_M: Final = (6.0, 12.0)
_STOP_LINE_M: Final = 0.5
_STRIPE_M: Final = (0.5, 0.5)
_GAUGE_M: Final = 1.435
"""Between the inner edges of the rails: standard gauge."""
_RAIL_HEAD_M: Final = 0.056
"""Width of the head of a grooved rail 60R2 (EN 14811); its groove is not modelled, and it lies as high as markings do."""
_FAST_M_S: Final = 20.0
TERRAIN_MARGIN_M: Final = 300.0
"""How far the terrain reaches beyond the roads."""
_FINE_M: Final = 4.0
"""Edges are cut to this length where the network has slopes."""
_SMALLEST_M2: Final = 0.02
_NO_AREA_M2: Final = 1e-6


@dataclass(frozen=True, slots=True)
class RoadStyle:
    """What things are made of, by names of the catalogue of materials; whether edges of roads without kerbs are marked, and
    roads have covers of manholes and gullies; how many patches of bare ground and fields are tried."""

    road: str = "asphalt/worn"
    walk: str = "concrete/light"
    kerb: str = "stone/granite"
    ground: str = "grass/green"
    mark: str = "line/white_thermoplastic"
    rail: str = "metal/steel_brushed"
    edge_lines: bool = False
    zebra: bool = True
    covers: bool = True
    bare_patches: int = 220
    fields: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class RoadSurface:
    """Triangles of one kind: `name` is the semantic class, `vertices_m` (n, 3), `faces` (m, 3), front upwards or outwards."""

    name: str
    material: str
    vertices_m: Array
    faces: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class GroundPlan:
    """Regions of a network from above (shapely geometries, metres), and the height of the carriageway anywhere."""

    carriageway: Any
    walk: Any
    crossings: Any
    heights: _Heights

    def is_free(self, outline: Any) -> bool:
        """Return whether a footprint touches neither carriageway nor pavement."""
        return not (self.carriageway.intersects(outline) or self.walk.intersects(outline))


class _Heights:
    """Height of the road that is nearest; 0 for flat networks."""

    def __init__(self, network: RoadNetwork) -> None:
        points = np.concatenate([lane.centre_m for lane in network.lanes])
        self.flat = bool(np.ptp(points[:, 2]) < 1e-3)
        self._level = float(points[:, 2].mean()) if self.flat else 0.0
        self._tree = None if self.flat else cKDTree(points[:, :2])
        self._points = points

    def at(self, places_m: Array) -> Array:
        """Return (n,) heights [m] at (n, 2) places: the mean of the nearest few points of lanes, by inverse distance."""
        if self._tree is None:
            return np.full(len(places_m), self._level)
        distance, nearest = self._tree.query(places_m, k=min(4, len(self._points)))
        weight = 1.0 / np.maximum(distance.reshape(len(places_m), -1), 0.05) ** 2
        return np.asarray((weight * self._points[nearest.reshape(weight.shape), 2]).sum(axis=1) / weight.sum(axis=1))


def ground_plan(network: RoadNetwork) -> GroundPlan:
    """Return the regions of a network: where vehicles drive, where people walk, and where they cross."""
    driven = [_strip(lane) for lane in network.of_kind("drive", "bus", "bike", "parking", "shoulder", "rail")]
    junctions = [shapely.Polygon(junction.outline_m[:, :2]).buffer(0) for junction in network.junctions]
    walked = [_strip(lane) for lane in network.of_kind("sidewalk")]
    areas = [lane.centre_m[:, :2] for lane in network.of_kind("walking_area") if len(lane.centre_m) > 2]
    walked += [shapely.Polygon(outline).buffer(0) for outline in areas]
    crossings = shapely.union_all([_strip(lane) for lane in network.of_kind("crossing")])
    # Where nobody may cross, SUMO's walking areas go on over the road.
    ways = [*driven, *(_strip(lane) for lane in network.of_kind("internal"))]
    walk = _closed(shapely.union_all(walked)).difference(shapely.union_all([crossings, *ways]))
    carriageway = _closed(shapely.union_all([*driven, *junctions, crossings]), _NOTCH_M).difference(walk)
    both = shapely.union_all([carriageway, walk])
    holes = shapely.get_parts(_closed(both, _NOTCH_M).difference(both))
    corners = [hole for hole in holes if hole.area < _SMALL_HOLE_M2 and hole.distance(walk) < _SMALLEST_M2]
    walk = shapely.union_all([walk, *corners]) if corners else walk
    return GroundPlan(carriageway, walk, crossings, _Heights(network))


def road_surfaces(
    network: RoadNetwork, plan: GroundPlan, style: RoadStyle, *, margin_m: float = TERRAIN_MARGIN_M
) -> list[RoadSurface]:
    """Return everything on the ground: road, sidewalk, kerb, marking, rail, and terrain to `margin_m` beyond the roads."""
    heights = plan.heights
    kerb = plan.walk.difference(plan.walk.buffer(-_KERB_WIDTH_M, join_style="mitre")).intersection(
        plan.carriageway.buffer(2 * _KERB_WIDTH_M)
    )
    outer = shapely.box(*plan.carriageway.union(plan.walk).bounds).buffer(margin_m, join_style="mitre")
    ground = outer.difference(shapely.union_all([plan.carriageway, plan.walk]).buffer(0.01))
    ground_m = terrain_m(plan)
    surfaces = [
        _flat("road", style.road, plan.carriageway, heights, 0.0),
        _flat("sidewalk", style.walk, plan.walk.difference(kerb), heights, KERB_HEIGHT_M),
        _flat("kerb", style.kerb, kerb, heights, KERB_HEIGHT_M),
        _walls("kerb", style.kerb, plan.walk, heights, KERB_HEIGHT_M),
        _flat("terrain", style.ground, ground, heights, ground_m),
        _walls("terrain", style.ground, ground, heights, ground_m),
        _ribbons("marking", style.mark, _marks(network, style)),
        _ribbons("rail", style.rail, _rails(network)),
    ]
    return merged(surfaces)


def terrain_m(plan: GroundPlan) -> float:
    """Return the height of the ground over the road's: beside pavements nearly theirs, beside bare roads nearly the road's."""
    return KERB_HEIGHT_M - 0.03 if not plan.walk.is_empty else 0.01


def merged(surfaces: Iterable[RoadSurface]) -> list[RoadSurface]:
    """Return one surface for each class and material, in the order in which they first come; empty ones are dropped."""
    found: dict[tuple[str, str], list[RoadSurface]] = {}
    for surface in surfaces:
        if len(surface.faces):
            found.setdefault((surface.name, surface.material), []).append(surface)
    return [_joined(parts) for parts in found.values()]


# Regions -------------------------------------------------------------------------------------------------------------


def _strip(lane: Lane) -> Any:
    """Return the lane from above. Butt ends: neighbours meet at them."""
    return shapely.LineString(lane.centre_m[:, :2]).buffer(
        lane.width_m / 2, cap_style="flat", join_style="mitre", mitre_limit=2.0
    )


_SMALL_HOLE_M2: Final = 1.5
"""Ground between a pavement's end and the road that is smaller than this is paved too."""
_NOTCH_M: Final = 0.8
"""Wedges that SUMO leaves between the edges of junctions and of lanes that bend away are paved: up to twice this wide."""


def _closed(region: Any, reach_m: float = 0.05) -> Any:
    """Return a region without the slivers between neighbours, up to twice `reach_m` wide."""
    return region.buffer(reach_m, join_style="mitre").buffer(-reach_m, join_style="mitre")


def _polygons(region: Any) -> Iterator[Any]:
    for part in shapely.get_parts(shapely.make_valid(region)):
        if part.geom_type == "MultiPolygon":
            yield from _polygons(part)
        elif part.geom_type == "Polygon" and part.area > _SMALLEST_M2:
            yield part


def _flat(name: str, material: str, region: Any, heights: _Heights, raised_m: float) -> RoadSurface:
    corners: list[Array] = []
    for polygon in _polygons(region):
        fine = polygon if heights.flat else shapely.segmentize(polygon, _FINE_M)
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(fine)):
            ring = np.asarray(triangle.exterior.coords)[:3, :2]
            first, second = ring[1] - ring[0], ring[2] - ring[0]
            doubled_m2 = first[0] * second[1] - first[1] * second[0]
            if abs(doubled_m2) > _NO_AREA_M2:
                corners.append(ring if doubled_m2 > 0 else ring[::-1])
    if not corners:
        return RoadSurface(name, material, np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    rounded = np.asarray(np.round(np.concatenate(corners), 6), dtype=np.float64)
    places, where = np.unique(rounded, axis=0, return_inverse=True)
    vertices = np.column_stack([places, heights.at(places) + raised_m])
    return RoadSurface(name, material, vertices, where.reshape(-1, 3).astype(np.int64))


def _walls(name: str, material: str, region: Any, heights: _Heights, high_m: float) -> RoadSurface:
    """Return the upright sides of a raised region."""
    vertices: list[Array] = []
    faces: list[NDArray[np.int64]] = []
    count = 0
    for polygon in _polygons(region):
        fine = shapely.orient_polygons(polygon if heights.flat else shapely.segmentize(polygon, _FINE_M))
        for ring in (fine.exterior, *fine.interiors):
            # Exterior rings run counter-clockwise: the outside is to the right of the way along them, as it is for holes.
            places = np.asarray(ring.coords, dtype=np.float64)[:, :2]
            level = heights.at(places)
            low, high = np.column_stack([places, level - 0.02]), np.column_stack([places, level + high_m])
            here = count + np.arange(len(places) - 1)
            size = len(places)
            vertices += [low, high]
            faces.append(np.stack([here, here + 1, here + 1 + size], axis=1))
            faces.append(np.stack([here, here + 1 + size, here + size], axis=1))
            count += 2 * size
    if not vertices:
        return RoadSurface(name, material, np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    return RoadSurface(name, material, np.concatenate(vertices), np.concatenate(faces).astype(np.int64))


# Markings ------------------------------------------------------------------------------------------------------------

Mark = tuple[Array, float]
"""A line (n, 3) and the width of its paint [m]."""


def _marks(network: RoadNetwork, style: RoadStyle) -> Iterator[Mark]:
    by_edge: dict[str, list[Lane]] = {}
    for lane in network.of_kind("drive", "bus", "bike", "parking", "shoulder"):
        by_edge.setdefault(lane.edge_id, []).append(lane)
    for edge, lanes in by_edge.items():
        ordered = sorted(lanes, key=lambda lane: lane.index)
        yield from _between_lanes(ordered)
        yield from _left_edge(edge, ordered[-1], by_edge)
        if style.edge_lines or ordered[0].kind == "shoulder":
            first = next((lane for lane in ordered if lane.kind != "shoulder"), ordered[0])
            yield offset(first.centre_m, -first.width_m / 2 + _LINE_M), _LINE_M
    yield from _stop_lines(network)
    if style.zebra:
        for lane in network.of_kind("crossing"):
            yield from ((mark, lane.width_m) for mark in dashes(lane.centre_m, *_STRIPE_M))


def _between_lanes(ordered: Sequence[Lane]) -> Iterator[Mark]:
    for right, left in itertools.pairwise(ordered):
        line = offset(right.centre_m, right.width_m / 2)
        if right.kind == left.kind == "drive":
            mark, gap = _FAST_DASH_M if right.speed_m_s > _FAST_M_S else _DASH_M
            yield from ((dash, _LINE_M) for dash in dashes(line, mark, gap))
        elif right.kind != "shoulder":  # to a bus or cycle lane: a line that is not to be crossed
            yield line, 2 * _LINE_M if "bus" in (right.kind, left.kind) else _LINE_M


def _left_edge(edge: str, leftmost: Lane, by_edge: dict[str, list[Lane]]) -> Iterator[Mark]:
    line = offset(leftmost.centre_m, leftmost.width_m / 2)
    other = by_edge.get(_opposite(edge, leftmost, by_edge))
    if other is None:
        yield offset(leftmost.centre_m, leftmost.width_m / 2 - _LINE_M), _LINE_M
    elif edge < other[0].edge_id:  # drawn once for both directions
        mark, gap = _FAST_DASH_M if leftmost.speed_m_s > _FAST_M_S else _DASH_M
        yield from ((dash, _LINE_M) for dash in dashes(line, mark, gap))


def _opposite(edge: str, leftmost: Lane, by_edge: dict[str, list[Lane]]) -> str:
    """Return the edge whose leftmost lane runs beside this one in the other direction, "" where there is none."""
    line = offset(leftmost.centre_m, leftmost.width_m / 2)
    for name, lanes in by_edge.items():
        if name == edge:
            continue
        last = max(lanes, key=lambda lane: lane.index)
        other = offset(last.centre_m, last.width_m / 2)
        if np.linalg.norm(line[0, :2] - other[-1, :2]) < 0.5 and np.linalg.norm(line[-1, :2] - other[0, :2]) < 0.5:
            return name
    return ""


def _stop_lines(network: RoadNetwork) -> Iterator[Mark]:
    controlled = {link.from_lane for link in network.signals if not link.crossing}
    for lane in network.of_kind("drive", "bus", "bike"):
        whole = length_m(lane.centre_m)
        if lane.id in controlled and whole > 6.0:
            middle = cut(lane.centre_m, whole - 0.15 - _STOP_LINE_M, whole - 0.15)
            yield middle, lane.width_m - 0.3


def _rails(network: RoadNetwork) -> Iterator[Mark]:
    """Yield both rails of each track, through junctions too; where tracks cross or join, rails lie on one another."""
    for lane in network.lanes:
        if lane.has_rails and lane.kind in ("drive", "bus", "rail", "internal") and not _turns_back(lane):
            for side in (-0.5, 0.5):
                yield offset(lane.centre_m, side * (_GAUGE_M + _RAIL_HEAD_M)), _RAIL_HEAD_M


def _turns_back(lane: Lane) -> bool:
    """Return whether a lane ends against its own direction, as those do that join the lanes of a dead end."""
    first, last = (lane.at(place)[1][:2] for place in (0.0, lane.length_m))
    return float(first @ last) < -0.5


def _ribbons(name: str, material: str, marks: Iterable[Mark]) -> RoadSurface:
    vertices: list[Array] = []
    faces: list[NDArray[np.int64]] = []
    count = 0
    for line, width in marks:
        if len(line) < 2 or width <= 0:
            continue
        points, triangles = ribbon(line, width, raised_m=_MARK_M)
        vertices.append(points)
        faces.append(triangles + count)
        count += len(points)
    if not vertices:
        return RoadSurface(name, material, np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    return RoadSurface(name, material, np.concatenate(vertices), np.concatenate(faces))


def _joined(parts: Sequence[RoadSurface]) -> RoadSurface:
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts[:-1], strict=True)])
    return RoadSurface(parts[0].name, parts[0].material, np.concatenate([part.vertices_m for part in parts]), faces)
