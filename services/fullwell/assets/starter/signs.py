"""Traffic signs on posts: plates of standard sizes with drawings of our own, in layers a millimetre apart.

Sizes: 600 mm discs and 900 mm triangles as in towns in Europe, 750 mm octagons; mounting height 2.1 to 2.3 m to the lower
edge where people walk below (Vienna Convention on Road Signs and Signals, 1968, annex 1; UK Traffic Signs Manual, chapter 1,
2018, and TSRGD 2016, schedules 2 to 9). Posts are tubes of 76 mm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.assembly import Assembly, span
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.glyphs import arrow, circle, filled, polygon, rectangle, ribbon, ring, rounded, text, walker
from fullwell.assets.starter.shapes import Shape, cylinder, extrusion

__all__ = ["SIGNS", "direction_board", "post", "stop_plate", "traffic_sign"]

Array = NDArray[np.float64]

LAYER_M = 0.0012
"""Films on a plate: thicker than in truth (0.3 mm), so that depth in float32 keeps them in order at any distance."""

_POST_RADIUS_M = 0.038


class _Plate:
    """A plate with its films, drawn about the origin; layer 0 covers the plate."""

    def __init__(self, outline_m: Array, colour: str) -> None:
        self.assembly = Assembly()
        self.low_m = float(outline_m[:, 1].min())
        self.high_m = float(outline_m[:, 1].max())
        self.width_m = float(np.ptp(outline_m[:, 0]))
        # Raised along z, then laid so that z becomes x, x becomes y, y becomes z.
        cycle = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
        plate = extrusion(outline_m, 0.003).transformed(cycle).moved(-0.003 - LAYER_M)
        self.assembly.add("plate", "metal/aluminium", plate)
        self.film(0, colour, filled(outline_m, 0.0))

    def film(self, layer: int, colour: str, *shapes: Shape) -> None:
        """Add a film of a colour; shapes are drawn at x = 0."""
        self.assembly.add(f"face_{colour}", f"sign/{colour}", *(shape.moved(layer * LAYER_M) for shape in shapes))


def _stop() -> _Plate:
    radius = 0.375 / np.cos(np.pi / 8)
    plate = _Plate(polygon(8, radius, turn_deg=22.5), "white")
    plate.film(1, "red", filled(polygon(8, radius * 0.945, turn_deg=22.5), 0.0))
    plate.film(2, "white", text("STOP", 0.19, 0.0, weight=0.17))
    return plate


def _triangle(side_m: float, *, down: bool) -> Array:
    return rounded(polygon(3, side_m / np.sqrt(3), turn_deg=-90 if down else 90), 0.045)


def _yield() -> _Plate:
    plate = _Plate(_triangle(0.9, down=True), "red")
    plate.film(1, "white", filled(_triangle(0.9, down=True) * 0.66, 0.0))
    return plate


def _warning() -> _Plate:
    plate = _Plate(_triangle(0.9, down=False), "red")
    plate.film(1, "white", filled(_triangle(0.9, down=False) * 0.7, 0.0))
    plate.film(2, "black", text("!", 0.32, 0.0, centre_m=(0.0, 0.0), weight=0.2))
    return plate


def _limit(number: str) -> _Plate:
    plate = _Plate(circle(0.3, sides=64), "white")
    plate.film(1, "red", ring(circle(0.294, sides=64), circle(0.232, sides=64), 0.0))
    plate.film(1, "black", text(number, 0.25, 0.0, weight=0.165))
    return plate


def _no_entry() -> _Plate:
    plate = _Plate(circle(0.3, sides=64), "white")
    plate.film(1, "red", filled(circle(0.292, sides=64), 0.0))
    plate.film(2, "white", filled(rectangle(0.46, 0.1), 0.0))
    return plate


def _blue_square() -> _Plate:
    plate = _Plate(rounded(rectangle(0.6, 0.6), 0.04), "white")
    plate.film(1, "blue", filled(rounded(rectangle(0.576, 0.576), 0.034), 0.0))
    return plate


def _crossing() -> _Plate:
    plate = _blue_square()
    plate.film(2, "white", filled(polygon(3, 0.28, turn_deg=90) * [1.05, 1.0] + [0.0, -0.06], 0.0))
    plate.film(3, "black", walker(0.26, 0.0, centre_m=(0.0, -0.035)))
    stripes = [filled(rectangle(0.035, 0.02, (-0.14 + 0.056 * k, -0.183)), 0.0) for k in range(6)]
    plate.film(3, "black", *stripes)
    return plate


def _parking() -> _Plate:
    plate = _blue_square()
    plate.film(2, "white", text("P", 0.4, 0.0, weight=0.18))
    return plate


def _one_way() -> _Plate:
    plate = _Plate(rounded(rectangle(0.8, 0.3), 0.03), "white")
    plate.film(1, "blue", filled(rounded(rectangle(0.78, 0.28), 0.024), 0.0))
    plate.film(2, "white", arrow(0.66, 0.085, 0.0, turn_deg=-90.0))
    return plate


def _keep_right() -> _Plate:
    plate = _Plate(circle(0.3, sides=64), "white")
    plate.film(1, "blue", filled(circle(0.292, sides=64), 0.0))
    plate.film(2, "white", arrow(0.46, 0.075, 0.0, turn_deg=-135.0))
    return plate


def _priority() -> _Plate:
    plate = _Plate(rounded(polygon(4, 0.424), 0.04), "white")
    plate.film(1, "black", ring(rounded(polygon(4, 0.418), 0.036), rounded(polygon(4, 0.404), 0.03), 0.0))
    plate.film(1, "yellow", filled(rounded(polygon(4, 0.3), 0.03), 0.0))
    return plate


def _bus_stop() -> _Plate:
    plate = _Plate(circle(0.225, sides=48), "green")
    plate.film(1, "yellow", filled(circle(0.19, sides=48), 0.0))
    plate.film(2, "green", text("H", 0.21, 0.0, weight=0.19))
    return plate


_PLATES: Mapping[str, Callable[[], _Plate]] = MappingProxyType(
    {
        "stop": _stop,
        "yield": _yield,
        "warning": _warning,
        "speed_limit_30": lambda: _limit("30"),
        "speed_limit_50": lambda: _limit("50"),
        "no_entry": _no_entry,
        "pedestrian_crossing": _crossing,
        "parking": _parking,
        "one_way": _one_way,
        "keep_right": _keep_right,
        "priority_road": _priority,
    }
)


def stop_plate() -> Assembly:
    """Return the round plate of a bus stop, about the origin."""
    return _bus_stop().assembly


def post(assembly: Assembly, height_m: float, *, y_m: float = 0.0) -> None:
    """Add a galvanised tube with a cap behind the plane x = 0, and its foot in the pavement."""
    x = -LAYER_M - 0.003 - 0.012 - _POST_RADIUS_M
    metal = "metal/steel_galvanised"
    assembly.add("post", metal, cylinder(_POST_RADIUS_M, height_m - 0.01, sides=20).moved(x, y_m, (height_m - 0.01) / 2))
    assembly.add("post_cap", "plastic/black", cylinder(_POST_RADIUS_M + 0.002, 0.02, sides=20).moved(x, y_m, height_m))
    assembly.add("post_foot", "concrete/grey", cylinder(0.12, 0.02, sides=20).moved(x, y_m, 0.01))


def _clamps(assembly: Assembly, heights_m: tuple[float, ...], *, y_m: float = 0.0) -> None:
    front = -LAYER_M - 0.003
    for z in heights_m:
        deep = front - 0.014 - 2 * _POST_RADIUS_M
        assembly.add("clamps", "metal/steel_galvanised", span((deep, y_m - 0.05, z - 0.015), (front, y_m + 0.05, z + 0.015)))


def traffic_sign(rng: np.random.Generator, *, sign: str, clearance_m: float = 2.2) -> BuiltAsset:
    """Return a sign on one post, its lower edge `clearance_m` above the ground; it leans by up to half a degree."""
    plate = _PLATES[sign]()
    middle = clearance_m - plate.low_m
    top = middle + plate.high_m
    assembly = Assembly()
    assembly.place(plate.assembly, z_m=middle)
    post(assembly, top - 0.03)
    _clamps(assembly, (middle + 0.6 * plate.low_m, middle + 0.5 * plate.high_m))
    turned = Assembly()
    turned.place(assembly, turn_deg=float(rng.uniform(-2.0, 2.0)))
    return BuiltAsset(
        "traffic_sign",
        ("sign", "retroreflective", sign),
        turned.parts(),
        {"meaning": sign, "plate_width_m": round(plate.width_m, 4), "clearance_m": clearance_m},
    )


def direction_board(
    rng: np.random.Generator,
    *,
    colour: str,
    lines: tuple[tuple[str, float], ...],
    width_m: float = 2.6,
    clearance_m: float = 2.1,
) -> BuiltAsset:
    """Return a board on two posts, with a row for each (place, arrow's angle from up, counter-clockwise) [degrees]."""
    row = 0.42
    height = row * len(lines) + 0.12
    plate = _Plate(rounded(rectangle(width_m, height), 0.08), colour)
    outer, inner = (
        rounded(rectangle(width_m - 0.05, height - 0.05), 0.07),
        rounded(rectangle(width_m - 0.1, height - 0.1), 0.05),
    )
    plate.film(1, "white", ring(outer, inner, 0.0))
    for number, (place, turn) in enumerate(lines):
        z = height / 2 - 0.06 - row * (number + 0.5)
        left = turn > 0
        at = -width_m / 2 + 0.32 if left else width_m / 2 - 0.32
        plate.film(1, "white", arrow(0.32, 0.055, 0.0, turn_deg=turn, centre_m=(at, z)))
        plate.film(1, "white", text(place, 0.19, 0.0, centre_m=(0.22 if left else -0.22, z), weight=0.15))
        if number:
            edge = z + row / 2
            line = ribbon([(-width_m / 2 + 0.05, edge), (width_m / 2 - 0.05, edge)], 0.02, 0.0)
            plate.film(1, "white", line)
    middle = clearance_m + height / 2
    assembly = Assembly()
    assembly.place(plate.assembly, z_m=middle)
    for y in (-width_m * 0.3, width_m * 0.3):
        post(assembly, middle + height / 2 - 0.05, y_m=y)
        _clamps(assembly, (middle - 0.3 * height, middle + 0.3 * height), y_m=y)
    turned = Assembly()
    turned.place(assembly, turn_deg=float(rng.uniform(-1.0, 1.0)))
    return BuiltAsset(
        "traffic_sign",
        ("sign", "retroreflective", "direction"),
        turned.parts(),
        {"meaning": "direction", "plate_width_m": width_m, "clearance_m": clearance_m},
    )


def _entry(name: str, title: str, seed: int) -> StarterEntry:
    return StarterEntry(f"sign-{name.replace('_', '-')}", title, traffic_sign, {"sign": name}, seed)


SIGNS: tuple[StarterEntry, ...] = (
    _entry("stop", "Stop sign, octagon of 750 mm", 101),
    _entry("yield", "Give way sign, triangle of 900 mm", 102),
    _entry("warning", "Danger warning sign, triangle of 900 mm", 103),
    _entry("speed_limit_30", "Speed limit 30, disc of 600 mm", 104),
    _entry("speed_limit_50", "Speed limit 50, disc of 600 mm", 105),
    _entry("no_entry", "No entry sign, disc of 600 mm", 106),
    _entry("pedestrian_crossing", "Pedestrian crossing sign, square of 600 mm", 107),
    _entry("parking", "Parking sign, square of 600 mm", 108),
    _entry("one_way", "One-way street sign, 800 by 300 mm", 109),
    _entry("keep_right", "Pass on the right, disc of 600 mm", 110),
    _entry("priority_road", "Priority road sign, square of 600 mm on its corner", 111),
    StarterEntry(
        "sign-direction-blue",
        "Direction board, blue, two places",
        direction_board,
        {"colour": "blue", "lines": (("CENTRE", 0.0), ("STATION", 90.0))},
        112,
    ),
    StarterEntry(
        "sign-direction-green",
        "Direction board, green, three places",
        direction_board,
        {"colour": "green", "lines": (("NORTH", 0.0), ("AIRPORT", -90.0), ("HARBOUR", 90.0)), "width_m": 2.9},
        113,
    ),
)
"""All traffic signs of the starter library."""
