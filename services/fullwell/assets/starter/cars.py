"""Cars, vans and ambulances: skins lofted to a class's proportions, with windows, lamps, seams, wheels and fittings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.lofts import (
    Field,
    Line,
    Panels,
    Patch,
    ShellSpec,
    below,
    beyond,
    half_shell,
    intersection,
    opposite,
    outline_walls,
    surface_at,
)
from fullwell.assets.starter.shapes import Shape, box, revolution, tube
from fullwell.assets.starter.vehicle_fittings import door_handle, mirror, number_plate, plate_text, rounded_box, wiper
from fullwell.assets.starter.vehicle_parts import PartList
from fullwell.assets.starter.wheels import RimStyle, car_wheel

__all__ = ["CarSpec", "Face", "Glass", "Tail", "car"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Face:
    """The front. Heights above the road, half widths and ways along the nose from its middle [m].

    Attributes
    ----------
    grille
        (half width, low, high), its bars' number and material, and its frame's; None: closed, as electric cars have it.
    lamps
        (from, to, low, high) along the nose, and by how much the outer end lies higher.
    lamp_style
        "led": dark, two projectors over a lit line; "halogen": chrome, one large reflector; "round": a round reflector;
        "slim": a lit line over a slit of projectors.
    intake
        (half width, low, high) of the opening in the bumper.
    plate_z_m
        Height of the number plate's middle.
    """

    grille: tuple[float, float, float] | None
    lamps: tuple[float, float, float, float]
    lamp_rise_m: float = 0.04
    lamp_style: Literal["led", "halogen", "round", "slim"] = "led"
    grille_bars: int = 5
    bar_material: str = "plastic/black"
    frame_material: str = "metal/chrome"
    intake: tuple[float, float, float] = (0.55, 0.24, 0.34)
    plate_z_m: float = 0.42


@dataclass(frozen=True, slots=True)
class Tail:
    """The rear: lamps (from, to, low, high) along the rear from its middle [m], plate height, exhausts, and what opens.

    `style`: "bar" lit lines and blocks, "upright" tall lamps at the corners, "band" a strip over the whole width.
    `lid`: "boot" (with the deck), "gate" (with the rear window), "doors" (two, a van's).
    """

    lamps: tuple[float, float, float, float]
    style: Literal["bar", "upright", "band"] = "bar"
    lamp_rise_m: float = 0.02
    plate_z_m: float = 0.72
    exhausts: int = 1
    lid: Literal["boot", "gate", "doors"] = "gate"


@dataclass(frozen=True, slots=True)
class Glass:
    """The greenhouse. Distances from the front bumper d and heights z [m].

    Attributes
    ----------
    front_base_m, front_top_m, rear_top_m, rear_base_m
        d of the windscreen's foot; (d, z) of its top; (d, z) of the rear window's top; d of its foot.
    roof
        (d, z) between: the roof line.
    tumblehome_m
        How much narrower each side is at the roof.
    shoulder_m
        How far each side stands in from the body's width at the belt.
    pillars
        d of the dark pillars between side windows, and half their breadth.
    side_rear_m
        d of the side windows' end at the belt, and by how much it leans forward over its height.
    """

    front_base_m: float
    front_top_m: tuple[float, float]
    rear_top_m: tuple[float, float]
    rear_base_m: float
    roof: tuple[tuple[float, float], ...]
    pillars: tuple[tuple[float, float], ...]
    side_rear_m: tuple[float, float]
    tumblehome_m: float = 0.19
    shoulder_m: float = 0.085
    front_power: float = 3.2
    rear_power: float = 4.0
    belt_m: float = 0.035
    rail_level: float = 0.86
    side_front: float = 0.70
    trim_material: str = "plastic/black"
    rear_window: bool = True
    roof_crown_m: float = 0.05
    rear_split: bool = False


@dataclass(frozen=True, slots=True)
class CarSpec:
    """A car of one make-up. Distances from the front bumper d, heights z [m]; see `Face`, `Tail` and `Glass`.

    Attributes
    ----------
    wheel
        Tyre radius and width, rim radius, rim style.
    deck
        (d, z) of the body's middle line below the greenhouse: bonnet, belt, boot.
    crown_m
        How much lower the deck is at the shoulders.
    doors
        (front d, rear d) of each door on a side.
    """

    asset_class: str
    tags: tuple[str, ...]
    length_m: float
    width_m: float
    wheelbase_m: float
    front_overhang_m: float
    wheel: tuple[float, float, float, RimStyle]
    deck: tuple[tuple[float, float], ...]
    glass: Glass
    face: Face
    tail: Tail
    doors: tuple[tuple[float, float], ...]
    paint: str = "paint/silver"
    clearance_m: float = 0.18
    sill_m: float = 0.07
    crown_m: float = 0.07
    front_power: float = 5.4
    rear_power: float = 5.5
    nose: tuple[float, ...] = (0.10, 0.04, 0.0, 0.005, 0.035, 0.09, 0.17, 0.30)
    stern: tuple[float, ...] = (0.16, 0.07, 0.01, 0.0, 0.02, 0.045, 0.09, 0.17)
    cladding: bool = False
    roof_rails: bool = False
    roof_glass: bool = False
    mirror_m: tuple[float, float] = (0.2, 0.13)
    sliding_door: bool = False
    arch_gap_m: float = 0.05
    livery: tuple[str, str] = ("", "")
    light_bars: bool = False

    @property
    def axles_x_m(self) -> tuple[float, float]:
        """x of the front and rear axle, the front bumper at 0."""
        return -self.front_overhang_m, -self.front_overhang_m - self.wheelbase_m


_LEVELS = (0.0, 0.10, 0.30, 0.50, 0.70, 0.84, 0.94, 1.0)
_SIDE = (0.085, 0.035, 0.008, 0.0, 0.006, 0.024, 0.055, 0.12)


def car(rng: np.random.Generator, *, spec: CarSpec) -> BuiltAsset:
    """Return a car. The seed makes up the characters on its plates."""
    parts = PartList()
    hull = _hull(spec)
    canopy = _canopy(spec)
    skin = (*hull.patches["body"],)
    roof = (*canopy.patches["body"],)
    _cut_arches(spec, hull)
    _cut_trim(spec, hull)
    _cut_face(spec, hull)
    _cut_tail(spec, hull)
    _cut_seams(spec, hull)
    _cut_windows(spec, canopy)
    if spec.livery[0]:
        _cut_livery(spec, hull)
    materials = _materials(spec)
    for panels in (hull, canopy):
        parts.add_panels(panels, materials, ("window_side",), ("body",))
    _add_wheels(spec, parts)
    _add_plates(spec, parts, skin, rng)
    _add_fittings(spec, parts, skin, roof)
    return parts.built(spec.asset_class, spec.tags, _attributes(spec), shift_x_m=spec.length_m / 2)


def _attributes(spec: CarSpec) -> dict[str, float | str]:
    eye_d = spec.glass.pillars[0][0] - 0.22 if spec.glass.pillars else spec.doors[0][1] - 0.3
    return {
        "front_overhang_m": spec.front_overhang_m,
        "wheelbase_m": spec.wheelbase_m,
        "body_width_m": spec.width_m,
        "wheel_radius_m": spec.wheel[0],
        "track_m": spec.width_m - 2 * _WHEEL_INSET_M - spec.wheel[1],
        "driver_eye_x_m": spec.length_m / 2 - eye_d,
        "driver_eye_y_m": 0.2 * spec.width_m,
        "driver_eye_z_m": spec.glass.front_top_m[1] - 0.2,
        "model_year_style": spec.tags[-1],
    }


def _line(points: tuple[tuple[float, float], ...], *, lift_m: float = 0.0) -> Line:
    return Line(tuple((-d, z + lift_m) for d, z in points))


def _hull(spec: CarSpec) -> Panels:
    half = spec.length_m / 2
    low = spec.clearance_m
    bottom = ((0.0, low + 0.05), (spec.front_overhang_m, low), (spec.length_m - 0.8, low), (spec.length_m, low + 0.09))
    radius = spec.wheel[0] + spec.arch_gap_m
    bulges = tuple((x, spec.wheel[0], radius, 0.014, 0.07) for x in spec.axles_x_m)
    skin, under = half_shell(
        ShellSpec(
            centre_x_m=-half,
            front_m=half,
            rear_m=half,
            half_width_m=spec.width_m / 2 - 0.012,
            low=_line(bottom),
            high=_line(spec.deck),
            crown_m=spec.crown_m,
            profile=tuple(zip(_LEVELS, _SIDE, spec.nose, spec.stern, strict=True)),
            front_power=spec.front_power,
            rear_power=spec.rear_power,
            columns=72,
            levels=17,
            across=4,
            bulges=bulges,
        )
    )
    panels = Panels()
    panels.add("body", skin)
    panels.add("underside", under)
    return panels


def _canopy(spec: CarSpec) -> Panels:
    glass = spec.glass
    front, rear = -glass.front_base_m, -glass.rear_base_m
    centre = -0.5 * (glass.front_top_m[0] + glass.rear_top_m[0])
    lean_front = glass.front_top_m[0] - glass.front_base_m
    lean_rear = glass.rear_base_m - glass.rear_top_m[0]
    home = glass.tumblehome_m
    # A windscreen bulges a little; a roof turns in from its edges.
    profile = (
        (0.0, 0.0, 0.0, 0.0),
        (0.22, 0.15 * home, 0.23 * lean_front, 0.21 * lean_rear),
        (0.45, 0.40 * home, 0.47 * lean_front, 0.44 * lean_rear),
        (0.68, 0.70 * home, 0.72 * lean_front, 0.69 * lean_rear),
        (0.86, 0.97 * home, 0.93 * lean_front, 0.91 * lean_rear),
        (0.94, 1.20 * home, 1.05 * lean_front + 0.02, 1.03 * lean_rear + 0.02),
        (0.985, 1.20 * home + 0.06, 1.05 * lean_front + 0.10, 1.03 * lean_rear + 0.09),
        (1.0, 1.20 * home + 0.13, 1.05 * lean_front + 0.22, 1.03 * lean_rear + 0.20),
    )
    skin, _ = half_shell(
        ShellSpec(
            centre_x_m=centre,
            front_m=front - centre,
            rear_m=centre - rear,
            half_width_m=spec.width_m / 2 - glass.shoulder_m,
            low=_line(spec.deck, lift_m=-spec.crown_m - 0.02),
            high=_line((glass.front_top_m, *glass.roof, glass.rear_top_m)),
            crown_m=glass.roof_crown_m,
            profile=profile,
            front_power=glass.front_power,
            rear_power=glass.rear_power,
            columns=56,
            levels=15,
            across=4,
        )
    )
    panels = Panels()
    panels.add("body", skin)
    return panels


_WHEEL_INSET_M = 0.035
"""How far a tyre's outer wall stands in from the body's width."""


def _circle(x_m: float, z_m: float, radius_m: float) -> Field:
    return lambda patch: np.hypot(patch.x - x_m, patch.z - z_m) - radius_m


def _cut_arches(spec: CarSpec, hull: Panels) -> None:
    radius = spec.wheel[0] + spec.arch_gap_m
    inner = spec.width_m / 2 - spec.wheel[1] - 0.16
    for x in spec.axles_x_m:
        hole = _circle(x, spec.wheel[0], radius)
        if spec.cladding:
            hull.cut("body", "trim", _circle(x, spec.wheel[0], radius + 0.06), edge_m=0.035)
        for name in ("body", "trim", "underside"):
            hull.cut(name, "\0side", beyond("y", inner), edge_m=1.0)
            hull.cut("\0side", "\0hole", hole, edge_m=0.03)
            hull.add(name, *hull.patches.pop("\0side", []))
        removed = hull.patches.pop("\0hole", [])
        hull.add_loose("wheel_well", *outline_walls(removed, hole, inner))
        hull.add_loose("wheel_well", _well_side(x, spec.wheel[0], radius + 0.004, inner, spec.clearance_m))


def _well_side(x_m: float, z_m: float, radius_m: float, y_m: float, floor_m: float) -> Shape:
    """Return the inner wall of a wheel well: a disc above the floor, facing outwards."""
    dip = np.arcsin(np.clip((floor_m - z_m) / radius_m, -1.0, 1.0))
    angle = np.linspace(dip, np.pi - dip, 32)
    rim = np.stack([x_m + radius_m * np.cos(angle), np.full(32, y_m), z_m + radius_m * np.sin(angle)], axis=1)
    vertices = np.concatenate([rim, [[x_m, y_m, floor_m]]])
    here = np.arange(31)
    return Shape(vertices, np.stack([here + 1, here, np.full(31, 32)], axis=1))


def _cut_trim(spec: CarSpec, hull: Panels) -> None:
    """Cut the dark lower edge, which climbs at the bumpers."""
    front, rear = spec.axles_x_m
    low = spec.clearance_m + spec.sill_m
    climb = 0.05 if not spec.cladding else 0.09
    edge = Line(
        ((-spec.length_m, low + climb + 0.08), (rear - 0.4, low + climb), (rear, low), (front, low), (0.0, low + climb))
    )
    hull.cut("body", "trim", lambda patch: patch.z - edge(patch.x), edge_m=0.06)


def _window_of(
    half_m: float, low_m: float, high_m: float, *, front: bool, limit_x_m: float, radius_m: float = 0.04, taper: float = 0.0
) -> Field:
    """Return a rounded rectangle in the front (or rear) view; narrower below (or above) by `taper` per metre."""
    side = 1.0 if front else -1.0

    def beside(patch: Patch) -> Array:
        return patch.y - half_m - taper * (patch.z - high_m)

    return intersection(
        (
            beside,
            lambda patch: low_m - patch.z,
            lambda patch: patch.z - high_m,
            lambda patch: side * (limit_x_m - patch.x),
        ),
        radius_m=radius_m,
    )


def _cut_face(spec: CarSpec, hull: Panels) -> None:
    face = spec.face
    if face.grille is not None:
        half, low, high = face.grille
        frame = _window_of(half, low, high, front=True, limit_x_m=-0.45, radius_m=0.045, taper=0.25)
        hull.cut("body", "grille_frame", frame, edge_m=0.025)
        hull.cut("grille_frame", "grille", lambda patch: frame(patch) + 0.014, edge_m=0.04, depth_m=0.022)
        for at in np.linspace(low, high, face.grille_bars + 2)[1:-1]:
            hull.strip("grille", "grille_bars", below("z", float(at)), half_width_m=0.011, depth_m=-0.012)
    half, low, high = face.intake
    intake = _window_of(half, low, high, front=True, limit_x_m=-0.5, radius_m=0.03, taper=-0.4)
    for name in ("body", "trim"):
        hull.cut(name, "grille", intake, edge_m=0.025, depth_m=0.03, wall="trim")
    _cut_headlamps(face, hull)


def _stripe(z_m: float, half_m: float) -> Field:
    return lambda patch: np.abs(patch.z - z_m) - half_m


def _cut_headlamps(face: Face, hull: Panels) -> None:
    start, stop, low, high = face.lamps
    rise = face.lamp_rise_m / (stop - start)
    length, height = stop - start, high - low

    def along(patch: Patch) -> Array:
        return (patch.front_arc_m - start) / length

    def above(patch: Patch) -> Array:
        """Height over the lamp's lower edge; it grows less tall towards the middle."""
        return patch.z - low - rise * (patch.front_arc_m - start)

    outline = intersection(
        (
            lambda patch: (start - patch.front_arc_m) + 0.35 * (height / 2 - above(patch)),
            lambda patch: patch.front_arc_m - stop - 0.5 * (above(patch) - height / 2),
            lambda patch: -above(patch),
            lambda patch: above(patch) - height,
            lambda patch: -1.1 - patch.x,
        ),
        radius_m=0.022,
    )
    if face.lamp_style == "round":
        centre, radius = (start + stop) / 2, height / 2
        outline = lambda patch: np.hypot(patch.front_arc_m - centre, above(patch) - radius) - radius  # noqa: E731
    hull.cut("body", "lamp_housing", outline, edge_m=0.018, depth_m=0.004, wall="trim")
    inside = lambda patch: outline(patch) + 0.010  # noqa: E731

    def lamp(name: str, *fields: Field, depth_m: float = -0.003) -> None:
        hull.cut("lamp_housing", name, intersection((inside, *fields), radius_m=0.006), edge_m=0.014, depth_m=depth_m)

    def disc(share: float, height_m: float, radius_m: float) -> Field:
        return lambda patch: np.hypot(patch.front_arc_m - start - share * length, above(patch) - height_m) - radius_m

    if face.lamp_style == "round":
        lamp("headlight", disc(0.5, height / 2, 0.36 * height))
        lamp("drl", lambda patch: -outline(patch) - 0.022)
        hull.cut("body", "indicator_front", _lamp_strip(stop + 0.02, stop + 0.12, low + 0.04, low + 0.09), edge_m=0.02)
        return
    lamp("indicator_front", lambda patch: 0.80 - along(patch), lambda patch: above(patch) - 0.62 * height)
    if face.lamp_style == "halogen":
        lamp("headlight", disc(0.36, 0.5 * height, min(0.40 * height, 0.075)))
        lamp("drl", lambda patch: along(patch) - 0.16)
    elif face.lamp_style == "led":
        lamp("drl", lambda patch: 0.80 * height - above(patch))
        radius = min(0.27 * height, 0.04)
        for share in (0.30, 0.58):
            lamp("headlight", disc(share, 0.40 * height, radius))
    else:
        lamp("drl", lambda patch: 0.66 * height - above(patch))
        for share in (0.2, 0.38, 0.56):
            lamp("headlight", _block(start + share * length, 0.05, above, 0.14 * height, 0.50 * height))


def _block(centre_m: float, half_m: float, above: Field, low_m: float, high_m: float) -> Field:
    return intersection(
        (
            lambda patch: np.abs(patch.front_arc_m - centre_m) - half_m,
            lambda patch: low_m - above(patch),
            lambda patch: above(patch) - high_m,
        ),
        radius_m=0.008,
    )


def _lamp_strip(start_m: float, stop_m: float, low_m: float, high_m: float) -> Field:
    return intersection(
        (
            lambda patch: start_m - patch.front_arc_m,
            lambda patch: patch.front_arc_m - stop_m,
            lambda patch: low_m - patch.z,
            lambda patch: patch.z - high_m,
        ),
        radius_m=0.012,
    )


def _cut_tail(spec: CarSpec, hull: Panels) -> None:
    start, stop, low, high = spec.tail.lamps
    rise = spec.tail.lamp_rise_m / (stop - start)
    height = high - low

    def above(patch: Patch) -> Array:
        return patch.z - low - rise * (patch.rear_arc_m - start)

    outline = intersection(
        (
            lambda patch: start - patch.rear_arc_m,
            lambda patch: patch.rear_arc_m - stop - 0.3 * (above(patch) - height / 2),
            lambda patch: -above(patch),
            lambda patch: above(patch) - height,
            lambda patch: patch.x + spec.length_m - 1.1,
        ),
        radius_m=0.022,
    )
    hull.cut("body", "tail_housing", outline, edge_m=0.02, depth_m=-0.003, wall="trim")

    def lamp(name: str, left: float, right: float, bottom: float, top: float) -> None:
        """Cut a lit field, as shares of the lamp's length and height."""
        field_ = intersection(
            (
                lambda patch: outline(patch) + 0.009,
                lambda patch: start + left * (stop - start) - patch.rear_arc_m,
                lambda patch: patch.rear_arc_m - start - right * (stop - start),
                lambda patch: bottom * height - above(patch),
                lambda patch: above(patch) - top * height,
            ),
            radius_m=0.005,
        )
        hull.cut("tail_housing", name, field_, edge_m=0.02, depth_m=-0.002)

    if spec.tail.style == "bar":
        lamp("taillight", 0.0, 1.0, 0.62, 1.0)
        lamp("brakelight", 0.42, 1.0, 0.0, 0.54)
        lamp("indicator_rear", 0.2, 0.39, 0.0, 0.54)
        lamp("reverselight", 0.0, 0.17, 0.0, 0.54)
    elif spec.tail.style == "upright":
        lamp("brakelight", 0.0, 1.0, 0.72, 1.0)
        lamp("taillight", 0.0, 1.0, 0.44, 0.69)
        lamp("indicator_rear", 0.0, 1.0, 0.22, 0.41)
        lamp("reverselight", 0.0, 1.0, 0.0, 0.19)
    else:
        lamp("taillight", 0.0, 1.0, 0.55, 1.0)
        lamp("brakelight", 0.6, 1.0, 0.0, 0.47)
        lamp("indicator_rear", 0.36, 0.58, 0.0, 0.47)
        lamp("reverselight", 0.2, 0.34, 0.0, 0.47)
    plate = spec.tail.plate_z_m
    niche = _window_of(0.32, plate - 0.085, plate + 0.085, front=False, limit_x_m=-spec.length_m + 0.4, radius_m=0.03)
    hull.cut("body", "body", niche, edge_m=0.03, depth_m=0.018)
    reflector = intersection(
        (
            lambda patch: spec.width_m / 2 - 0.30 - patch.rear_arc_m,
            lambda patch: patch.rear_arc_m - spec.width_m / 2 + 0.10,
            _stripe(spec.clearance_m + 0.2, 0.018),
        ),
        radius_m=0.01,
    )
    for name in ("body", "trim"):
        hull.cut(name, "reflector", reflector, edge_m=0.03)


def _cut_seams(spec: CarSpec, hull: Panels) -> None:
    sill = spec.clearance_m + spec.sill_m + 0.03
    radius = spec.wheel[0] + spec.arch_gap_m + 0.06
    for front_d, rear_d in spec.doors:
        fields: list[Field] = [below("x", -front_d), beyond("x", -rear_d), beyond("z", sill)]
        fields += [opposite(_circle(x, spec.wheel[0], radius)) for x in spec.axles_x_m]
        hull.strip("body", "seams", intersection(fields, radius_m=0.05))
    edge = 0.78 * spec.width_m / 2
    hull.strip(
        "body",
        "seams",
        intersection(
            (
                lambda patch: patch.y - edge - 0.06 * (patch.x + 1.0),
                lambda patch: patch.x + 0.13,
                lambda patch: -spec.glass.front_base_m - 0.2 - patch.x,
                lambda patch: spec.face.lamps[3] - 0.02 - patch.z,
            ),
            radius_m=0.06,
        ),
    )
    bumper = spec.length_m - 0.13
    back: dict[str, tuple[Field, ...]] = {
        "boot": (
            lambda patch: patch.x + spec.glass.rear_base_m + 0.05,
            lambda patch: patch.y - 0.66 * spec.width_m / 2,
            lambda patch: spec.tail.plate_z_m - 0.12 - patch.z,
        ),
        "gate": (
            lambda patch: patch.x + bumper - 0.4,
            lambda patch: patch.y - 0.72 * spec.width_m / 2,
            lambda patch: spec.tail.plate_z_m - 0.16 - patch.z,
        ),
        "doors": (
            lambda patch: patch.x + bumper - 0.3,
            lambda patch: patch.y - 0.80 * spec.width_m / 2,
            lambda patch: spec.clearance_m + 0.24 - patch.z,
        ),
    }
    hull.strip("body", "seams", intersection(back[spec.tail.lid], radius_m=0.07))


def _cut_windows(spec: CarSpec, canopy: Panels) -> None:
    glass = spec.glass
    deck = _line(spec.deck, lift_m=-spec.crown_m)
    half = spec.width_m / 2 - glass.shoulder_m
    centre = -0.5 * (glass.front_top_m[0] + glass.rear_top_m[0])
    rise = glass.front_top_m[1] - 0.95
    front_reach = -glass.front_base_m - centre
    header: Field = lambda patch: (patch.level - glass.rail_level - 0.02) * rise  # noqa: E731
    windscreen = intersection(
        (
            lambda patch: (patch.ring_y - 0.86) * half,
            lambda patch: -patch.ring_x * front_reach + 0.02,
            header,
            lambda patch: deck(patch.x) + 0.5 * spec.crown_m + 0.02 - patch.z,
        ),
        radius_m=0.05,
    )
    _glaze(canopy, windscreen, "window_windscreen", "window_seal")
    rear_d, lean = glass.side_rear_m
    side = intersection(
        (
            lambda patch: 0.30 * half - patch.y,
            lambda patch: deck(patch.x) + glass.belt_m - patch.z,
            lambda patch: (patch.level - glass.rail_level) * rise,
            lambda patch: (patch.ring_x - glass.side_front) * front_reach,
            lambda patch: -rear_d + lean * (patch.z - deck(patch.x)) / rise - patch.x,
        ),
        radius_m=0.045,
    )
    canopy.cut("body", "window_trim", side, edge_m=0.025)
    canopy.cut("window_trim", "window_side", lambda patch: side(patch) + 0.013, edge_m=0.04, depth_m=0.003)
    for pillar_d, breadth in glass.pillars:
        canopy.strip("window_side", "pillars", below("x", -pillar_d), half_width_m=breadth)
    if glass.rear_window:
        rear = intersection(
            (
                lambda patch: (patch.ring_y - 0.84) * half,
                lambda patch: patch.ring_x + 0.3,
                header,
                lambda patch: deck(patch.x) + 0.5 * spec.crown_m + 0.03 - patch.z,
            ),
            radius_m=0.05,
        )
        _glaze(canopy, rear, "window_rear", "window_seal")
        if glass.rear_split:
            canopy.strip("window_rear", "body", lambda patch: patch.y, half_width_m=0.07)
    if spec.roof_glass:
        roof = intersection(
            (lambda patch: patch.y - 0.40, lambda patch: 0.99 - patch.level, lambda patch: patch.x - centre - 0.42),
            radius_m=0.03,
        )
        canopy.cut("body", "window_roof", roof, edge_m=0.05)


def _glaze(canopy: Panels, outline: Field, name: str, seal: str) -> None:
    canopy.cut("body", seal, outline, edge_m=0.025)
    canopy.cut(seal, name, lambda patch: outline(patch) + 0.016, edge_m=0.04)


def _cut_livery(spec: CarSpec, hull: Panels) -> None:
    """Cut two rows of reflecting blocks along the side, of two colours in turn."""
    low, block = 0.52, 0.30
    for row in (0, 1):
        band = intersection(
            (
                below("z", low + block * (row + 1)),
                beyond("z", low + block * row),
                beyond("y", 0.4 * spec.width_m),
                below("x", 0.3 - spec.front_overhang_m),
                beyond("x", 0.12 - spec.length_m),
            )
        )
        hull.cut("body", "\0band", band, edge_m=0.05)
        count = int(spec.length_m / (2 * block)) + 1
        for number in range(count):
            centre = -(2 * number + row + 0.5) * block
            hull.strip("\0band", "livery_0", below("x", centre), half_width_m=block / 2)
        hull.add("livery_1", *hull.patches.pop("\0band", []))


def _materials(spec: CarSpec) -> dict[str, str]:
    led = spec.face.lamp_style in ("led", "slim")
    return {
        "body": spec.paint,
        "livery_0": spec.livery[0],
        "livery_1": spec.livery[1],
        "underside": "plastic/black",
        "trim": "plastic/black",
        "wheel_well": "plastic/black",
        "grille": "plastic/black",
        "grille_frame": spec.face.frame_material,
        "grille_bars": spec.face.bar_material,
        "lamp_housing": "plastic/black" if led else "metal/chrome",
        "headlight": "lamp/headlight_led" if led else "lamp/headlight_halogen",
        "tail_housing": "plastic/red",
        "reflector": "plastic/red",
        "seams": "plastic/black",
        "pillars": "paint/black",
        "window_seal": "plastic/black",
        "window_trim": spec.glass.trim_material,
        "window_side": "glass/tinted",
        "window_windscreen": "glass/tinted",
        "window_rear": "glass/tinted",
        "window_roof": "glass/tinted",
    }


def _add_wheels(spec: CarSpec, parts: PartList) -> None:
    radius, width, rim, style = spec.wheel
    wheel = car_wheel(radius, width, rim, style)
    y = spec.width_m / 2 - _WHEEL_INSET_M - width / 2
    for place, x in zip(("front", "rear"), spec.axles_x_m, strict=True):
        parts.add_wheel(
            place, wheel.placed(x, y, radius), rim_material="plastic/grey" if style == "steel" else "metal/rim_alloy"
        )


def _add_plates(spec: CarSpec, parts: PartList, skin: tuple[Patch, ...], rng: np.random.Generator) -> None:
    text = plate_text(rng)
    holder = box((0.05, 0.535, 0.125), centre_m=(-0.026, 0.0, 0.0))
    front = max(surface_at(skin, "x", y, spec.face.plate_z_m) for y in (0.0, 0.1)) + 0.004
    rear = min(surface_at(skin, "x", y, spec.tail.plate_z_m, last=False) for y in (0.0, 0.1)) + 0.012
    for name, x, z, turn in (("front", front, spec.face.plate_z_m, 0.0), ("rear", rear, spec.tail.plate_z_m, 180.0)):
        parts.add(f"plate_{name}", "sign/white", number_plate().turned("z", turn).moved(x, 0.0, z))
        parts.add("plate_text", "plastic/black", text.turned("z", turn).moved(x, 0.0, z))
        parts.add("plate_holders", "plastic/black", holder.turned("z", turn).moved(x, 0.0, z))


def _add_fittings(spec: CarSpec, parts: PartList, skin: tuple[Patch, ...], roof: tuple[Patch, ...]) -> None:
    glass = spec.glass
    deck = _line(spec.deck, lift_m=-spec.crown_m)
    # Mirrors stand at the foot of the windscreen's pillar.
    x = -glass.front_base_m - 0.30 * (glass.front_top_m[0] - glass.front_base_m) - 0.16
    z = float(deck(x)) + glass.belt_m + 0.005
    y = surface_at(roof, "y", x, z + 0.04)
    reach = spec.width_m / 2 + 0.085 - y
    housing, arm, face = (shape.moved(x, y - 0.005, z) for shape in mirror(*spec.mirror_m, reach_m=reach))
    parts.add_pair("mirror", spec.paint, housing)
    parts.paintable.update({"mirror_left", "mirror_right"})
    parts.add_both("trim", "plastic/black", arm)
    parts.add_pair("mirror_glass", "mirror/silver", face)
    for _, rear_d in spec.doors:
        at = -rear_d + 0.17
        height = float(deck(at)) - 0.10
        parts.add_both(
            "handles", spec.paint, door_handle().moved(at, surface_at(skin, "y", at, height) - 0.012, height), paintable=True
        )
    _add_wiper(spec, parts, roof)
    for number in range(spec.tail.exhausts):
        y = spec.width_m / 2 - 0.46 - 0.09 * number
        tip = surface_at(skin, "x", y, spec.clearance_m + 0.14, last=False)
        pipe = revolution([(0.0, -0.25), (0.032, -0.25), (0.032, 0.0), (0.027, 0.0), (0.027, -0.12), (0.0, -0.12)], sides=20)
        pipe = pipe.turned("y", -90).moved(tip + 0.005, y, spec.clearance_m + 0.07)
        parts.add_both("exhaust", "metal/chrome", pipe)
    if spec.light_bars:
        for d in (glass.front_top_m[0] + 0.25, glass.rear_top_m[0] - 0.2):
            top = surface_at(roof, "z", -d, 0.3)
            parts.add("light_bar_base", "plastic/grey", rounded_box((0.3, 1.3, 0.1), 0.03, centre_m=(-d, 0.0, top - 0.01)))
            parts.add_both("light_bar", "plastic/blue", rounded_box((0.26, 0.52, 0.12), 0.05, centre_m=(-d, 0.36, top + 0.09)))
    if spec.roof_rails:
        path = [(-glass.front_top_m[0] - 0.28, 0.0), (-glass.rear_top_m[0] + 0.22, 0.0)]
        xs = np.linspace(path[0][0], path[1][0], 12)
        side = spec.width_m / 2 - glass.shoulder_m - 1.2 * glass.tumblehome_m - 0.05
        heights = np.array([surface_at(roof, "z", float(at), side) for at in xs]) + 0.035
        heights[[0, -1]] -= 0.05
        parts.add_both(
            "roof_rails", "metal/aluminium", tube(np.stack([xs, np.full(12, side), heights], axis=1), 0.014, sides=8)
        )


def _add_wiper(spec: CarSpec, parts: PartList, roof: tuple[Patch, ...]) -> None:
    points = []
    deck = _line(spec.deck)
    for y, lift in ((0.08, 0.035), (0.35, 0.045), (0.58, 0.075)):
        z = float(deck(-spec.glass.front_base_m)) + lift
        points.append((surface_at(roof, "x", y, z) + 0.008, y, z))
    parts.add_both("trim", "plastic/black", wiper(points[0], points[1]), wiper(points[1], points[2]))
