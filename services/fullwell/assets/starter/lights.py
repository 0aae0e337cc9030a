"""Street lights and traffic lights, whose lamps are parts that a recipe lights at night.

Traffic signals have roundels of 200 mm (300 mm over the carriageway), lower edge of the head at 2.1 m beside and above 5 m
over the carriageway (EN 12368:2015; Vienna Convention on Road Signs and Signals, 1968, art. 23). Street light columns are of
the sizes of EN 40-2; lamp luminous fluxes are those of common 50 W LED, 150 W high-pressure sodium and 70 W metal halide
lamps.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.assembly import Assembly, boxes, quads, span
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.glyphs import circle, filled, walker
from fullwell.assets.starter.shapes import Shape, box, cylinder, grid_surface, loft, revolution, tube

__all__ = ["LIGHTS", "bracket_light", "column_light", "lantern", "pedestrian_signal", "vehicle_signal"]

Array = NDArray[np.float64]

_GALVANISED = "metal/steel_galvanised"


def _column(assembly: Assembly, height_m: float, *, foot_m: float, head_m: float, material: str) -> None:
    """A tapered column with a thicker base section that holds the fuse door, and a flange."""
    half, top = foot_m / 2, head_m / 2
    profile = [(half + 0.02, 0.0), (half + 0.02, 1.0), (half, 1.06), (top, height_m), (0.0, height_m)]
    assembly.add("column", material, revolution([(0.0, 0.0), *profile], sides=24))
    assembly.add("column", material, span((half + 0.005, -0.045, 0.45), (half + 0.024, 0.045, 0.85)))
    assembly.add("flange", "concrete/grey", cylinder(0.2, 0.03, sides=24).moved(z_m=0.015))


def _led_head(length_m: float = 0.62) -> Assembly:
    """A flat LED luminaire along +x from the origin, its light leaving downwards through a flat cover set back in a rim."""
    head = Assembly()
    wide = 0.29
    outline = np.array([(0.0, -0.05), (0.12, -wide / 2), (length_m - 0.06, -wide / 2), (length_m, -wide / 2 + 0.07)])
    outline = np.concatenate([outline, outline[::-1] * [1, -1]])
    low = np.column_stack([outline, np.full(len(outline), 0.0)])
    middle = np.column_stack([outline, np.full(len(outline), 0.05)])
    top = np.column_stack([outline * [0.94, 0.8] + [0.02, 0.0], np.full(len(outline), 0.085)])
    head.add("housing", "coating/grey", loft(np.array([low, middle, top])).smooth(30.0))
    for y in np.linspace(-0.07, 0.07, 6):  # cooling fins
        head.add("housing", "coating/grey", span((0.16, y - 0.004, 0.08), (length_m - 0.12, y + 0.004, 0.105)))
    inner_x, inner_y = (0.17, length_m - 0.09), wide / 2 - 0.03
    rim = boxes(
        [
            (inner_x[0] - 0.015, -inner_y - 0.015, -0.016),
            (inner_x[0] - 0.015, inner_y, -0.016),
            (inner_x[0] - 0.015, -inner_y, -0.016),
        ]
        + [(inner_x[1], -inner_y, -0.016)],
        [(inner_x[1] + 0.015, -inner_y, 0.01), (inner_x[1] + 0.015, inner_y + 0.015, 0.01), (inner_x[0], inner_y, 0.01)]
        + [(inner_x[1] + 0.015, inner_y, 0.01)],
    )
    head.add("housing", "coating/grey", rim)
    a, b = inner_x
    face = [(a, -inner_y, -0.004), (a, inner_y, -0.004), (b, inner_y, -0.004), (b, -inner_y, -0.004)]
    head.add("lamp", "lamp/street_led", quads([face]))
    head.add("socket", "coating/grey", cylinder(0.045, 0.16, sides=16, axis="x").moved(-0.02, 0.0, 0.035))
    return head


def _cobra_head(lamp: str) -> Assembly:
    """A lamp house of pressed metal along +x with a bowl below, through which it shines."""
    head = Assembly()
    length, wide = 0.78, 0.34
    stations = np.linspace(0.0, 1.0, 9)
    width = wide * np.sin(np.pi * np.clip(0.12 + 0.8 * stations, 0, 1)) ** 0.7
    height = 0.13 * np.sin(np.pi * np.clip(0.15 + 0.75 * stations, 0, 1)) ** 0.8 + 0.03
    turn = np.linspace(0.0, np.pi, 9)
    rings = []
    for s, w, h in zip(stations, width, height, strict=True):
        arch = np.column_stack([np.full(9, s * length), np.cos(turn) * w / 2, np.sin(turn) * h])
        rings.append(arch)
    shell = loft(np.array(rings)).smooth(50.0)
    head.add("housing", "metal/aluminium", shell)
    u, v = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 13))
    # A square of parameters bent into an ellipse: rows and columns stay regular, and no face degenerates.
    x, y = u * np.sqrt(1 - v**2 / 2), v * np.sqrt(1 - u**2 / 2)
    depth = 0.11 * np.sqrt(np.clip(1 - np.minimum(x**2 + y**2, 1.0), 0, None)) + 0.004
    bowl = np.stack([0.46 + 0.24 * x, -0.135 * y, -depth], axis=-1)
    head.add("lamp", lamp, grid_surface(bowl).smooth(60.0))
    head.add("socket", "metal/aluminium", cylinder(0.05, 0.2, sides=16, axis="x").moved(-0.02, 0.0, 0.05))
    return head


def _arm(assembly: Assembly, low_m: float, reach_m: float, rise_m: float, *, material: str, radius_m: float = 0.03) -> None:
    """An arm bent from upright to nearly level, from the column's axis at a height, along +x."""
    angle = np.linspace(0.0, np.pi / 2, 9)
    bend = np.column_stack([reach_m * 0.6 * (1 - np.cos(angle)), np.zeros(9), low_m + rise_m * 0.92 * np.sin(angle)])
    path = np.vstack([[(0.0, 0.0, low_m - 0.25)], bend, [(reach_m, 0.0, low_m + rise_m)]])
    assembly.add("arm", material, tube(path, radius_m, sides=14))


def _light(tags: tuple[str, ...], assembly: Assembly, *, column_m: float, flux_lm: float) -> BuiltAsset:
    """Return the asset with what placing and lighting it need: offsets are from the pivot, which is below the box's centre."""
    parts = assembly.parts(paintable=("column", "arm"))
    everything = np.concatenate([part.shape.vertices_m for part in parts])
    lamp = np.concatenate([part.shape.vertices_m for part in parts if part.name == "lamp"])
    centre = (everything.min(axis=0) + everything.max(axis=0)) / 2
    middle = (lamp.min(axis=0) + lamp.max(axis=0)) / 2 - centre
    return BuiltAsset(
        "street_light",
        tags,
        parts,
        {
            "column_height_m": column_m,
            "column_offset_x_m": round(float(-centre[0]), 4),
            "lamp_offset_x_m": round(float(middle[0]), 4),
            "lamp_height_m": round(float(lamp[:, 2].min()), 4),
            "luminous_flux_lm": flux_lm,
        },
    )


def column_light(
    rng: np.random.Generator,
    *,
    height_m: float,
    reach_m: float,
    lamp: str = "lamp/street_led",
    arms: int = 1,
    material: str = _GALVANISED,
    flux_lm: float = 6500.0,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a column with one arm over the street (+x), or two, the second turned back."""
    assembly = Assembly()
    top = height_m - 0.55
    _column(assembly, top, foot_m=0.11 + 0.006 * height_m, head_m=0.076, material=material)
    side = Assembly()
    _arm(side, top, reach_m, 0.42, material=material)
    head = _led_head() if lamp == "lamp/street_led" else _cobra_head(lamp)
    side.place(_tilted(head, 5.0), x_m=reach_m, z_m=top + 0.39)
    for number in range(arms):
        assembly.place(side, turn_deg=180.0 * number)
    return _light(("column", *tags), assembly, column_m=height_m, flux_lm=flux_lm)


def _tilted(head: Assembly, tilt_deg: float) -> Assembly:
    """The head with its far end raised."""
    raised = Assembly()
    for part in head.parts():
        raised.add(part.name, part.material, part.shape.turned("y", -tilt_deg))
    return raised


def lantern(
    rng: np.random.Generator, *, height_m: float = 4.0, lamp: str = "lamp/street_mh", flux_lm: float = 6000.0
) -> BuiltAsset:
    """Return a cast-iron column with ladder bar and a six-sided lantern; the lamp hangs below its roof."""
    iron = "coating/black"
    assembly = Assembly()
    base = height_m - 0.95
    profile = [
        (0.0, 0.0), (0.2, 0.0), (0.2, 0.08), (0.16, 0.1), (0.15, 0.55), (0.11, 0.62), (0.13, 0.68), (0.085, 0.8), (0.085, 0.92),
        (0.06, 0.98), (0.05, base - 0.5), (0.075, base - 0.47), (0.075, base - 0.42), (0.04, base - 0.36), (0.035, base - 0.1),
        (0.07, base), (0.0, base),
    ]  # fmt: skip
    assembly.add("column", iron, revolution(profile, sides=24, crease_deg=30.0))
    for number in range(8):  # flutes stand proud of the shaft
        angle = np.deg2rad(45.0 * number)
        ends = [(0.058 * np.cos(angle), 0.058 * np.sin(angle), 1.0), (0.05 * np.cos(angle), 0.05 * np.sin(angle), base - 0.55)]
        assembly.add("column", iron, tube(ends, 0.009, sides=6))
    assembly.add("ladder_bar", iron, cylinder(0.014, 0.7, sides=10, axis="y").moved(z_m=base - 0.3))
    for y in (-0.36, 0.36):
        assembly.add("ladder_bar", iron, revolution(_ball(0.025), sides=10).moved(0.0, y, base - 0.3))
    _lantern_cage(assembly, base, iron)
    assembly.add("lamp", lamp, filled(circle(0.1, sides=24), 0.0).turned("y", 90).moved(z_m=base + 0.52))
    assembly.add("reflector", "metal/aluminium", cylinder(0.14, 0.02, sides=24).moved(z_m=base + 0.535))
    return _light(("lantern", "historic"), assembly, column_m=height_m, flux_lm=flux_lm)


def _ball(radius_m: float) -> Array:
    angle = np.linspace(-np.pi / 2, np.pi / 2, 7)
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius_m


def _lantern_cage(assembly: Assembly, base: float, iron: str) -> None:
    low, high = base + 0.08, base + 0.55
    corners = [np.array([np.cos(a), np.sin(a)]) for a in np.deg2rad(np.arange(6) * 60.0 + 30)]
    for here in range(6):
        start, stop = corners[here], corners[(here + 1) % 6]
        assembly.add("cage", iron, tube([(*(0.13 * start), low), (*(0.23 * start), high)], 0.011, sides=6))
        assembly.add("cage", iron, tube([(*(0.13 * start), low), (*(0.13 * stop), low)], 0.011, sides=6))
        assembly.add("cage", iron, tube([(*(0.235 * start), high), (*(0.235 * stop), high)], 0.016, sides=6))
        assembly.add("cage", iron, tube([(0.0, 0.0, base - 0.02), (*(0.13 * start), low)], 0.009, sides=6))
    roof = [
        (0.0, high - 0.005),
        (0.25, high - 0.005),
        (0.255, high + 0.015),
        (0.11, high + 0.2),
        (0.1, high + 0.2),
        (0.1, high + 0.27),
    ]
    roof += [(0.12, high + 0.28), (0.03, high + 0.34), (0.02, high + 0.38), (0.0, high + 0.4)]
    assembly.add("roof", iron, revolution(roof, sides=6).flat())


def bracket_light(
    rng: np.random.Generator, *, height_m: float = 7.6, lamp: str = "lamp/street_hps", flux_lm: float = 10000.0
) -> BuiltAsset:
    """Return a timber pole with a bracket arm, a stay, and a lamp house; insulators and a cable down the pole."""
    assembly = Assembly()
    lean = rng.uniform(-0.03, 0.03, 2)
    # Upright at the foot, so that its end lies flat on the ground.
    path = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.6), (lean[0] / 2, lean[1] / 2, height_m / 2), (lean[0], lean[1], height_m)]
    assembly.add("pole", "wood/weathered", tube(path, np.array([0.13, 0.128, 0.115, 0.095]), sides=16))
    arm_z = height_m - 1.3
    assembly.add("arm", _GALVANISED, tube([(0.05, 0, arm_z), (0.9, 0, arm_z + 0.3), (1.5, 0, arm_z + 0.36)], 0.028, sides=12))
    assembly.add("arm", _GALVANISED, tube([(0.05, 0, arm_z - 0.6), (0.8, 0, arm_z + 0.26)], 0.012, sides=8))
    assembly.add(
        "clamps", _GALVANISED, *(cylinder(0.118, 0.05, sides=16).moved(lean[0], lean[1], z) for z in (arm_z, arm_z - 0.6))
    )
    assembly.place(_tilted(_cobra_head(lamp), 4.0), x_m=1.46, z_m=arm_z + 0.33)
    cross = height_m - 0.45
    assembly.add("crossarm", "wood/weathered", box((0.09, 1.3, 0.11), centre_m=(0.13, 0.0, cross)))
    pin = revolution(
        [(0.0, 0.0), (0.02, 0.0), (0.02, 0.06), (0.05, 0.07), (0.045, 0.1), (0.03, 0.12), (0.04, 0.14), (0.0, 0.16)], sides=14
    )
    for y in (-0.55, -0.2, 0.2, 0.55):
        assembly.add("insulators", "stone/limestone", pin.moved(0.13, y, cross + 0.055))
    assembly.add("cable", "plastic/black", tube([(0.0, 0.125, 0.3), (0.0, 0.11, arm_z - 0.1)], 0.014, sides=8))
    assembly.add("label", "sign/yellow", span((0.112, -0.05, 1.9), (0.135, 0.05, 2.05)))
    return _light(("pole", "bracket", "timber"), assembly, column_m=height_m, flux_lm=flux_lm)


# -- traffic lights -------------------------------------------------------------------------------------------------------

_LAMPS: Mapping[str, str] = MappingProxyType({name: f"lamp/traffic_{name}" for name in ("red", "amber", "green")})


def _visor(radius_m: float, depth_m: float, x_m: float, z_m: float) -> Shape:
    """A cowl around the upper three quarters of a roundel, shorter below, open to the front; both of its sides are there."""
    angle = np.deg2rad(np.linspace(-45.0, 225.0, 15))
    reach = depth_m * (0.45 + 0.55 * np.clip(np.sin(angle) + 0.4, 0, 1.0))
    circle_ = np.column_stack([np.cos(angle), np.sin(angle)])

    def curve(radius: float, out: Array) -> Array:
        return np.column_stack([x_m + out, radius * circle_[:, 0], z_m + radius * circle_[:, 1]])

    zero = np.zeros(len(angle))
    rings = np.array(
        [curve(radius_m + 0.004, zero), curve(radius_m + 0.004, reach), curve(radius_m, reach), curve(radius_m, zero)]
    )
    grid = np.swapaxes(rings, 0, 1)
    faces = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2).reshape(-1, 4, 3)
    return quads(faces[:, ::-1]).smooth(40.0)


def _signal_head(colours: tuple[str, ...], diameter_m: float, *, board: bool) -> Assembly:
    """A head with its aspects one below another, the lowest edge at z = 0, the front of the doors at x = 0."""
    head = Assembly()
    cell = diameter_m * 1.5
    wide, deep = diameter_m * 1.55, 0.16
    tall = cell * len(colours)
    for number, colour in enumerate(colours):
        z = tall - cell * (number + 0.5)
        door = span((-0.02, -wide / 2 + 0.004, z - cell / 2 + 0.004), (0.0, wide / 2 - 0.004, z + cell / 2 - 0.004))
        head.add("housing", "plastic/black", door)
        lens = revolution([(diameter_m / 2, 0.0), (diameter_m * 0.4, 0.012), (diameter_m * 0.2, 0.02), (0.0, 0.023)], sides=28)
        head.add(f"light_{colour}", _LAMPS[colour], lens.turned("y", 90).moved(0.004, 0.0, z))
        head.add("visors", "plastic/black", _visor(diameter_m / 2 + 0.012, 0.2 if diameter_m < 0.25 else 0.26, 0.0, z))
    head.add("housing", "plastic/black", span((-deep, -wide / 2, 0.0), (-0.02, wide / 2, tall)))
    if board:
        outer = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * [wide / 2 + 0.14, tall / 2 + 0.14] + [0.0, tall / 2]
        low, high = outer.min(axis=0), outer.max(axis=0)
        head.add("board", "plastic/black", span((-0.05, low[0], low[1]), (-0.045, high[0], high[1])))
        edge = 0.04
        strips = [(low[0], high[0], low[1], low[1] + edge), (low[0], high[0], high[1] - edge, high[1])]
        strips += [
            (low[0], low[0] + edge, low[1] + edge, high[1] - edge),
            (high[0] - edge, high[0], low[1] + edge, high[1] - edge),
        ]
        x = -0.043
        head.add("board_edge", "sign/white", quads([[(x, a, c), (x, b, c), (x, b, d), (x, a, d)] for a, b, c, d in strips]))
    return head


def _signal(tags: tuple[str, ...], assembly: Assembly, *, diameter_m: float, phases: Mapping[str, str]) -> BuiltAsset:
    parts = assembly.parts()
    everything = np.concatenate([part.shape.vertices_m for part in parts])
    centre = (everything.min(axis=0) + everything.max(axis=0)) / 2
    facts: dict[str, float | str] = {
        "phases": " ".join(phases),
        **{f"lit_in_{phase}": lit for phase, lit in phases.items()},
        "aspect_diameter_m": diameter_m,
        "post_offset_x_m": round(float(-centre[0]), 4),
        "post_offset_y_m": round(float(-centre[1]), 4),
    }
    return BuiltAsset("traffic_light", tags, parts, facts)


_VEHICLE_PHASES: Mapping[str, str] = MappingProxyType(
    {"red": "light_red", "red_amber": "light_red light_amber", "green": "light_green", "amber": "light_amber"}
)
"""The cycle of a vehicle signal in Europe, and the parts that shine in each phase."""


def vehicle_signal(rng: np.random.Generator, *, arm_m: float = 0.0, board: bool = True) -> BuiltAsset:
    """Return a three-aspect signal on a post; with `arm_m`, another with larger aspects on an arm over the carriageway (-y).

    Drivers come towards +x's end looking along -x, keep right, and see the post at their right hand, which is +y.
    """
    assembly = Assembly()
    colours = ("red", "amber", "green")
    post = 6.1 if arm_m else 3.25
    radius = 0.095 if arm_m else 0.057
    assembly.add("post", _GALVANISED, revolution([(0, 0), (radius * 1.15, 0), (radius, post), (0, post)], sides=24))
    assembly.add("flange", "concrete/grey", cylinder(0.24, 0.03, sides=24).moved(z_m=0.015))
    assembly.add("post_cap", "plastic/black", cylinder(radius + 0.004, 0.03, sides=24).moved(z_m=post))
    head = _signal_head(colours, 0.2, board=board)
    assembly.place(head, x_m=radius + 0.2, z_m=2.15 if not arm_m else 2.3)
    brackets = boxes([(0.0, -0.03, 2.35), (0.0, -0.03, 2.9)], [(radius + 0.05, 0.03, 2.41), (radius + 0.05, 0.03, 2.96)])
    assembly.add("brackets", _GALVANISED, brackets)
    if arm_m:
        path = [(0, 0, 5.7), (0, -arm_m * 0.5, 5.88), (0, -arm_m, 5.95)]
        assembly.add("arm", _GALVANISED, tube(path, np.array([0.075, 0.06, 0.05]), sides=16))
        over = _signal_head(colours, 0.3, board=board)
        y = -arm_m + 0.35
        assembly.place(over, x_m=0.28, y_m=y, z_m=5.2)
        assembly.add("brackets", _GALVANISED, span((0.0, y - 0.04, 5.86), (0.13, y + 0.04, 5.98)))
    tags = ("signal", "vehicle", *(("overhead",) if arm_m else ()))
    return _signal(tags, assembly, diameter_m=0.3 if arm_m else 0.2, phases=_VEHICLE_PHASES)


def pedestrian_signal(rng: np.random.Generator) -> BuiltAsset:
    """Return a signal of two aspects with a standing and a walking figure, and a push button at 1.05 m."""
    assembly = Assembly()
    radius, post = 0.057, 3.05
    assembly.add("post", _GALVANISED, cylinder(radius, post, sides=24).moved(z_m=post / 2))
    assembly.add("post_cap", "plastic/black", cylinder(radius + 0.004, 0.03, sides=24).moved(z_m=post))
    assembly.add("flange", "concrete/grey", cylinder(0.2, 0.03, sides=24).moved(z_m=0.015))
    x, low, cell = radius + 0.2, 2.2, 0.3
    assembly.add("housing", "plastic/black", span((x - 0.15, -0.155, low), (x, 0.155, low + 2 * cell)))
    for colour, z in (("red", low + 1.5 * cell), ("green", low + 0.5 * cell)):
        assembly.add(f"light_{colour}", _LAMPS[colour], walker(0.19, x + 0.003, standing=colour == "red", centre_m=(0.0, z)))
        assembly.add("visors", "plastic/black", _visor(0.125, 0.17, x, z))
    assembly.add(
        "brackets",
        _GALVANISED,
        boxes([(0.0, -0.03, 2.3), (0.0, -0.03, 2.66)], [(x - 0.15, 0.03, 2.36), (x - 0.15, 0.03, 2.72)]),
    )
    assembly.add("button_box", "plastic/yellow", span((radius - 0.005, -0.045, 0.98), (radius + 0.06, 0.045, 1.16)))
    assembly.add("button", "plastic/black", cylinder(0.024, 0.02, sides=16, axis="x").moved(radius + 0.066, 0.0, 1.05))
    assembly.add("button_label", "sign/white", span((radius + 0.05, -0.035, 1.09), (radius + 0.0625, 0.035, 1.145)))
    return _signal(("signal", "pedestrian"), assembly, diameter_m=0.2, phases={"red": "light_red", "green": "light_green"})


LIGHTS: tuple[StarterEntry, ...] = (
    StarterEntry(
        "street-light-led-8",
        "Street light, 8 m, one arm, LED",
        column_light,
        {"height_m": 8.0, "reach_m": 1.2, "tags": ("led",)},
        131,
    ),
    StarterEntry(
        "street-light-hps-10",
        "Street light, 10 m, two arms, high-pressure sodium",
        column_light,
        {
            "height_m": 10.0,
            "reach_m": 1.8,
            "lamp": "lamp/street_hps",
            "arms": 2,
            "flux_lm": 16000.0,
            "tags": ("sodium", "double"),
        },
        132,
    ),
    StarterEntry("street-light-lantern-4", "Lantern on a cast column, 4 m, metal halide", lantern, {}, 133),
    StarterEntry("street-light-bracket", "Timber pole with bracket lamp, sodium", bracket_light, {}, 134),
    StarterEntry("traffic-light-post", "Traffic light on a post, three aspects", vehicle_signal, {}, 141),
    StarterEntry(
        "traffic-light-overhead", "Traffic light with an arm over the carriageway", vehicle_signal, {"arm_m": 5.5}, 142
    ),
    StarterEntry("traffic-light-pedestrian", "Pedestrian signal with push button", pedestrian_signal, {}, 143),
)
"""All street lights and traffic lights of the starter library."""
