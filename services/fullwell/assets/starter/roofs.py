"""Roofs: laid tiles, gables, hips, mansards and flat roofs with what stands on them; chimneys, dormers, gutters.

A roof is drawn over a rectangular building centred on the origin: `width_m` along y, `depth_m` along x, eaves at `eaves_m`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.assets.starter.assembly import Assembly, boxes, quads, span
from fullwell.assets.starter.facades import Facade, Opening, PaneLots, WindowLook, moulding
from fullwell.assets.starter.shapes import Shape, cylinder, loft, quad, revolution, tube

__all__ = ["Covering", "Dormer", "chimney", "dormer", "flat_roof", "gable_roof", "hip_roof", "laid_tiles", "mansard_roof"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Covering:
    """What lies on a slope: material, exposed size of a tile along the eave and up the slope [m], thickness, unevenness."""

    material: str = "roof/tile_red"
    width_m: float = 0.30
    course_m: float = 0.33
    thickness_m: float = 0.03
    uneven_m: float = 0.006


TILES_RED = Covering()
TILES_DARK = Covering("roof/tile_dark")
SLATES = Covering("roof/slate", 0.30, 0.22, 0.012, 0.003)


def laid_tiles(corners_m: ArrayLike, covering: Covering, rng: np.random.Generator) -> Shape:
    """Return courses of tiles in bond on a slope, given as eave left, eave right, ridge right, ridge left seen from outside.

    Eave and ridge are parallel; a hip's ridge may be a point. Each tile's lower edge stands above the course below, unevenly,
    which is what makes a roof look laid.
    """
    corner = np.asarray(corners_m, dtype=np.float64)
    along = corner[1] - corner[0]
    eave = float(np.linalg.norm(along))
    along = along / eave
    relative = corner - corner[0]
    right_top, left_top = float(relative[2] @ along), float(relative[3] @ along)
    upward = relative[3] - left_top * along
    slope = float(np.linalg.norm(upward))
    upward = upward / slope
    normal = np.cross(along, upward)
    courses = max(round(slope / covering.course_m), 1)
    step = slope / courses
    count = int(np.ceil(eave / covering.width_m)) + 1
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(courses), np.arange(-1, count), indexing="ij"))
    start = (column + 0.5 * (row % 2)) * covering.width_m
    lift = covering.thickness_m + rng.uniform(0.0, covering.uneven_m, (len(start), 2))

    def place(u: NDArray[Any], v: NDArray[Any], height: NDArray[Any]) -> Array:
        left, right = left_top * v / slope, eave + (right_top - eave) * v / slope
        inside = np.clip(u, left, right)
        return np.asarray(corner[0] + inside[:, None] * along + v[:, None] * upward + height[:, None] * normal)

    low, high = row * step, (row + 1) * step
    zero = np.zeros(len(start))
    gap = 0.004
    end = start + covering.width_m - gap
    lower_left, lower_right = place(start, low, lift[:, 0]), place(end, low, lift[:, 1])
    upper_right, upper_left = place(end, high, zero + 0.004), place(start, high, zero + 0.004)
    base_left, base_right = place(start, low, zero - 0.01), place(end, low, zero - 0.01)
    tops = np.stack([lower_left, lower_right, upper_right, upper_left], axis=1)
    edges = np.stack([base_left, base_right, lower_right, lower_left], axis=1)
    under = quad(corner - 0.008 * normal)
    sheet = quads(np.concatenate([tops, edges]))
    return Shape(
        np.concatenate([sheet.vertices_m, under.vertices_m]), np.concatenate([sheet.faces, under.faces + len(sheet.vertices_m)])
    )


def _half_tile(path_m: Sequence[Sequence[float]], radius_m: float = 0.11) -> Shape:
    return tube(path_m, radius_m, sides=8)


def _slope(
    assembly: Assembly, corners_m: ArrayLike, covering: Covering, rng: np.random.Generator, *, thick_m: float = 0.1
) -> None:
    """Tiles on a slope and the boarding below it, closed towards the room and at the edges."""
    corner = np.asarray(corners_m, dtype=np.float64)
    assembly.add("roof", covering.material, laid_tiles(corner, covering, rng))
    normal = np.cross(corner[1] - corner[0], corner[3] - corner[0])
    normal = normal / np.linalg.norm(normal)
    upper, lower = corner - 0.012 * normal, corner - thick_m * normal
    faces = [lower[::-1]]
    for here in range(4):
        there = (here + 1) % 4
        faces.append(np.array([lower[here], lower[there], upper[there], upper[here]]))
    assembly.add("eaves", "wood/painted_white", quads(np.array(faces)))


def gable_roof(
    assembly: Assembly,
    width_m: float,
    depth_m: float,
    eaves_m: float,
    *,
    pitch_deg: float,
    covering: Covering,
    wall_part: str,
    wall_material: str,
    rng: np.random.Generator,
    overhang_m: float = 0.4,
    verge_m: float = 0.25,
    to_street: bool = False,
) -> float:
    """Draw a gable roof, its ridge along the street or, `to_street`, at right angles to it; return the ridge's height [m]."""
    across, along = (width_m, depth_m) if to_street else (depth_m, width_m)
    tangent = float(np.tan(np.deg2rad(pitch_deg)))
    ridge = eaves_m + across / 2 * tangent
    sub = Assembly()
    half, end = across / 2, along / 2
    out, low = half + overhang_m, eaves_m - overhang_m * tangent
    lift = 0.11 / float(np.cos(np.deg2rad(pitch_deg)))
    for side in (1.0, -1.0):
        a, b = -side * (end + verge_m), side * (end + verge_m)
        corners = [(side * out, a, low + lift), (side * out, b, low + lift), (0, b, ridge + lift), (0, a, ridge + lift)]
        _slope(sub, corners, covering, rng)
        _gutter(sub, side * (out + 0.05), end + verge_m, low + lift - 0.09)
        face = [(half, side * end, eaves_m), (-half, side * end, eaves_m), (0, side * end, ridge)]
        sub.add(wall_part, wall_material, Shape(np.array(face), np.array([[0, 1, 2] if side > 0 else [1, 0, 2]])))
        sub.add(
            "verges",
            "wood/painted_white",
            *(
                _board(
                    [(s * out, side * (end + verge_m), low + lift - 0.03), (0, side * (end + verge_m), ridge + lift - 0.03)],
                    0.2,
                )
                for s in (1.0, -1.0)
            ),
        )
    sub.add(
        "ridge",
        covering.material,
        _half_tile([(0, -end - verge_m - 0.01, ridge + lift + 0.015), (0, end + verge_m + 0.01, ridge + lift + 0.015)]),
    )
    assembly.place(sub, turn_deg=90.0 if to_street else 0.0)
    return ridge + lift


def _board(ends_m: Sequence[tuple[float, float, float]], tall_m: float) -> Shape:
    """A board below a line in the xz plane, 24 mm thick to both sides."""
    start, stop = np.array(ends_m[0]), np.array(ends_m[1])
    rings = []
    for point in (start, stop):
        rings.append([point + [0, y, z] for y, z in ((-0.012, -tall_m), (0.012, -tall_m), (0.012, 0), (-0.012, 0))])
    flip = start[0] > stop[0]
    return loft(np.array(rings[::-1] if flip else rings))


def _gutter(assembly: Assembly, x_m: float, half_m: float, z_m: float) -> None:
    assembly.add("gutters", "metal/steel_galvanised", cylinder(0.06, 2 * half_m, sides=10, axis="y").moved(x_m, 0.0, z_m))


def hip_roof(
    assembly: Assembly,
    width_m: float,
    depth_m: float,
    eaves_m: float,
    *,
    pitch_deg: float,
    covering: Covering,
    rng: np.random.Generator,
    overhang_m: float = 0.5,
) -> float:
    """Draw a hipped roof of equal slopes; return the ridge height [m]."""
    tangent = float(np.tan(np.deg2rad(pitch_deg)))
    x, y = depth_m / 2 + overhang_m, width_m / 2 + overhang_m
    lift = 0.11
    low = eaves_m - overhang_m * tangent + lift
    run = min(x, y)
    ridge = low + run * tangent
    rx, ry = x - run, y - run
    for side in (1.0, -1.0):
        front = [
            (side * x, -side * y, low),
            (side * x, side * y, low),
            (side * rx, side * ry, ridge),
            (side * rx, -side * ry, ridge),
        ]
        flank = [
            (side * x, side * y, low),
            (-side * x, side * y, low),
            (-side * rx, side * ry, ridge),
            (side * rx, side * ry, ridge),
        ]
        for corners in (front, flank):
            _slope(assembly, corners, covering, rng)
        for other in (1.0, -1.0):
            assembly.add(
                "ridge",
                covering.material,
                _half_tile([(side * x, other * y, low + 0.01), (side * rx, other * ry, ridge + 0.01)], 0.09),
            )
        _gutter(assembly, side * (x + 0.05), y, low - 0.08)
        assembly.add(
            "gutters",
            "metal/steel_galvanised",
            cylinder(0.06, 2 * x, sides=10, axis="x").moved(0.0, side * (y + 0.05), low - 0.08),
        )
    if rx + ry > 0.1:
        assembly.add("ridge", covering.material, _half_tile([(-rx, -ry, ridge + 0.01), (rx, ry, ridge + 0.01)]))
    inner = (low - 0.13 + 0.02,)
    assembly.add("soffits", "wood/painted_white", span((-x + 0.05, -y + 0.05, inner[0] - 0.03), (x - 0.05, y - 0.05, inner[0])))
    return ridge


def mansard_roof(
    assembly: Assembly,
    width_m: float,
    depth_m: float,
    eaves_m: float,
    *,
    height_m: float,
    covering: Covering,
    rng: np.random.Generator,
    steep_deg: float = 70.0,
) -> float:
    """Draw steep slopes of slate with a low metal roof above them; return the height of the top [m]."""
    inset = height_m / float(np.tan(np.deg2rad(steep_deg)))
    x, y = depth_m / 2 - 0.05, width_m / 2 - 0.05
    top = eaves_m + height_m
    tx, ty = x - inset, y - inset
    for side in (1.0, -1.0):
        front = [
            (side * x, -side * y, eaves_m),
            (side * x, side * y, eaves_m),
            (side * tx, side * ty, top),
            (side * tx, -side * ty, top),
        ]
        flank = [
            (side * x, side * y, eaves_m),
            (-side * x, side * y, eaves_m),
            (-side * tx, side * ty, top),
            (side * tx, side * ty, top),
        ]
        for corners in (front, flank):
            assembly.add("roof", covering.material, laid_tiles(corners, covering, rng))
        for other in (1.0, -1.0):
            assembly.add(
                "flashing",
                "roof/metal",
                tube([(side * x, other * y, eaves_m + 0.02), (side * tx, other * ty, top)], 0.05, sides=6),
            )
    crown = [(0.0, top - 0.06), (0.14, top - 0.06), (0.14, top + 0.06), (0.0, top + 0.08)]
    assembly.add("flashing", "roof/metal", moulding(2 * ty, 2 * tx, crown))
    rise = 0.1 * min(tx, ty)
    ridge = top + 0.08 + rise
    run = min(tx, ty)
    rx, ry = tx - run, ty - run
    slopes = []
    for side in (1.0, -1.0):
        z = top + 0.08
        slopes.append(
            [
                (side * tx, -side * ty, z),
                (side * tx, side * ty, z),
                (side * rx, side * ry, ridge),
                (side * rx, -side * ry, ridge),
            ]
        )
        slopes.append(
            [
                (side * tx, side * ty, z),
                (-side * tx, side * ty, z),
                (-side * rx, side * ry, ridge),
                (side * rx, side * ry, ridge),
            ]
        )
    assembly.add("roof_top", "roof/metal", quads(np.array(slopes)))
    return ridge


def flat_roof(
    assembly: Assembly,
    width_m: float,
    depth_m: float,
    top_m: float,
    *,
    rng: np.random.Generator,
    parapet_m: float = 0.9,
    wall_part: str = "walls",
    wall_material: str = "plaster/cream",
    coping_material: str = "stone/limestone",
    plant: int = 3,
    stair: bool = True,
) -> float:
    """Draw a gravelled roof behind a parapet, with plant, vents and the head of the stairs; return the greatest height [m]."""
    thick = 0.3
    x, y = depth_m / 2, width_m / 2
    crown = top_m + parapet_m
    assembly.add(wall_part, wall_material, moulding(width_m, depth_m, [(0.0, top_m), (0.0, crown)]))
    assembly.add(wall_part, wall_material, moulding(width_m, depth_m, [(-thick, crown), (-thick, top_m)]))
    coping = [
        (-thick - 0.05, crown),
        (-thick - 0.05, crown - 0.03),
        (0.06, crown - 0.03),
        (0.06, crown + 0.05),
        (-thick - 0.05, crown + 0.07),
        (-thick - 0.05, crown),
    ]
    assembly.add("coping", coping_material, moulding(width_m, depth_m, coping))
    ix, iy = x - 0.8 * thick, y - 0.8 * thick
    assembly.add("roof", "concrete/grey", quad([(ix, -iy, top_m), (ix, iy, top_m), (-ix, iy, top_m), (-ix, -iy, top_m)]))
    highest = crown + 0.07
    free_x, free_y = x - 1.2, y - 1.2
    if stair and free_x > 2 and free_y > 2:
        at = float(rng.uniform(-0.5, 0.5)) * free_y
        low = (-free_x, at - 1.6, top_m)
        size = (3.4, 3.2, 2.6)
        high = tuple(a + b for a, b in zip(low, size, strict=True))
        assembly.add("roof_house", wall_material, span(low, high))
        assembly.add(
            "roof_house_top",
            "roof/metal",
            span((low[0] - 0.15, low[1] - 0.15, high[2]), (high[0] + 0.15, high[1] + 0.15, high[2] + 0.12)),
        )
        assembly.add(
            "doors_roof",
            "metal/steel_galvanised",
            span((high[0], at - 0.45, top_m + 0.1), (high[0] + 0.04, at + 0.45, top_m + 2.1)),
        )
        highest = max(highest, high[2] + 0.12)
    for _ in range(plant):
        highest = max(highest, _plant_box(assembly, free_x, free_y, top_m, rng))
    for _ in range(3):
        px, py = float(rng.uniform(0.2, 1.0)) * free_x, float(rng.uniform(-free_y, free_y))
        assembly.add(
            "vents",
            "metal/steel_galvanised",
            cylinder(0.09, 0.9, sides=10).moved(px, py, top_m + 0.45),
            cylinder(0.14, 0.12, sides=10).moved(px, py, top_m + 0.96),
        )
    return highest


def _plant_box(assembly: Assembly, free_x: float, free_y: float, low_m: float, rng: np.random.Generator) -> float:
    """An air handler on feet, with louvred sides and fans on top; kept to the street half, away from the stairs."""
    size = rng.uniform([1.0, 1.4, 1.1], [1.8, 2.8, 1.7])
    x = float(rng.uniform(0.25, 1.0)) * max(free_x - size[0], 0.0)
    y = float(rng.uniform(-1.0, 1.0)) * max(free_y - size[1], 0.0)
    low, high = (
        np.array([x - size[0] / 2, y - size[1] / 2, low_m + 0.2]),
        np.array([x + size[0] / 2, y + size[1] / 2, low_m + 0.2 + size[2]]),
    )
    assembly.add("plant", "metal/steel_galvanised", boxes(low, high))
    count = 8
    levels = np.linspace(low[2] + 0.15, high[2] - 0.15, count)
    assembly.add(
        "plant",
        "metal/steel_galvanised",
        boxes(
            np.column_stack([np.full(count, low[0] - 0.03), np.full(count, low[1] + 0.1), levels]),
            np.column_stack([np.full(count, high[0] + 0.03), np.full(count, high[1] - 0.1), levels + 0.05]),
        ),
        boxes(
            [(low[0], low[1] + 0.1, low_m), (low[0], high[1] - 0.25, low_m)],
            [(high[0], low[1] + 0.25, low_m + 0.2), (high[0], high[1] - 0.1, low_m + 0.2)],
        ),
    )
    fan = min(size[0], size[1]) * 0.32
    for shift in (-0.22, 0.22):
        assembly.add("plant_fans", "plastic/black", cylinder(fan, 0.12, sides=16).moved(x, y + shift * size[1], high[2] + 0.06))
    return float(high[2] + 0.12)


def chimney(
    assembly: Assembly, x_m: float, y_m: float, low_m: float, high_m: float, *, material: str = "brick/red", pots: int = 2
) -> None:
    """Draw a chimney stack with an oversailing head and clay pots."""
    half_x, half_y = 0.28, 0.22 + 0.17 * pots
    assembly.add("chimneys", material, span((x_m - half_x, y_m - half_y, low_m), (x_m + half_x, y_m + half_y, high_m)))
    for number, out in enumerate((0.03, 0.06)):
        z = high_m - 0.3 + 0.075 * number
        assembly.add(
            "chimneys",
            material,
            span((x_m - half_x - out, y_m - half_y - out, z), (x_m + half_x + out, y_m + half_y + out, z + 0.075)),
        )
    assembly.add(
        "chimney_caps",
        "concrete/grey",
        span((x_m - half_x - 0.03, y_m - half_y - 0.03, high_m), (x_m + half_x + 0.03, y_m + half_y + 0.03, high_m + 0.07)),
    )
    pot = revolution([(0.12, 0.0), (0.1, 0.08), (0.09, 0.38), (0.115, 0.4), (0.115, 0.45), (0.08, 0.45), (0.08, 0.3)], sides=12)
    for number in range(pots):
        assembly.add("chimney_pots", "roof/tile_red", pot.moved(x_m, y_m + (number - (pots - 1) / 2) * 0.34, high_m + 0.07))


@dataclass(frozen=True, slots=True)
class Dormer:
    """A dormer's window: width and height [m], how far its cheeks run back, and its roof."""

    width_m: float = 1.1
    height_m: float = 1.5
    depth_m: float = 2.0
    roof: str = "gable"
    face_material: str = "wood/painted_white"
    cheek_material: str = "roof/slate"
    covering: Covering = SLATES


def dormer(
    assembly: Assembly,
    style: Dormer,
    *,
    at_m: tuple[float, float, float],
    look: WindowLook,
    panes: PaneLots,
    rng: np.random.Generator,
) -> None:
    """Draw a dormer whose sill is at (x, y, z), looking along +x; its back runs into the slope."""
    wide, tall, deep = style.width_m + 0.3, style.height_m + 0.15, style.depth_m
    face = Facade(wide, look, panes, rng, "dormers", style.face_material)
    face.window(Opening(-style.width_m / 2, style.width_m / 2, 0.08, 0.08 + style.height_m), look, sill=False)
    face.close(0.0, tall)
    face.assembly.add("dormer_sills", "roof/metal", span((-0.02, -wide / 2, -0.05), (0.08, wide / 2, 0.0)))
    half = wide / 2
    for side in (1.0, -1.0):
        cheek = [(0, side * half, 0), (-deep, side * half, 0), (-deep, side * half, tall), (0, side * half, tall)]
        face.assembly.add("dormer_cheeks", style.cheek_material, quads([cheek if side > 0 else cheek[::-1]]))
    out = 0.14
    if style.roof == "gable":
        rise = 0.62 * half
        triangle = Shape(
            np.array([(0, -half, tall), (0, half, tall), (0, 0, tall + rise)], dtype=np.float64), np.array([[0, 1, 2]])
        )
        face.assembly.add("dormers", style.face_material, triangle)
        drop = out * rise / half
        for side in (1.0, -1.0):
            eave, ridge = (side * (half + out), tall - drop + 0.06), (0.0, tall + rise + 0.06)
            a, b = (out, -deep) if side > 0 else (-deep, out)
            corners = [(a, *eave), (b, *eave), (b, *ridge), (a, *ridge)]
            _slope(face.assembly, corners, style.covering, rng, thick_m=0.06)
    else:
        lid = span((-deep, -half - out, tall), (out, half + out, tall + 0.12))
        face.assembly.add("dormer_tops", "roof/metal", lid)
    assembly.place(face.assembly, x_m=at_m[0], y_m=at_m[1], z_m=at_m[2])
