"""Buildings, street furniture, lights, signs and clutter: true sizes, sound surfaces, lamps that face the right way."""

from __future__ import annotations

import re
from collections import Counter
from functools import cache

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from fullwell.assets.classes import size_problems
from fullwell.assets.materials.catalogue import asset_material
from fullwell.assets.records import check_asset_id, check_tags
from fullwell.assets.starter.assembly import Assembly, boxes, quads, round_box, span
from fullwell.assets.starter.building import BuiltAsset, BuiltPart, StarterEntry
from fullwell.assets.starter.built import BUILT
from fullwell.assets.starter.facades import Facade, Opening, PaneLots, WindowLook, solid_spans, wall
from fullwell.assets.starter.glyphs import circle, filled, ribbon, rounded, text
from fullwell.assets.starter.roofs import Covering, laid_tiles

Array = NDArray[np.float64]

BUILDINGS = [entry for entry in BUILT if entry.id.startswith("building-")]

LEAST_LAYER_M = 5e-4
"""Nearer than this, depth in float32 may swap two layers at the far end of a street."""

by_id = pytest.mark.parametrize("entry", BUILT, ids=lambda entry: entry.id)
each_building = pytest.mark.parametrize("entry", BUILDINGS, ids=lambda entry: entry.id)


@cache
def _built(asset_id: str) -> BuiltAsset:
    return {entry.id: entry for entry in BUILT}[asset_id].build()


def _points(asset: BuiltAsset) -> Array:
    return np.concatenate([part.shape.vertices_m for part in asset.parts])


def _triangles(part: BuiltPart) -> tuple[Array, Array]:
    """(n, 3, 3) corners and (n, 3) unit normals of the triangles that have an area."""
    corners = part.shape.vertices_m[part.shape.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    kept = length > 1e-10
    return corners[kept], normal[kept] / length[kept, None]


# -- all ------------------------------------------------------------------------------------------------------------------


def test_the_collection_covers_its_classes_with_unique_ids() -> None:
    classes = Counter(_built(entry.id).asset_class for entry in BUILT)
    assert len({entry.id for entry in BUILT}) == len(BUILT)
    wanted = {
        "building": 14, "street_light": 4, "traffic_light": 3, "traffic_sign": 8, "bin": 3, "bench": 2, "bike_rack": 2,
        "bus_stop": 2, "call_box": 2, "billboard": 2, "cone": 2, "barrier": 3, "clutter": 6,
    }  # fmt: skip
    assert {name: classes[name] for name in wanted if classes[name] < wanted[name]} == {}


@by_id
def test_an_asset_is_plausible_in_size_and_stands_on_the_ground(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    low, high = _points(asset).min(axis=0), _points(asset).max(axis=0)
    size = tuple(float(side) for side in high - low)
    assert size_problems(asset.asset_class, asset.tags, (size[0], size[1], size[2])) == ()
    assert low[2] == pytest.approx(0.0, abs=2e-4)


@by_id
def test_ids_tags_and_materials_are_known(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    check_asset_id(entry.id)
    assert check_tags(asset.tags)
    for part in asset.parts:
        asset_material(part.material)


@by_id
def test_the_same_seed_gives_the_same_bytes(entry: StarterEntry) -> None:
    first, second = _built(entry.id), entry.build()
    assert [(part.name, part.material) for part in first.parts] == [(part.name, part.material) for part in second.parts]
    for one, other in zip(first.parts, second.parts, strict=True):
        assert one.shape.vertices_m.tobytes() == other.shape.vertices_m.tobytes()
        assert one.shape.faces.tobytes() == other.shape.faces.tobytes()


@by_id
def test_coordinates_are_finite_and_indices_are_in_range(entry: StarterEntry) -> None:
    for part in _built(entry.id).parts:
        assert np.isfinite(part.shape.vertices_m).all()
        assert part.shape.faces.min() >= 0
        assert part.shape.faces.max() < len(part.shape.vertices_m)


def _overlaps(asset: BuiltAsset) -> list[tuple[str, str, float]]:
    """Pairs of parts of different materials with parallel faces of one facing, nearer than `LEAST_LAYER_M`, and their area.

    Looks along the three axes, which nearly all flat layers here face. Undersides on the ground are nobody's to see.
    """
    parts = [(index, *_triangles(part)) for index, part in enumerate(asset.parts)]
    owner = np.concatenate([np.full(len(corners), index) for index, corners, _ in parts])
    corners = np.concatenate([entry[1] for entry in parts])
    normal = np.concatenate([entry[2] for entry in parts])
    material = np.array([part.material for part in asset.parts])
    found: Counter[tuple[str, str]] = Counter()
    for axis in range(3):
        for sign in (1.0, -1.0):
            chosen = np.flatnonzero(sign * normal[:, axis] > 0.9999)
            if axis == 2 and sign < 0:
                chosen = chosen[corners[chosen, :, 2].max(axis=1) > 1e-3]
            flat = shapely.polygons(np.delete(corners[chosen], axis, axis=2))
            place = corners[chosen].mean(axis=1)
            first, second = _near_pairs(flat, place[:, axis])
            apart = np.abs(np.einsum("ij,ij->i", place[second] - place[first], normal[chosen][first]))
            other = material[owner[chosen][first]] != material[owner[chosen][second]]
            kept = (apart < LEAST_LAYER_M) & other
            first, second = first[kept], second[kept]
            area = shapely.area(shapely.intersection(flat[first], flat[second]))
            for one, two, size in zip(owner[chosen][first], owner[chosen][second], area, strict=True):
                if size > 1e-5:
                    found[asset.parts[one].name, asset.parts[two].name] += size
    return [(one, two, float(size)) for (one, two), size in found.items()]


def _near_pairs(flat: NDArray[np.object_], depth_m: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of pairs whose outlines meet and whose depths differ little: slab by slab, so that few are compared."""
    slab = np.floor(depth_m / 0.02).astype(np.int64)
    firsts, seconds = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for key in np.unique(slab):
        members = np.flatnonzero((slab == key) | (slab == key + 1))
        tree = shapely.STRtree(flat[members])
        one, two = tree.query(flat[members], predicate="intersects")
        near = (one < two) & (np.abs(depth_m[members][one] - depth_m[members][two]) < 0.02)
        firsts.append(members[one[near]])
        seconds.append(members[two[near]])
    return np.concatenate(firsts), np.concatenate(seconds)


@by_id
def test_no_two_layers_fight_for_one_plane(entry: StarterEntry) -> None:
    assert _overlaps(_built(entry.id)) == []


def test_the_search_for_fighting_layers_finds_one() -> None:
    sheet = [(0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (0.0, 1.0, 2.0), (0.0, 0.0, 2.0)]
    near, far = quads([sheet]).moved(2e-4), quads([sheet]).moved(2e-3)
    parts = (BuiltPart("a", quads([sheet]), "sign/red"), BuiltPart("b", near, "sign/white"), BuiltPart("c", far, "sign/blue"))
    assert [(one, two) for one, two, _ in _overlaps(BuiltAsset("other", (), parts))] == [("a", "b")]


# -- lamps ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("entry", [e for e in BUILT if e.id.startswith("street-light")], ids=lambda entry: entry.id)
def test_street_lamps_shine_downwards_from_where_the_attributes_say(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    (lamp,) = [part for part in asset.parts if part.name == "lamp"]
    assert lamp.material.startswith("lamp/street_")
    corners, normal = _triangles(lamp)
    assert (normal[:, 2] < 0).all()
    everything = _points(asset)
    centre = (everything.min(axis=0) + everything.max(axis=0)) / 2
    middle = (corners.reshape(-1, 3).min(axis=0) + corners.reshape(-1, 3).max(axis=0)) / 2
    assert asset.attributes["lamp_offset_x_m"] == pytest.approx(middle[0] - centre[0], abs=1e-3)
    assert asset.attributes["lamp_height_m"] == pytest.approx(corners[..., 2].min(), abs=1e-3)


@pytest.mark.parametrize("entry", [e for e in BUILT if e.id.startswith("street-light")], ids=lambda entry: entry.id)
def test_nothing_hangs_before_a_street_lamp(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    lamp = next(part for part in asset.parts if part.name == "lamp")
    corners, _ = _triangles(lamp)
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    for other in asset.parts:
        # Cages and columns stand around a lantern's lamp; no housing may reach below the lamp across its middle.
        if other.name in ("housing", "reflector"):
            points = other.shape.vertices_m
            across = np.abs(points[:, :2] - (low[:2] + high[:2]) / 2).max(axis=1) < 0.3 * (high[:2] - low[:2]).max()
            below = points[:, 2] < low[2] - 0.02
            assert not (across & below).any()


@pytest.mark.parametrize("entry", [e for e in BUILT if e.id.startswith("traffic-light")], ids=lambda entry: entry.id)
def test_signal_lamps_face_the_traffic_and_are_named_by_phase(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    lamps = {part.name: part for part in asset.parts if part.material.startswith("lamp/")}
    for part in lamps.values():
        assert part.material == f"lamp/traffic_{part.name.removeprefix('light_')}"
        assert (_triangles(part)[1][:, 0] > 0.5).all()
    phases = str(asset.attributes["phases"]).split()
    lit = {name for phase in phases for name in str(asset.attributes[f"lit_in_{phase}"]).split()}
    assert lit == set(lamps)


def test_signals_and_signs_have_their_standard_sizes() -> None:
    signal = next(part for part in _built("traffic-light-post").parts if part.name == "light_red")
    assert np.ptp(signal.shape.vertices_m[:, 1]) == pytest.approx(0.2, abs=0.003)
    assert np.ptp(_points(_built("sign-speed-limit-50"))[:, 1]) == pytest.approx(0.6, abs=0.003)
    assert _built("sign-stop").attributes["plate_width_m"] == pytest.approx(0.75, abs=0.07)
    bin_size = np.ptp(_points(_built("bin-wheelie-240")), axis=0)
    assert bin_size == pytest.approx([0.74, 0.58, 1.07], abs=0.02)
    assert np.ptp(_points(_built("clutter-pallet")), axis=0) == pytest.approx([1.2, 0.8, 0.144], abs=1e-6)
    jersey = next(part for part in _built("barrier-jersey").parts if part.name == "body").shape.bounds_m()
    assert np.ptp(jersey, axis=0)[[0, 2]] == pytest.approx([0.61, 0.81], abs=1e-6)


def test_lit_windows_and_signs_of_buildings_face_outwards() -> None:
    for entry in BUILDINGS:
        asset = _built(entry.id)
        for part in asset.parts:
            if part.material.startswith("lamp/"):
                _, normal = _triangles(part)
                assert (np.abs(normal[:, 2]) < 0.1).all(), (entry.id, part.name)
                if part.name == "sign_panel" and "corner" not in asset.tags:
                    assert (normal[:, 0] > 0.99).all()


# -- buildings ------------------------------------------------------------------------------------------------------------


@each_building
def test_a_building_has_so_many_triangles_as_streets_can_bear(entry: StarterEntry) -> None:
    assert 5_000 <= sum(len(part.shape.faces) for part in _built(entry.id).parts) <= 60_000


@each_building
def test_panes_lie_inside_the_facades_and_face_away_from_the_middle(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    deep, wide = (float(asset.attributes[name]) / 2 for name in ("body_depth_m", "body_width_m"))
    panes = [part for part in asset.parts if re.fullmatch(r"panes_\d\d|lit_windows_(warm|cool)", part.name)]
    assert panes
    slack = 0.02  # panes are tilted by up to 0.3 degrees
    for part in panes:
        corners, normal = _triangles(part)
        middle = corners.mean(axis=1)
        # Bays, dormers, gables and garages stand out of the body.
        on_body = (np.abs(middle[:, 0]) < deep + slack) & (np.abs(middle[:, 1]) < wide + slack)
        facing_x = np.abs(normal[:, 0]) > 0.9
        out = np.where(facing_x, np.sign(middle[:, 0]) * normal[:, 0], np.sign(middle[:, 1]) * normal[:, 1])
        recess = np.where(facing_x, deep - np.abs(middle[:, 0]), wide - np.abs(middle[:, 1]))
        flat = on_body & (np.maximum(np.abs(normal[:, 0]), np.abs(normal[:, 1])) > 0.95) & (recess < 0.5)
        assert (out[flat] > 0).all()
        assert (recess[flat] > -slack).all()


@each_building
def test_a_building_offers_groups_of_panes_to_light(entry: StarterEntry) -> None:
    parts = {part.name: part.material for part in _built(entry.id).parts}
    groups = {name: material for name, material in parts.items() if name.startswith("panes_")}
    assert 3 <= len(groups) <= 8
    assert set(groups.values()) == {"glass/window"}
    assert {"lit_windows_warm", "lit_windows_cool"} & set(parts)
    assert parts.get("lit_windows_warm", "lamp/window_warm") == "lamp/window_warm"
    assert parts.get("lit_windows_cool", "lamp/window_cool") == "lamp/window_cool"


@each_building
def test_the_attributes_tell_how_far_things_stand_out_of_the_street_facade(entry: StarterEntry) -> None:
    asset = _built(entry.id)
    reach = _points(asset)[:, 0].max()
    assert float(asset.attributes["body_depth_m"]) / 2 + float(asset.attributes["front_projection_m"]) == pytest.approx(
        reach, abs=1e-3
    )


# -- the pieces -----------------------------------------------------------------------------------------------------------


def test_a_wall_and_its_openings_share_the_facade() -> None:
    openings = [Opening(-2.0, -1.0, 0.0, 2.0), Opening(0.5, 1.5, 1.0, 2.5)]
    shape = wall(6.0, 0.0, 3.0, openings)
    corners = shape.vertices_m[shape.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(6.0 * 3.0 - 2.0 - 1.5)


def test_solid_spans_leave_out_what_openings_touch() -> None:
    openings = [Opening(-1.0, 0.0, 0.0, 2.0), Opening(1.0, 2.0, 3.0, 4.0)]
    assert solid_spans(6.0, 0.5, 1.0, openings) == [(-3.0, -1.0), (0.0, 3.0)]
    assert solid_spans(6.0, 2.5, 2.8, openings, beyond_m=0.1) == [(-3.1, 3.1)]


@pytest.mark.parametrize(
    "shape",
    [span((0, 0, 0), (1, 2, 3)), boxes([(0, 0, 0), (3, 0, 0)], [(1, 1, 1), (4, 2, 0.5)]), round_box((1.0, 2.0, 0.5), 0.1)],
)
def test_boxes_are_closed_and_face_outwards(shape: object) -> None:
    import trimesh

    mesh = trimesh.Trimesh(shape.vertices_m, shape.faces, process=False)  # type: ignore[attr-defined]
    mesh.merge_vertices(merge_norm=True)
    assert mesh.is_watertight
    assert mesh.volume > 0


def test_an_assembly_names_the_same_part_of_another_material_after_it() -> None:
    assembly = Assembly()
    assembly.add("doors", "wood/oak", span((0, 0, 0), (1, 1, 1)))
    assembly.add("doors", "coating/grey", span((2, 0, 0), (3, 1, 1)))
    parts = assembly.parts(paintable=("doors",))
    assert [(part.name, part.material, part.paintable) for part in parts] == [
        ("doors", "wood/oak", True),
        ("doors_grey", "coating/grey", True),
    ]


def test_a_window_cuts_its_opening_and_sets_its_pane_back() -> None:
    look = WindowLook(recess_m=0.2, curtains=0.0)
    facade = Facade(4.0, look, PaneLots(np.random.default_rng(0), warm=0.0, cool=0.0), np.random.default_rng(1))
    facade.window(Opening(-0.6, 0.6, 1.0, 2.4))
    assert facade.openings == [Opening(-0.6, 0.6, 1.0, 2.4)]
    (pane,) = [part for part in facade.assembly.parts() if part.name.startswith("panes_")]
    assert pane.shape.vertices_m[:, 0] == pytest.approx(-0.2, abs=0.01)
    assert np.ptp(pane.shape.vertices_m[:, 1]) == pytest.approx(1.2)


def test_tiles_cover_a_slope_and_rise_above_it() -> None:
    corners = np.array([(0.0, 0.0, 0.0), (0.0, 6.0, 0.0), (-3.0, 5.0, 3.0), (-3.0, 1.0, 3.0)])
    shape = laid_tiles(corners, Covering(), np.random.default_rng(0))
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    normal /= np.linalg.norm(normal)
    height = shape.vertices_m @ normal
    assert height.min() >= -0.0101
    assert height.max() <= 0.03 + 0.006 + 1e-9
    low, high = shape.vertices_m.min(axis=0), shape.vertices_m.max(axis=0)
    assert low[1] >= -1e-9
    assert high[1] <= 6.0 + 1e-9


def test_letters_fill_their_height_and_read_from_left_to_right() -> None:
    shape = text("LT", 1.0, 0.0)
    assert np.ptp(shape.vertices_m[:, 2]) == pytest.approx(1.0, abs=1e-9)
    # The L's foot is low on the left, the T's bar is high on the right: +y is to the right of who looks along -x.
    left, right = shape.vertices_m[shape.vertices_m[:, 1] < 0], shape.vertices_m[shape.vertices_m[:, 1] > 0]
    assert (left[:, 2] < -0.3).sum() > (right[:, 2] < -0.3).sum()
    assert (_triangles(BuiltPart("t", shape, "sign/white"))[1][:, 0] > 0.99).all()


def test_flat_drawings_have_the_area_of_their_outlines() -> None:
    def area(shape: object) -> float:
        corners, _ = _triangles(BuiltPart("x", shape, "sign/red"))  # type: ignore[arg-type]
        return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2)

    assert area(filled(circle(0.3, sides=400), 0.0)) == pytest.approx(np.pi * 0.09, rel=1e-3)
    assert area(ribbon([(0, 0), (1, 0), (1, 1)], 0.1, 0.0)) == pytest.approx(0.2, rel=1e-9)
    square = rounded([(0, 0), (1, 0), (1, 1), (0, 1)], 0.1, steps=40)
    assert area(filled(square, 0.0)) == pytest.approx(1 - (4 - np.pi) * 0.01, rel=1e-3)
